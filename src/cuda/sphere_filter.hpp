/// A cheap test that no touching pair fails: what passes goes through the exact formula.
#pragma once

#include <jfpx/contact.hpp>

#include <limits>

namespace jfpx::inline JFPX_ABI::cuda {

/// Fused multiply-add on host and device, whatever the contraction flags say.
JFPX_HD inline Real fused(Real a, Real b, Real c) {
#if defined(__CUDA_ARCH__)
  return ::fma(a, b, c);
#else
  return std::fma(a, b, c);
#endif
}

/// False only if shared::test_sphere_pair(a, b) says that a and b do not touch. Spheres must be
/// valid (finite, radius > 0).
///
/// Proof. u = epsilon/2 is the unit roundoff, t = 2^-150 (float) half the smallest subnormal. Both
/// tests start from the same differences dx, dy, dz; D is their true sum of squares, s the sum of
/// the radii as both compute it.
///  1. The exact test computes q >= D(1-u)^3 - 3t and touches iff fl(sqrt(q)) <= s, so that
///     q <= s^2 / (1-u)^2 and D <= (s^2 / (1-u)^2 + 3t) / (1-u)^3.
///  2. This test computes d2 <= D(1+u)^3 + 3t <= s^2 (1 + 9u) + 8t for any u <= 2^-24.
///  3. It passes iff d2 <= bound, and bound >= (s^2 (1-u) - t)(1+16u)(1-u) + min(1-u)
///     >= s^2 (1 + 9u) + 8t, because min, the smallest normal number, is 2^24 t or more.
///  4. Overflow: if d2 overflows to infinity then s^2 (1+9u) + 8t exceeds the largest finite
///  number,
///     and the bound, which is larger by 4u s^2, overflows as well; infinity <= infinity passes.
JFPX_HD inline bool may_touch(const SphereInstance& a, const SphereInstance& b) {
  constexpr Real kSlack = 1 + 8 * std::numeric_limits<Real>::epsilon();
  const Real dx = a.centre.x - b.centre.x;
  const Real dy = a.centre.y - b.centre.y;
  const Real dz = a.centre.z - b.centre.z;
  const Real s = a.radius + b.radius;
  const Real d2 = fused(dx, dx, fused(dy, dy, dz * dz));
  return !(d2 > fused(s * s, kSlack, std::numeric_limits<Real>::min()));
}

}  // namespace jfpx::inline JFPX_ABI::cuda
