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
/// series of calls takes linear time; the factor is only 9/8, because contact lists take most of
/// the memory of a world.
/// @throws std::bad_alloc, std::length_error like std::vector::reserve()
template <class T>
void reserve_geometric(std::vector<T>* items, std::size_t count) {
  const std::size_t capacity = items->capacity();
  if (capacity < count) items->reserve(std::max(count, capacity + capacity / 8));
}

/// items->resize(count) with geometric growth of the capacity even after a reduction of the size,
/// so that a buffer whose size varies from step to step soon stops allocating.
template <class T>
void resize_geometric(std::vector<T>* items, std::size_t count) {
  reserve_geometric(items, count);
  items->resize(count);
}
/// items->assign(count, value) with geometric growth of the capacity.
template <class T>
void assign_geometric(std::vector<T>* items, std::size_t count,
                      const std::type_identity_t<T>& value) {
  reserve_geometric(items, count);
  items->assign(count, value);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
