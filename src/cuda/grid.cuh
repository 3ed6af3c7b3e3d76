/// What the kernels of the large-N search share.
#pragma once

#include "src/cuda/grid_cells.hpp"
#include "src/cuda/tiles.cuh"

namespace jfpx::inline JFPX_ABI::cuda {

// Positive floating-point numbers are ordered as their bits are.
__device__ inline Real half_0_of(const SearchState* state) {
  return std::bit_cast<Real>(static_cast<RealBits>(state->largest_half));
}
__device__ inline unsigned long long bits_of(Real x) {
  return static_cast<unsigned long long>(std::bit_cast<RealBits>(x));
}

}  // namespace jfpx::inline JFPX_ABI::cuda
