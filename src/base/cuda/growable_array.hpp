/// Arrays whose capacity only grows, over any kind of memory.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// New capacity for `count` elements: the current capacity if it suffices, otherwise a quarter more
/// than `count`, limited to `limit` unless `count` exceeds it. A count that grows in small steps
/// then causes O(log count) reallocations.
constexpr std::size_t geometric_capacity(
    std::size_t capacity, std::size_t count,
    std::size_t limit = std::numeric_limits<std::size_t>::max()) {
  if (count <= capacity) return capacity;
  return std::max(count, std::min(count + count / 4 + 64, limit));
}

/// Uninitialized array whose capacity only grows. Growing discards the contents.
/// @tparam Memory owner of a block of bytes: default-constructible (no bytes), movable, data().
template <typename T, typename Memory>
class GrowableArray {
 public:
  GrowableArray() = default;
  GrowableArray(const GrowableArray&) = delete;
  GrowableArray& operator=(const GrowableArray&) = delete;

  /// If the capacity is smaller than `count`, reallocates to exactly `count` elements, in the
  /// Memory that `allocate(bytes)` returns. If `allocate` throws, the array is unchanged.
  /// @return whether the array was reallocated.
  template <typename Allocate>
  bool reserve(std::size_t count, const Allocate& allocate) {
    if (count <= capacity_) return false;
    // Clamps a size that overflows, so that the allocation fails.
    constexpr std::size_t kMaxCount = std::numeric_limits<std::size_t>::max() / sizeof(T);
    memory_ = allocate(std::min(count, kMaxCount) * sizeof(T));
    capacity_ = count;
    return true;
  }
  /// reserve() with the slack of geometric_capacity().
  template <typename Allocate>
  bool reserve_geometric(std::size_t count, const Allocate& allocate) {
    return reserve(geometric_capacity(capacity_, count), allocate);
  }
  void swap(GrowableArray& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(capacity_, other.capacity_);
  }
  T* data() const noexcept { return static_cast<T*>(memory_.data()); }
  std::size_t capacity() const noexcept { return capacity_; }

 private:
  Memory memory_;
  std::size_t capacity_ = 0;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
