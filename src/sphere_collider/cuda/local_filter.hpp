/// Filtered predicate for close spheres, relative to a common origin, in float for both precisions.
/// The squared distance of two points is |p|^2 + |q|^2 - 2 p*q. The squares are computed once per
/// sphere, so that a pair takes three fused multiply-adds and a subtraction.
#pragma once

#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// A sphere whose neighbors are searched.
struct LocalQuery {
  float x, y, z;  ///< -2 p, where p is the centre relative to the origin
  float limit;    ///< S^2 - |p|^2 plus a slack, where S is the largest sum of the radii
  float doubt;    ///< largest depth of pairs that are not certain
};
/// A sphere that may touch the query.
struct alignas(16) LocalCandidate {
  float x, y, z;  ///< its centre q, relative to the origin
  float square;   ///< |q|^2, minus a slack; infinite if there is no sphere
};

/// Bounds of half a cell width within which no square overflows and underflows are negligible, if
/// coordinates are within 2^31 cells. CrowdedSearcher also depends on the lower bound (kMaxRows).
inline constexpr Real kLeastLocalHalf = Real(0x1p-20), kLargestLocalHalf = Real(0x1p+20);

/// Relative slack, 24 u: see the proof.
inline constexpr float kLocalSlack = 24 * 0x1p-24f;

JFPX_HD inline float squared_norm(float x, float y, float z) {
  return fused(x, x, fused(y, y, z * z));
}

JFPX_HD inline LocalCandidate local_candidate(const Vec3& centre, const Vec3& origin) {
  const auto x = static_cast<float>(centre.x - origin.x),
             y = static_cast<float>(centre.y - origin.y),
             z = static_cast<float>(centre.z - origin.z);
  return {x, y, z, squared_norm(x, y, z) * (1 - kLocalSlack)};
}

/// @param largest_radius of all spheres
JFPX_HD inline LocalQuery local_query(const SphereInstance& s, Real largest_radius,
                                      const Vec3& origin) {
  const LocalCandidate p = local_candidate(s.centre, origin);
  const auto sum = static_cast<float>(s.radius + largest_radius);
  return {-2 * p.x, -2 * p.y, -2 * p.z, fused(sum * sum, 1 + kLocalSlack, -p.square),
          7 * kLocalSlack * fused(sum, sum, p.square)};
}

/// Approximates S^2 minus the squared distance of the centres, where S is the sum of the radii if
/// the candidate has the largest one. Let d be the result: spheres that touch have d > 0. If the
/// candidate has the largest radius, spheres with d > doubt touch. The largest radius must be
/// within kLeastLocalHalf and kLargestLocalHalf.
///
/// Proof. u = 2^-24. Underflows are less than 2^-50 S^2 and are contained in the slack.
///  1. A component of p and q is rounded at most twice, with an error of at most 1.01u of its
///     magnitude. Hence the computed vectors have a squared distance that differs from the true
///     one, D, by at most 1.01u (|p| + |q|) 2.01 (|p| + |q|) <= 4.1u (|p|^2 + |q|^2).
///  2. The three additions start at |q|^2 and add terms of at most 2 |p| |q| in all: their errors
///     are at most 3.1u (2 |q|^2 + |p|^2). Those of `square` are at most 4u |q|^2, those of `limit`
///     5u |p|^2 + 8u S^2. The last subtraction rounds, but keeps the sign.
///  3. The sum is at most 14.3u |q|^2 + 12.2u |p|^2 + 8u S^2. The slack is 24u of each square. The
///     exact test rounds the differences of the coordinates, which changes D by at most 2.1u of it,
///     so that sphere_filter.hpp proves D <= S^2 (1+11.2u) for spheres that touch. So d > 0.
///  4. Let d > 0. Slack and errors together are E <= 48u (|p|^2 + |q|^2 + S^2), and D <= S^2 + E.
///     With |q|^2 <= 2 |p|^2 + 2 D follows |q|^2 <= 2.01 (|p|^2 + S^2), hence
///     E <= 145u (|p|^2 + S^2). `doubt` is at least 167u (|p|^2 + S^2). If d > doubt then
///     D < S^2 (1-22u), but spheres that do not touch have D >= S^2 (1-8.2u).
JFPX_HD inline float local_depth(const LocalQuery& p, const LocalCandidate& q) {
  return p.limit - fused(p.x, q.x, fused(p.y, q.y, fused(p.z, q.z, q.square)));
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
