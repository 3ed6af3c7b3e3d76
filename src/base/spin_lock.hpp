/// A lock for sections of some nanoseconds.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/pause.hpp"

#include <atomic>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {

/// Has the members of a std::mutex that std::lock_guard needs. A thread that waits polls, and
/// yields its core after some polls: the system call by which a std::mutex waits takes longer than
/// many loops of a step.
class SpinLock {
 public:
  void lock() noexcept {
    for (unsigned i = 0; held_.test_and_set(std::memory_order_acquire); ++i) {
      constexpr unsigned kMostPolls = 256;
      while (i < kMostPolls && held_.test(std::memory_order_relaxed)) {
        pause();
        ++i;
      }
      if (i >= kMostPolls) std::this_thread::yield();
    }
  }
  void unlock() noexcept { held_.clear(std::memory_order_release); }

 private:
  std::atomic_flag held_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
