/// Result of a search that the host polls.
#pragma once

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/pause.hpp"
#include "src/sphere_collider/cuda/search.hpp"

#include <atomic>
#include <chrono>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Word of host memory that a kernel writes and the host polls.
class SearchSignal {
 public:
  SearchSignal() { word_.reserve(1, "signals"); }
  unsigned long long* word() const { return word_.data(); }
  void clear() { *word_.data() = kNoSignal; }
  /// Waits for the kernel. Polls for a millisecond, because searches are shorter unless `stream`
  /// has earlier work. @throws DeviceError
  unsigned long long wait(cudaStream_t stream) const {
    const std::atomic_ref<unsigned long long> word(*word_.data());
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
    do {
      for (int k = 0; k < 64; ++k) {
        const unsigned long long value = word.load(std::memory_order_acquire);
        if (value != kNoSignal) return value;
        pause();
      }
    } while (std::chrono::steady_clock::now() < end);
    JFPX_CUDA_TRY(cudaStreamSynchronize(stream));
    return word.load(std::memory_order_acquire);
  }

 private:
  PinnedBuffer<unsigned long long> word_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
