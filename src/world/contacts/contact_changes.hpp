/// Changes of detected contacts by contact generators.
#pragma once

#include <jfpx/contact_generator.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The list of ContactContext::detected(), made on demand, and the use of its changes. Owns buffers
/// that grow and never shrink. For each step: start(), the generators, apply().
class ContactChanges {
 public:
  using ContactSet = soft_step::ContactSet;

  /// @param set,found contacts of the step of Solver::soft_step; both outlive apply()
  void start(const BodyStore& bodies, const MaterialSettings& rules, ThreadPool* pool,
             ContactSet* set, DetectedContacts* found);
  /// @param contacts of the step of Solver::worst_first, with their materials
  JFPX_API void start(std::vector<Contact>* contacts);

  std::span<DetectedContact> contacts();

  /// Checks and uses the changes of a step of Solver::soft_step.
  /// @param ignored empty; receives the pairs of bodies with an ignored contact, in any order
  /// @returns the number of touching contacts that were removed from ContactSet::spheres
  /// @throws InvalidArgument for a material that is out of its range
  std::size_t apply(std::vector<BodyPair>* ignored);
  /// The same for Solver::worst_first.
  /// @param detected number of contacts before those of generators; reduced by those removed
  /// @param of_spheres number of contacts of two spheres, which precede all others; likewise
  JFPX_API void apply(std::size_t* detected, std::size_t* of_spheres);

 private:
  void make_list();
  void make_list_of_set();
  void change_materials();
  void remove_touches();
  std::size_t remove_contacts();

  std::vector<DetectedContact> list_;
  bool is_made_ = false;
  std::vector<Contact>* contacts_ = nullptr;  ///< of Solver::worst_first
  // Solver::soft_step:
  const BodyStore* bodies_ = nullptr;
  MaterialSettings rules_;
  ThreadPool* pool_ = nullptr;
  ContactSet* set_ = nullptr;
  DetectedContacts* found_ = nullptr;
};

/// Sets the materials that generators have set in a list of contacts of a step.
/// @param list contacts of the set and of DetectedContacts::contacts
void set_own_materials(const DetectedContacts& detected, const soft_step::ContactView& contacts,
                       ThreadPool* pool, std::vector<Contact>* list);

}  // namespace JFPX_ABI
}  // namespace jfpx
