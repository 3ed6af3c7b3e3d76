/// Reserves memory before state changes, so that a failed allocation leaves the state unchanged.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Reserves capacity for `count` elements in total. The capacity grows geometrically, so that a
/// series of calls takes linear time, but by an eighth only, because the lists of contacts are most
/// of the memory of a world.
/// @throws std::bad_alloc, std::length_error as std::vector::reserve()
template <class T>
void reserve_geometric(std::vector<T>* items, std::size_t count) {
  const std::size_t capacity = items->capacity();
  if (capacity < count) items->reserve(std::max(count, capacity + capacity / 8));
}

/// As items->resize(count), but the capacity grows geometrically even if the size was reduced
/// before, so that a buffer whose size varies from step to step soon stops to allocate.
template <class T>
void resize_geometric(std::vector<T>* items, std::size_t count) {
  reserve_geometric(items, count);
  items->resize(count);
}
/// As items->assign(count, value), but the capacity grows geometrically.
template <class T>
void assign_geometric(std::vector<T>* items, std::size_t count,
                      const std::type_identity_t<T>& value) {
  reserve_geometric(items, count);
  items->assign(count, value);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
