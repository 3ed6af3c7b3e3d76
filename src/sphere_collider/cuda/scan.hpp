/// Device-wide prefix sums.
#pragma once

#include <jfpx/config.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Number of bytes of scratch memory that exclusive_scan() needs for up to `n` values.
std::size_t scan_scratch_bytes(std::size_t n);
/// Enqueues sums[i] = values[0] + ... + values[i - 1] for i < n, in 64 bits.
void exclusive_scan(const std::uint32_t* values, unsigned long long* sums, std::size_t n,
                    void* scratch, std::size_t scratch_bytes, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
