/// Waiting for other threads.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/pause.hpp"

#include <cstdint>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {

/// Waits for other threads, which may be waiting for a processor themselves: spins first, then
/// yields, for a limited or unlimited time.
class Backoff {
 public:
  /// @param endless if false, the wait ends after some tens of microseconds on a free processor,
  /// and
  ///   after some time slices of other threads on a busy processor
  explicit Backoff(bool endless) : endless_(endless) {}

  /// Waits briefly. @return false when the limit is reached
  bool wait() {
    if (waits_ < kSpins) {
      pause();
    } else {
      if (!endless_ && waits_ >= kSpins + kYields) return false;
      std::this_thread::yield();
    }
    ++waits_;
    return true;
  }
  void reset() { waits_ = 0; }

 private:
  static constexpr std::uint64_t kSpins = 1000, kYields = 50;
  bool endless_;
  std::uint64_t waits_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
