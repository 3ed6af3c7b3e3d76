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

#if defined(JFPX_DOUBLE_PRECISION)
struct Reals {
  using Vec = __m256d;
  static Vec load(const Real* p) { return _mm256_loadu_pd(p); }
  static Vec set(Real v) { return _mm256_set1_pd(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_NGT_UQ)));
  }
};
#else
struct Reals {
  using Vec = __m256;
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static Vec set(Real v) { return _mm256_set1_ps(v); }
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
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};

}  // namespace

constinit const Kernels kAvx2Kernels = {search_all<Simd>, search_rows<Simd>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
