/// Waiting for an atomic variable to change.
#pragma once

#include <jfpx/config.hpp>

#include <atomic>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

#if defined(_WIN32)
// By WaitOnAddress(). Where there is no futex, std::atomic::wait() of libstdc++ 12 compares the
// value before it locks, so that it may miss a notification and wait forever.
JFPX_API void wait_while_equal(const std::atomic<std::uint32_t>& value, std::uint32_t old) noexcept;
JFPX_API void wake_one(std::atomic<std::uint32_t>& value) noexcept;
JFPX_API void wake_all(std::atomic<std::uint32_t>& value) noexcept;
#else
/// Returns when the value is not `old`, which it reads with acquire semantics. The thread sleeps
/// until a thread that changed the value calls wake_one() or wake_all().
inline void wait_while_equal(const std::atomic<std::uint32_t>& value, std::uint32_t old) noexcept {
  value.wait(old, std::memory_order_acquire);
}
/// Wakes one thread that waits for the variable.
inline void wake_one(std::atomic<std::uint32_t>& value) noexcept { value.notify_one(); }
/// Wakes all threads that wait for the variable.
inline void wake_all(std::atomic<std::uint32_t>& value) noexcept { value.notify_all(); }
#endif

}  // namespace JFPX_ABI
}  // namespace jfpx
