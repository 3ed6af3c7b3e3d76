/// Queries the attributes of an empty kernel. They apply to all kernels, because all are compiled
/// for the same architectures.
#include "src/base/cuda/cuda_try.hpp"
#include "src/base/cuda/device_code.hpp"

#include <array>
#include <atomic>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

__global__ void empty_kernel() {}

}  // namespace

cudaError_t kernels_loadable() {
  cudaFuncAttributes attributes{};
  return cudaFuncGetAttributes(&attributes, empty_kernel);
}

bool has_hopper_code() {
  constexpr int kDevices = 64;
  enum : signed char { kUnknown, kNo, kYes };
  static std::array<std::atomic<signed char>, kDevices> known{};
  int device = 0;
  JFPX_CUDA_TRY(cudaGetDevice(&device));
  const bool cached = device < kDevices;
  if (cached && known[device] != kUnknown) return known[device] == kYes;
  cudaFuncAttributes attributes{};
  JFPX_CUDA_TRY(cudaFuncGetAttributes(&attributes, empty_kernel));
  const bool yes = attributes.ptxVersion >= 90;
  if (cached) known[device] = yes ? kYes : kNo;
  return yes;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
