/// Contacts of a step that are not in its contact set.
#pragma once

#include <jfpx/world.hpp>

#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Complement of a soft_step::ContactSet: ContactListMaker computes the contacts of
/// ContactSet::spheres from the set and copies all other contacts from this struct.
struct DetectedContacts {
  /// Contacts of sensors, compounds, boxes and walls at the start of the step, without materials.
  /// Contacts of two spheres precede all others; both parts have the order of World::contacts().
  std::vector<Contact> contacts;
  std::size_t sphere_count = 0;    ///< number of contacts of two spheres in `contacts`
  std::vector<Contact> generated;  ///< contacts of contact generators
  bool any_own_material = false;   ///< whether a generator has changed the material of a contact
  std::vector<Vec3> position;      ///< [m], by body, at the start of the step
  /// [m/s], [rad/s], by body, at the start of the step; only in worlds with hit events
  std::vector<Vec3> velocity, angular_velocity;
  std::uint64_t version = 0;  ///< Domain::version() in the step; 0: a single rank
};

}  // namespace JFPX_ABI
}  // namespace jfpx
