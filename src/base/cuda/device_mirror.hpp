/// An array of the host on the device, to which only what has changed is sent.
#pragma once

#include "src/base/cuda/device_buffer.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Compares with what was sent last. That reads as much as sending would, but the bus is slower
/// than memory, and nobody has to be trusted to say what changed.
template <typename T>
class DeviceMirror {
 public:
  /// Enqueues what makes the device's copy equal to `values`, which may change at once. Wait for
  /// the stream before the next call.
  /// @return bytes sent.
  std::size_t update(const MemoryPool& pool, cudaStream_t stream, std::span<const T> values,
                     const char* what) {
    std::size_t known = std::exchange(known_, 0);  // should anything throw, all is sent again
    if (values.size() > device_.size()) {
      const std::size_t room = values.size() + values.size() / 4 + 64;
      device_.grow(pool, stream, room, what);
      host_.grow(room, what);
      known = 0;
    }
    std::size_t bytes = 0, begin = 0, end = 0;  // of the range that is to be sent next
    for (std::size_t i = 0; i < values.size(); i += kBlock) {
      const std::size_t past = std::min(values.size(), i + kBlock);
      const std::size_t size = (past - i) * sizeof(T);
      if (past <= known && std::memcmp(host_.data() + i, values.data() + i, size) == 0) continue;
      std::memcpy(host_.data() + i, values.data() + i, size);
      if (begin == end || i - end > kGap) {
        bytes += send(stream, begin, end);
        begin = i;
      }
      end = past;
    }
    bytes += send(stream, begin, end);
    known_ = values.size();
    return bytes;
  }
  const T* data() const noexcept { return device_.data(); }

 private:
  static constexpr std::size_t kBlock = 4096 / sizeof(T);
  /// Shorter gaps are sent along: another copy takes longer.
  static constexpr std::size_t kGap = 65536 / sizeof(T);

  std::size_t send(cudaStream_t stream, std::size_t begin, std::size_t end) {
    const std::size_t bytes = (end - begin) * sizeof(T);
    if (bytes == 0) return 0;
    JFPX_CUDA_TRY(cudaMemcpyAsync(device_.data() + begin, host_.data() + begin, bytes,
                                  cudaMemcpyHostToDevice, stream));
    return bytes;
  }

  DeviceBuffer<T> device_;
  PinnedBuffer<T> host_;
  std::size_t known_ = 0;  ///< values that the device has as the host's copy has them
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
