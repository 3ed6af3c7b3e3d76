/// Friction directions of a contact.
#pragma once

#include "src/bullet/solver/contact_scan.hpp"
#include "src/contact_solver/sequential_impulse/row_layout.hpp"

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Stores the friction directions in the contact, like Bullet, and in the rows.
/// @param second the second direction in the contact plane, in the lane of the contact; null if the
///   contact slides
/// @param one,two the lane of the contact in its friction rows, which start with the direction.
///   `two` is null for a single friction direction
void set_friction_directions(const ContactRef& contact, const rows::RowSettings& settings,
                             std::size_t lanes, const Real* second, Real* one, Real* two);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
