/// Search among pairs of bounds; see the header.
#include "src/world/neighbor_list.hpp"

#include "src/base/parallel_for.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cpu/pair_filter.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Fewer spheres are tested pair by pair in about the same time.
constexpr std::size_t kFewest = 512;
constexpr std::size_t kSpheresPerChunk = 4096, kNearPairsPerChunk = 4096;
/// The slack is the motion of about this number of searches, within these parts of the smallest
/// radius. More slack means more pairs to test in every search (bench/results/soft_step.md).
constexpr Real kSearches = 10, kLeast = Real(0.02), kMost = Real(0.15);
/// Bounds that would last for fewer searches take more time than they save.
constexpr Real kFewestSearches = Real(2.5);

}  // namespace

/// The largest distance by which a sphere has moved or grown since the bounds were made; above
/// slack_ if a sphere is not within its bound.
Real NeighborList::largest_motion(std::span<const SphereInstance> spheres, ThreadPool* pool) {
  constexpr Real kMargin = 1 + 16 * kEpsilon;
  largest_.resize((spheres.size() + kSpheresPerChunk - 1) / kSpheresPerChunk);
  parallel_for(pool, largest_.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t chunk = first; chunk < last; ++chunk) {
      const std::size_t begin = chunk * kSpheresPerChunk;
      const std::size_t end = std::min(spheres.size(), begin + kSpheresPerChunk);
      Real largest = -slack_;
      for (std::size_t i = begin; i < end; ++i) {
        const Real moved = length(spheres[i].centre - bounds_[i].centre);
        const Real outside = (moved + spheres[i].radius) * kMargin - bounds_[i].radius;
        largest = outside <= largest ? largest : outside;  // NaN is the largest
      }
      largest_[chunk] = largest;
    }
  });
  Real largest = -slack_;
  for (const Real outside : largest_) largest = outside <= largest ? largest : outside;
  return slack_ + largest;
}

/// @param motion [m], per search
Real NeighborList::choose_slack(std::span<const SphereInstance> spheres, Real motion) const {
  const Real smallest = std::ranges::min(spheres, {}, &SphereInstance::radius).radius;
  const bool pays = kFewestSearches * motion <= kMost * smallest;
  if (!pays || !(smallest >= kLeastRadius)) return 0;
  return std::clamp(kSearches * motion, kLeast * smallest, kMost * smallest);
}

std::span<const SpherePair> NeighborList::find(std::span<const SphereInstance> spheres,
                                               SphereCollider* collider, ThreadPool* pool) {
  if (spheres.size() < kFewest || collider->backend() != Backend::cpu) {
    clear();
    return collider->find_pairs(spheres);
  }
  Real slack = 0;
  if (spheres.size() == count_) {
    ++searches_;
    const Real motion = largest_motion(spheres, pool);
    if (motion <= slack_) return select(spheres, pool);
    slack = choose_slack(spheres, motion / static_cast<Real>(searches_));
  }
  clear();
  bounds_.reserve(spheres.size(), "bounds of spheres");
  parallel_for(pool, spheres.size(), kSpheresPerChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      bounds_[i] = {spheres[i].centre, spheres[i].radius + slack};
    }
  });
  pairs_ = collider->find_pairs({bounds_.data(), spheres.size()});
  slack_ = slack;
  searches_ = 0;
  if (collider->backend() == Backend::cpu) count_ = spheres.size();
  return slack > 0 ? select(spheres, pool) : pairs_;
}

/// The pairs of pairs_ whose spheres touch. Several threads count them first, so that each has its
/// range of the list.
std::span<const SpherePair> NeighborList::select(std::span<const SphereInstance> spheres,
                                                 ThreadPool* pool) {
  selected_.reserve(pairs_.size(), "pairs of spheres");
  const auto for_each_selected = [&](std::size_t chunk, const auto& visit) {
    const std::size_t begin = chunk * kNearPairsPerChunk;
    const auto part = pairs_.subspan(begin, std::min(kNearPairsPerChunk, pairs_.size() - begin));
    std::array<std::uint32_t, kNearPairsPerChunk> found;
    const std::size_t count =
        cpu::find_candidates(spheres.data(), part.data(), part.size(), found.data());
    for (std::size_t k = 0; k < count; ++k) {
      const SpherePair& pair = part[found[k]];
      if (detail::test_sphere_pair(spheres[pair.a], spheres[pair.b]).touching != 0) visit(pair);
    }
  };
  const std::size_t chunks = (pairs_.size() + kNearPairsPerChunk - 1) / kNearPairsPerChunk;
  if (pool == nullptr || pool->threads() == 1) {
    SpherePair* next = selected_.data();
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      for_each_selected(chunk, [&next](const SpherePair& pair) { *next++ = pair; });
    }
    return {selected_.data(), next};
  }
  selected_counts_.resize(chunks + 1);
  pool->run(chunks, [&](std::size_t chunk) {
    std::size_t count = 0;
    for_each_selected(chunk, [&count](const SpherePair&) { ++count; });
    selected_counts_[chunk] = count;
  });
  selected_counts_[chunks] = 0;
  std::exclusive_scan(selected_counts_.begin(), selected_counts_.end(), selected_counts_.begin(),
                      std::size_t{0});
  pool->run(chunks, [&](std::size_t chunk) {
    SpherePair* next = selected_.data() + selected_counts_[chunk];
    for_each_selected(chunk, [&next](const SpherePair& pair) { *next++ = pair; });
  });
  return {selected_.data(), selected_counts_[chunks]};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
