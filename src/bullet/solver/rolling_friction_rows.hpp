/// Rows against rolling and spinning of a contact, which Bullet's own function sets up: they are
/// seldom many.
#pragma once

#include "src/bullet/solver/contact_scan.hpp"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Friction that depends on the direction, which is a matter for Bullet.
/// @param mode one of btCollisionObject::AnisotropicFrictionFlags
void turn_by_anisotropy(const ContactRef& contact, btVector3* axis, int mode);

/// Fills the kRollingFrictionRows rows of a contact, where they are not to stay 0. Safe for
/// different contacts at once.
/// @param fixed Bullet's solver body that stands for all bodies without one
/// @param to    the contact's lane of the rows, all 0
void set_up_rolling_frictions(btSequentialImpulseConstraintSolver& solver, int fixed,
                              btScalar relaxation, const ContactRef& contact, Real* to,
                              std::size_t lanes);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
