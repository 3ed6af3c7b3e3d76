/// Kernels of the row solver for AVX2.
#include "src/base/avx2_lanes.inl"
#include "src/contact_solver/sequential_impulse/cpu/row_kernels.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// The first field of body `id`. Bodies that no row moves are addressed by the complement.
template <class T>
T* field_of(T* base, std::int32_t id, int stride) {
  return base + std::ptrdiff_t{id ^ (id >> 31)} * stride;
}

#if defined(JFPX_DOUBLE_PRECISION)
struct Simd : Avx2Lanes {
  static Mask is_real(const std::int32_t* ids) {
    const __m128i id = _mm_loadu_si128(reinterpret_cast<const __m128i*>(ids));
    const __m128i fixed = _mm_cmpeq_epi32(id, _mm_set1_epi32(rows::kFixedBody));
    return negate_mask(_mm256_castsi256_pd(_mm256_cvtepi32_epi64(fixed)));
  }
  static Vec residual(Vec impulse, Vec inverse) {
    return _mm256_mul_pd(impulse, _mm256_div_pd(set(1), inverse));
  }
  [[gnu::always_inline]] static void gather4(const Real* base, const std::int32_t* ids, int stride,
                                             Vec* out) {
    Vec r[4];
    for (int i = 0; i < 4; ++i) r[i] = load(field_of(base, ids[i], stride));
    transpose(r, out);
  }
  [[gnu::always_inline]] static void scatter8(Real* base, const std::int32_t* ids, int stride,
                                              const Vec* u, const Vec* w) {
    Real nowhere[8];
    Vec low[4], high[4];
    transpose(u, low);
    transpose(w, high);
    for (int i = 0; i < 4; ++i) {
      Real* p = ids[i] < 0 ? nowhere : field_of(base, ids[i], stride);
      store(p, low[i]);
      store(p + 4, high[i]);
    }
  }
};
#else
struct Simd : Avx2Lanes {
  static Mask is_real(const std::int32_t* ids) {
    const __m256i id = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(ids));
    const __m256i fixed = _mm256_cmpeq_epi32(id, _mm256_set1_epi32(rows::kFixedBody));
    return negate_mask(_mm256_castsi256_ps(fixed));
  }
  /// Computed in double and rounded once, as Bullet does.
  static __m128 residual(__m128 impulse, __m128 inverse) {
    const __m256d quotient = _mm256_div_pd(_mm256_set1_pd(1), _mm256_cvtps_pd(inverse));
    return _mm256_cvtpd_ps(_mm256_mul_pd(_mm256_cvtps_pd(impulse), quotient));
  }
  static Vec residual(Vec impulse, Vec inverse) {
    return _mm256_set_m128(
        residual(_mm256_extractf128_ps(impulse, 1), _mm256_extractf128_ps(inverse, 1)),
        residual(_mm256_castps256_ps128(impulse), _mm256_castps256_ps128(inverse)));
  }
  [[gnu::always_inline]] static void gather4(const Real* base, const std::int32_t* ids, int stride,
                                             Vec* out) {
    Vec r[4];
    for (int i = 0; i < 4; ++i) {
      r[i] = _mm256_set_m128(_mm_loadu_ps(field_of(base, ids[i + 4], stride)),
                             _mm_loadu_ps(field_of(base, ids[i], stride)));
    }
    transpose(r, out);
  }
  [[gnu::always_inline]] static void scatter8(Real* base, const std::int32_t* ids, int stride,
                                              const Vec* u, const Vec* w) {
    Real nowhere[8];
    Vec low[4], high[4];
    transpose(u, low);
    transpose(w, high);
    for (int i = 0; i < 4; ++i) {
      Real* p = ids[i] < 0 ? nowhere : field_of(base, ids[i], stride);
      Real* q = ids[i + 4] < 0 ? nowhere : field_of(base, ids[i + 4], stride);
      store(p, _mm256_permute2f128_ps(low[i], high[i], 0x20));
      store(q, _mm256_permute2f128_ps(low[i], high[i], 0x31));
    }
  }
};
#endif

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx

#include "src/contact_solver/sequential_impulse/cpu/row_kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
const RowKernels kAvx2RowKernels = kKernels;
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
