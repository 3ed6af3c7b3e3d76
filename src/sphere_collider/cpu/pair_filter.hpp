/// Vector filter for lists of sphere pairs, with the SSE2 instructions that every x86-64 processor
/// supports.
#pragma once

#include <jfpx/contact.hpp>

#include <cstddef>
#include <cstdint>
#include <emmintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

#if defined(JFPX_DOUBLE_PRECISION)
using RealLanes = __m128d;
inline RealLanes square_root(RealLanes x) { return _mm_sqrt_pd(x); }
/// Returns one bit per lane: set unless x > y.
inline int not_greater(RealLanes x, RealLanes y) { return _mm_movemask_pd(_mm_cmpngt_pd(x, y)); }
#else
using RealLanes = __m128;
inline RealLanes square_root(RealLanes x) { return _mm_sqrt_ps(x); }
/// Returns one bit per lane: set unless x > y.
inline int not_greater(RealLanes x, RealLanes y) { return _mm_movemask_ps(_mm_cmpngt_ps(x, y)); }
#endif
inline constexpr std::size_t kPairLanes = sizeof(RealLanes) / sizeof(Real);

/// The first or the second spheres of kPairLanes pairs.
struct SphereLanes {
  RealLanes x, y, z, radius;
};
inline SphereLanes load_lanes(const SphereInstance* spheres, const SpherePair* pairs,
                              SphereIndex SpherePair::*which) {
  const auto real = [&](std::size_t i) { return &spheres[pairs[i].*which].centre.x; };
#if defined(JFPX_DOUBLE_PRECISION)
  const RealLanes xy0 = _mm_loadu_pd(real(0)), zr0 = _mm_loadu_pd(real(0) + 2);
  const RealLanes xy1 = _mm_loadu_pd(real(1)), zr1 = _mm_loadu_pd(real(1) + 2);
  return {_mm_unpacklo_pd(xy0, xy1), _mm_unpackhi_pd(xy0, xy1), _mm_unpacklo_pd(zr0, zr1),
          _mm_unpackhi_pd(zr0, zr1)};
#else
  SphereLanes s{_mm_loadu_ps(real(0)), _mm_loadu_ps(real(1)), _mm_loadu_ps(real(2)),
                _mm_loadu_ps(real(3))};
  _MM_TRANSPOSE4_PS(s.x, s.y, s.z, s.radius);
  return s;
#endif
}

/// Returns one bit per pair: set unless the distance of the centres exceeds the sum of the radii.
inline unsigned touching_lanes(const SphereInstance* spheres, const SpherePair* pairs) {
  const SphereLanes a = load_lanes(spheres, pairs, &SpherePair::a);
  const SphereLanes b = load_lanes(spheres, pairs, &SpherePair::b);
  const RealLanes x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return static_cast<unsigned>(
      not_greater(square_root(x * x + y * y + z * z), a.radius + b.radius));
}
static_assert(sizeof(SphereInstance) == 4 * sizeof(Real));

/// Writes the ascending indices of all pairs that touch, and of a few more at the end of the list,
/// to `found`, which must have room for `count` indices. The filter compares the same values as the
/// exact test, with the same roundings. It does not branch on the result, which is unpredictable in
/// lists that mix pairs that touch with pairs that do not.
/// @return the number of indices
inline std::size_t find_candidates(const SphereInstance* spheres, const SpherePair* pairs,
                                   std::size_t count, std::uint32_t* found) {
  constexpr std::size_t kAhead = 16;  // prefetch distance: accesses to spheres are random
  std::size_t kept = 0, i = 0;
  for (; i + kPairLanes <= count; i += kPairLanes) {
    if (i + kAhead + kPairLanes <= count) {
      for (std::size_t k = i + kAhead; k < i + kAhead + kPairLanes; ++k) {
        __builtin_prefetch(&spheres[pairs[k].a]);
        __builtin_prefetch(&spheres[pairs[k].b]);
      }
    }
    const unsigned mask = touching_lanes(spheres, pairs + i);
    for (std::size_t k = 0; k < kPairLanes; ++k) {
      found[kept] = static_cast<std::uint32_t>(i + k);
      kept += mask >> k & 1;
    }
  }
  for (; i < count; ++i) found[kept++] = static_cast<std::uint32_t>(i);
  return kept;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
