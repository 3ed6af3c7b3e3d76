/// Allocation of device memory from stream-ordered pools, and of pinned host memory.
#include "src/base/cuda/device_buffer.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

MemoryPool::MemoryPool(int device) {
  cudaMemPoolProps properties{};
  properties.allocType = cudaMemAllocationTypePinned;
  properties.location.type = cudaMemLocationTypeDevice;
  properties.location.id = device;
  JFPX_CUDA_TRY(cudaMemPoolCreate(&pool_, &properties));
  // Without a release threshold, every synchronization returns unused memory to the driver.
  std::uint64_t keep = UINT64_MAX;
  const cudaError_t error =
      JFPX_CUDA_RESULT(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &keep));
  if (error != cudaSuccess) {
    static_cast<void>(cudaMemPoolDestroy(pool_));
    throw_device_error(error, "cudaMemPoolSetAttribute", __FILE__, __LINE__);
  }
}

DeviceMemory::DeviceMemory(const MemoryPool& pool, cudaStream_t stream, std::size_t bytes,
                           const char* what) {
  JFPX_CUDA_TRY_ALLOC(cudaMallocFromPoolAsync(&data_, bytes, pool.get(), stream), bytes, what);
  bytes_ = bytes;
  stream_ = stream;
}

PinnedMemory::PinnedMemory(std::size_t bytes, const char* what) {
  JFPX_CUDA_TRY_ALLOC(cudaHostAlloc(&data_, bytes, cudaHostAllocMapped), bytes, what);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
