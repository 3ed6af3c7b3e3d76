/// The directions in which a contact is held by friction.
#pragma once

#include "src/bullet/solver/contact_scan.hpp"
#include "src/contact_solver/row_layout.hpp"

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Leaves the directions of friction in the contact, as Bullet does, and in the rows.
/// @param second  the other direction in the plane of the contact; null if it does not slide
/// @param one,two the contact's lane of its rows: where the direction comes first. `two` is null if
///   there is friction in one direction only.
void set_friction_directions(const ContactRef& contact, const rows::RowSettings& settings,
                             std::size_t lanes, const Real* second, Real* one, Real* two);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
