/// The list of World::contacts(), built on demand from the contacts of a step.
#pragma once

#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/ranks/domain.hpp"
#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Contacts in the order of World::contacts().
struct ContactList {
  std::vector<Contact> contacts;
  std::size_t detected = 0;  ///< number of contacts before those of contact generators
};

/// Builds lists from the contacts of a step. Owns its buffers, which grow and never shrink.
class ContactListMaker {
 public:
  /// @param pool outlives the object
  explicit ContactListMaker(ThreadPool* pool) : pool_(pool) {}

  /// @param detected,contacts of the same step
  /// @param with_begun adds the contacts that began during the step; requires the impulses of the
  ///                 completed step in `contacts`
  /// @param bodies   with the ids and materials of the step
  /// @throws std::bad_alloc
  void make(const DetectedContacts& detected, const soft_step::ContactView& contacts,
            bool with_begun, const BodiesOfStep& bodies, const MaterialSettings& rules,
            ContactList* list);

 private:
  void append_spheres(const DetectedContacts& detected, const soft_step::ContactView& contacts,
                      bool with_begun, const BodiesOfStep& bodies, std::vector<Contact>* list);

  ThreadPool* pool_;
  std::vector<std::size_t> begin_;  ///< by chunk of contacts of spheres: its first place in a list
  std::vector<Contact> merged_;     ///< copy of the second of two lists
};

/// Numbers of contacts that began during a step.
struct BegunCounts {
  std::size_t spheres = 0, points = 0;
};
/// @param contacts after the step, with its impulses
/// @param domain null, or counts only the contacts that this rank has detected
BegunCounts count_begun_contacts(const soft_step::ContactView& contacts, const Domain* domain,
                                 ThreadPool* pool);

/// Sets the fields of detected contacts that follow from the properties of their bodies: the
/// materials of those of without_material(), and Contact::sensor.
JFPX_API void set_materials(const BodiesOfStep& bodies, const MaterialSettings& rules,
                            ThreadPool* pool, std::vector<Contact>* contacts);

}  // namespace JFPX_ABI
}  // namespace jfpx
