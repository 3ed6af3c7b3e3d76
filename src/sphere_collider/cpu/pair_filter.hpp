/// Which pairs of a list of sphere pairs may touch: several at a time, with the vectors that every
/// x86-64 processor has.
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
/// One bit a lane: set unless x is greater than y.
inline int not_greater(RealLanes x, RealLanes y) { return _mm_movemask_pd(_mm_cmpngt_pd(x, y)); }
#else
using RealLanes = __m128;
inline RealLanes square_root(RealLanes x) { return _mm_sqrt_ps(x); }
/// One bit a lane: set unless x is greater than y.
inline int not_greater(RealLanes x, RealLanes y) { return _mm_movemask_ps(_mm_cmpngt_ps(x, y)); }
#endif
inline constexpr std::size_t kPairLanes = sizeof(RealLanes) / sizeof(Real);

/// The same sphere, first or second, of as many pairs.
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

/// One bit a pair: set unless the distance of the centres is greater than the sum of the radii.
inline unsigned touching_lanes(const SphereInstance* spheres, const SpherePair* pairs) {
  const SphereLanes a = load_lanes(spheres, pairs, &SpherePair::a);
  const SphereLanes b = load_lanes(spheres, pairs, &SpherePair::b);
  const RealLanes x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return static_cast<unsigned>(
      not_greater(square_root(x * x + y * y + z * z), a.radius + b.radius));
}
static_assert(sizeof(SphereInstance) == 4 * sizeof(Real));

/// Writes the positions in the list, ascending, of all pairs that touch, and of a few more at its
/// end, to `found`, which has room for all. The filter compares the numbers that the exact test
/// compares, each rounded alike. No branch depends on them: in lists in which touching and not
/// touching are mixed nothing could predict it.
/// @return their number
inline std::size_t find_candidates(const SphereInstance* spheres, const SpherePair* pairs,
                                   std::size_t count, std::uint32_t* found) {
  constexpr std::size_t kAhead = 16;  // spheres come from anywhere: ask for them in time
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
