/// Which pairs of a list of sphere pairs may touch: several at a time, with the vectors that every
/// x86-64 processor has.
#pragma once

#include <jfpx/contact.hpp>

#include <cstddef>
#include <cstdint>
#include <emmintrin.h>

namespace jfpx::inline JFPX_ABI::x86 {

#if defined(JFPX_DOUBLE_PRECISION)
inline constexpr std::size_t kPairLanes = 2;

struct SphereLanes {
  SphereLanes(const SphereInstance& s, const SphereInstance& t) {
    const __m128d xy0 = _mm_loadu_pd(&s.centre.x), zr0 = _mm_loadu_pd(&s.centre.z);
    const __m128d xy1 = _mm_loadu_pd(&t.centre.x), zr1 = _mm_loadu_pd(&t.centre.z);
    x = _mm_unpacklo_pd(xy0, xy1);
    y = _mm_unpackhi_pd(xy0, xy1);
    z = _mm_unpacklo_pd(zr0, zr1);
    radius = _mm_unpackhi_pd(zr0, zr1);
  }
  __m128d x, y, z, radius;
};

/// One bit a pair: set unless the distance of the centres is greater than the sum of the radii.
inline unsigned touching_lanes(const SphereInstance* spheres, const SpherePair* pairs) {
  const SphereLanes a(spheres[pairs[0].a], spheres[pairs[1].a]);
  const SphereLanes b(spheres[pairs[0].b], spheres[pairs[1].b]);
  const __m128d x = _mm_sub_pd(a.x, b.x), y = _mm_sub_pd(a.y, b.y), z = _mm_sub_pd(a.z, b.z);
  const __m128d square =
      _mm_add_pd(_mm_add_pd(_mm_mul_pd(x, x), _mm_mul_pd(y, y)), _mm_mul_pd(z, z));
  const __m128d sum = _mm_add_pd(a.radius, b.radius);
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmpngt_pd(_mm_sqrt_pd(square), sum)));
}
#else
inline constexpr std::size_t kPairLanes = 4;

struct SphereLanes {
  SphereLanes(const SphereInstance& s, const SphereInstance& t, const SphereInstance& u,
              const SphereInstance& v)
      : x(_mm_loadu_ps(&s.centre.x)),
        y(_mm_loadu_ps(&t.centre.x)),
        z(_mm_loadu_ps(&u.centre.x)),
        radius(_mm_loadu_ps(&v.centre.x)) {
    _MM_TRANSPOSE4_PS(x, y, z, radius);
  }
  __m128 x, y, z, radius;
};

/// One bit a pair: set unless the distance of the centres is greater than the sum of the radii.
inline unsigned touching_lanes(const SphereInstance* spheres, const SpherePair* pairs) {
  const SphereLanes a(spheres[pairs[0].a], spheres[pairs[1].a], spheres[pairs[2].a],
                      spheres[pairs[3].a]);
  const SphereLanes b(spheres[pairs[0].b], spheres[pairs[1].b], spheres[pairs[2].b],
                      spheres[pairs[3].b]);
  const __m128 x = _mm_sub_ps(a.x, b.x), y = _mm_sub_ps(a.y, b.y), z = _mm_sub_ps(a.z, b.z);
  const __m128 square =
      _mm_add_ps(_mm_add_ps(_mm_mul_ps(x, x), _mm_mul_ps(y, y)), _mm_mul_ps(z, z));
  const __m128 sum = _mm_add_ps(a.radius, b.radius);
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmpngt_ps(_mm_sqrt_ps(square), sum)));
}
#endif
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

}  // namespace jfpx::inline JFPX_ABI::x86
