/// Contacts of this step and of the last one, and the transfer of impulses and colors.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/contact_solver/soft_step/greedy_coloring.hpp"
#include "src/contact_solver/soft_step/joint_set.hpp"

#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// What the matching of contacts reads of the bodies.
struct MatchedBodies {
  std::span<const Real> inverse_mass;     ///< by body [1/kg]; 0: immovable or kinematic
  std::span<const std::uint32_t> places;  ///< by body, in the partition into blocks
  bool has_blocks = false;                ///< whether the world has several blocks

  bool are_movable(const ContactKey& key) const {
    return inverse_mass[key.a] > 0 && inverse_mass[key.b] > 0;
  }
  /// Whether the row of a contact of two bodies is an inner row.
  bool are_in_one_block(const ContactKey& key) const {
    return is_inner(has_blocks, places[key.a], places[key.b]);
  }
};

/// Owns the contacts of two steps. Buffers grow and never shrink.
class ContactCache {
 public:
  /// Contacts of the current step. The caller replaces the three lists of contacts and calls
  /// match().
  ContactSet& current() { return current_; }
  const ContactSet& current() const { return current_; }
  /// Contacts of the last completed step, without those of forgotten bodies.
  ContactSet& last() {
    drop_forgotten();
    return last_;
  }
  /// drop_forgotten() must have been called since the last forget().
  const ContactSet& last() const { return last_; }

  /// Assigns to each contact and joint its impulses and color of the last step, and colors the new
  /// ones.
  /// @param bodies of the step; their arrays are used during the call
  /// @param any_rolls whether a body has rolling or spinning friction
  /// @param pool null: in the calling thread
  /// @param domain null: a single rank. Otherwise, only joints of bodies of this rank are matched.
  void match(const MatchedBodies& bodies, bool any_rolls, const JointView& joints, ThreadPool* pool,
             Domain* domain = nullptr);
  /// Completes the step: the current contacts become the last ones. Does not allocate.
  void commit() noexcept { std::swap(last_, current_); }
  /// Reserves memory for forget() of bodies with indices below `bodies`. @throws std::bad_alloc
  void reserve(std::size_t bodies);
  /// Replaces the contacts of the last completed step.
  void restore(ContactSet last) noexcept;
  /// Marks the contacts of a body as removed, in constant time; drop_forgotten() removes the
  /// contacts of all marked bodies. Bodies that match() and reserve() did not include have no
  /// contacts.
  void forget(std::uint32_t body) noexcept;
  void drop_forgotten() noexcept;
  /// Clears the marks of forget(): the last contacts are now those of a later step.
  void forget_none() noexcept;
  /// Replaces the contacts of the last completed step by contacts as before forget().
  void replace_last(ContactSet last) noexcept { last_ = std::move(last); }

 private:
  void match_spheres(std::uint32_t first, std::uint32_t last, const MatchedBodies& bodies);
  void match_manifolds(std::uint32_t first, std::uint32_t last, const MatchedBodies& bodies);
  void match_joints(const JointView& joints, const MatchedBodies& bodies, const Domain* domain);
  void keep(std::uint32_t i, bool is_kept, std::uint32_t before, const MatchedBodies& bodies,
            GreedyColoring::Portion* uncolored);

  ContactSet current_, last_;
  std::vector<std::uint8_t> forgotten_;  ///< by body: 1 if its contacts in last_ must be removed
  bool any_forgotten_ = false;
  GreedyColoring coloring_;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
