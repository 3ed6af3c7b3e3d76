/// Search by the collider's own cells, by the tree of bounding spheres, or by all pairs.
#include "src/world/broad_phase_search.hpp"

#include <jfpx/error.hpp>

#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

BroadPhaseSearch::BroadPhaseSearch(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
    : collider_(std::move(collider)), broad_phase_(broad_phase) {
  if (broad_phase <= BroadPhase::brute_force) return;
  throw InvalidArgument("broad_phase is " + std::to_string(static_cast<int>(broad_phase)) +
                        "; it must be cells, hierarchy or brute_force");
}

void BroadPhaseSearch::set_spheres(std::span<const SphereInstance> spheres) {
  if (broad_phase_ == BroadPhase::hierarchy) hierarchy_.assign(spheres);
}

ContactSpan BroadPhaseSearch::find(std::span<const SphereInstance> spheres) {
  neighbors_.clear();
  if (broad_phase_ == BroadPhase::cells) return collider_->find_contacts(spheres);
  contacts_.clear();
  if (broad_phase_ == BroadPhase::brute_force) {
    test_every_pair(spheres);
  } else {
    for (std::size_t i = 0; i < spheres.size(); ++i) {
      hierarchy_.update(static_cast<SphereHierarchy::Leaf>(i), spheres[i]);
    }
    hierarchy_.find_pairs(&pairs_);
    add_touching(spheres);
  }
  return contacts_;
}

NearPairs BroadPhaseSearch::find_pairs(std::span<const SphereInstance> spheres, ThreadPool* pool) {
  if (broad_phase_ == BroadPhase::cells) return neighbors_.find(spheres, collider_.get(), pool);
  const ContactSpan found = find(spheres);
  pairs_.clear();
  for (const SphereContact& c : found) pairs_.push_back({c.a, c.b});
  return {pairs_};
}

/// Works in batches, because all pairs of many spheres would exhaust the memory.
void BroadPhaseSearch::test_every_pair(std::span<const SphereInstance> spheres) {
  constexpr std::size_t kBatch = 4096;
  pairs_.clear();
  for (SphereIndex a = 0; a < spheres.size(); ++a) {
    for (SphereIndex b = a + 1; b < spheres.size(); ++b) {
      pairs_.push_back({a, b});
      if (pairs_.size() < kBatch) continue;
      add_touching(spheres);
      pairs_.clear();
    }
  }
  add_touching(spheres);
}

/// Appends the touching pairs of pairs_.
void BroadPhaseSearch::add_touching(std::span<const SphereInstance> spheres) {
  for (const PairContact& c : collider_->find_touching(spheres, pairs_)) {
    contacts_.push_back({pairs_[c.pair].a, pairs_[c.pair].b, c.normal, c.distance});
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
