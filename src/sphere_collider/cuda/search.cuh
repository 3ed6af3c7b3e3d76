/// Device functions shared by the sphere searches: loading, validation and output.
#pragma once

#include "src/base/cuda/launch.cuh"
#include "src/base/cuda/warp.cuh"
#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cuda/search.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Loads a sphere through the read-only cache: no thread may write it during the kernel.
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

/// Loads sphere `i` of arrays through the read-only cache.
__device__ inline SphereInstance load_from(const SphereArrays& arrays, std::uint64_t i) {
  const auto row = static_cast<std::ptrdiff_t>(i);
  const Real* const p = arrays.positions + row * arrays.row_stride;
  const Real radius =
      arrays.radii == nullptr ? arrays.radius : __ldg(arrays.radii + row * arrays.radius_stride);
  return {{__ldg(p), __ldg(p + arrays.column_stride), __ldg(p + 2 * arrays.column_stride)}, radius};
}
/// Loads sphere `i` of the input through the read-only cache.
__device__ inline SphereInstance load_sphere(const SphereInput& input, std::uint64_t i) {
  return input.spheres != nullptr ? load_sphere(input.spheres + i) : load_from(input.arrays, i);
}

__device__ inline bool is_valid(const SphereInstance& s) {
  return is_finite(s.centre) && is_finite(s.radius) && s.radius > 0;
}

/// Records that sphere `i` is invalid. The lowest index is kept.
__device__ inline void report_invalid(SearchState* state, std::uint32_t i) {
  atomicMax(&state->valid_before, ~i);
}
__device__ inline std::uint32_t first_invalid(std::uint32_t valid_before) {
  return valid_before == 0 ? kNoSphere : ~valid_before;
}
__device__ inline std::uint32_t first_invalid(const SearchState* state) {
  return first_invalid(state->valid_before);
}

/// Writes the pair a < b to index `at` of the output. Values that the search does not read again
/// are evicted first from the cache.
__device__ inline void write_pair(const SearchOutput& output, unsigned long long at,
                                  std::uint32_t a, std::uint32_t b) {
  const IndexRows& rows = output.rows;
  if (output.pairs != nullptr) {
    __stcs(reinterpret_cast<uint2*>(output.pairs) + at, uint2{a, b});
  } else if (output.neighbors != nullptr) {
    output.neighbors[at] = b;
  } else if (rows.is_wide) {
    auto* const indices = static_cast<std::int64_t*>(rows.indices);
    indices[at] = a;
    indices[rows.length + at] = b;
  } else {
    auto* const indices = static_cast<std::int32_t*>(rows.indices);
    __stcs(indices + at, static_cast<std::int32_t>(a));
    __stcs(indices + rows.length + at, static_cast<std::int32_t>(b));
  }
}

/// Writes the contact of the touching pair a < b to index `at` of the output.
__device__ inline void write_contact(const SearchOutput& output, unsigned long long at,
                                     std::uint32_t a, std::uint32_t b, const PairResult& r) {
  if (output.contacts == nullptr) {
    write_pair(output, at, a, b);
  } else {
    output.contacts[at] = {a, b, r.normal, r.distance};
  }
}
/// The same from the spheres.
__device__ inline void write_contact(const SearchOutput& output, unsigned long long at,
                                     std::uint32_t a, std::uint32_t b, const SphereInstance& sa,
                                     const SphereInstance& sb) {
  if (output.contacts == nullptr) {
    write_pair(output, at, a, b);
  } else {
    write_contact(output, at, a, b, detail::test_sphere_pair(sa, sb));
  }
}

/// Writes a word that the host polls; see SearchSignal.
__device__ inline void write_signal(unsigned long long* signal, unsigned long long number,
                                    bool valid, bool complete) {
  const unsigned long long word = (valid ? number : 0) << kSignalBits |
                                  (valid ? kSignalIsValid : 0) |
                                  (valid && complete ? kSignalIsComplete : 0);
  asm volatile("st.relaxed.sys.global.u64 [%0], %1;" ::"l"(signal), "l"(word) : "memory");
}

/// Writes the ContactCount of a search, with 0 contacts if a sphere is invalid. Call from one
/// thread.
__device__ inline void write_count(const SearchOutput& output, unsigned long long contacts,
                                   std::uint32_t invalid, bool complete) {
  const bool valid = invalid == kNoSphere;
  *output.count = {valid ? contacts : 0, invalid, valid && complete ? 1u : 0u};
  if (output.signal != nullptr) write_signal(output.signal, contacts, valid, complete);
}

/// A warp writes the contacts of a row, given as 32 words of a bit mask, one word per lane: lane l
/// holds the neighbors 32*(first_word + l) to +31.
/// @param write write(at, b) writes the contact with b to index `at` of the output
/// @return the output index after the last contact.
template <typename Write>
__device__ inline unsigned long long emit_row(unsigned long long at, std::uint32_t first_word,
                                              std::uint32_t my_word, Write write) {
  for (unsigned left = __ballot_sync(kFullWarp, my_word != 0); left != 0; left &= left - 1) {
    const int owner = __ffs(static_cast<int>(left)) - 1;
    const unsigned word = __shfl_sync(kFullWarp, my_word, owner);
    if ((word >> lane_id() & 1u) != 0) {
      const std::uint32_t b = 32 * (first_word + static_cast<std::uint32_t>(owner)) + lane_id();
      const auto rank = static_cast<unsigned>(__popc(word & lanes_below()));
      write(at + rank, b);
    }
    at += static_cast<unsigned>(__popc(word));
  }
  return at;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
