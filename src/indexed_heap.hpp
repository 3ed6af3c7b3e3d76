/// A priority queue over the numbers 0..n-1 whose keys can change: largest key first, ties to the
/// lowest number, which is what a scan from the front would pick.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx::inline JFPX_ABI {

/// A binary heap with the place of each number beside it. Grows, never shrinks.
class IndexedHeap {
 public:
  /// Replaces all keys, in O(n).
  void assign(std::span<const Real> keys);
  /// The number with the largest key. The heap is not empty.
  std::uint32_t top() const { return heap_.front(); }
  Real key(std::uint32_t number) const { return keys_[number]; }
  /// Changes one key, in O(log n).
  void update(std::uint32_t number, Real key);

 private:
  bool before(std::uint32_t a, std::uint32_t b) const;
  void put(std::size_t place, std::uint32_t number);
  void sift_up(std::size_t place);
  void sift_down(std::size_t place);

  std::vector<Real> keys_;
  std::vector<std::uint32_t> heap_;   ///< numbers, as a binary heap
  std::vector<std::uint32_t> place_;  ///< of each number in heap_
};

}  // namespace jfpx::inline JFPX_ABI
