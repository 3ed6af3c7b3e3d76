/// Copy of a host array in device memory; only blocks that have changed are uploaded.
#pragma once

#include "src/base/cuda/device_buffer.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Compares each block of the array with a host copy of the last uploaded values. The comparison
/// reads as many bytes as an upload would, but host memory is faster than the bus, and callers need
/// not track changes.
template <typename T>
class DeviceMirror {
 public:
  /// Enqueues the copies that make the device array equal to `values`. The caller may change
  /// `values` after the call, and must synchronize the stream before the next call.
  /// @return number of bytes uploaded.
  std::size_t update(const MemoryPool& pool, cudaStream_t stream, std::span<const T> values,
                     const char* what) {
    // After an exception, the next call uploads everything.
    std::size_t uploaded = std::exchange(uploaded_, 0);
    // The capacities can differ, because an earlier allocation of host_ may have failed.
    if (device_.reserve_geometric(pool, stream, values.size(), what)) uploaded = 0;
    if (host_.reserve_geometric(values.size(), what)) uploaded = 0;
    std::size_t bytes = 0, begin = 0, end = 0;  // [begin, end) is the range to upload next
    for (std::size_t i = 0; i < values.size(); i += kBlock) {
      const std::size_t past = std::min(values.size(), i + kBlock);
      const std::size_t size = (past - i) * sizeof(T);
      if (past <= uploaded && std::memcmp(host_.data() + i, values.data() + i, size) == 0) continue;
      std::memcpy(host_.data() + i, values.data() + i, size);
      if (begin == end || i - end > kGap) {
        bytes += upload(stream, begin, end);
        begin = i;
      }
      end = past;
    }
    bytes += upload(stream, begin, end);
    uploaded_ = values.size();
    return bytes;
  }
  const T* data() const noexcept { return device_.data(); }

 private:
  static constexpr std::size_t kBlock = 4096 / sizeof(T);
  /// Shorter gaps between changed blocks are also uploaded, because a separate copy takes longer.
  static constexpr std::size_t kGap = 65536 / sizeof(T);

  std::size_t upload(cudaStream_t stream, std::size_t begin, std::size_t end) {
    const std::size_t bytes = (end - begin) * sizeof(T);
    if (bytes == 0) return 0;
    JFPX_CUDA_TRY(cudaMemcpyAsync(device_.data() + begin, host_.data() + begin, bytes,
                                  cudaMemcpyHostToDevice, stream));
    return bytes;
  }

  DeviceBuffer<T> device_;
  PinnedBuffer<T> host_;
  /// Number of leading values that are equal on the device and in host_.
  std::size_t uploaded_ = 0;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
