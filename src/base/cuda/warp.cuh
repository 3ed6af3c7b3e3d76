/// Reductions, scans and searches across the lanes of a warp.
///
/// cub::WarpReduce and cub::WarpScan use the same shuffles, but a reduction is returned in lane 0
/// only, and callers must declare a TempStorage per warp.
#pragma once

#include <jfpx/config.hpp>

#include <bit>
#include <concepts>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kFullWarp = 0xffffffffu;

__device__ inline unsigned lane_id() { return threadIdx.x % 32; }
__device__ inline unsigned lanes_below() { return (1u << lane_id()) - 1; }
/// This lane and all lower ones.
__device__ inline unsigned lanes_up_to() { return ~(~1u << lane_id()); }

/// Reduction over the 32 lanes of a warp, returned in every lane.
template <typename T, typename Combine>
__device__ inline T warp_reduce(T value, Combine combine) {
  for (unsigned d = 16; d != 0; d /= 2) {
    value = combine(value, __shfl_xor_sync(kFullWarp, value, static_cast<int>(d)));
  }
  return value;
}

template <typename T>
__device__ inline T warp_sum(T value) {
  return warp_reduce(value, [](T p, T q) { return p + q; });
}

__device__ inline unsigned warp_max(unsigned value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_max_sync(kFullWarp, value);
#else
  return warp_reduce(value, [](unsigned p, unsigned q) { return p > q ? p : q; });
#endif
}

/// Maximum over the lanes of a warp, returned in every lane. No value may be NaN.
__device__ inline Real warp_max(Real x) {
#if __CUDA_ARCH__ >= 800 && !defined(JFPX_DOUBLE_PRECISION)
  // Orders the bits of floats as signed integers. The map is its own inverse.
  const auto in_order = [](int bits) { return bits ^ (bits >> 31 & 0x7fffffff); };
  return std::bit_cast<Real>(
      in_order(__reduce_max_sync(kFullWarp, in_order(std::bit_cast<int>(x)))));
#else
  return warp_reduce(x, [](Real p, Real q) { return q > p ? q : p; });
#endif
}

/// Sum of the values of this lane and of all lower lanes.
template <typename T>
__device__ inline T warp_inclusive_sum(T value) {
  for (unsigned d = 1; d < 32; d *= 2) {
    const T below = __shfl_up_sync(kFullWarp, value, d);
    if (lane_id() >= d) value += below;
  }
  return value;
}

/// Minimum and maximum over the lanes of a warp, returned in every lane.
template <std::integral T>
__device__ T lowest_of_warp(T x) {
  static_assert(sizeof(T) == 4);
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(kFullWarp, x);
#else
  return warp_reduce(x, [](T p, T q) { return p < q ? p : q; });
#endif
}
__device__ inline std::int32_t highest_of_warp(std::int32_t x) { return ~lowest_of_warp(~x); }

/// The bits that are set in any lane of a warp, returned in every lane.
__device__ inline unsigned union_of_warp(unsigned bits) {
#if __CUDA_ARCH__ >= 800
  return __reduce_or_sync(kFullWarp, bits);
#else
  return warp_reduce(bits, [](unsigned p, unsigned q) { return p | q; });
#endif
}

/// Binary search in the inclusive sums of all lanes. Call from all lanes of the warp; `i` may
/// differ between them.
/// @return the first lane with sum > i, or the last lane if there is none.
__device__ inline unsigned owner_of(std::uint32_t i, std::uint32_t sum) {
  unsigned owner = 0;
  for (unsigned step = 16; step != 0; step /= 2) {
    if (__shfl_sync(kFullWarp, sum, owner + step - 1) <= i) owner += step;
  }
  return owner;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
