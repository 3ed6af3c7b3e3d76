/// Construction of the tree of the queries: bounds, order and blocks.
#include "src/world/query_tree.hpp"

#include "src/base/spatial_order.hpp"
#include "src/world/posed_sub_shapes.hpp"

#include <numeric>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// [m], far outside of the world, where all coordinates of bodies are below 1e10. Differences, and
/// their products with the reciprocal direction of a ray, are finite.
constexpr Real kFar = Real(1e12);
constexpr Aabb kEmpty{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};

/// Rounded outwards: the extents have an error of at most 4 u of themselves, and the bounds one of
/// u times the coordinate, where u is half of kEpsilon.
Aabb bounds_around(const Vec3& centre, const Vec3& extents) {
  Aabb bounds;
  for (int i = 0; i < 3; ++i) {
    const Real reach = extents[i] + 4 * kEpsilon * (absolute(centre[i]) + extents[i]);
    bounds.lower[i] = centre[i] - reach;
    bounds.upper[i] = centre[i] + reach;
  }
  return bounds;
}

/// The bounds of a body; empty for a wall.
Aabb bounds_of(const BodyStore& bodies, std::uint32_t body) {
  Aabb bounds = kEmpty;
  for_each_posed_sub_shape(bodies, body, [&](const auto& shape, const Transform& pose) {
    using S = std::decay_t<decltype(shape)>;
    if constexpr (std::is_same_v<S, Sphere> || std::is_same_v<S, Box>) {
      bounds = merged(bounds, bounds_around(pose.origin, half_extents(shape, pose)));
    }
  });
  return bounds;
}

/// Boxes from which the order of the tree is derived.
constexpr std::size_t kSample = 64;

}  // namespace

void QueryTree::build(const BodyStore& bodies) {
  walls_.clear();
  items_.clear();
  for (const BodyId id : bodies.ids()) {
    const Aabb bounds = jfpx::bounds_of(bodies, id.index);
    if (bounds == kEmpty) {
      walls_.push_back(id.index);
    } else {
      items_.push_back({bounds, id.index});
    }
  }
  sort();
  pack();
}

void QueryTree::sort() {
  keys_.resize(items_.size());
  spare_keys_.resize(items_.size());
  if (items_.empty()) return;
  const SpatialOrder order(items_.size(), kSample, [&](std::size_t i) { return items_[i].bounds; });
  for (std::uint32_t i = 0; i < items_.size(); ++i) keys_[i] = {order(items_[i].bounds), i};
  // A stable radix sort by digits of eight bits.
  constexpr unsigned kDigits = 4;
  std::array<std::array<std::uint32_t, 256>, kDigits> counts{};
  for (const Key& key : keys_) {
    for (unsigned d = 0; d < kDigits; ++d) ++counts[d][key.code >> 8 * d & 255];
  }
  for (unsigned d = 0; d < kDigits; ++d) {
    std::exclusive_scan(counts[d].begin(), counts[d].end(), counts[d].begin(), 0u);
    for (const Key& key : keys_) spare_keys_[counts[d][key.code >> 8 * d & 255]++] = key;
    std::swap(keys_, spare_keys_);
  }
}

void QueryTree::pack() {
  const std::size_t leaves = (items_.size() + kWidth - 1) / kWidth;
  // An inner block replaces up to eight blocks without a parent by one.
  const std::size_t inner = leaves > 1 ? (leaves + kWidth - 3) / (kWidth - 1) : 0;
  leaf_blocks_ = static_cast<std::uint32_t>(leaves);
  blocks_.resize(leaves + inner);
  bodies_.resize(leaves * kWidth);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Item item = i < keys_.size() ? items_[keys_[i].item] : Item{kEmpty, 0};
    bodies_[i] = item.body;
    set(&blocks_[i / kWidth], i % kWidth, item.bounds);
  }
  for (std::size_t i = 0; i < inner * kWidth; ++i) {
    const std::size_t parent = leaves + i / kWidth;
    set(&blocks_[parent], i % kWidth, i < parent ? bounds_of(blocks_[i]) : kEmpty);
  }
}

void QueryTree::set(Block* block, std::size_t lane, const Aabb& bounds) {
  for (int i = 0; i < 3; ++i) {
    block->lower[i][lane] = bounds.lower[i];
    block->upper[i][lane] = bounds.upper[i];
  }
}

Aabb QueryTree::bounds_of(const Block& block) {
  Aabb bounds;
  for (int i = 0; i < 3; ++i) {
    bounds.lower[i] = *std::ranges::min_element(block.lower[i]);
    bounds.upper[i] = *std::ranges::max_element(block.upper[i]);
  }
  return bounds;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
