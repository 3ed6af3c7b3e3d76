/// The kernels for AVX-512 (F, BW, DQ, VL).
#include "src/sphere_collider/cpu/kernels.hpp"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// A mask as a number. The empty statement keeps the number in a general register from here on:
/// g++ 12 may spill a widened mask as one byte and read four back (seen under -fsanitize=thread).
inline std::uint32_t widened(std::uint32_t mask) {
  __asm__("" : "+r"(mask));
  return mask;
}

/// One bit per cell for eight cells.
inline std::uint32_t eight_below(const std::int64_t* cell, std::int64_t bound) {
  return widened(_mm512_cmplt_epi64_mask(_mm512_loadu_si512(cell), _mm512_set1_epi64(bound)));
}

/// Writes eight pairs of `id`, in the order of `others`.
inline void store_eight(std::uint64_t* out, __m256i id, __m256i others) {
  const __m512i low = _mm512_cvtepu32_epi64(_mm256_min_epu32(id, others));
  const __m512i high = _mm512_cvtepu32_epi64(_mm256_max_epu32(id, others));
  _mm512_storeu_si512(out, _mm512_or_si512(_mm512_slli_epi64(low, 32), high));
}

/// Appends the pairs of `id` with those of eight others that the mask names, without a branch on
/// the mask, which nothing could predict: a whole vector is written, and the next pairs overwrite
/// what was too much. (Compressing to memory instead is microcoded on Zen 4.)
inline std::uint64_t* append_eight(std::uint64_t* out, std::uint32_t id,
                                   const std::uint32_t* others, std::uint32_t mask) {
  const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(others));
  const __m256i chosen = _mm256_maskz_compress_epi32(static_cast<__mmask8>(mask), all);
  store_eight(out, _mm256_set1_epi32(static_cast<int>(id)), chosen);
  return out + __builtin_popcount(mask);
}

#if defined(JFPX_DOUBLE_PRECISION)
struct Simd {
  static constexpr std::uint32_t kLanes = 8;
  static constexpr std::uint32_t kAll = (1u << kLanes) - 1;
  using Vec = __m512d;
  static Vec load(const Real* p) { return _mm512_loadu_pd(p); }
  static Vec set(Real v) { return _mm512_set1_pd(v); }
  static Vec add(Vec a, Vec b) { return _mm512_add_pd(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm512_sub_pd(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm512_mul_pd(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return widened(_mm512_cmp_pd_mask(a, b, _CMP_NGT_UQ));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return eight_below(cell, bound);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_eight(out, id, others, mask);
  }
};
using RowSimd = Simd;
#else
struct Simd {
  static constexpr std::uint32_t kLanes = 16;
  using Vec = __m512;
  static Vec load(const Real* p) { return _mm512_loadu_ps(p); }
  static Vec set(Real v) { return _mm512_set1_ps(v); }
  static Vec add(Vec a, Vec b) { return _mm512_add_ps(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm512_sub_ps(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm512_mul_ps(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return widened(_mm512_cmp_ps_mask(a, b, _CMP_NGT_UQ));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return eight_below(cell, bound) | (eight_below(cell + 8, bound) << 8);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    const __m512i chosen =
        _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), _mm512_loadu_si512(others));
    const __m256i id8 = _mm256_set1_epi32(static_cast<int>(id));
    const std::uint32_t found = count(mask);
    store_eight(out, id8, _mm512_castsi512_si256(chosen));
    if (found > 8) store_eight(out + 8, id8, _mm512_extracti64x4_epi64(chosen, 1));
    return out + found;
  }
};

/// Half as wide: the runs of a row rarely hold more than eight.
struct RowSimd {
  static constexpr std::uint32_t kLanes = 8;
  static constexpr std::uint32_t kAll = (1u << kLanes) - 1;
  using Vec = __m256;
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static Vec add(Vec a, Vec b) { return _mm256_add_ps(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm256_sub_ps(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm256_mul_ps(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return widened(_mm256_cmp_ps_mask(a, b, _CMP_NGT_UQ));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return eight_below(cell, bound);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_eight(out, id, others, mask);
  }
};
#endif

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx

#include "src/sphere_collider/cpu/kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
constinit const Kernels kAvx512Kernels = {search_all, search_rows};
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
