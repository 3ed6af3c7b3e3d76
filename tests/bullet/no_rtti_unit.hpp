/// A part of a user's program that is compiled with -fno-rtti and derives from Bullet's classes.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <memory>

namespace jfpx::test {

std::unique_ptr<btCollisionDispatcher> make_no_rtti_dispatcher(btCollisionConfiguration* c);
/// With a pair cache of a class without RTTI, too.
std::unique_ptr<btBroadphaseInterface> make_no_rtti_broadphase();
/// Creates Bullet's own algorithm for two spheres.
std::unique_ptr<btCollisionAlgorithmCreateFunc> make_no_rtti_create_function();
/// Its filter ignores bodies whose user index is a multiple of 7.
std::unique_ptr<btRigidBody> make_no_rtti_body(btCollisionShape* shape);
btCollisionShape* make_no_rtti_sphere(btScalar radius);

}  // namespace jfpx::test
