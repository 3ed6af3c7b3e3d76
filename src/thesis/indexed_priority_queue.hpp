/// A priority queue of the numbers 0..n-1 with mutable keys: largest key first; among equal keys,
/// the lowest number first, as in a linear scan.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A tournament tree (Knuth, The Art of Computer Programming 3, 5.2.3, trees of selection) with
/// sixteen children per node. Most updates do not change the winner of a node and stop there; a
/// binary heap would move entries. Only a smaller key of a winner requires a comparison of all
/// children, which are in one cache line. Buffers grow and never shrink.
class IndexedPriorityQueue {
 public:
  /// Replaces all keys, in O(n). @param keys not empty, no NaN
  void assign(std::span<const Real> keys);
  /// The number with the largest key, in O(log n).
  std::uint32_t top() const {
    std::uint32_t node = 0;
    for (std::size_t level = count_; level-- > 1;) {
      node = node * kChildren + levels_[level].winner[node];
    }
    return node;
  }
  Real key(std::uint32_t number) const { return levels_[0].key[number]; }
  /// Changes one key, in O(log n) at most.
  void update(std::uint32_t number, Real key) {
    levels_[0].key[number] = key;
    std::uint32_t child = number;
    for (std::size_t level = 1; level < count_ && update_parent(level, child, key); ++level) {
      key = levels_[level].key[child /= kChildren];
    }
  }

 private:
  static constexpr std::uint32_t kChildren = 16;

  /// Level 0 contains the leaves, each further level the parents of the level below. Levels are
  /// padded to a multiple of kChildren with keys that never win.
  struct Level {
    std::vector<Real> key;             ///< largest key of the subtree
    std::vector<std::uint8_t> winner;  ///< child with that key; empty in level 0
  };

  /// Updates the parent, in `level`, of a child whose key has changed to `key`. Returns false if
  /// the levels above do not change.
  bool update_parent(std::size_t level, std::uint32_t child, Real key) {
    const std::uint32_t parent = child / kChildren, position = child % kChildren;
    Real& best = levels_[level].key[parent];
    std::uint8_t& winner = levels_[level].winner[parent];
    if (position != winner && (key < best || (key == best && position > winner))) return false;
    if (position == winner && key < best) {
      find_winner(level, parent);
    } else {
      best = key;
      winner = static_cast<std::uint8_t>(position);
    }
    return true;
  }
  void find_winner(std::size_t level, std::uint32_t node);

  std::vector<Level> levels_;  ///< levels from count_ on are unused and keep their memory
  std::size_t count_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
