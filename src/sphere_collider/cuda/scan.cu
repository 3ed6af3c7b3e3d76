/// Device-wide prefix sums by CUB (decoupled look-back: Merrill and Garland 2016).
#include "src/base/cuda/cuda_try.hpp"
#include "src/sphere_collider/cuda/scan.hpp"

#include <cub/device/device_scan.cuh>

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

template <class Size>
cudaError_t scan(void* scratch, std::size_t& bytes, const std::uint32_t* in,
                 unsigned long long* out, Size n, cudaStream_t stream) {
  // CUB returns CUDA's last error of the thread, even if an earlier call of the program caused it.
  static_cast<void>(cudaGetLastError());
  return cub::DeviceScan::ExclusiveScan(scratch, bytes, in, out, ::cuda::std::plus<>{}, 0ull, n,
                                        stream);
}

/// 64-bit numbers of elements take more registers.
cudaError_t scan_any(void* scratch, std::size_t& bytes, const std::uint32_t* in,
                     unsigned long long* out, std::size_t n, cudaStream_t stream) {
  if (n <= std::numeric_limits<std::uint32_t>::max()) {
    return scan(scratch, bytes, in, out, static_cast<std::uint32_t>(n), stream);
  }
  return scan(scratch, bytes, in, out, static_cast<std::uint64_t>(n), stream);
}

}  // namespace

std::size_t scan_scratch_bytes(std::size_t n) {
  std::size_t bytes = 0;
  const std::uint32_t* in = nullptr;
  unsigned long long* out = nullptr;
  JFPX_CUDA_TRY(scan_any(nullptr, bytes, in, out, n, nullptr));
  return bytes;
}

void exclusive_scan(const std::uint32_t* values, unsigned long long* sums, std::size_t n,
                    void* scratch, std::size_t scratch_bytes, cudaStream_t stream) {
  JFPX_CUDA_TRY(scan_any(scratch, scratch_bytes, values, sums, n, stream));
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
