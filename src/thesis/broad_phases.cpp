/// Searches by the tree of bounding spheres, and by tests of every pair.
#include "src/thesis/broad_phases.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {

ContactSpan CandidateSearch::find(std::span<const SphereInstance> spheres) {
  contacts_.clear();
  test_candidates(spheres);
  return contacts_;
}

NeighborPairs CandidateSearch::find_pairs(std::span<const SphereInstance> spheres, ThreadPool*) {
  const ContactSpan found = find(spheres);
  pairs_.clear();
  for (const SphereContact& c : found) pairs_.push_back({c.a, c.b});
  return {pairs_};
}

void CandidateSearch::add_touching(std::span<const SphereInstance> spheres,
                                   std::span<const SpherePair> pairs) {
  for (const PairContact& c : collider().find_touching(spheres, pairs)) {
    contacts_.push_back({pairs[c.pair].a, pairs[c.pair].b, c.normal, c.distance});
  }
}

void HierarchySearch::test_candidates(std::span<const SphereInstance> spheres) {
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    tree_.update(static_cast<SphereHierarchy::Leaf>(i), spheres[i]);
  }
  tree_.find_pairs(&candidates_);
  add_touching(spheres, candidates_);
}

/// Works in batches, because all pairs of many spheres would exhaust the memory.
void EveryPairSearch::test_candidates(std::span<const SphereInstance> spheres) {
  constexpr std::size_t kBatch = 4096;
  candidates_.clear();
  for (SphereIndex a = 0; a < spheres.size(); ++a) {
    for (SphereIndex b = a + 1; b < spheres.size(); ++b) {
      candidates_.push_back({a, b});
      if (candidates_.size() < kBatch) continue;
      add_touching(spheres, candidates_);
      candidates_.clear();
    }
  }
  add_touching(spheres, candidates_);
}

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
