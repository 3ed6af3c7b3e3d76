/// The step of Solver::soft_step: contacts, waking, substeps, sleep.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_cache.hpp"
#include "src/contact_solver/soft_step/cpu/soft_step_solver.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/bodies/partition.hpp"
#include "src/world/contacts/swept_bounds.hpp"
#include "src/world/ranks/world_ranks.hpp"
#include "src/world/step/islands.hpp"
#include "src/world/step/soft_step_stages.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {

/// Moves the bodies of a world by one step. Owns its buffers, which grow and never shrink, and the
/// contacts of the last step, whose impulses and colors are part of the state of the world.
/// A step: the caller fills contacts() and calls add_generated(), solve() and commit(). If commit()
/// is not called, poses and velocities are unchanged, and the next step starts with the contacts of
/// the last completed step.
class SoftStep {
 public:
  /// @param pool outlives the object
  /// @param simd widest vector instructions of the sweeps
  /// @param ranks outlives the object; null: a single rank
  SoftStep(const SoftStepSettings& settings, const MaterialSettings& materials, Real dt,
           ThreadPool* pool, SimdLevel simd, WorldRanks* ranks = nullptr);

  /// Contacts of the current step, for ContactFinder::find_speculative_contacts().
  soft_step::ContactSet& contacts() { return cache_.current(); }
  /// After commit(): contacts of the second-to-last step, until the next detection.
  soft_step::ContactView contacts_before() { return set_before().view(); }
  soft_step::ContactSet& set_before() { return cache_.current(); }
  /// Contacts of the last completed step, with their impulses and colors.
  soft_step::ContactSet& last_contacts() { return cache_.last(); }
  /// Const overload. drop_removed() must have been called since the last forget().
  const soft_step::ContactSet& last_contacts() const { return cache_.last(); }
  Real inverse_h() const { return constants_.inverse_h; }  ///< [1/s], of a substep
  /// Adds the contacts of contact generators.
  void add_generated(const BodyStore& bodies, std::span<const Contact> generated);
  /// Excludes pairs from the continuous collision of the step in progress.
  void ignore(std::span<const BodyPair> pairs);
  /// Computes the motion of the step. Wakes bodies and updates accelerations. Forces must have been
  /// summed before.
  /// @returns the first body for which is_in_world() is false, if any
  /// @param joints its arrays are valid until commit(); `now` receives their impulses
  std::optional<BodyId> solve(BodyStore* bodies, const soft_step::JointView& joints);
  /// Moves the bodies, clears forces, puts islands to sleep, and renews the partition into blocks
  /// if it is due.
  /// @param steps World::steps() before the step
  /// @param sub_shapes,trees those of the contact search of the step
  /// @param present ContactFinder::present()
  void commit(BodyStore* bodies, std::uint64_t steps, const SubShapeView& sub_shapes,
              const FixedTreesView& trees, std::span<const std::uint32_t> present);
  /// Reserves memory for bodies with indices below `bodies`. @throws std::bad_alloc
  void reserve(std::size_t bodies) { cache_.reserve(bodies); }
  /// Replaces the parameters of the constructor and the contacts of the last completed step.
  void restore(const SoftStepSettings& settings, const MaterialSettings& materials, Real dt,
               soft_step::ContactSet last) noexcept;
  /// Removes the contacts of a removed body, in constant time; drop_removed() completes the
  /// removal.
  void forget(std::uint32_t body) noexcept { cache_.forget(body); }
  void drop_removed() noexcept { cache_.drop_forgotten(); }
  /// Replaces the contacts of the last step by the contacts of a device, without those of removed
  /// bodies.
  void replace_last_contacts(soft_step::ContactSet last) noexcept {
    cache_.replace_last(std::move(last));
    cache_.drop_forgotten();
  }
  /// Must be called after a step on a device; no contact then refers to a removed body.
  void forget_none() noexcept { cache_.forget_none(); }

 private:
  void prepare(const BodyStore& bodies);
  soft_step::Islands islands_of(const BodyStore& bodies, std::span<const std::uint32_t> mobile);
  std::span<const std::uint32_t> moved(const BodyStore& bodies) const;
  std::span<const std::uint32_t> present(const BodyStore& bodies) const;
  Domain* domain() const { return ranks_ == nullptr ? nullptr : &ranks_->domain(); }
  void wake_touched(const BodyStore& bodies);
  void put_to_sleep(const BodyStore& bodies);
  void share_marks(const soft_step::Islands& islands);
  void share_orientations();
  bool any_rank(bool condition);
  void mark_constrained();
  template <class Stage>
  void for_each_body(const BodyStore& bodies, const Stage& stage);
  template <class Stage>
  void for_each_part(const BodyStore& bodies, const Stage& stage);
  cpu::BodySweep body_sweep(bool is_first);
  void hold(std::span<const std::uint32_t> bodies);
  void accelerate_bodies(const BodyStore& bodies, bool is_first);
  void move_bodies(const BodyStore& bodies);
  void run_substeps(const BodyStore& bodies);
  template <class Test>
  bool any_body(std::span<const std::uint32_t> bodies, const Test& test);
  void load(const BodyStore& bodies);
  std::optional<BodyId> find_runaway(const BodyStore& bodies);
  void stop_fast_bodies(const BodyStore& bodies, const SubShapeView& sub_shapes,
                        const FixedTreesView& trees, std::span<const std::uint32_t> tested);

  soft_step::StepConstants constants_;
  SoftStepSettings settings_;
  MaterialSettings materials_;
  ThreadPool* pool_;
  WorldRanks* ranks_;
  soft_step::ContactCache cache_;
  soft_step::SoftStepSolver solver_;

  soft_step::JointView joints_;  ///< during a step
  soft_step::StepBodies step_;   ///< of the arrays below and the bodies, during a step
  std::vector<soft_step::SolverBody> bodies_;       ///< by body
  std::vector<std::uint8_t> traits_;                ///< by body: soft_step::BodyTraits
  std::vector<Quat> orientation_;                   ///< by body, during the step
  std::vector<Vec3> moved_rotation_;                ///< by body, if there are joints
  std::vector<soft_step::FreeMotion> free_;         ///< by body
  std::vector<soft_step::SubstepBody> gyroscopic_;  ///< by body, if a kernel takes it
  std::vector<std::uint8_t> constrained_;           ///< by body: StepBodies::constrained
  std::vector<std::uint32_t> parent_;               ///< by body: soft_step::DisjointSets::parent
  std::vector<std::uint8_t> marked_;                ///< by label of an island
  Partition partition_;
  IgnoredPairs ignored_;  ///< of the continuous collision
};

}  // namespace JFPX_ABI
}  // namespace jfpx
