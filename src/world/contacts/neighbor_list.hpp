/// Neighbor list: pairs of close spheres, reused by several searches (Verlet 1967).
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Sorted candidate pairs of spheres, which include all touching pairs.
struct NeighborPairs {
  std::span<const SpherePair> pairs;
  bool all_touch = true;

  /// Calls visit(std::span<const SpherePair>) for the touching pairs of a range, in order, in parts
  /// of at most kMostSelected pairs.
  template <class Visit>
  void for_each_touching(std::span<const SphereInstance> spheres, std::size_t first,
                         std::size_t last, const Visit& visit) const {
    std::array<SpherePair, kMostSelected> room;
    for (; first < last; first += kMostSelected) {
      visit(touching(spheres, first, std::min(last, first + kMostSelected), room.data()));
    }
  }
  static constexpr std::size_t kMostSelected = 1024;

 private:
  std::span<const SpherePair> touching(std::span<const SphereInstance> spheres, std::size_t first,
                                       std::size_t last, SpherePair* room) const;
};

/// Finds the touching pairs of spheres that move little between two searches. Each sphere has a
/// larger bound. While all spheres are within their bounds, only pairs of touching bounds are
/// tested. The result does not depend on earlier searches: the pairs and their order are those of a
/// search among the spheres. Owns its buffers, which grow and never shrink.
///
/// Claim: if two spheres that are within their bounds touch, the bounds touch. A sphere counts as
/// within its bound if (distance of the centres + radius) * (1 + 16 eps) <= radius of the bound.
/// The exact test rounds the distance and the sum of the radii with a relative error of at most 4
/// eps, so the centres of the bounds are at most (R_a + R_b)(1 - 7 eps) apart, and the test of the
/// bounds reports a contact. Radii are at least kLeastRadius, so errors of underflow are
/// negligible.
class NeighborList {
 public:
  /// Valid until the next call, or another call of the collider.
  /// @throws the exceptions of SphereCollider::find_pairs()
  NeighborPairs find(std::span<const SphereInstance> spheres, SphereCollider* collider,
                     ThreadPool* pool);
  /// Must be called after every other call of the collider.
  void clear() noexcept { count_ = 0; }

 private:
  static constexpr Real kLeastRadius = Real(1e-9);

  Real largest_motion(std::span<const SphereInstance> spheres, ThreadPool* pool);
  Real choose_slack(std::span<const SphereInstance> spheres, Real motion, ThreadPool* pool) const;

  std::size_t count_ = 0;              ///< number of bounds; 0: there are none
  Buffer<SphereInstance> bounds_;      ///< by sphere
  Real slack_ = 0;                     ///< [m], radius of a bound, minus that of its sphere
  std::size_t searches_ = 0;           ///< since the bounds were made
  std::span<const SpherePair> pairs_;  ///< of bounds that touch; in the collider
};

}  // namespace JFPX_ABI
}  // namespace jfpx
