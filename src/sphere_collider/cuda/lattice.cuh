/// 32 spheres against 32 others on a lattice, by the tensor cores of a warp; what is left in doubt,
/// exactly.
#pragma once

#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cuda/lattice.hpp"
#include "src/sphere_collider/cuda/tiles.cuh"

#include <cuda_fp16.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Largest x, -x, y, -y, z, -z and radius of each warp.
struct LatticeStorage {
  Real extremes[7][32];
};
/// A lattice for the spheres of a block, two a thread. All threads of the block.
__device__ inline Lattice lattice_of_block(const SphereInstance& p, const SphereInstance& q,
                                           LatticeStorage& s) {
  const auto enter = [&](int which, Real x, Real y) {
    const Real most = warp_max(x > y ? x : y);
    if (lane_id() == 0) s.extremes[which][threadIdx.x / 32] = most;
  };
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    enter(2 * axis, p.centre[axis], q.centre[axis]);
    enter(2 * axis + 1, -p.centre[axis], -q.centre[axis]);
  }
  enter(6, p.radius, q.radius);
  __syncthreads();
  const unsigned warp = min(lane_id(), blockDim.x / 32 - 1);
  const auto most = [&](int which) { return warp_max(s.extremes[which][warp]); };
  return lattice_around({-most(1), -most(3), -most(5)}, {most(0), most(2), most(4)}, most(6));
}

/// The terms of a sphere, in half precision.
struct alignas(16) LatticeRecord {
  std::uint32_t pairs[4];
};
__device__ inline LatticeRecord record_of(const LatticeTerms& terms) {
  const float* const v = terms.values;
  const auto pair = [](float low, float high) {
    return std::bit_cast<std::uint32_t>(__half2_raw(__floats2half2_rn(low, high)));
  };
  static_assert(kTerms == 8);
  return {{pair(v[0], v[1]), pair(v[2], v[3]), pair(v[4], v[5]), pair(v[6], v[7])}};
}

/// What lane l has of 32 records: word l % 4 of records l / 4, 8 + l / 4, 16 + l / 4, 24 + l / 4.
struct LatticeFragment {
  std::uint32_t words[4];
};
/// All lanes of a warp; the records are in shared memory.
__device__ inline LatticeFragment load_fragment(const LatticeRecord* records) {
  LatticeFragment f;
  const auto address = static_cast<unsigned>(__cvta_generic_to_shared(records + lane_id()));
  asm volatile("ldmatrix.sync.aligned.m8n8.x4.shared.b16 {%0, %1, %2, %3}, [%4];"
               : "=r"(f.words[0]), "=r"(f.words[1]), "=r"(f.words[2]), "=r"(f.words[3])
               : "r"(address)
               : "memory");
  return f;
}

/// Sums of products of 16 rows and 8 columns. Lane l has those of rows l / 4 (twice) and 8 + l / 4
/// (twice), columns 2 (l % 4) and 2 (l % 4) + 1.
struct LatticeSums {
  float values[4];
};
__device__ inline LatticeSums multiply(std::uint32_t rows_0, std::uint32_t rows_8,
                                       std::uint32_t columns) {
  LatticeSums s;
  asm("mma.sync.aligned.m16n8k8.row.col.f32.f16.f16.f32 {%0, %1, %2, %3}, {%4, %5}, {%6}, "
      "{%7, %7, %7, %7};"
      : "=f"(s.values[0]), "=f"(s.values[1]), "=f"(s.values[2]), "=f"(s.values[3])
      : "r"(rows_0), "r"(rows_8), "r"(columns), "f"(0.0f));
  return s;
}

/// Where the record of column k is to be, so that a lane gets columns that follow each other.
__device__ inline unsigned place_of_column(unsigned k) {
  return k / 32 * 32 + k % 8 / 2 * 8 + k % 32 / 8 * 2 + k % 2;
}

/// Which pairs may touch, of rows l / 4, 8 + l / 4, 16 + l / 4, 24 + l / 4, in this order, with
/// columns 8 (l % 4) to 8 (l % 4) + 7: a bit each.
struct LatticeBytes {
  std::uint32_t of_rows[4];
};
/// All lanes of a warp.
__device__ inline LatticeBytes lattice_bytes(const LatticeFragment& rows,
                                             const LatticeFragment& columns) {
  LatticeBytes bytes{};
#pragma unroll
  for (int c = 3; c >= 0; --c) {
#pragma unroll
    for (unsigned r = 0; r < 4; r += 2) {
      const LatticeSums s = multiply(rows.words[r], rows.words[r + 1], columns.words[c]);
#pragma unroll
      for (unsigned k = 0; k < 4; ++k) {  // column 1 before 0: the sign becomes the lowest bit
        const float value = s.values[k ^ 1];
        std::uint32_t& byte = bytes.of_rows[r + k / 2];
        byte = __funnelshift_l(std::bit_cast<std::uint32_t>(value), byte, 1);
      }
    }
  }
  return bytes;
}

/// Puts the bytes together to a word a row, of 32 columns; `stride` words on is that of the next
/// row.
__device__ inline void put_bytes(const LatticeBytes& bytes, std::uint32_t* words,
                                 std::size_t stride) {
#pragma unroll
  for (unsigned r = 0; r < 4; ++r) {
    auto* const word = reinterpret_cast<unsigned char*>(words + (8 * r + lane_id() / 4) * stride);
    word[lane_id() % 4] = static_cast<unsigned char>(bytes.of_rows[r]);
  }
}

/// Clears the bits of `word` whose spheres do not touch `a`.
__device__ inline std::uint32_t exactly_touching(std::uint32_t word, const SphereInstance& a,
                                                 const SphereInstance* b) {
  for (std::uint32_t left = word; left != 0; left &= left - 1) {
    const int k = __ffs(static_cast<int>(left)) - 1;
    if (detail::test_sphere_pair(a, b[k]).touching == 0) word &= ~(1u << k);
  }
  return word;
}

/// The bits of word `first_b / 32` of row `a` that stand for pairs: a < b < n.
__device__ inline std::uint32_t pair_bits(std::uint32_t a, std::uint32_t first_b, std::uint32_t n) {
  std::uint32_t bits = n <= first_b ? 0 : n - first_b >= 32 ? ~0u : (1u << (n - first_b)) - 1;
  if (a >= first_b) bits &= a - first_b >= 31 ? 0 : ~0u << (a - first_b + 1);
  return bits;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
