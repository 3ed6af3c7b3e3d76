/// Linked lists of items, as one array of the next item of each.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/device/step_data.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Prepends an item to a list. Several threads may call it concurrently.
JFPX_HD inline void prepend(std::uint32_t* first, std::uint32_t* next, std::uint32_t item) {
  next[item] = atomic_exchange(first, item);
}

/// Sorts a list by merging runs of doubling length. @returns its first item
template <class Less>
JFPX_HD std::uint32_t sort_list(std::uint32_t first, std::uint32_t* next, const Less& less) {
  if (first == kNone || next[first] == kNone) return first;
  for (std::uint32_t length = 1;; length *= 2) {
    std::uint32_t from = first, last = kNone, merges = 0;
    first = kNone;
    while (from != kNone) {
      ++merges;
      std::uint32_t a = from, b = from, left_a = 0, left_b = length;
      for (; left_a < length && b != kNone; ++left_a) b = next[b];
      from = b;
      while (left_a > 0 || (left_b > 0 && from != kNone)) {
        const bool takes_b = left_a == 0 || (left_b > 0 && from != kNone && less(from, a));
        std::uint32_t item;
        if (takes_b) {
          item = from;
          from = next[from];
          --left_b;
        } else {
          item = a;
          a = next[a];
          --left_a;
        }
        (last == kNone ? first : next[last]) = item;
        last = item;
      }
    }
    next[last] = kNone;
    if (merges == 1) return first;
  }
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
