/// Memory whose pages are on several devices.
#pragma once

#include "src/base/cuda/device_buffer.hpp"

#include <cuda.h>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Lets other devices access the memory of a pool. @param devices all that access it
void share(const MemoryPool& pool, const std::vector<int>& devices);

/// Owner of a range of addresses that several devices access. Each page is in the memory of one of
/// them (CUDA's virtual memory management). Not in stream order: the destructor must not be called
/// while a device uses the memory.
class MappedMemory {
 public:
  MappedMemory() = default;
  /// @param devices by part; a device may occur more than once
  /// @param parts   by page: the part that has it
  /// @throws OutOfMemory with `what` and the number of bytes, DeviceError
  MappedMemory(const std::vector<int>& devices, std::size_t bytes,
               const std::vector<std::uint32_t>& parts, const char* what);
  ~MappedMemory();
  MappedMemory(MappedMemory&& other) noexcept { swap(other); }
  MappedMemory& operator=(MappedMemory&& other) noexcept {
    swap(other);
    return *this;
  }
  void* data() const noexcept { return data_; }
  /// Moves pages to other devices. Addresses and contents do not change. If a page moves, waits for
  /// all work of the devices, and for the copies in the stream, which is of the current device.
  /// @throws OutOfMemory, without effect, DeviceError
  void move(const std::vector<int>& devices, const std::vector<std::uint32_t>& parts,
            const char* what, cudaStream_t stream);

  /// Bytes of a page. Smaller arrays should be on one device.
  static constexpr std::size_t kPage = std::size_t{2} << 20;

 private:
  /// Consecutive pages of one device.
  struct Piece {
    std::size_t begin, end;  ///< bytes
    int device;
    CUmemGenericAllocationHandle memory;
  };

  void swap(MappedMemory& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    std::swap(mapped_, other.mapped_);
    devices_.swap(other.devices_);
    pieces_.swap(other.pieces_);
  }
  CUdeviceptr address() const noexcept { return reinterpret_cast<CUdeviceptr>(data_); }
  /// Maps the memory of all pieces. @returns the first error, or CUDA_SUCCESS
  CUresult map();
  void unmap() noexcept;
  void release() noexcept;

  void* data_ = nullptr;
  std::size_t bytes_ = 0;      ///< of the range of addresses
  std::size_t mapped_ = 0;     ///< of these, with memory
  std::vector<int> devices_;   ///< that access it
  std::vector<Piece> pieces_;  ///< in the order of addresses
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
