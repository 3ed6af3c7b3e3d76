/// Largest numbers of many threads.
#pragma once

#include "src/cuda/grid_cells.hpp"
#include "src/cuda/tiles.cuh"

namespace jfpx::inline JFPX_ABI::cuda {

/// Largest number of a warp; every lane gets it. Not for NaN.
__device__ inline Real warp_max(Real x) {
#if __CUDA_ARCH__ >= 800 && !defined(JFPX_DOUBLE_PRECISION)
  const auto in_order = [](int bits) { return bits ^ (bits >> 31 & 0x7fffffff); };
  return std::bit_cast<Real>(
      in_order(__reduce_max_sync(kFullWarp, in_order(std::bit_cast<int>(x)))));
#else
  for (unsigned d = 16; d != 0; d /= 2) {
    const Real other = __shfl_xor_sync(kFullWarp, x, static_cast<int>(d));
    x = other > x ? other : x;
  }
  return x;
#endif
}

/// A number from 1 on that grows with x; ordered(-x) falls with it.
__device__ inline unsigned long long ordered(Real x) {
  constexpr unsigned kShift = sizeof(Real) == 4 ? 32 : 0;
  const unsigned long long bits = static_cast<unsigned long long>(std::bit_cast<RealBits>(x))
                                  << kShift;
  constexpr unsigned long long kSign = 1ull << 63;
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}
__device__ inline Real from_ordered(unsigned long long key) {
  constexpr unsigned kShift = sizeof(Real) == 4 ? 32 : 0;
  constexpr unsigned long long kSign = 1ull << 63;
  const unsigned long long bits = (key & kSign) != 0 ? key & ~kSign : ~key;
  return std::bit_cast<Real>(static_cast<RealBits>(bits >> kShift));
}

}  // namespace jfpx::inline JFPX_ABI::cuda
