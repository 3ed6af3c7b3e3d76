/// Kernel launches that overlap with the previous kernel of the stream (programmatic dependent
/// launch).
#pragma once

#include "src/base/cuda/cuda_try.hpp"
#include "src/base/cuda/device_code.hpp"

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Launches a kernel with the given amount of dynamic shared memory. On Hopper, its blocks can
/// start before the previous kernel of the stream has completed, which saves about a microsecond.
/// Therefore the kernel must begin with wait_for_previous_kernel().
template <typename... Parameters, typename... Arguments>
void launch_sharing(std::size_t shared_bytes, void (*kernel)(Parameters...), unsigned blocks_x,
                    unsigned blocks_y, unsigned threads, cudaStream_t stream,
                    const Arguments&... arguments) {
  cudaLaunchAttribute overlap{};
  overlap.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  overlap.val.programmaticStreamSerializationAllowed = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(blocks_x, blocks_y);
  config.blockDim = threads;
  config.dynamicSmemBytes = shared_bytes;
  config.stream = stream;
  config.attrs = &overlap;
  config.numAttrs = has_hopper_code() ? 1 : 0;  // older code does not support the wait
  JFPX_CUDA_TRY(cudaLaunchKernelEx(&config, kernel, Parameters(arguments)...));
}
/// launch() without dynamic shared memory.
template <typename... Parameters, typename... Arguments>
void launch(void (*kernel)(Parameters...), unsigned blocks_x, unsigned blocks_y, unsigned threads,
            cudaStream_t stream, const Arguments&... arguments) {
  launch_sharing(0, kernel, blocks_x, blocks_y, threads, stream, arguments...);
}

/// Waits until the writes of all earlier kernels of the stream are visible. Every kernel started by
/// launch() must call it, because the wait covers only the previous kernel.
__device__ inline void wait_for_previous_kernel() {
#if __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
#endif
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
