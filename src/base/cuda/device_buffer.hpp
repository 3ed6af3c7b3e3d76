/// Owners of CUDA streams, device memory and pinned host memory. The library allocates device and
/// pinned memory only through these classes.
#pragma once

#include "src/base/cuda/cuda_try.hpp"
#include "src/base/cuda/growable_array.hpp"

#include <cstddef>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Makes `device` the current device for its lifetime, so that colliders of several devices can
/// share a thread.
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

/// Owner of a stream that does not synchronize with the default stream.
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

/// Owner of an event that measures time.
class OwnedEvent {
 public:
  explicit OwnedEvent(int device) {
    const DeviceGuard guard(device);
    JFPX_CUDA_TRY(cudaEventCreate(&event_));
  }
  ~OwnedEvent() { static_cast<void>(cudaEventDestroy(event_)); }
  OwnedEvent(const OwnedEvent&) = delete;
  OwnedEvent& operator=(const OwnedEvent&) = delete;
  cudaEvent_t get() const noexcept { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

/// Pool of device memory. It keeps freed memory for later allocations, and returns all memory to
/// the device when it is destroyed.
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

/// Owner of device memory that is allocated from a pool and freed in stream order.
class DeviceMemory {
 public:
  DeviceMemory() = default;
  /// @throws OutOfMemory with `what` and the number of bytes.
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

/// Owner of page-locked host memory that the device can address.
class PinnedMemory {
 public:
  PinnedMemory() = default;
  /// @throws OutOfMemory with `what` and the number of bytes.
  PinnedMemory(std::size_t bytes, const char* what);
  ~PinnedMemory() {
    if (data_ != nullptr) static_cast<void>(cudaFreeHost(data_));
  }
  PinnedMemory(PinnedMemory&& other) noexcept : data_(std::exchange(other.data_, nullptr)) {}
  PinnedMemory& operator=(PinnedMemory&& other) noexcept {
    std::swap(data_, other.data_);
    return *this;
  }
  void* data() const noexcept { return data_; }

 private:
  void* data_ = nullptr;
};

/// Growable array in device memory. Growing discards the contents.
template <typename T>
class DeviceBuffer {
 public:
  /// Makes the capacity at least `count`; a reallocation makes it exactly `count`.
  /// @return whether the buffer was reallocated.
  /// @throws OutOfMemory with `what` and the number of bytes; the buffer is then unchanged.
  bool reserve(const MemoryPool& pool, cudaStream_t stream, std::size_t count, const char* what) {
    return array_.reserve(
        count, [&](std::size_t bytes) { return DeviceMemory(pool, stream, bytes, what); });
  }
  /// reserve() with slack, so that a slowly growing count rarely causes a reallocation.
  bool reserve_geometric(const MemoryPool& pool, cudaStream_t stream, std::size_t count,
                         const char* what) {
    return array_.reserve_geometric(
        count, [&](std::size_t bytes) { return DeviceMemory(pool, stream, bytes, what); });
  }
  void swap(DeviceBuffer& other) noexcept { array_.swap(other.array_); }
  T* data() const noexcept { return array_.data(); }
  std::size_t capacity() const noexcept { return array_.capacity(); }

 private:
  GrowableArray<T, DeviceMemory> array_;
};

/// Growable array in page-locked host memory that the device can address. Growing discards the
/// contents.
template <typename T>
class PinnedBuffer {
 public:
  /// See DeviceBuffer::reserve().
  bool reserve(std::size_t count, const char* what) {
    return array_.reserve(count, [&](std::size_t bytes) { return PinnedMemory(bytes, what); });
  }
  /// See DeviceBuffer::reserve_geometric().
  bool reserve_geometric(std::size_t count, const char* what) {
    return array_.reserve_geometric(count,
                                    [&](std::size_t bytes) { return PinnedMemory(bytes, what); });
  }
  T* data() const noexcept { return array_.data(); }
  std::size_t capacity() const noexcept { return array_.capacity(); }

 private:
  GrowableArray<T, PinnedMemory> array_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
