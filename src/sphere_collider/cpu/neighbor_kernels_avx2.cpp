/// The loops of neighbor lists for AVX2.
#include "src/sphere_collider/cpu/neighbor_kernels.hpp"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Bytes that move the selected ones of four numbers to the front, by mask.
struct CompressTable {
  alignas(16) std::uint8_t bytes[16][16];
};
constexpr CompressTable make_compress_table() {
  CompressTable table{};
  for (int mask = 0; mask < 16; ++mask) {
    int to = 0;
    for (int lane = 0; lane < 4; ++lane) {
      if ((mask >> lane & 1) == 0) continue;
      for (int byte = 0; byte < 4; ++byte) {
        table.bytes[mask][to++] = static_cast<std::uint8_t>(4 * lane + byte);
      }
    }
  }
  return table;
}
constexpr CompressTable kCompress = make_compress_table();

/// Comparisons of integers are signed.
inline __m128i flipped(__m128i numbers) {
  return _mm_xor_si128(numbers, _mm_set1_epi32(INT32_MIN));
}

std::uint32_t search_neighbors(const NeighborColumns& columns, const NeighborQuery& query,
                               std::uint32_t begin, std::uint32_t end, std::uint32_t* found,
                               bool* unsure) {
  const __m256d x = _mm256_set1_pd(query.x);
  const __m256d y = _mm256_set1_pd(query.y);
  const __m256d z = _mm256_set1_pd(query.z);
  const __m128i least = flipped(_mm_set1_epi32(static_cast<std::int32_t>(query.least_index)));
  const __m256d outer = _mm256_set1_pd(query.outer), inner = _mm256_set1_pd(query.inner);
  const __m256d lowest = _mm256_set1_pd(query.lowest), surely = _mm256_set1_pd(query.least);
  const double* const xs = columns.x;
  const double* const ys = columns.y;
  const double* const zs = columns.z;
  const std::uint32_t* const indices = columns.index;
  __m256d any_unsure = _mm256_setzero_pd();
  std::uint32_t* out = found;
  for (std::uint32_t k = begin; k < end; k += 4) {
    const __m256d dx = _mm256_sub_pd(_mm256_loadu_pd(xs + k), x);
    const __m256d dy = _mm256_sub_pd(_mm256_loadu_pd(ys + k), y);
    const __m256d dz = _mm256_sub_pd(_mm256_loadu_pd(zs + k), z);
    const __m256d square = _mm256_add_pd(
        _mm256_add_pd(_mm256_mul_pd(dx, dx), _mm256_mul_pd(dy, dy)), _mm256_mul_pd(dz, dz));
    const __m256d kept = _mm256_and_pd(_mm256_cmp_pd(square, outer, _CMP_LE_OQ),
                                       _mm256_cmp_pd(square, lowest, _CMP_GE_OQ));
    const __m256d sure = _mm256_and_pd(_mm256_cmp_pd(square, inner, _CMP_LE_OQ),
                                       _mm256_cmp_pd(square, surely, _CMP_GE_OQ));
    any_unsure = _mm256_or_pd(any_unsure, _mm256_andnot_pd(sure, kept));
    const __m128i index = _mm_loadu_si128(reinterpret_cast<const __m128i*>(indices + k));
    const auto before = static_cast<std::uint32_t>(
        _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpgt_epi32(least, flipped(index)))));
    std::uint32_t mask = static_cast<std::uint32_t>(_mm256_movemask_pd(kept)) & ~before;
    if (end - k < 4) mask &= (1u << (end - k)) - 1;
    const __m128i order = _mm_load_si128(reinterpret_cast<const __m128i*>(kCompress.bytes[mask]));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm_shuffle_epi8(index, order));
    out += __builtin_popcount(mask);
  }
  // May be that of a point after the range, which costs time and has no other effect.
  *unsure = *unsure || _mm256_movemask_pd(any_unsure) != 0;
  return static_cast<std::uint32_t>(out - found);
}

void rank_neighbors(const std::uint32_t* numbers, std::uint32_t count, std::uint32_t* ranks) {
  const __m256i flip = _mm256_set1_epi32(INT32_MIN);
  for (std::uint32_t i = 0; i < count; i += 8) {
    const __m256i eight =
        _mm256_xor_si256(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(numbers + i)), flip);
    __m256i rank = _mm256_setzero_si256();
    for (std::uint32_t k = 0; k < count; ++k) {
      const __m256i other =
          _mm256_xor_si256(_mm256_set1_epi32(static_cast<std::int32_t>(numbers[k])), flip);
      rank = _mm256_sub_epi32(rank, _mm256_cmpgt_epi32(eight, other));
    }
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(ranks + i), rank);
  }
}

}  // namespace

constinit const NeighborKernels kAvx2NeighborKernels = {search_neighbors, rank_neighbors};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
