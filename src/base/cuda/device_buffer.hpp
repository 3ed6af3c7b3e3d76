/// Streams, events, device and pinned memory with owners. The only place that takes or frees them.
#pragma once

#include "src/base/cuda/cuda_try.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Makes `device` current for its lifetime; colliders of several devices can share a thread.
class DeviceGuard {
 public:
  explicit DeviceGuard(int device) {
    JFPX_CUDA_TRY(cudaGetDevice(&previous_));
    if (device == previous_) return;
    JFPX_CUDA_TRY(cudaSetDevice(device));
    changed_ = true;
  }
  ~DeviceGuard() {
    if (changed_) static_cast<void>(JFPX_CUDA_RESULT(cudaSetDevice(previous_)));
  }
  DeviceGuard(const DeviceGuard&) = delete;
  DeviceGuard& operator=(const DeviceGuard&) = delete;

 private:
  int previous_ = 0;
  bool changed_ = false;
};

/// A stream of its own, not ordered with the default stream.
class OwnedStream {
 public:
  explicit OwnedStream(int device) {
    const DeviceGuard guard(device);
    JFPX_CUDA_TRY(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
  }
  ~OwnedStream() { static_cast<void>(cudaStreamDestroy(stream_)); }
  OwnedStream(const OwnedStream&) = delete;
  OwnedStream& operator=(const OwnedStream&) = delete;
  cudaStream_t get() const noexcept { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

/// A pool of device memory. It keeps what is freed for the next use, and gives everything back to
/// the device when it goes.
class MemoryPool {
 public:
  explicit MemoryPool(int device);
  ~MemoryPool() { static_cast<void>(cudaMemPoolDestroy(pool_)); }
  MemoryPool(const MemoryPool&) = delete;
  MemoryPool& operator=(const MemoryPool&) = delete;
  cudaMemPool_t get() const noexcept { return pool_; }

 private:
  cudaMemPool_t pool_ = nullptr;
};

/// Bytes on the device, taken from a pool in the order of a stream.
class DeviceMemory {
 public:
  DeviceMemory() = default;
  /// @throws OutOfMemory naming `what` and the bytes.
  DeviceMemory(const MemoryPool& pool, cudaStream_t stream, std::size_t bytes, const char* what);
  ~DeviceMemory() {
    if (data_ != nullptr) static_cast<void>(cudaFreeAsync(data_, stream_));
  }
  DeviceMemory(DeviceMemory&& other) noexcept { swap(other); }
  DeviceMemory& operator=(DeviceMemory&& other) noexcept {
    swap(other);
    return *this;
  }
  void* data() const noexcept { return data_; }
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  void swap(DeviceMemory& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    std::swap(stream_, other.stream_);
  }
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
  cudaStream_t stream_ = nullptr;
};

/// Values on the device; grow() drops the old ones.
template <typename T>
class DeviceBuffer {
 public:
  void grow(const MemoryPool& pool, cudaStream_t stream, std::size_t count, const char* what) {
    if (count <= size_) return;
    const std::size_t most = std::numeric_limits<std::size_t>::max() / sizeof(T);
    memory_ = DeviceMemory(pool, stream, std::min(count, most) * sizeof(T), what);
    size_ = count;
  }
  T* data() const noexcept { return static_cast<T*>(memory_.data()); }
  std::size_t size() const noexcept { return size_; }

 private:
  DeviceMemory memory_;
  std::size_t size_ = 0;
};

/// Page-locked host memory that the device can address; grow() drops the old values.
template <typename T>
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  ~PinnedBuffer() { static_cast<void>(cudaFreeHost(data_)); }
  PinnedBuffer(const PinnedBuffer&) = delete;
  PinnedBuffer& operator=(const PinnedBuffer&) = delete;
  void grow(std::size_t count, const char* what) {
    if (count <= size_) return;
    void* fresh = nullptr;
    JFPX_CUDA_TRY_ALLOC(cudaHostAlloc(&fresh, count * sizeof(T), cudaHostAllocMapped),
                        count * sizeof(T), what);
    static_cast<void>(cudaFreeHost(data_));
    data_ = static_cast<T*>(fresh);
    size_ = count;
  }
  T* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
