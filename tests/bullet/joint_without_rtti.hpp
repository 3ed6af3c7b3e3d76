/// A joint of a class without run-time type information.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <memory>

namespace jfpx {

/// Makes a point-to-point joint of a class that is compiled with -fno-rtti.
std::unique_ptr<btTypedConstraint> make_joint_without_rtti(btRigidBody& a, btRigidBody& b);

}  // namespace jfpx
