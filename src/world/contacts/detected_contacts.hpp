/// Contacts of a step that are not in its contact set.
#pragma once

#include <jfpx/world.hpp>

#include "src/contact_solver/soft_step/contact_set.hpp"

#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A contact whose material set_materials() combines from those of the bodies.
inline Contact without_material(BodyId a, BodyId b, const Vec3& normal, const Vec3& point,
                                Real distance) {
  return {a, b, normal, point, distance, -1, 0};
}

/// Complement of a soft_step::ContactSet: ContactListMaker computes the contacts of
/// ContactSet::spheres from the set and copies all other contacts from this struct.
struct DetectedContacts {
  /// Contacts of sensors, compounds, boxes and walls at the start of the step, without materials,
  /// unless a contact generator has set one.
  /// Contacts of two spheres precede all others; both parts have the order of World::contacts().
  std::vector<Contact> contacts;
  /// Keys of `contacts`; only in worlds with contact generators.
  std::vector<soft_step::ContactKey> keys;
  std::size_t sphere_count = 0;    ///< number of contacts of two spheres in `contacts`
  std::vector<Contact> generated;  ///< contacts of contact generators
  std::vector<Vec3> position;      ///< [m], by body, at the start of the step
  /// [m/s], [rad/s], by body, at the start of the step; only in worlds with hit events
  std::vector<Vec3> velocity, angular_velocity;
  std::uint64_t version = 0;  ///< Domain::version() in the step; 0: a single rank
};

}  // namespace JFPX_ABI
}  // namespace jfpx
