/// Sequential contact resolver: corrects penetrations, then velocities, always the worst contact
/// first (thesis 4.4.6).
#pragma once

#include <jfpx/world.hpp>

#include "src/thesis/contact_response.hpp"
#include "src/thesis/indexed_priority_queue.hpp"
#include "src/world/bodies/body_store.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Iteration counts of the resolver in a step.
struct ResolverReport {
  std::uint64_t position_iterations = 0;
  std::uint64_t velocity_iterations = 0;
  bool exhausted = false;  ///< a loop stopped at its limit with work left
};

/// There are two loops, one for positions and one for velocities. Each iteration takes the worst
/// contact, resolves it, and updates the keys of all contacts of its two bodies (errata E6, E10,
/// E11). The key of a contact is its penetration in the first loop, and the required change of its
/// separating velocity in the second.
///
/// The queue selects the largest key, and the lowest index among equal keys, like the linear scan
/// of the thesis. Buffers grow and never shrink.
class ContactResolver {
 public:
  /// @param contacts between `bodies`. Two movable bodies in contact must be both awake or both
  ///   asleep. Contacts without an awake body are ignored.
  /// @param generated number of contacts of contact generators at the end of `contacts`. They act
  /// at
  ///   Contact::point, even on spheres, and form no patches.
  ResolverReport resolve(BodyStore& bodies, std::span<const Contact> contacts,
                         const ResolverSettings& settings, std::size_t generated = 0);

 private:
  struct alignas(64) Row {  // a cache line in float, two in double
    std::uint32_t a, b;
    Vec3 normal, arm_a, arm_b;  ///< arms: from the centre of mass to the contact
    Real from_acceleration;     ///< [m/s], change of the separating velocity by accelerations
    Real friction, restitution;
    std::uint32_t first, last;  ///< rows of the same two bodies with the same normal: [first, last)
  };
  /// One correction for one or several rows of the same two bodies with the same normal.
  struct Patch {
    const Row& row;     ///< the worst row
    Vec3 arm_a, arm_b;  ///< to the point of the correction
    Real amount;        ///< of the correction: [m] in the position loop, [m/s] in the velocity loop
    Real radius = 0;    ///< [m], mean distance of the points from their centre; 0 for one point
  };
  /// Fractions of a patch's friction that act against sliding and against spinning; their squares
  /// add up to 1.
  struct FrictionShares {
    Real sliding, spinning;
  };
  using RowIndex = std::uint32_t;

  void prepare(std::span<const Contact> contacts, std::size_t generated);
  void add_row(const Contact& contact, const Vec3& arm_a, const Vec3& arm_b);
  void group_patches();
  Patch patch_of(RowIndex worst, Real slack) const;
  void index_rows_by_body();
  std::span<const RowIndex> rows_of(std::uint32_t body) const;
  Vec3 lever_arm(std::uint32_t body, const Contact& contact, Real side) const;

  void resolve_positions(ResolverReport* report);
  void project(const Patch& patch);
  void displace(std::uint32_t body, const detail::Displacement& displacement);

  void resolve_velocities(ResolverReport* report);
  void apply_impulse(const Patch& patch);
  FrictionShares share_friction(const Patch& patch, const Vec3& velocity) const;
  Real spin(const Row& row) const;
  void apply_spin_friction(const Row& row, Real limit);
  void add_impulse(std::uint32_t body, const Vec3& arm, const Vec3& impulse);
  Vec3 relative_velocity(const Row& row, const Vec3& arm_a, const Vec3& arm_b) const;
  Real target_delta_velocity(const Row& row) const;
  std::uint64_t limit() const;

  BodyStore* bodies_ = nullptr;  ///< during resolve()
  ResolverSettings settings_;
  std::vector<Row> rows_;
  std::vector<Real> keys_;
  IndexedPriorityQueue queue_;
  std::vector<std::uint32_t> first_row_;  ///< by body: start of its range in body_rows_
  std::vector<RowIndex> body_rows_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
