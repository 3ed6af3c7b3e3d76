/// Finds which of many bounds touch, in the way that was chosen.
#pragma once

#include <jfpx/broad_phase.hpp>
#include <jfpx/sphere_collider.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Whatever the way, the collider has tested each touch, so that contacts, their bits and their
/// order are the same.
class BroadPhaseSearch {
 public:
  /// @param collider not null @throws InvalidArgument for a broad phase that there is not
  BroadPhaseSearch(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase);

  /// Must be called when the number of spheres changed, or what they stand for.
  void set_spheres(std::span<const SphereInstance> spheres);
  /// All touching pairs, sorted. Valid until the next call.
  /// @throws what SphereCollider::find_contacts() throws
  ContactSpan find(std::span<const SphereInstance> spheres);

  const SphereCollider& collider() const noexcept { return *collider_; }

 private:
  void test_every_pair(std::span<const SphereInstance> spheres);
  void test_pairs(std::span<const SphereInstance> spheres);

  std::unique_ptr<SphereCollider> collider_;
  BroadPhase broad_phase_;
  SphereHierarchy hierarchy_;
  std::vector<SpherePair> pairs_;
  std::vector<SphereContact> touches_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
