/// Dynamic shared memory of a block on a device.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// A piece of shared memory with the alignment of four numbers.
struct alignas(4 * sizeof(Real)) SharedPiece {
  Real numbers[4];
};

/// The dynamic shared memory of a block; null on the host.
JFPX_HD inline void* dynamic_shared_memory() {
#if defined(__CUDA_ARCH__)
  extern __shared__ SharedPiece shared_memory[];
  return shared_memory;
#else
  return nullptr;
#endif
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
