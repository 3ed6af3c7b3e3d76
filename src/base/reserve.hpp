/// Taking memory before anything changes, so that nothing has when there is none.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Room for `count` elements in all. Grows as push_back() does: a series of calls costs linear
/// time.
template <class T>
void reserve_geometric(std::vector<T>* items, std::size_t count) {
  if (items->capacity() < count) items->reserve(std::max(count, 2 * items->capacity()));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
