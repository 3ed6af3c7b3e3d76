/// Lazily computed values.
#pragma once

#include <atomic>
#include <mutex>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

/// A value that const functions of its owner compute on demand. get() and copies may run
/// concurrently with each other; the other functions exclude all calls.
template <class T>
class Lazy {
 public:
  Lazy() = default;
  Lazy(const Lazy& other) { *this = other; }
  Lazy& operator=(const Lazy& other) {
    if (this == &other) return *this;
    const std::lock_guard lock(other.computing_);
    value_ = other.value_;
    is_current_ = other.is_current_.load();
    return *this;
  }
  Lazy(Lazy&& other) noexcept
      : is_current_(other.is_current_.load()), value_(std::move(other.value_)) {}
  Lazy& operator=(Lazy&& other) noexcept {
    is_current_ = other.is_current_.load();
    value_ = std::move(other.value_);
    return *this;
  }

  /// The next get() computes the value.
  void invalidate() noexcept { is_current_.store(false, std::memory_order_relaxed); }
  /// The value, for an owner that updates it in place; null after invalidate().
  T* current() noexcept { return is_current_.load(std::memory_order_relaxed) ? &value_ : nullptr; }
  /// The value, current or not, so that the owner can fill parts of it before get().
  T* storage() noexcept { return &value_; }

  /// Calls compute(T*) after invalidate(), and returns the value. Takes a lock only to compute.
  /// @throws the exceptions of compute(); the next call then tries again
  template <class Compute>
  const T& get(const Compute& compute) const {
    if (!is_current_.load(std::memory_order_acquire)) {
      const std::lock_guard lock(computing_);
      if (!is_current_.load(std::memory_order_relaxed)) {
        compute(&value_);
        is_current_.store(true, std::memory_order_release);
      }
    }
    return value_;
  }

 private:
  mutable std::atomic<bool> is_current_{false};
  mutable T value_{};
  mutable std::mutex computing_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
