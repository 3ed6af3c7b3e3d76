/// Changes of detected contacts by contact generators.
#pragma once

#include <jfpx/contact_generator.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The list of ContactContext::detected(), made on demand, and the use of its changes. Owns buffers
/// that grow and never shrink. For each step: start(), the generators, apply().
class ContactChanges {
 public:
  using ContactSet = soft_step::ContactSet;
  using ContactKey = soft_step::ContactKey;
  using OwnMaterial = soft_step::OwnMaterial;

  /// Starts a step of Solver::soft_step.
  /// @param set,found contacts of the step before ContactFinder::complete(); both outlive apply()
  void start(const BodyStore& bodies, const MaterialSettings& rules, ThreadPool* pool,
             ContactSet* set, DetectedContacts* found);
  /// Starts a step of Solver::worst_first.
  /// @param contacts of the step, with their materials; outlives apply()
  /// @param count    number of contacts before those of generators
  JFPX_API void start(std::vector<Contact>* contacts, std::size_t count);

  std::span<DetectedContact> contacts();

  /// The contacts that a step of Solver::soft_step ignores.
  struct Ignored {
    std::size_t touching_spheres = 0;  ///< number of those removed from ContactSet::spheres
    bool any_manifold = false;         ///< whether manifolds have no points any more
    /// Pairs of a movable and a fixed body, all of whose contacts are ignored. Valid until start().
    std::span<const BodyPair> pairs;
  };
  /// Checks and uses the changes of a step of Solver::soft_step.
  /// @throws InvalidArgument for a material that is out of its range, or another member that was
  ///   changed
  Ignored apply();
  /// The same for Solver::worst_first.
  /// @param spheres number of contacts of two spheres, which precede all others; is reduced by
  ///   those removed
  JFPX_API void apply(std::size_t* spheres);

 private:
  const ContactKey& key(std::size_t contact) const;
  void make_list();
  void make_list_of_set();
  void check() const;
  void change_materials();
  void find_ignored_pairs();
  void remove_touches();

  std::vector<DetectedContact> list_;
  bool is_made_ = false;
  // Solver::worst_first:
  std::vector<Contact>* contacts_ = nullptr;  ///< null: Solver::soft_step
  std::size_t count_ = 0;
  // Solver::soft_step:
  const BodyStore* bodies_ = nullptr;
  MaterialSettings rules_;
  ThreadPool* pool_ = nullptr;
  ContactSet* set_ = nullptr;
  DetectedContacts* found_ = nullptr;
  std::vector<std::pair<ContactKey, OwnMaterial>> changed_;  ///< manifolds with a material
  std::vector<ContactKey> ignored_;                          ///< manifolds, sorted
  std::vector<BodyPair> pairs_;                              ///< Ignored::pairs
};

}  // namespace JFPX_ABI
}  // namespace jfpx
