/// Rolling and spinning friction rows of a contact. Bullet's own function sets them up, because
/// there are usually few.
#pragma once

#include "src/bullet/solver/contact_scan.hpp"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Applies the anisotropic friction of both bodies to an axis, with Bullet's own function.
/// @param mode one of btCollisionObject::AnisotropicFrictionFlags
void apply_anisotropic_friction(const ContactRef& contact, btVector3* axis, int mode);

/// Sets up the nonzero rows among the kRollingFrictionRows rows of a contact. Thread-safe for
/// different contacts.
/// @param fixed index of the solver body that replaces all bodies without a solver body
/// @param to    the lane of the contact in its rows, which are all 0
void set_up_rolling_frictions(btSequentialImpulseConstraintSolver& solver, int fixed,
                              btScalar relaxation, const ContactRef& contact, Real* to,
                              std::size_t lanes);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
