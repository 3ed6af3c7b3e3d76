/// Construction of a tree of bounding boxes: order and blocks.
#include "src/collide/block_tree.hpp"

#include "src/base/spatial_order.hpp"

#include <numeric>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void BlockTree::build(std::span<const Aabb> bounds, std::span<const std::uint32_t> items) {
  constexpr std::size_t kWidth = TreeBlock::kWidth;
  sort(bounds);
  item_count_ = static_cast<std::uint32_t>(items.size());
  const std::size_t leaves = (items.size() + kWidth - 1) / kWidth;
  // Each inner block combines up to eight parentless blocks.
  const std::size_t inner = leaves > 1 ? (leaves + kWidth - 3) / (kWidth - 1) : 0;
  leaf_blocks_ = static_cast<std::uint32_t>(leaves);
  blocks_.resize(leaves + inner);
  for (TreeBlock& block : blocks_) {
    for (std::uint32_t lane = 0; lane < kWidth; ++lane) block.set(lane, TreeBlock::kEmpty);
  }
  items_.assign(leaves * kWidth, 0);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    items_[i] = items[keys_[i].index];
    blocks_[i / kWidth].set(static_cast<std::uint32_t>(i % kWidth), bounds[keys_[i].index]);
  }
  refit_inner();
}

void BlockTree::sort(std::span<const Aabb> bounds) {
  constexpr std::size_t kSample = 64;  // number of boxes that determine the order
  keys_.resize(bounds.size());
  spare_keys_.resize(bounds.size());
  if (bounds.empty()) return;
  const SpatialOrder order(bounds.size(), kSample, [&](std::size_t i) { return bounds[i]; });
  for (std::uint32_t i = 0; i < bounds.size(); ++i) keys_[i] = {order(bounds[i]), i};
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

}  // namespace JFPX_ABI
}  // namespace jfpx
