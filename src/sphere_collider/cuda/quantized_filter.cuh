/// Overlap tests of 32 spheres against 32 others: quantized on the tensor cores of a warp, then
/// exact for pairs that may touch.
#pragma once

#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cuda/quantized_filter.hpp"
#include "src/sphere_collider/cuda/search.cuh"

#include <cuda_fp16.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Largest x, -x, y, -y, z, -z and radius of each warp.
struct QuantizationStorage {
  Real extremes[7][32];
};
/// Quantization for the spheres of a block, two per thread. Call from all threads of the block.
__device__ inline Quantization quantization_of_block(const SphereInstance& p,
                                                     const SphereInstance& q,
                                                     QuantizationStorage& s) {
  const auto enter = [&](int which, Real x, Real y) {
    const Real largest = warp_max(x > y ? x : y);
    if (lane_id() == 0) s.extremes[which][threadIdx.x / 32] = largest;
  };
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    enter(2 * axis, p.centre[axis], q.centre[axis]);
    enter(2 * axis + 1, -p.centre[axis], -q.centre[axis]);
  }
  enter(6, p.radius, q.radius);
  __syncthreads();
  const unsigned warp = min(lane_id(), blockDim.x / 32 - 1);
  const auto largest = [&](int which) { return warp_max(s.extremes[which][warp]); };
  return quantization_around({-largest(1), -largest(3), -largest(5)},
                             {largest(0), largest(2), largest(4)}, largest(6));
}

/// The terms of a sphere in half precision.
struct alignas(16) QuantizedRecord {
  std::uint32_t pairs[4];
};
__device__ inline QuantizedRecord record_of(const QuantizedTerms& terms) {
  const float* const v = terms.values;
  const auto pair = [](float low, float high) {
    return std::bit_cast<std::uint32_t>(__half2_raw(__floats2half2_rn(low, high)));
  };
  static_assert(kTerms == 8);
  return {{pair(v[0], v[1]), pair(v[2], v[3]), pair(v[4], v[5]), pair(v[6], v[7])}};
}

/// Part of 32 records that one lane holds, in the layout of ldmatrix and mma: in lane l, words[i]
/// is word l % 4 of record 8 i + l / 4.
struct QuantizedFragment {
  std::uint32_t words[4];
};
/// Call from all lanes of a warp. The records must be in shared memory.
__device__ inline QuantizedFragment load_fragment(const QuantizedRecord* records) {
  QuantizedFragment f;
  const auto address = static_cast<unsigned>(__cvta_generic_to_shared(records + lane_id()));
  asm volatile("ldmatrix.sync.aligned.m8n8.x4.shared.b16 {%0, %1, %2, %3}, [%4];"
               : "=r"(f.words[0]), "=r"(f.words[1]), "=r"(f.words[2]), "=r"(f.words[3])
               : "r"(address)
               : "memory");
  return f;
}

/// Dot products of 16 rows and 8 columns. Lane l holds those of row l / 4 (first two values) and
/// row 8 + l / 4 (last two), with columns 2 (l % 4) and 2 (l % 4) + 1.
struct ProductSums {
  float values[4];
};
__device__ inline ProductSums multiply(std::uint32_t rows_0, std::uint32_t rows_8,
                                       std::uint32_t columns) {
  ProductSums s;
  asm("mma.sync.aligned.m16n8k8.row.col.f32.f16.f16.f32 {%0, %1, %2, %3}, {%4, %5}, {%6}, "
      "{%7, %7, %7, %7};"
      : "=f"(s.values[0]), "=f"(s.values[1]), "=f"(s.values[2]), "=f"(s.values[3])
      : "r"(rows_0), "r"(rows_8), "r"(columns), "f"(0.0f));
  return s;
}

/// Slot in which the record of column k is stored. With this permutation, the products of a lane
/// are those of eight consecutive columns.
__device__ inline unsigned column_slot(unsigned k) {
  return k / 32 * 32 + k % 8 / 2 * 8 + k % 32 / 8 * 2 + k % 2;
}

/// Part of the results of 32 x 32 overlap tests that one lane holds. In lane l, bit j of of_rows[i]
/// is set if row 8 i + l / 4 may touch column 8 (l % 4) + j.
struct OverlapBytes {
  std::uint32_t of_rows[4];
};
/// Call from all lanes of a warp.
__device__ inline OverlapBytes overlap_bytes(const QuantizedFragment& rows,
                                             const QuantizedFragment& columns) {
  OverlapBytes bytes{};
#pragma unroll
  for (int c = 3; c >= 0; --c) {
#pragma unroll
    for (unsigned r = 0; r < 4; r += 2) {
      const ProductSums s = multiply(rows.words[r], rows.words[r + 1], columns.words[c]);
#pragma unroll
      for (unsigned k = 0; k < 4; ++k) {  // higher columns first: a sign enters as the lowest bit
        const float value = s.values[k ^ 1];
        std::uint32_t& byte = bytes.of_rows[r + k / 2];
        byte = __funnelshift_l(std::bit_cast<std::uint32_t>(value), byte, 1);
      }
    }
  }
  return bytes;
}

/// Assembles the bytes of all lanes into one word of 32 columns per row. Words of consecutive rows
/// are `stride` words apart.
__device__ inline void put_bytes(const OverlapBytes& bytes, std::uint32_t* words,
                                 std::size_t stride) {
#pragma unroll
  for (unsigned r = 0; r < 4; ++r) {
    auto* const word = reinterpret_cast<unsigned char*>(words + (8 * r + lane_id() / 4) * stride);
    word[lane_id() % 4] = static_cast<unsigned char>(bytes.of_rows[r]);
  }
}

/// Clears the bits of `word` for spheres that do not touch `a`.
__device__ inline std::uint32_t exactly_touching(std::uint32_t word, const SphereInstance& a,
                                                 const SphereInstance* b) {
  for (std::uint32_t left = word; left != 0; left &= left - 1) {
    const int k = __ffs(static_cast<int>(left)) - 1;
    if (detail::test_sphere_pair(a, b[k]).touching == 0) word &= ~(1u << k);
  }
  return word;
}

/// Mask of the bits of word `first_b / 32` of row `a` that represent pairs, that is, a < b < n.
__device__ inline std::uint32_t pair_bits(std::uint32_t a, std::uint32_t first_b, std::uint32_t n) {
  std::uint32_t bits = n <= first_b ? 0 : n - first_b >= 32 ? ~0u : (1u << (n - first_b)) - 1;
  if (a >= first_b) bits &= a - first_b >= 31 ? 0 : ~0u << (a - first_b + 1);
  return bits;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
