/// Kernels of hulls, for AVX2.
#include "src/base/avx2_lanes.inl"
#include "src/collide/cpu/hull_kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

#if defined(JFPX_DOUBLE_PRECISION)
struct Avx2 : Avx2Lanes {
  using Avx2Lanes::square_root;
  static Real square_root(Real x) {
    return _mm_cvtsd_f64(_mm_sqrt_sd(_mm_set_sd(x), _mm_set_sd(x)));
  }
  static Vec larger(Vec a, Vec b) { return _mm256_max_pd(a, b); }
  static Real largest(Vec v) {
    const __m128d pair = _mm_max_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd(v, 1));
    return _mm_cvtsd_f64(_mm_max_sd(pair, _mm_unpackhi_pd(pair, pair)));
  }
  using Words = __m128i;
  static Words load_words(const std::uint32_t* p) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
  }
  template <int k>
  static Words get_byte(Words w) {
    return _mm_and_si128(_mm_srli_epi32(w, 8 * k), _mm_set1_epi32(255));
  }
  static Vec gather(const Real* base, Words w) {
    return _mm256_mask_i32gather_pd(set(0), base, w, always(), sizeof(Real));
  }
};
#else
struct Avx2 : Avx2Lanes {
  using Avx2Lanes::square_root;
  static Real square_root(Real x) { return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))); }
  static Vec larger(Vec a, Vec b) { return _mm256_max_ps(a, b); }
  static Real largest(Vec v) {
    const __m128 four = _mm_max_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
    const __m128 two = _mm_max_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  using Words = __m256i;
  static Words load_words(const std::uint32_t* p) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
  }
  template <int k>
  static Words get_byte(Words w) {
    return _mm256_and_si256(_mm256_srli_epi32(w, 8 * k), _mm256_set1_epi32(255));
  }
  static Vec gather(const Real* base, Words w) {
    return _mm256_mask_i32gather_ps(set(0), base, w, always(), sizeof(Real));
  }
};
#endif
static_assert(Avx2::kLanes == kHullLanes);

}  // namespace

constinit const HullKernels kAvx2HullKernels = {test_axes<Avx2>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
