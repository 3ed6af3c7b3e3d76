/// Device functions that several kernels share.
#pragma once

#include "src/cuda/cuda_try.hpp"
#include "src/cuda/kernels.hpp"
#include "src/shared/sphere_pair.hpp"

namespace jfpx::inline JFPX_ABI::cuda {

/// Launches a kernel, with bytes of dynamic shared memory, that may be set up while the one before
/// it on the stream still runs; the kernel must begin with wait_for_previous_kernel(). Saves about
/// a microsecond a kernel.
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
  config.numAttrs = has_hopper_code() ? 1 : 0;  // older code does not wait
  JFPX_CUDA_TRY(cudaLaunchKernelEx(&config, kernel, Parameters(arguments)...));
}
template <typename... Parameters, typename... Arguments>
void launch(void (*kernel)(Parameters...), unsigned blocks_x, unsigned blocks_y, unsigned threads,
            cudaStream_t stream, const Arguments&... arguments) {
  launch_sharing(0, kernel, blocks_x, blocks_y, threads, stream, arguments...);
}

/// All that earlier kernels wrote can be read after it.
__device__ inline void wait_for_previous_kernel() {
#if __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
#endif
}

inline constexpr unsigned kFullWarp = 0xffffffffu;

__device__ inline unsigned lane_id() { return threadIdx.x % 32; }
__device__ inline unsigned lanes_below() { return (1u << lane_id()) - 1; }

/// Sum, maximum and union over a warp; every lane gets it.
template <typename T, typename Combine>
__device__ inline T warp_reduce(T value, Combine combine) {
  for (unsigned d = 16; d != 0; d /= 2) {
    value = combine(value, __shfl_xor_sync(kFullWarp, value, static_cast<int>(d)));
  }
  return value;
}

__device__ inline unsigned warp_max(unsigned value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_max_sync(kFullWarp, value);
#else
  return warp_reduce(value, [](unsigned p, unsigned q) { return p > q ? p : q; });
#endif
}

/// Largest number of a warp; every lane gets it. Not for NaN.
__device__ inline Real warp_max(Real x) {
#if __CUDA_ARCH__ >= 800 && !defined(JFPX_DOUBLE_PRECISION)
  const auto in_order = [](int bits) { return bits ^ (bits >> 31 & 0x7fffffff); };
  return std::bit_cast<Real>(
      in_order(__reduce_max_sync(kFullWarp, in_order(std::bit_cast<int>(x)))));
#else
  return warp_reduce(x, [](Real p, Real q) { return q > p ? q : p; });
#endif
}

/// Sum of the values of this lane and those below.
__device__ inline unsigned warp_inclusive_sum(unsigned value) {
  for (unsigned d = 1; d < 32; d *= 2) {
    const unsigned below = __shfl_up_sync(kFullWarp, value, d);
    if (lane_id() >= d) value += below;
  }
  return value;
}

/// Of sums that grow from lane to lane: the lane with the first one beyond i, or the last lane.
__device__ inline unsigned owner_of(std::uint32_t i, std::uint32_t sum) {
  unsigned owner = 0;
  for (unsigned step = 16; step != 0; step /= 2) {
    if (__shfl_sync(kFullWarp, sum, owner + step - 1) <= i) owner += step;
  }
  return owner;
}

/// Loads of data that no thread writes during the kernel.
__device__ inline SphereInstance load_sphere(const SphereInstance* p) {
  SphereInstance s;
  if constexpr (sizeof(Real) == 4) {
    const float4 v = __ldg(reinterpret_cast<const float4*>(p));
    s = {{v.x, v.y, v.z}, v.w};
  } else {
    const double2 lo = __ldg(reinterpret_cast<const double2*>(p));
    const double2 hi = __ldg(reinterpret_cast<const double2*>(p) + 1);
    s = {{static_cast<Real>(lo.x), static_cast<Real>(lo.y), static_cast<Real>(hi.x)},
         static_cast<Real>(hi.y)};
  }
  return s;
}

__device__ inline bool is_valid(const SphereInstance& s) {
  return is_finite(s.centre) && is_finite(s.radius) && s.radius > 0;
}

/// Remembers that sphere `i` is invalid; the lowest one wins.
__device__ inline void report_invalid(SearchState* state, std::uint32_t i) {
  atomicMax(&state->valid_before, ~i);
}
__device__ inline std::uint32_t first_invalid(std::uint32_t valid_before) {
  return valid_before == 0 ? kNoSphere : ~valid_before;
}
__device__ inline std::uint32_t first_invalid(const SearchState* state) {
  return first_invalid(state->valid_before);
}

/// Writes the contact of the pair a < b, which is known to touch, to place `at` of the output.
__device__ inline void write_contact(const SearchOutput& output, unsigned long long at,
                                     std::uint32_t a, std::uint32_t b, const SphereInstance& sa,
                                     const SphereInstance& sb) {
  if (output.contacts == nullptr) {
    output.pairs[at] = {a, b};
    return;
  }
  const PairResult r = shared::test_sphere_pair(sa, sb);
  output.contacts[at] = {a, b, r.normal, r.distance};
}

/// By one thread of a search: publishes the outcome.
__device__ inline void write_count(const SearchOutput& output, unsigned long long contacts,
                                   std::uint32_t invalid, bool complete) {
  const bool valid = invalid == kNoSphere;
  *output.count = {valid ? contacts : 0, invalid, valid && complete ? 1u : 0u};
}

/// A warp writes the contacts of row `a` whose partners are the bits of 32 words, one a lane: lane
/// l holds partners 32*(first_word + l) to +31. Returns the place after the last one written.
template <typename LoadSphere>
__device__ inline unsigned long long emit_row(const SearchOutput& output, unsigned long long at,
                                              std::uint32_t a, const SphereInstance& sa,
                                              std::uint32_t first_word, std::uint32_t my_word,
                                              LoadSphere load) {
  for (unsigned left = __ballot_sync(kFullWarp, my_word != 0); left != 0; left &= left - 1) {
    const int owner = __ffs(static_cast<int>(left)) - 1;
    const unsigned word = __shfl_sync(kFullWarp, my_word, owner);
    if ((word >> lane_id() & 1u) != 0) {
      const std::uint32_t b = 32 * (first_word + static_cast<std::uint32_t>(owner)) + lane_id();
      const auto rank = static_cast<unsigned>(__popc(word & lanes_below()));
      write_contact(output, at + rank, a, b, sa, load(b));
    }
    at += static_cast<unsigned>(__popc(word));
  }
  return at;
}

}  // namespace jfpx::inline JFPX_ABI::cuda
