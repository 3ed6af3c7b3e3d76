/// Kernels for rows of two spheres, for AVX2.
#include "src/contact_solver/cpu/sphere_sweep.inl"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

#if defined(JFPX_DOUBLE_PRECISION)
struct Avx2 {
  static constexpr unsigned kLanes = 4;
  using Vec = __m256d;
  using Mask = __m256d;
  static Vec set(Real v) { return _mm256_set1_pd(v); }
  static Vec negate(Vec v) { return _mm256_xor_pd(v, set(-0.0)); }
  static Vec square_root(Vec v) { return _mm256_sqrt_pd(v); }
  static Vec select(Mask mask, Vec a, Vec b) { return _mm256_blendv_pd(b, a, mask); }
  static Mask less(Vec a, Vec b) { return _mm256_cmp_pd(a, b, _CMP_LT_OQ); }
  static Mask less_equal(Vec a, Vec b) { return _mm256_cmp_pd(a, b, _CMP_LE_OQ); }
  static unsigned bits(Mask mask) { return static_cast<unsigned>(_mm256_movemask_pd(mask)); }

  static void transpose(const Vec* r, Vec* out) {
    const Vec t0 = _mm256_unpacklo_pd(r[0], r[1]), t1 = _mm256_unpackhi_pd(r[0], r[1]);
    const Vec t2 = _mm256_unpacklo_pd(r[2], r[3]), t3 = _mm256_unpackhi_pd(r[2], r[3]);
    out[0] = _mm256_permute2f128_pd(t0, t2, 0x20);
    out[1] = _mm256_permute2f128_pd(t1, t3, 0x20);
    out[2] = _mm256_permute2f128_pd(t0, t2, 0x31);
    out[3] = _mm256_permute2f128_pd(t1, t3, 0x31);
  }
  static void load_quads(const Real* base, const std::uint32_t* items, Vec* columns) {
    Vec rows[4];
    for (int k = 0; k < 4; ++k) rows[k] = _mm256_loadu_pd(base + items[k] * kSweepStride);
    transpose(rows, columns);
  }
  static void store_quads(Real* base, const std::uint32_t* items, const Vec* columns,
                          unsigned lanes) {
    Vec rows[4];
    transpose(columns, rows);
    for (int k = 0; k < 4; ++k) {
      if ((lanes >> k & 1) != 0) _mm256_storeu_pd(base + items[k] * kSweepStride, rows[k]);
    }
  }
  static Vec load_column(const Real* base, const std::uint32_t* items) {
    return _mm256_set_pd(base[items[3] * kSweepStride], base[items[2] * kSweepStride],
                         base[items[1] * kSweepStride], base[items[0] * kSweepStride]);
  }
};
#else
struct Avx2 {
  static constexpr unsigned kLanes = 8;
  using Vec = __m256;
  using Mask = __m256;
  static Vec set(Real v) { return _mm256_set1_ps(v); }
  static Vec negate(Vec v) { return _mm256_xor_ps(v, set(-0.0f)); }
  static Vec square_root(Vec v) { return _mm256_sqrt_ps(v); }
  static Vec select(Mask mask, Vec a, Vec b) { return _mm256_blendv_ps(b, a, mask); }
  static Mask less(Vec a, Vec b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
  static Mask less_equal(Vec a, Vec b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
  static unsigned bits(Mask mask) { return static_cast<unsigned>(_mm256_movemask_ps(mask)); }

  /// Transposes both halves of four vectors.
  static void transpose(const Vec* r, Vec* out) {
    const __m256d t0 = _mm256_castps_pd(_mm256_unpacklo_ps(r[0], r[1]));
    const __m256d t1 = _mm256_castps_pd(_mm256_unpackhi_ps(r[0], r[1]));
    const __m256d t2 = _mm256_castps_pd(_mm256_unpacklo_ps(r[2], r[3]));
    const __m256d t3 = _mm256_castps_pd(_mm256_unpackhi_ps(r[2], r[3]));
    out[0] = _mm256_castpd_ps(_mm256_unpacklo_pd(t0, t2));
    out[1] = _mm256_castpd_ps(_mm256_unpackhi_pd(t0, t2));
    out[2] = _mm256_castpd_ps(_mm256_unpacklo_pd(t1, t3));
    out[3] = _mm256_castpd_ps(_mm256_unpackhi_pd(t1, t3));
  }
  static void load_quads(const Real* base, const std::uint32_t* items, Vec* columns) {
    Vec rows[4];
    for (int k = 0; k < 4; ++k) {
      rows[k] =
          _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(base + items[k] * kSweepStride)),
                               _mm_loadu_ps(base + items[k + 4] * kSweepStride), 1);
    }
    transpose(rows, columns);
  }
  static void store_quads(Real* base, const std::uint32_t* items, const Vec* columns,
                          unsigned lanes) {
    Vec rows[4];
    transpose(columns, rows);
    for (int k = 0; k < 4; ++k) {
      if ((lanes >> k & 1) != 0) {
        _mm_storeu_ps(base + items[k] * kSweepStride, _mm256_castps256_ps128(rows[k]));
      }
      if ((lanes >> (k + 4) & 1) != 0) {
        _mm_storeu_ps(base + items[k + 4] * kSweepStride, _mm256_extractf128_ps(rows[k], 1));
      }
    }
  }
  static Vec load_column(const Real* base, const std::uint32_t* items) {
    Real values[8];
    for (int k = 0; k < 8; ++k) values[k] = base[items[k] * kSweepStride];
    return _mm256_loadu_ps(values);
  }
};
#endif

}  // namespace

constinit const SphereSweepKernels kAvx2SphereSweep = {warm_start<Avx2>,
                                                       {solve<Avx2, false>, solve<Avx2, true>}};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
