/// Prefix sums, by CUB (decoupled look-back: Merrill and Garland 2016).
#include "src/cuda/cuda_try.hpp"
#include "src/cuda/kernels.hpp"

#include <cub/device/device_scan.cuh>

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

template <typename In, typename Sum>
cudaError_t scan(void* scratch, std::size_t& bytes, const In* in, Sum* out, std::size_t n,
                 cudaStream_t stream) {
  return cub::DeviceScan::ExclusiveScan(scratch, bytes, in, out, ::cuda::std::plus<>{}, Sum{0},
                                        static_cast<std::uint32_t>(n), stream);
}

}  // namespace

std::size_t scan_scratch_bytes(std::size_t n) {
  std::size_t narrow = 0, wide = 0;
  std::uint32_t* in = nullptr;
  unsigned long long* out = nullptr;
  JFPX_CUDA_TRY(scan(nullptr, narrow, in, in, n, nullptr));
  JFPX_CUDA_TRY(scan(nullptr, wide, in, out, n, nullptr));
  return narrow > wide ? narrow : wide;
}

void exclusive_scan(std::uint32_t* values, std::size_t n, void* scratch, std::size_t scratch_bytes,
                    cudaStream_t stream) {
  JFPX_CUDA_TRY(scan(scratch, scratch_bytes, values, values, n, stream));
}

void exclusive_scan(const std::uint32_t* values, unsigned long long* sums, std::size_t n,
                    void* scratch, std::size_t scratch_bytes, cudaStream_t stream) {
  JFPX_CUDA_TRY(scan(scratch, scratch_bytes, values, sums, n, stream));
}

}  // namespace jfpx::inline JFPX_ABI::cuda
