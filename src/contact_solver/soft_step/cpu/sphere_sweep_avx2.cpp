/// Kernels for rows of two spheres, for AVX2.
#include "src/contact_solver/avx2_lanes.inl"
#include "src/contact_solver/soft_step/cpu/sphere_sweep.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

#if defined(JFPX_DOUBLE_PRECISION)
struct Avx2 : Avx2Lanes {
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
struct Avx2 : Avx2Lanes {
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
