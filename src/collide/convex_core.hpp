/// A convex shape by its farthest points, for casts and distances.
#pragma once

#include "src/collide/bounding_sphere.hpp"
#include "src/collide/shapes.hpp"

#include <algorithm>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The core of a ball.
struct CorePoint {};

/// A convex shape in its axes: all points within `radius` of a core, which is known by its farthest
/// points.
struct ConvexCore {
  std::variant<CorePoint, CoreSegment, BoxPolyhedron, HullPolyhedron, Frustum, TriangleFace> core;
  Real radius = 0;  ///< [m]
  Vec3 centre;      ///< [m], a point inside
  Real reach = 0;   ///< [m], at least the distance of the farthest point from the centre
};

template <class S>
ConvexCore make_core(const S& solid) {
  ConvexCore core;
  core.reach = bounding_radius(solid);
  if constexpr (std::is_same_v<S, Sphere>) {
    core.radius = solid.radius;
  } else if constexpr (std::is_same_v<S, Capsule>) {
    core.core = CoreSegment{solid.half_height};
    core.radius = solid.radius;
  } else if constexpr (std::is_same_v<S, Box>) {
    core.core = BoxPolyhedron{solid.half_extents};
  } else if constexpr (std::is_same_v<S, Hull>) {
    const HullView& hull = solid.data().view;
    core.core = HullPolyhedron{&hull};
    core.centre = hull.centre;
    core.reach += length(hull.centre) * (1 + 8 * kEpsilon);
  } else {
    core.core = to_frustum(solid);
  }
  return core;
}

/// A triangle, without its inside.
/// @param corner [m], with one corner near the origin
/// @param normal unit
inline ConvexCore make_core(const Vec3 (&corner)[3], const Vec3& normal) {
  ConvexCore core;
  core.core = TriangleFace{{corner[0], corner[1], corner[2]}, normal};
  core.centre = (corner[0] + corner[1] + corner[2]) * (Real(1) / 3);
  for (const Vec3& p : corner) {
    const Real distance = length(p - core.centre) * (1 + 16 * kEpsilon) + kLostLength;
    core.reach = std::max(core.reach, distance);
  }
  return core;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
