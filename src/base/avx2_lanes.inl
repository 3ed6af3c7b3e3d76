/// Vectors of AVX2 for the kernels of this folder.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {  // see src/sphere_collider/cpu/kernels.hpp for the reason

#if defined(JFPX_DOUBLE_PRECISION)
struct Avx2Lanes {
  static constexpr int kLanes = 4;
  using Vec = __m256d;
  using Mask = __m256d;
  using Id = std::int32_t;
  static Vec set(Real v) { return _mm256_set1_pd(v); }
  static Vec load(const Real* p) { return _mm256_loadu_pd(p); }
  static void store(Real* p, Vec v) { _mm256_storeu_pd(p, v); }
  static Vec negate(Vec v) { return _mm256_xor_pd(v, set(-0.0)); }
  static Vec absolute(Vec v) { return _mm256_andnot_pd(set(-0.0), v); }
  static Vec zero_with_sign_of(Vec v) { return _mm256_and_pd(set(-0.0), v); }
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
  static Mask mask_of(unsigned bits) {
    const __m256i lane = _mm256_setr_epi64x(1, 2, 4, 8);
    const __m256i of_lane = _mm256_and_si256(_mm256_set1_epi64x(static_cast<int>(bits)), lane);
    return _mm256_castsi256_pd(_mm256_cmpeq_epi64(of_lane, lane));
  }
  static bool any(Mask m) { return _mm256_movemask_pd(m) != 0; }
  static unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_pd(m)); }
  static void transpose(const Vec* r, Vec* out) {
    const Vec t0 = _mm256_unpacklo_pd(r[0], r[1]), t1 = _mm256_unpackhi_pd(r[0], r[1]);
    const Vec t2 = _mm256_unpacklo_pd(r[2], r[3]), t3 = _mm256_unpackhi_pd(r[2], r[3]);
    out[0] = _mm256_permute2f128_pd(t0, t2, 0x20);
    out[1] = _mm256_permute2f128_pd(t1, t3, 0x20);
    out[2] = _mm256_permute2f128_pd(t0, t2, 0x31);
    out[3] = _mm256_permute2f128_pd(t1, t3, 0x31);
  }
};
#else
struct Avx2Lanes {
  static constexpr int kLanes = 8;
  using Vec = __m256;
  using Mask = __m256;
  using Id = std::int32_t;
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static Vec load(const Real* p) { return _mm256_loadu_ps(p); }
  static void store(Real* p, Vec v) { _mm256_storeu_ps(p, v); }
  static Vec negate(Vec v) { return _mm256_xor_ps(v, set(-0.0f)); }
  static Vec absolute(Vec v) { return _mm256_andnot_ps(set(-0.0f), v); }
  static Vec zero_with_sign_of(Vec v) { return _mm256_and_ps(set(-0.0f), v); }
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
  static Mask mask_of(unsigned bits) {
    const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i of_lane = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), lane);
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32(of_lane, lane));
  }
  static bool any(Mask m) { return _mm256_movemask_ps(m) != 0; }
  static unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_ps(m)); }
  /// Transposes four vectors of x y z w, in each half, to one vector each of x, y, z and w.
  static void transpose(const Vec* r, Vec* out) {
    const Vec t0 = _mm256_unpacklo_ps(r[0], r[1]), t1 = _mm256_unpackhi_ps(r[0], r[1]);
    const Vec t2 = _mm256_unpacklo_ps(r[2], r[3]), t3 = _mm256_unpackhi_ps(r[2], r[3]);
    out[0] = _mm256_shuffle_ps(t0, t2, 0x44);
    out[1] = _mm256_shuffle_ps(t0, t2, 0xEE);
    out[2] = _mm256_shuffle_ps(t1, t3, 0x44);
    out[3] = _mm256_shuffle_ps(t1, t3, 0xEE);
  }
};
#endif

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
