/// The kernels for AVX-512 (F, BW, DQ, VL).
#include "src/sphere_collider/cpu/kernels.inl"

// g++ 12 with sanitizers reports operands of its own intrinsics, which are undefined on purpose
// (GCC bug 105593).
#pragma GCC diagnostic ignored "-Wuninitialized"
#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Converts a mask to an integer. The empty assembly statement forces the integer into a general
/// register: g++ 12 may otherwise spill a widened mask as one byte and reload four (observed with
/// -fsanitize=thread).
inline std::uint32_t widened(std::uint32_t mask) {
  __asm__("" : "+r"(mask));
  return mask;
}

/// Returns one bit per cell for eight cells.
inline std::uint32_t eight_below(const std::int64_t* cell, std::int64_t bound) {
  return widened(_mm512_cmplt_epi64_mask(_mm512_loadu_si512(cell), _mm512_set1_epi64(bound)));
}

/// Writes eight pairs of `id`, in the order of `others`.
inline void store_eight(std::uint64_t* out, __m256i id, __m256i others) {
  const __m512i low = _mm512_cvtepu32_epi64(_mm256_min_epu32(id, others));
  const __m512i high = _mm512_cvtepu32_epi64(_mm256_max_epu32(id, others));
  _mm512_storeu_si512(out, _mm512_or_si512(_mm512_slli_epi64(low, 32), high));
}

#if defined(JFPX_DOUBLE_PRECISION)
struct Reals {
  using Vec = __m512d;
  static Vec load(const Real* p) { return _mm512_loadu_pd(p); }
  static Vec set(Real v) { return _mm512_set1_pd(v); }
  static void store(Real* p, Vec v) { _mm512_storeu_pd(p, v); }
  static Vec square_root(Vec v) { return _mm512_sqrt_pd(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return widened(_mm512_cmp_pd_mask(a, b, _CMP_NGT_UQ));
  }
};
using RowReals = Reals;
#else
struct Reals {
  using Vec = __m512;
  static Vec load(const Real* p) { return _mm512_loadu_ps(p); }
  static Vec set(Real v) { return _mm512_set1_ps(v); }
  static void store(Real* p, Vec v) { _mm512_storeu_ps(p, v); }
  static Vec square_root(Vec v) { return _mm512_sqrt_ps(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return widened(_mm512_cmp_ps_mask(a, b, _CMP_NGT_UQ));
  }
};

/// Half as wide, because the runs of a row rarely contain more than eight targets.
struct RowReals {
  using Vec = __m256;
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static Vec square_root(Vec v) { return _mm256_sqrt_ps(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return widened(_mm256_cmp_ps_mask(a, b, _CMP_NGT_UQ));
  }
};
#endif

template <class R>
struct Simd : R {
  static constexpr std::uint32_t kLanes = sizeof(typename R::Vec) / sizeof(Real);
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    std::uint32_t below = eight_below(cell, bound);
    if constexpr (kLanes == 16) below |= eight_below(cell + 8, bound) << 8;
    return below;
  }
  static std::uint32_t ids_above(const std::uint32_t* ids, std::uint32_t bound) {
    if constexpr (kLanes == 16) {
      return widened(_mm512_cmpgt_epu32_mask(_mm512_loadu_si512(ids),
                                             _mm512_set1_epi32(static_cast<int>(bound))));
    } else {
      return widened(
          _mm256_cmpgt_epu32_mask(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(ids)),
                                  _mm256_set1_epi32(static_cast<int>(bound))));
    }
  }
  static void copy_ids(const std::uint32_t* from, std::uint32_t* to) {
    __builtin_memcpy(to, from, kLanes * sizeof *to);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  /// Avoids an unpredictable branch on the mask: writes a whole vector, and the next pairs
  /// overwrite the excess. (Compressing to memory instead is microcoded on Zen 4.)
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    const __m256i id8 = _mm256_set1_epi32(static_cast<int>(id));
    const std::uint32_t found = count(mask);
    if constexpr (kLanes == 16) {
      const __m512i all = _mm512_loadu_si512(others);
      const __m512i chosen = _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), all);
      store_eight(out, id8, _mm512_castsi512_si256(chosen));
      if (found > 8) store_eight(out + 8, id8, _mm512_extracti64x4_epi64(chosen, 1));
    } else {
      const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(others));
      const __m256i chosen = _mm256_maskz_compress_epi32(static_cast<__mmask8>(mask), all);
      store_eight(out, id8, chosen);
    }
    return out + found;
  }
};

}  // namespace

constinit const Kernels kAvx512Kernels = {search_all<Simd<Reals>>, search_rows<Simd<RowReals>>,
                                          search_cells<Simd<Reals>>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
