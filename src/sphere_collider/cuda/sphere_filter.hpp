/// Filtered predicates for sphere pairs: cheap tests that never contradict the exact test. Pairs
/// that they cannot decide need the exact formula.
#pragma once

#include "src/collide/sphere_pair.hpp"

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Fused multiply-add on host and device, independent of the compiler's contraction flags.
template <typename T>
JFPX_HD inline T fused(T a, T b, T c) {
#if defined(__CUDA_ARCH__)
  return ::fma(a, b, c);
#else
  return std::fma(a, b, c);
#endif
}

/// Result of closeness() for two spheres.
struct Closeness {
  bool near;     ///< false only if detail::test_sphere_pair() reports that they do not touch
  bool certain;  ///< true only if it reports a contact
};

/// Compares the squared distance of the centres with the squared sum of the radii, with a slack
/// that exceeds all rounding errors. Spheres must be valid (finite, radius > 0).
///
/// Proof. u = epsilon/2 is the unit roundoff, t = 2^-150 (float) is half the smallest subnormal.
/// Both tests start from the same differences dx, dy, dz. D is their true sum of squares, and s is
/// the sum of the radii as both tests compute it.
///  1. The exact test computes q >= D(1-u)^3 - 3t and reports a contact iff fl(sqrt(q)) <= s. Then
///     q <= s^2 / (1-u)^2 and D <= (s^2 / (1-u)^2 + 3t) / (1-u)^3.
///  2. This test computes d2 <= D(1+u)^3 + 3t <= s^2 (1 + 9u) + 8t for any u <= 2^-24.
///  3. It sets `near` iff d2 <= bound, and bound >= (s^2 (1-u) - t)(1+16u)(1-u) + min(1-u)
///     >= s^2 (1 + 9u) + 8t, because min, the smallest normal number, is 2^24 t or more.
///  4. Overflow: if d2 overflows to infinity, s^2 (1+9u) + 8t exceeds the largest finite number.
///     The bound is larger by 4u s^2 and overflows as well; infinity <= infinity passes.
///  5. It sets `certain` iff fl(d2 (1+16u) + min) < fl(s^2), where d2 >= D(1-u)^3 - 3t. Let both
///     sides be finite. Then d2 (1+15u) + min/2 < s^2 (1+u) + t, and the exact test computes
///     q <= D(1+u)^3 + 3t <= d2 (1+7u) + 8t < (s^2 (1+u) + t)(1-7u) - min/4 + 8t < s^2 (1-5u), as
///     min/4 exceeds 9t. So fl(sqrt(q)) <= s (1-2u)(1+u) < s: the spheres touch.
///  6. If fl(s^2) overflows in 5, the left side is finite, hence d2 (1+7u) + 8t, hence q; s^2
///     exceeds all finite numbers, hence sqrt(q) < s and, as rounding is monotone, also
///     fl(sqrt(q)) <= s.
JFPX_HD inline Closeness closeness(const SphereInstance& a, const SphereInstance& b) {
  constexpr Real kSlack = 1 + 8 * std::numeric_limits<Real>::epsilon();
  constexpr Real kLeast = std::numeric_limits<Real>::min();
  const Real dx = a.centre.x - b.centre.x;
  const Real dy = a.centre.y - b.centre.y;
  const Real dz = a.centre.z - b.centre.z;
  const Real s = a.radius + b.radius;
  const Real d2 = fused(dx, dx, fused(dy, dy, dz * dz)), s2 = s * s;
  return {!(d2 > fused(s2, kSlack, kLeast)), fused(d2, kSlack, kLeast) < s2};
}

/// Equals detail::test_sphere_pair(a, b).touching for valid spheres, but rarely computes a square
/// root.
JFPX_HD inline bool touch(const SphereInstance& a, const SphereInstance& b) {
  const Closeness c = closeness(a, b);
  return c.near && (c.certain || detail::test_sphere_pair(a, b).touching != 0);
}

/// Approximates the squared distance of the centres minus the squared sum of the radii, with half
/// the instructions of closeness(). Let e = excess(a, b) and d = error_bound_of(S), where S is at
/// least the computed sum of the radii: spheres that touch have !(e > d), and spheres with e < -d
/// touch. Spheres must be valid.
///
/// Proof, with u, t, D and s as above and p = fl(s^2), so that |p - s^2| <= u s^2 + t.
///  1. If they touch, D <= s^2 (1+9u) + 8t. Each of the three sums is rounded from a number between
///     -p and D (1+3u) + 3t, whose magnitude is at most s^2 (1+13u) + 12t. So all errors together
///     are at most 4.1u s^2 + 5t, and e <= 13.1u s^2 + 13t.
///  2. If e < 0, the sums before it are negative too, as each addition adds a square. As rounding
///     is monotone, none is less than -p, and all errors together are at most 4.1u s^2 + 5t. If
///     e < -d then D < s^2 - d + 4.1u s^2 + 5t. But spheres that do not touch have fl(sqrt(q)) > s,
///     hence q >= s^2 (1-2u), with q <= D (1+u)^3 + 3t: D >= s^2 (1-6u) - 4t.
///  3. d >= 18u S^2 (1-u)^3 - 18u t + min (1-u) >= 16u s^2 + 2^23 t, which is more than 1 and 2
///     require.
///  4. Overflow: if S^2 overflows, d is infinite, so that no pair is excluded and no pair is
///     certain, even if e is NaN. Otherwise p is finite; where a sum overflows, D exceeds p by far
///     more than it can for touching spheres, and e is infinite.
JFPX_HD inline Real excess(const SphereInstance& a, const SphereInstance& b) {
  const Real dx = a.centre.x - b.centre.x;
  const Real dy = a.centre.y - b.centre.y;
  const Real dz = a.centre.z - b.centre.z;
  const Real s = a.radius + b.radius;
  return fused(dx, dx, fused(dy, dy, fused(dz, dz, -(s * s))));
}
/// The bound d of excess() for pairs whose sum of radii is at most `largest_sum`.
JFPX_HD inline Real error_bound_of(Real largest_sum) {
  constexpr Real kSlack = 9 * std::numeric_limits<Real>::epsilon();
  return fused(largest_sum * largest_sum, kSlack, std::numeric_limits<Real>::min());
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
