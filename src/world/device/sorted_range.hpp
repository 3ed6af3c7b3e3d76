/// Sorting of a short range by one thread.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Sorts items[0 .. n) by insertion, or by a heap if there are many.
template <class Item, class Less>
JFPX_HD void sort_range(Item* items, std::uint32_t n, const Less& less) {
  constexpr std::uint32_t kFew = 32;
  if (n <= kFew) {
    for (std::uint32_t i = 1; i < n; ++i) {
      const Item item = items[i];
      std::uint32_t at = i;
      for (; at > 0 && less(item, items[at - 1]); --at) items[at] = items[at - 1];
      items[at] = item;
    }
    return;
  }
  const auto sift = [&](std::uint32_t root, std::uint32_t size) {
    const Item item = items[root];
    for (std::uint32_t child = 2 * root + 1; child < size; child = 2 * root + 1) {
      if (child + 1 < size && less(items[child], items[child + 1])) ++child;
      if (!less(item, items[child])) break;
      items[root] = items[child];
      root = child;
    }
    items[root] = item;
  };
  for (std::uint32_t i = n / 2; i-- > 0;) sift(i, n);
  for (std::uint32_t last = n - 1; last > 0; --last) {
    const Item item = items[last];
    items[last] = items[0];
    items[0] = item;
    sift(0, last);
  }
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
