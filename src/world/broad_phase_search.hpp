/// The broad phase of a world: finds the touching pairs of bounding spheres.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/neighbor_list.hpp"
#include "src/world/sphere_hierarchy.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Searches as BroadPhase selects. The collider tests every pair in all of them, so the contacts,
/// their bits and their order are the same.
class BroadPhaseSearch {
 public:
  /// @param collider not null
  /// @throws InvalidArgument if `broad_phase` is not a value of the enumeration
  BroadPhaseSearch(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase);

  /// Must be called after the number of spheres, or the body that a sphere belongs to, has changed.
  void set_spheres(std::span<const SphereInstance> spheres);
  /// All touching pairs, sorted. Valid until the next call.
  /// @throws the exceptions of SphereCollider::find_contacts() and find_touching()
  ContactSpan find(std::span<const SphereInstance> spheres);
  /// The pairs of find() as indices alone, perhaps among others. Takes less time if the spheres
  /// have moved little since the last call. Valid until the next call of either function.
  /// @throws as find()
  NearPairs find_pairs(std::span<const SphereInstance> spheres, ThreadPool* pool);

  const SphereCollider& collider() const noexcept { return *collider_; }

 private:
  void test_every_pair(std::span<const SphereInstance> spheres);
  void add_touching(std::span<const SphereInstance> spheres);

  std::unique_ptr<SphereCollider> collider_;
  BroadPhase broad_phase_;
  SphereHierarchy hierarchy_;
  NeighborList neighbors_;
  std::vector<SpherePair> pairs_;
  std::vector<SphereContact> contacts_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
