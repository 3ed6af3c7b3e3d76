/// Between two steps: what is drawn lies there, because pictures and steps have clocks of their
/// own.
#pragma once

#include <jfpx/body.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

inline Vec3 between(const Vec3& a, const Vec3& b, Real share) { return a + (b - a) * share; }

/// Along the shorter way, of nearly constant speed for the small turns of a step.
inline Quat between(const Quat& a, const Quat& b, Real share) {
  const Real way = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0 ? -share : share;
  const Real rest = 1 - share;
  return normalized(Quat{a.w * rest + b.w * way, a.x * rest + b.x * way, a.y * rest + b.y * way,
                         a.z * rest + b.z * way});
}

/// Place and turn; at rest.
inline BodyState between(const BodyState& a, const BodyState& b, Real share) {
  return {
      between(a.position, b.position, share), between(a.orientation, b.orientation, share), {}, {}};
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
