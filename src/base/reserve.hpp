/// Reserves memory before state changes, so that a failed allocation leaves the state unchanged.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Reserves capacity for `count` elements in total. The capacity grows geometrically, as with
/// push_back(), so that a series of calls takes linear time.
/// @throws std::bad_alloc, std::length_error as std::vector::reserve()
template <class T>
void reserve_geometric(std::vector<T>* items, std::size_t count) {
  if (items->capacity() < count) items->reserve(std::max(count, 2 * items->capacity()));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
