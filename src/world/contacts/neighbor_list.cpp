/// Search among pairs of bounds; see the header.
#include "src/world/contacts/neighbor_list.hpp"

#include "src/base/parallel_for.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cpu/pair_filter.hpp"

#include <algorithm>
#include <array>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Below this number of spheres, testing all pairs takes about the same time.
constexpr std::size_t kFewest = 512;
constexpr std::size_t sphere_chunk(std::size_t spheres) { return chunk_size(spheres, 128, 1024); }
/// The slack is the motion of about kSearches searches, limited to fractions of the smallest
/// radius. More slack means more pairs to test in every search (bench/results/soft_step.md).
constexpr Real kSearches = 10, kLeast = Real(0.02), kMost = Real(0.15);
/// Bounds that last for fewer searches cost more time than they save.
constexpr Real kFewestSearches = Real(2.5);

/// Maximum, with NaN as the largest number.
Real larger(Real x, Real y) { return x > y || x != x ? x : y; }

}  // namespace

/// The largest distance by which a sphere has moved or grown since the bounds were computed; above
/// slack_ if a sphere has left its bound.
Real NeighborList::largest_motion(std::span<const SphereInstance> spheres, ThreadPool* pool) {
  constexpr Real kMargin = 1 + 16 * kEpsilon;
  const auto largest_of = [&](std::size_t first, std::size_t last) {
    Real largest = -slack_;
    for (std::size_t i = first; i < last; ++i) {
      const Real moved = length(spheres[i].centre - bounds_[i].centre);
      const Real outside = (moved + spheres[i].radius) * kMargin - bounds_[i].radius;
      largest = larger(largest, outside);
    }
    return largest;
  };
  return slack_ + parallel_reduce(pool, spheres.size(), sphere_chunk(spheres.size()), -slack_,
                                  largest_of, larger);
}

/// @param motion [m], per search
Real NeighborList::choose_slack(std::span<const SphereInstance> spheres, Real motion,
                                ThreadPool* pool) const {
  const auto smallest_of = [&](std::size_t first, std::size_t last) {
    return std::ranges::min(spheres.subspan(first, last - first), {}, &SphereInstance::radius)
        .radius;
  };
  const Real smallest = parallel_reduce(pool, spheres.size(), sphere_chunk(spheres.size()),
                                        spheres[0].radius, smallest_of, std::ranges::min);
  const bool pays = kFewestSearches * motion <= kMost * smallest;
  if (!pays || !(smallest >= kLeastRadius)) return 0;
  return std::clamp(kSearches * motion, kLeast * smallest, kMost * smallest);
}

NeighborPairs NeighborList::find(std::span<const SphereInstance> spheres, SphereCollider* collider,
                                 ThreadPool* pool) {
  if (spheres.size() < kFewest || collider->backend() != Backend::cpu) {
    clear();
    return {collider->find_pairs(spheres)};
  }
  Real slack = 0;
  if (spheres.size() == count_) {
    ++searches_;
    const Real motion = largest_motion(spheres, pool);
    if (motion <= slack_) return {pairs_, false};
    slack = choose_slack(spheres, motion / static_cast<Real>(searches_), pool);
  }
  clear();
  bounds_.reserve(spheres.size(), "bounds of spheres");
  parallel_for(pool, spheres.size(), sphere_chunk(spheres.size()),
               [&](std::size_t first, std::size_t last) {
                 for (std::size_t i = first; i < last; ++i) {
                   bounds_[i] = {spheres[i].centre, spheres[i].radius + slack};
                 }
               });
  pairs_ = collider->find_pairs({bounds_.data(), spheres.size()});
  slack_ = slack;
  searches_ = 0;
  if (collider->backend() == Backend::cpu) count_ = spheres.size();
  return {pairs_, !(slack > 0)};
}

std::span<const SpherePair> NeighborPairs::touching(std::span<const SphereInstance> spheres,
                                                    std::size_t first, std::size_t last,
                                                    SpherePair* room) const {
  const std::span<const SpherePair> part = pairs.subspan(first, last - first);
  if (all_touch) return part;
  std::array<std::uint32_t, kMostSelected> found;
  const std::size_t count =
      cpu::find_candidates(spheres.data(), part.data(), part.size(), found.data());
  SpherePair* next = room;
  for (std::size_t k = 0; k < count; ++k) {
    const SpherePair& pair = part[found[k]];
    if (detail::test_sphere_pair(spheres[pair.a], spheres[pair.b]).touching != 0) *next++ = pair;
  }
  return {room, next};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
