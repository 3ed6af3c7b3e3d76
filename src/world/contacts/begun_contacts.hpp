/// Contacts that began during a step, after contact detection.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Whether a point that did not touch at the start of the step has pushed the bodies apart.
/// @param point of the contact; that of two spheres has point 0 only
JFPX_HD inline bool has_begun(const ContactView& contacts, std::uint32_t contact,
                              std::uint32_t point) {
  return contacts.distance(contact, point) > 0 &&
         contacts.impulses[contacts.first_impulse(contact) + point].has_pushed();
}

/// Number of points of a contact for which has_begun() holds; 0 for a generated contact.
JFPX_HD inline std::uint32_t count_begun(const ContactView& contacts, std::uint32_t contact) {
  if (contacts.key(contact).is_generated()) return 0;
  std::uint32_t count = 0;
  for (std::uint32_t p = 0; p < contacts.impulse_count(contact); ++p) {
    if (has_begun(contacts, contact, p)) ++count;
  }
  return count;
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
