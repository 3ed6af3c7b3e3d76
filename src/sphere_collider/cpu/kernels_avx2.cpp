/// The kernels for AVX2.
#include "src/sphere_collider/cpu/kernels.hpp"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

std::uint64_t* append_bits(std::uint64_t*, std::uint32_t, const std::uint32_t*, std::uint32_t);

/// One bit per cell for four cells.
inline std::uint32_t four_below(const std::int64_t* cell, std::int64_t bound) {
  const __m256i cells = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(cell));
  const __m256i below = _mm256_cmpgt_epi64(_mm256_set1_epi64x(bound), cells);
  return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_castsi256_pd(below)));
}

#if defined(JFPX_DOUBLE_PRECISION)
struct Simd {
  static constexpr std::uint32_t kLanes = 4;
  static constexpr std::uint32_t kAll = (1u << kLanes) - 1;
  using Vec = __m256d;
  static Vec load(const Real* p) { return _mm256_loadu_pd(p); }
  static Vec set(Real v) { return _mm256_set1_pd(v); }
  static Vec add(Vec a, Vec b) { return _mm256_add_pd(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm256_sub_pd(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm256_mul_pd(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_NGT_UQ)));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return four_below(cell, bound);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};
#else
struct Simd {
  static constexpr std::uint32_t kLanes = 8;
  static constexpr std::uint32_t kAll = (1u << kLanes) - 1;
  using Vec = __m256;
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static Vec add(Vec a, Vec b) { return _mm256_add_ps(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm256_sub_ps(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm256_mul_ps(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_NGT_UQ)));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return four_below(cell, bound) | (four_below(cell + 4, bound) << 4);
  }
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};
#endif

using RowSimd = Simd;

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx

#include "src/sphere_collider/cpu/kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
constinit const Kernels kAvx2Kernels = {search_all, search_rows};
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
