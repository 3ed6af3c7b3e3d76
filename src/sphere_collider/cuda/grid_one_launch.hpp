/// Grid search in one cooperative launch.
#pragma once

#include "src/sphere_collider/cuda/grid.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Largest number of blocks of this search that can be resident on the device.
/// @param multiprocessors of the current device
/// @throws DeviceError
unsigned resident_grid_blocks(unsigned multiprocessors);
/// Enqueues all phases as one launch of up to `max_blocks` blocks, with grid barriers between them.
void launch_in_one(const GridArgs& args, const SearchOutput& output, unsigned max_blocks,
                   cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
