/// The share of a rank in a world that several ranks hold together.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/collide/block_tree.hpp"
#include "src/ranks/domain.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/contacts/detected_contacts.hpp"
#include "src/world/joints/joint_store.hpp"
#include "src/world/ranks/contact_exchange.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Boxes of other ranks.
class ForeignBoxes {
 public:
  /// @param messages by rank: boxes
  void receive(std::span<const Communicator::Message> messages);
  /// Calls visit(box, rank) for the boxes that overlap a box.
  template <class Visit>
  void visit_overlapping(const Aabb& box, const Visit& visit) const {
    tree_.view().visit_overlapping(box,
                                   [&](std::uint32_t item) { visit(boxes_[item], ranks_[item]); });
  }

 private:
  std::vector<Aabb> boxes_;
  std::vector<Domain::Rank> ranks_;  ///< by box
  std::vector<std::uint32_t> items_;
  BlockTree tree_;
};

/// Assigns the bodies to ranks, selects the ghosts, and exchanges the state of bodies, contacts and
/// joints (docs/ranks.md). Every rank has a slot for each body; between steps, the state of a body
/// is up to date on the rank that owns it and, after collect(), on all ranks.
///
/// All functions that take a non-const object communicate: all ranks call them in the same order.
class WorldRanks {
 public:
  /// @param pool not null; outlives the object
  WorldRanks(std::shared_ptr<Communicator> communicator, ThreadPool* pool)
      : domain_(std::move(communicator), pool) {}

  Domain& domain() { return domain_; }
  const Domain& domain() const { return domain_; }

  /// Fetches the motion of all bodies.
  void collect(BodyStore* bodies);
  /// Must be called after bodies were added, removed or moved; collect() must precede the change.
  void note_change() { owners_changed_ = true; }

  /// Starts a step: assigns new owners if that is due, and moves contacts and joints to them.
  /// @param steps World::steps() before the step
  /// @param last,detected contacts of the last step
  void start_step(BodyStore* bodies, JointStore* joints, std::uint64_t steps,
                  soft_step::ContactSet* last, DetectedContacts* detected);
  /// Updates the ghosts, after the forces of the step are known.
  /// @param margin [m], SoftStepSettings::speculative_margin
  void update_ghosts(BodyStore* bodies, const JointStore& joints, Real margin);
  /// Fetches what Partition::update() reads of the bodies of other ranks, if the partition into
  /// blocks must be renewed. @returns whether it must be renewed, if a body is awake
  /// @param steps World::steps() before the step
  bool prepare_partition(BodyStore* bodies, std::uint64_t steps);

  /// Thrown by check_owners(): the step must be undone and repeated.
  struct OwnersChanged {};
  /// @param stray bodies that rank 0 must own
  /// @throws OwnersChanged on all ranks, if there are any on one of them
  void check_owners(std::span<const std::uint32_t> stray);

  /// Time of a step of this rank, in rows of spheres. @param awake number of awake bodies
  static std::uint64_t load(std::uint64_t awake, const soft_step::ContactSet& contacts);
  /// Must be called after each step. @param most,mean of the loads of all ranks
  void note_loads(std::uint64_t most, std::uint64_t mean) { balance_.update(most, mean); }

  /// Must be called when a step has replaced the contacts of the last step.
  void complete_step() {
    before_ = last_;
    last_ = {false, false};
  }
  /// Fetches the contacts of the last step, and of the step before.
  void gather_last(soft_step::ContactSet* set, DetectedContacts* detected) {
    gather(&last_, set, detected);
  }
  void gather_before(soft_step::ContactSet* set, DetectedContacts* detected) {
    gather(&before_, set, detected);
  }
  /// Must be called when the contacts have been replaced by those of a snapshot.
  void note_restored() {
    note_change();
    pinned_.clear();
    motion_is_complete_ = joints_are_complete_ = true;
    last_ = before_ = {true, true};
  }
  /// Fetches impulses and colors of all joints.
  void gather_joints(JointStore* joints);

 private:
  /// Whether owners should be assigned again because the loads of the ranks have changed.
  class Balance {
   public:
    void update(std::uint64_t most, std::uint64_t mean);
    bool is_lost() const { return is_lost_; }

   private:
    std::uint32_t steps_ = 0;         ///< since owners were assigned
    std::uint64_t first_excess_ = 0;  ///< highest load / mean, in the first of these
    bool is_lost_ = false;
  };

  void share_positions(BodyStore* bodies, std::span<std::uint8_t> rows);
  void migrate_motion(std::span<const Domain::Rank> before, BodyStore* bodies,
                      DetectedContacts* detected);
  void assign_owners(const BodyStore& bodies, std::span<const std::uint8_t> rows);
  bool sweep_boxes(const BodyView& bodies, Real margin);
  void enclose(const BodyView& bodies);
  /// Bodies, as places in movable_, and a box around their enclosures.
  struct Group {
    std::span<const std::uint32_t> places;
    Aabb box;
  };
  std::vector<Group> groups_of(std::span<const std::uint32_t> places, std::size_t size) const;
  void find_touching(std::span<const Group> groups, const ForeignBoxes& boxes,
                     BodyLists* places) const;
  void select_ghosts(const BodyView& bodies, const JointStore& joints);

  /// Whether this rank has all contacts of a step.
  struct Contacts {
    bool has_set = true, has_detected = true;
  };
  void gather(Contacts* contacts, soft_step::ContactSet* set, DetectedContacts* detected);

  Domain domain_;
  bool owners_changed_ = true;
  bool ghosts_changed_ = true;
  bool motion_is_complete_ = true;  ///< whether this rank has the motion of all bodies
  bool joints_are_complete_ = true;
  Contacts last_, before_;
  Balance balance_;
  std::uint32_t without_place_ = 0;    ///< number of movable bodies without a place
  std::vector<std::uint32_t> pinned_;  ///< bodies that rank 0 owns, for a while
  bool is_repeated_ = false;  ///< whether the next step repeats one for which it got bodies
  std::vector<std::uint32_t> movable_;  ///< bodies of this rank, ascending
  std::vector<std::uint32_t> order_;    ///< places in movable_, along a Morton curve
  std::vector<Aabb> boxes_;             ///< by place in movable_: bounds of the motion of the step
  std::vector<Aabb> enclosures_;        ///< likewise, while the ghosts are the same
  Real horizon_ = 4;        ///< [steps], for which enclosures_ include the motion of the bodies
  std::uint32_t uses_ = 0;  ///< number of steps with these ghosts
  ForeignBoxes foreign_boxes_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
