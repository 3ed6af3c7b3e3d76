/// Vectors of 128 bits in the baseline instruction set of the architecture: SSE2 on x86-64, NEON on
/// ARM64.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>

#if defined(__x86_64__)
#include <emmintrin.h>
#else
#include <arm_neon.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

// RealLanes has the operators + - * of Real. LaneMask has all bits of a lane set or none.
#if defined(__x86_64__) && defined(JFPX_DOUBLE_PRECISION)
using RealLanes = __m128d;
using LaneMask = __m128d;
inline RealLanes load_lanes(const Real* p) { return _mm_loadu_pd(p); }
inline void store_lanes(Real* p, RealLanes v) { _mm_storeu_pd(p, v); }
inline RealLanes set_lanes(Real v) { return _mm_set1_pd(v); }
inline RealLanes square_root(RealLanes x) { return _mm_sqrt_pd(x); }
inline LaneMask not_greater(RealLanes x, RealLanes y) { return _mm_cmpngt_pd(x, y); }
inline LaneMask less_equal(RealLanes x, RealLanes y) { return _mm_cmple_pd(x, y); }
inline LaneMask both(LaneMask x, LaneMask y) { return _mm_and_pd(x, y); }
/// One bit per lane.
inline unsigned bits(LaneMask mask) { return static_cast<unsigned>(_mm_movemask_pd(mask)); }
#elif defined(__x86_64__)
using RealLanes = __m128;
using LaneMask = __m128;
inline RealLanes load_lanes(const Real* p) { return _mm_loadu_ps(p); }
inline void store_lanes(Real* p, RealLanes v) { _mm_storeu_ps(p, v); }
inline RealLanes set_lanes(Real v) { return _mm_set1_ps(v); }
inline RealLanes square_root(RealLanes x) { return _mm_sqrt_ps(x); }
inline LaneMask not_greater(RealLanes x, RealLanes y) { return _mm_cmpngt_ps(x, y); }
inline LaneMask less_equal(RealLanes x, RealLanes y) { return _mm_cmple_ps(x, y); }
inline LaneMask both(LaneMask x, LaneMask y) { return _mm_and_ps(x, y); }
/// One bit per lane.
inline unsigned bits(LaneMask mask) { return static_cast<unsigned>(_mm_movemask_ps(mask)); }
#elif defined(JFPX_DOUBLE_PRECISION)
using RealLanes = float64x2_t;
using LaneMask = uint64x2_t;
inline RealLanes load_lanes(const Real* p) { return vld1q_f64(p); }
inline void store_lanes(Real* p, RealLanes v) { vst1q_f64(p, v); }
inline RealLanes set_lanes(Real v) { return vdupq_n_f64(v); }
inline RealLanes square_root(RealLanes x) { return vsqrtq_f64(x); }
inline LaneMask not_greater(RealLanes x, RealLanes y) {
  return vreinterpretq_u64_u32(vmvnq_u32(vreinterpretq_u32_u64(vcgtq_f64(x, y))));
}
inline LaneMask less_equal(RealLanes x, RealLanes y) { return vcleq_f64(x, y); }
inline LaneMask both(LaneMask x, LaneMask y) { return vandq_u64(x, y); }
/// One bit per lane.
inline unsigned bits(LaneMask mask) {
  constexpr uint64x2_t kBits = {1, 2};
  return static_cast<unsigned>(vaddvq_u64(vandq_u64(mask, kBits)));
}
#else
using RealLanes = float32x4_t;
using LaneMask = uint32x4_t;
inline RealLanes load_lanes(const Real* p) { return vld1q_f32(p); }
inline void store_lanes(Real* p, RealLanes v) { vst1q_f32(p, v); }
inline RealLanes set_lanes(Real v) { return vdupq_n_f32(v); }
inline RealLanes square_root(RealLanes x) { return vsqrtq_f32(x); }
inline LaneMask not_greater(RealLanes x, RealLanes y) { return vmvnq_u32(vcgtq_f32(x, y)); }
inline LaneMask less_equal(RealLanes x, RealLanes y) { return vcleq_f32(x, y); }
inline LaneMask both(LaneMask x, LaneMask y) { return vandq_u32(x, y); }
/// One bit per lane.
inline unsigned bits(LaneMask mask) {
  constexpr uint32x4_t kBits = {1, 2, 4, 8};
  return vaddvq_u32(vandq_u32(mask, kBits));
}
#endif
inline constexpr std::size_t kRealLanes = sizeof(RealLanes) / sizeof(Real);

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
