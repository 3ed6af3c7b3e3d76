/// btAlignedObjectArray::quickSort() on several threads, with the same permutation.
#pragma once

#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Bullet's sort is not stable, so the order of equal items depends on its steps. The two parts of
/// a partition are independent and sorted in parallel.
template <class T, class Less>
class ParallelQuickSort {
 public:
  explicit ParallelQuickSort(const Less& less) : less_(less) {}

  /// Allocates no memory.
  void sort(ThreadPool& pool, std::span<T> items) const {
    if (items.size() < 2) return;
    if (are_equal(items)) {
      permute_equal(items);
      return;
    }
    std::array<Part, kMaxParts> parts{Part{0, items.size() - 1}}, halves;
    std::size_t count = 1;
    // Each round halves the parts; its time is that of the largest part.
    if (pool.threads() > 1 && items.size() >= kSerial) {
      while (count > 0 && count < 4 * pool.threads() && 2 * count <= kMaxParts) {
        pool.run(count, [&](std::size_t i) {
          std::tie(halves[2 * i], halves[2 * i + 1]) = partition(items, parts[i]);
        });
        const auto end =
            std::copy_if(halves.begin(), halves.begin() + static_cast<std::ptrdiff_t>(2 * count),
                         parts.begin(), [](const Part& part) { return part.steps() > 0; });
        count = static_cast<std::size_t>(end - parts.begin());
      }
    }
    pool.run(count, [&](std::size_t i) { sort_part(items, parts[i]); });
  }

 private:
  static constexpr std::size_t kSerial = 8192;  ///< fewer items are sorted by one thread

  static constexpr std::size_t kMaxParts = 256;

  /// Items [first, last]; nothing to sort unless first < last.
  struct Part {
    std::size_t first = 0, last = 0;
    std::size_t steps() const { return first < last ? last - first : 0; }
  };

  /// The steps of btAlignedObjectArray::quickSortInternal().
  std::pair<Part, Part> partition(std::span<T> items, const Part& part) const {
    auto i = static_cast<std::ptrdiff_t>(part.first), j = static_cast<std::ptrdiff_t>(part.last);
    const T pivot = items[(part.first + part.last) / 2];
    const auto at = [&](std::ptrdiff_t k) -> T& { return items[static_cast<std::size_t>(k)]; };
    exchange_blocks(items.data(), pivot, &i, &j);
    while (i <= j) {
      while (less_(at(i), pivot)) ++i;
      while (less_(pivot, at(j))) --j;
      if (i <= j) std::swap(at(i++), at(j--));
    }
    const auto first = static_cast<std::ptrdiff_t>(part.first);
    const auto last = static_cast<std::ptrdiff_t>(part.last);
    return {first < j ? Part{part.first, static_cast<std::size_t>(j)} : Part{},
            i < last ? Part{static_cast<std::size_t>(i), part.last} : Part{}};
  }
  /// The first steps of a partition, without the branches that a processor can't predict
  /// (S. Edelkamp and A. Weiss, BlockQuicksort, 2016): lists the items of a block at each end that
  /// must move, and exchanges the k-th of one list with the k-th of the other, as the steps of the
  /// partition do. Ends before the blocks would overlap.
  void exchange_blocks(T* items, const T& pivot, std::ptrdiff_t* i, std::ptrdiff_t* j) const {
    constexpr std::ptrdiff_t kItemsOfBlock = 32;
    using Offsets = std::array<std::uint8_t, kItemsOfBlock>;
    // Returns the number of offsets in a block for which must_move(offset) is true.
    const auto list = [](Offsets* offsets, const auto& must_move) {
      std::size_t count = 0;
      for (std::ptrdiff_t k = 0; k < kItemsOfBlock; ++k) {
        (*offsets)[count] = static_cast<std::uint8_t>(k);
        count += must_move(k) ? 1 : 0;
      }
      return count;
    };
    Offsets of_left, of_right;
    std::size_t left = 0, left_count = 0, right = 0, right_count = 0;  // next, and past the last
    while (*j - *i + 1 >= 2 * kItemsOfBlock) {
      if (left == left_count) {
        left = 0;
        left_count = list(&of_left, [&](std::ptrdiff_t k) { return !less_(items[*i + k], pivot); });
      }
      if (right == right_count) {
        right = 0;
        right_count =
            list(&of_right, [&](std::ptrdiff_t k) { return !less_(pivot, items[*j - k]); });
      }
      for (; left < left_count && right < right_count; ++left, ++right) {
        std::swap(items[*i + of_left[left]], items[*j - of_right[right]]);
      }
      if (left == left_count) *i += kItemsOfBlock;
      if (right == right_count) *j -= kItemsOfBlock;
    }
    if (left < left_count) *i += of_left[left];
    if (right < right_count) *j -= of_right[right];
  }

  void sort_part(std::span<T> items, Part part) const {
    while (part.steps() > 0) {
      const std::span<T> all = items.subspan(part.first, part.steps() + 1);
      if (are_equal(all)) {
        permute_equal(all);
        return;
      }
      // Recursion into the smaller part limits the depth.
      const auto [left, right] = partition(items, part);
      const bool left_is_smaller = left.steps() < right.steps();
      sort_part(items, left_is_smaller ? left : right);
      part = left_is_smaller ? right : left;
    }
  }

  bool are_equal(std::span<const T> items) const {
    return std::all_of(items.begin() + 1, items.end(), [&](const T& item) {
      return !less_(item, items[0]) && !less_(items[0], item);
    });
  }
  /// The permutation of equal items. The partition of a range reverses it, except for the middle
  /// item, and the partitions of the halves reverse each half again. Both rounds together exchange
  /// the halves.
  static void permute_equal(std::span<T> items) {
    const std::size_t half = items.size() / 2, quarter = half / 2;
    if (half == 0) return;
    const std::span<T> left = items.first(half), right = items.last(half);
    std::swap_ranges(left.begin(), left.end(), right.begin());
    for (const std::span<T> part : {left, right}) {
      permute_equal(part.first(quarter));
      permute_equal(part.last(quarter));
    }
  }

  Less less_;
};

template <class T, class Less>
void parallel_quick_sort(ThreadPool& pool, std::span<T> items, const Less& less) {
  ParallelQuickSort<T, Less>(less).sort(pool, items);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
