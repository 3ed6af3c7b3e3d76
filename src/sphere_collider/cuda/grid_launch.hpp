/// How the search among many spheres is launched.
#pragma once

#include "src/sphere_collider/cuda/kernels.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// All phases in one launch of `most_blocks` blocks at most, with barriers between them.
void launch_in_one(const GridArgs& args, const SearchOutput& output, unsigned most_blocks,
                   cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
