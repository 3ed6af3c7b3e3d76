/// Uninitialized growable buffer that reports the purpose of a failed allocation.
#pragma once

#include <jfpx/error.hpp>

#include "src/base/system.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

/// Elements are trivially copyable and not initialized. Growing discards the contents, except
/// elements that reserve() is told to keep.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Buffer() = default;
  Buffer(Buffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), capacity_(std::exchange(other.capacity_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~Buffer() { release(data_, capacity_); }

  T* data() noexcept { return data_; }
  const T* data() const noexcept { return data_; }
  std::size_t capacity() const noexcept { return capacity_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }

  /// Makes the capacity at least `count`, and keeps the first `kept` elements. `purpose` is a
  /// plural noun for the message of the exception.
  /// @throws OutOfMemory; the buffer is then unchanged.
  T* reserve(std::size_t count, const char* purpose, std::size_t kept = 0) {
    if (count <= capacity_) return data_;
    T* fresh = allocate(count, purpose);
    std::copy_n(data_, kept, fresh);
    release(data_, capacity_);
    data_ = fresh;
    capacity_ = count;
    return data_;
  }

  /// reserve() with geometric growth, by an eighth. Discards the contents.
  void reserve_geometric(std::size_t count, const char* purpose) {
    if (count > capacity_) reserve(std::max(count, capacity_ + capacity_ / 8), purpose);
  }

 private:
  static constexpr std::size_t kHugePage = std::size_t{1} << 21;
  // NOLINTNEXTLINE(bugprone-sizeof-expression): T may well be a pointer
  static constexpr std::size_t kElement = sizeof(T);

  static std::align_val_t alignment(std::size_t bytes) {
    return std::align_val_t{bytes >= 2 * kHugePage ? kHugePage : 64};
  }

  static T* allocate(std::size_t count, const char* purpose) {
    if (count > std::numeric_limits<std::ptrdiff_t>::max() / kElement) {
      throw OutOfMemory(std::to_string(count) + " " + purpose + " are more than can be addressed");
    }
    const std::size_t bytes = count * kElement;
    void* memory = nullptr;
    try {
      memory = ::operator new(bytes, alignment(bytes));
    } catch (const std::bad_alloc&) {
      throw OutOfMemory("out of memory: " + std::to_string(bytes) + " bytes needed for " +
                        std::to_string(count) + " " + purpose);
    }
    // Random access to large buffers is bound by address translation.
    if (bytes >= 2 * kHugePage) advise_huge_pages(memory, bytes);
    return static_cast<T*>(memory);
  }
  static void release(T* data, std::size_t capacity) noexcept {
    if (data != nullptr) ::operator delete(data, alignment(capacity * kElement));
  }

  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
