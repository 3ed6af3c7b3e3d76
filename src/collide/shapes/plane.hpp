/// The two-sided plane: name and ray. Contact tests use the half-space behind its front or back.
#pragma once

#include "src/collide/shapes/half_space.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Plane> = "plane";

/// The normal points to the side where the ray starts.
JFPX_HD constexpr RayEntry enter(const Vec3& origin, const Vec3& direction, const Plane& plane) {
  const bool behind = dot(plane.normal, origin) < plane.offset;
  return behind ? enter(origin, direction, HalfSpace{-plane.normal, -plane.offset})
                : enter(origin, direction, HalfSpace{plane.normal, plane.offset});
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
