/// Kernels of the row solver for AVX2.
#include "src/contact_solver/cpu/row_kernels.hpp"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// The first field of body `id`. The id of a body that no row moves is its complement.
template <class T>
T* field_of(T* base, std::int32_t id, int stride) {
  return base + std::ptrdiff_t{id ^ (id >> 31)} * stride;
}

#if defined(JFPX_DOUBLE_PRECISION)
struct Simd {
  static constexpr int kLanes = 4;
  using Vec = __m256d;
  using Mask = __m256d;
  using Id = std::int32_t;
  static Vec set(Real v) { return _mm256_set1_pd(v); }
  static Vec load(const Real* p) { return _mm256_loadu_pd(p); }
  static void store(Real* p, Vec v) { _mm256_storeu_pd(p, v); }
  static Vec negate(Vec v) { return _mm256_xor_pd(v, set(-0.0)); }
  static Vec absolute(Vec v) { return _mm256_andnot_pd(set(-0.0), v); }
  static Vec square_root(Vec v) { return _mm256_sqrt_pd(v); }
  static Vec select(Mask m, Vec a, Vec b) { return _mm256_blendv_pd(b, a, m); }
  static Vec keep(Mask m, Vec v) { return _mm256_and_pd(m, v); }
  static Mask less(Vec a, Vec b) { return _mm256_cmp_pd(a, b, _CMP_LT_OQ); }
  static Mask less_equal(Vec a, Vec b) { return _mm256_cmp_pd(a, b, _CMP_LE_OQ); }
  static Mask differs(Vec a, Vec b) { return _mm256_cmp_pd(a, b, _CMP_NEQ_UQ); }
  static Mask unordered(Vec v) { return _mm256_cmp_pd(v, v, _CMP_UNORD_Q); }
  static Mask both(Mask a, Mask b) { return _mm256_and_pd(a, b); }
  static Mask either(Mask a, Mask b) { return _mm256_or_pd(a, b); }
  static Mask negate_mask(Mask m) { return _mm256_xor_pd(m, always()); }
  static Mask always() { return _mm256_castsi256_pd(_mm256_set1_epi32(-1)); }
  static Mask never() { return _mm256_setzero_pd(); }
  static bool any(Mask m) { return _mm256_movemask_pd(m) != 0; }
  static unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_pd(m)); }
  static Mask is_real(const std::int32_t* ids) {
    const __m128i id = _mm_loadu_si128(reinterpret_cast<const __m128i*>(ids));
    const __m128i fixed = _mm_cmpeq_epi32(id, _mm_set1_epi32(rows::kFixedBody));
    return negate_mask(_mm256_castsi256_pd(_mm256_cvtepi32_epi64(fixed)));
  }
  static Vec residual(Vec impulse, Vec inverse) {
    return _mm256_mul_pd(impulse, _mm256_div_pd(set(1), inverse));
  }
  static void transpose(const Vec* r, Vec* out) {
    const Vec t0 = _mm256_unpacklo_pd(r[0], r[1]), t1 = _mm256_unpackhi_pd(r[0], r[1]);
    const Vec t2 = _mm256_unpacklo_pd(r[2], r[3]), t3 = _mm256_unpackhi_pd(r[2], r[3]);
    out[0] = _mm256_permute2f128_pd(t0, t2, 0x20);
    out[1] = _mm256_permute2f128_pd(t1, t3, 0x20);
    out[2] = _mm256_permute2f128_pd(t0, t2, 0x31);
    out[3] = _mm256_permute2f128_pd(t1, t3, 0x31);
  }
  static void gather4(const Real* base, const std::int32_t* ids, int stride, Vec* out) {
    Vec r[4];
    for (int i = 0; i < 4; ++i) r[i] = load(field_of(base, ids[i], stride));
    transpose(r, out);
  }
  static void scatter8(Real* base, const std::int32_t* ids, int stride, const Vec* u,
                       const Vec* w) {
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
struct Simd {
  static constexpr int kLanes = 8;
  using Vec = __m256;
  using Mask = __m256;
  using Id = std::int32_t;
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static void store(Real* p, Vec v) { _mm256_storeu_ps(p, v); }
  static Vec negate(Vec v) { return _mm256_xor_ps(v, set(-0.0f)); }
  static Vec absolute(Vec v) { return _mm256_andnot_ps(set(-0.0f), v); }
  static Vec square_root(Vec v) { return _mm256_sqrt_ps(v); }
  static Vec select(Mask m, Vec a, Vec b) { return _mm256_blendv_ps(b, a, m); }
  static Vec keep(Mask m, Vec v) { return _mm256_and_ps(m, v); }
  static Mask less(Vec a, Vec b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
  static Mask less_equal(Vec a, Vec b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
  static Mask differs(Vec a, Vec b) { return _mm256_cmp_ps(a, b, _CMP_NEQ_UQ); }
  static Mask unordered(Vec v) { return _mm256_cmp_ps(v, v, _CMP_UNORD_Q); }
  static Mask both(Mask a, Mask b) { return _mm256_and_ps(a, b); }
  static Mask either(Mask a, Mask b) { return _mm256_or_ps(a, b); }
  static Mask negate_mask(Mask m) { return _mm256_xor_ps(m, always()); }
  static Mask always() { return _mm256_castsi256_ps(_mm256_set1_epi32(-1)); }
  static Mask never() { return _mm256_setzero_ps(); }
  static bool any(Mask m) { return _mm256_movemask_ps(m) != 0; }
  static unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_ps(m)); }
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
  /// Transposes four vectors of x y z w, in each half, to one vector each of x, y, z and w.
  static void transpose(const Vec* r, Vec* out) {
    const Vec t0 = _mm256_unpacklo_ps(r[0], r[1]), t1 = _mm256_unpackhi_ps(r[0], r[1]);
    const Vec t2 = _mm256_unpacklo_ps(r[2], r[3]), t3 = _mm256_unpackhi_ps(r[2], r[3]);
    out[0] = _mm256_shuffle_ps(t0, t2, 0x44);
    out[1] = _mm256_shuffle_ps(t0, t2, 0xEE);
    out[2] = _mm256_shuffle_ps(t1, t3, 0x44);
    out[3] = _mm256_shuffle_ps(t1, t3, 0xEE);
  }
  static void gather4(const Real* base, const std::int32_t* ids, int stride, Vec* out) {
    Vec r[4];
    for (int i = 0; i < 4; ++i) {
      r[i] = _mm256_set_m128(_mm_loadu_ps(field_of(base, ids[i + 4], stride)),
                             _mm_loadu_ps(field_of(base, ids[i], stride)));
    }
    transpose(r, out);
  }
  static void scatter8(Real* base, const std::int32_t* ids, int stride, const Vec* u,
                       const Vec* w) {
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

#include "src/contact_solver/cpu/row_kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
const RowKernels kAvx2RowKernels = kKernels;
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
