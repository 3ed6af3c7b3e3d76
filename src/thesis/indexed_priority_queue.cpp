/// Construction of the tournament tree and comparison of the children of a node.
#include "src/thesis/indexed_priority_queue.hpp"

#include <array>
#include <bit>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {

void IndexedPriorityQueue::assign(std::span<const Real> keys) {
  constexpr Real kPadding = -std::numeric_limits<Real>::infinity();
  const auto padded = [](std::size_t nodes) {
    return (nodes + kChildren - 1) / kChildren * kChildren;
  };
  count_ = 1;
  for (std::size_t left = keys.size(); left > 1; left = padded(left) / kChildren) ++count_;
  if (levels_.size() < count_) levels_.resize(count_);
  levels_[0].key.assign(keys.begin(), keys.end());
  levels_[0].key.resize(padded(keys.size()), kPadding);
  for (std::size_t level = 1; level < count_; ++level) {
    const std::size_t nodes = levels_[level - 1].key.size() / kChildren;
    levels_[level].key.assign(padded(nodes), kPadding);
    levels_[level].winner.assign(padded(nodes), 0);
    for (std::uint32_t node = 0; node < nodes; ++node) find_winner(level, node);
  }
}

/// Sets key and winner of a node of `level` from its children in the level below.
void IndexedPriorityQueue::find_winner(std::size_t level, std::uint32_t node) {
  const Real* key = &levels_[level - 1].key[std::size_t{node} * kChildren];
  Real best[kChildren / 2];
  for (std::uint32_t i = 0; i < kChildren / 2; ++i) {
    best[i] = key[i] > key[i + kChildren / 2] ? key[i] : key[i + kChildren / 2];
  }
  for (std::uint32_t half = kChildren / 4; half > 0; half /= 2) {
    for (std::uint32_t i = 0; i < half; ++i) {
      best[i] = best[i] > best[i + half] ? best[i] : best[i + half];
    }
  }
  // The lowest position with that key, also branch-free.
  std::array<std::uint8_t, kChildren> lost;
  for (std::uint32_t i = 0; i < kChildren; ++i) lost[i] = key[i] == best[0] ? 0 : 0xff;
  const auto eights = std::bit_cast<std::array<std::uint64_t, 2>>(lost);
  const int low = std::countr_one(eights[0]) / 8, high = std::countr_one(eights[1]) / 8;
  const int position = low < 8 ? low : 8 + high % 8;
  levels_[level].key[node] = best[0];
  levels_[level].winner[node] = static_cast<std::uint8_t>(position);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
