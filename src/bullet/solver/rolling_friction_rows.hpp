/// Anisotropic friction, and the inputs of rolling and spinning friction rows.
#pragma once

#include "src/bullet/solver/contact_scan.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Applies the anisotropic friction of both bodies to an axis, with Bullet's own function.
/// @param mode one of btCollisionObject::AnisotropicFrictionFlags
void apply_anisotropic_friction(const ContactRef& contact, btVector3* axis, int mode);

/// Writes the strengths of the rolling friction rows of a contact, and that it has these rows.
/// @param to the lane of the contact in its rows
void pack_rolling_friction(const btManifoldPoint& point, std::size_t lanes, Real* to);

/// Applies anisotropic friction to the rolling axes of a contact, but not to its spinning axis.
void scale_rolling_axes(const ContactRef& contact, std::size_t lanes, Real* to);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
