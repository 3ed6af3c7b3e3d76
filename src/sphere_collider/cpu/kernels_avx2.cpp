/// The kernels for AVX2.
#include "src/sphere_collider/cpu/kernels.inl"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Returns one bit per cell for four cells.
inline std::uint32_t four_below(const std::int64_t* cell, std::int64_t bound) {
  const __m256i cells = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(cell));
  const __m256i below = _mm256_cmpgt_epi64(_mm256_set1_epi64x(bound), cells);
  return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_castsi256_pd(below)));
}

/// Returns one bit per id for four ids. There are only comparisons of signed integers.
inline std::uint32_t four_above(const std::uint32_t* ids, std::uint32_t bound) {
  const __m128i flip = _mm_set1_epi32(INT32_MIN);
  const __m128i four = _mm_loadu_si128(reinterpret_cast<const __m128i*>(ids));
  const __m128i above =
      _mm_cmpgt_epi32(_mm_xor_si128(four, flip),
                      _mm_xor_si128(_mm_set1_epi32(static_cast<std::int32_t>(bound)), flip));
  return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_castsi128_ps(above)));
}

#if defined(JFPX_DOUBLE_PRECISION)
struct Reals {
  using Vec = __m256d;
  static Vec load(const Real* p) { return _mm256_loadu_pd(p); }
  static Vec set(Real v) { return _mm256_set1_pd(v); }
  static void store(Real* p, Vec v) { _mm256_storeu_pd(p, v); }
  static Vec square_root(Vec v) { return _mm256_sqrt_pd(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_NGT_UQ)));
  }
};
#else
struct Reals {
  using Vec = __m256;
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static void store(Real* p, Vec v) { _mm256_storeu_ps(p, v); }
  static Vec square_root(Vec v) { return _mm256_sqrt_ps(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_NGT_UQ)));
  }
};
#endif

struct Simd : Reals {
  static constexpr std::uint32_t kLanes = sizeof(Vec) / sizeof(Real);
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    std::uint32_t below = four_below(cell, bound);
    if constexpr (kLanes == 8) below |= four_below(cell + 4, bound) << 4;
    return below;
  }
  static std::uint32_t ids_above(const std::uint32_t* ids, std::uint32_t bound) {
    std::uint32_t above = four_above(ids, bound);
    if constexpr (kLanes == 8) above |= four_above(ids + 4, bound) << 4;
    return above;
  }
  static void copy_ids(const std::uint32_t* from, std::uint32_t* to) {
    __builtin_memcpy(to, from, kLanes * sizeof *to);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};

}  // namespace

constinit const Kernels kAvx2Kernels = {search_all<Simd>, search_rows<Simd>, search_cells<Simd>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
