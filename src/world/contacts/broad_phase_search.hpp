/// The broad phase of a world: finds the touching pairs of bounding spheres.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/contacts/neighbor_list.hpp"

#include <memory>
#include <span>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

/// Interface of the searches that BroadPhase selects. Every search tests pairs with the collider,
/// so all searches return the same contacts with the same bits in the same order.
class BroadPhaseSearch {
 public:
  /// @param collider not null
  explicit BroadPhaseSearch(std::unique_ptr<SphereCollider> collider)
      : collider_(std::move(collider)) {}
  virtual ~BroadPhaseSearch() = default;

  /// Must be called after the number of spheres, or the body that a sphere belongs to, has changed.
  virtual void set_spheres(std::span<const SphereInstance> spheres) = 0;
  /// All touching pairs, sorted. Valid until the next call.
  /// @throws the exceptions of SphereCollider::find_contacts() and find_touching()
  virtual ContactSpan find(std::span<const SphereInstance> spheres) = 0;
  /// The pairs of find() without contact data; may include pairs that do not touch. Faster if the
  /// spheres have moved little since the last call. Valid until the next call of either function.
  /// @throws the exceptions of find()
  virtual NeighborPairs find_pairs(std::span<const SphereInstance> spheres, ThreadPool* pool) = 0;

  SphereCollider& collider() const noexcept { return *collider_; }

 private:
  std::unique_ptr<SphereCollider> collider_;
};

/// BroadPhase::cells: the collider's own search.
class CellSearch final : public BroadPhaseSearch {
 public:
  using BroadPhaseSearch::BroadPhaseSearch;
  void set_spheres(std::span<const SphereInstance>) override {}
  ContactSpan find(std::span<const SphereInstance> spheres) override {
    neighbors_.clear();
    return collider().find_contacts(spheres);
  }
  NeighborPairs find_pairs(std::span<const SphereInstance> spheres, ThreadPool* pool) override {
    return neighbors_.find(spheres, &collider(), pool);
  }

 private:
  NeighborList neighbors_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
