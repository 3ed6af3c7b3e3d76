/// Searches by the tree of bounding spheres (thesis 4.4.5), and by tests of every pair.
#pragma once

#include "src/thesis/sphere_hierarchy.hpp"
#include "src/world/contacts/broad_phase_search.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {

/// A search that tests its candidate pairs with the collider. Buffers grow and never shrink.
class CandidateSearch : public BroadPhaseSearch {
 public:
  using BroadPhaseSearch::BroadPhaseSearch;
  ContactSpan find(std::span<const SphereInstance> spheres) final;
  NeighborPairs find_pairs(std::span<const SphereInstance> spheres, ThreadPool* pool) final;

 protected:
  /// Calls add_touching() for all pairs that may touch, in order.
  virtual void test_candidates(std::span<const SphereInstance> spheres) = 0;
  /// Appends the touching pairs of `pairs` to the contacts.
  void add_touching(std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs);

 private:
  std::vector<SpherePair> pairs_;
  std::vector<SphereContact> contacts_;
};

/// BroadPhase::hierarchy.
class HierarchySearch final : public CandidateSearch {
 public:
  using CandidateSearch::CandidateSearch;
  void set_spheres(std::span<const SphereInstance> spheres) override { tree_.assign(spheres); }

 private:
  void test_candidates(std::span<const SphereInstance> spheres) override;

  SphereHierarchy tree_;
  std::vector<SpherePair> candidates_;
};

/// BroadPhase::brute_force.
class EveryPairSearch final : public CandidateSearch {
 public:
  using CandidateSearch::CandidateSearch;
  void set_spheres(std::span<const SphereInstance>) override {}

 private:
  void test_candidates(std::span<const SphereInstance> spheres) override;

  std::vector<SpherePair> candidates_;
};

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
