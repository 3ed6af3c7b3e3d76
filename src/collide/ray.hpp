/// Ray casts against a sphere, a box, a half-space and a plane. `direction` is always a unit
/// vector, and solids include their surface.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The point where a ray enters a solid. Without a hit the other fields are 0.
struct RayEntry {
  bool hit = false;
  Real distance = 0;  ///< [m], >= 0
  Vec3 normal;        ///< unit, outwards; opposite to the ray if it starts inside
};

/// The half chord is computed from the distance between the centre and the line, and not from the
/// difference of two large squares, so that the result is accurate for small spheres far away.
/// Lengths are divided by the radius, because the square of a small radius may underflow.
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction,
                              const SphereInstance& sphere) {
  const Real r = sphere.radius;
  const Vec3 from_centre = origin - sphere.centre;
  if (!(length_squared(from_centre) > r * r)) return {true, 0, -direction};
  const Real ahead = -dot(from_centre, direction);
  if (!(ahead > 0)) return {};
  const Vec3 beside = add_scaled(from_centre, direction, ahead);
  const Vec3 in_radii{beside.x / r, beside.y / r, beside.z / r};
  const Real half_chord2 = 1 - length_squared(in_radii);
  if (!(half_chord2 >= 0)) return {};
  const Real half_chord = square_root(half_chord2);
  const Real distance = ahead - half_chord * r;
  return {true, distance > 0 ? distance : Real(0),
          normalized(add_scaled(in_radii, direction, -half_chord))};
}

/// Slab test (Kay and Kajiya 1986). A ray that enters through an edge hits the face whose axis
/// comes first.
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction, const Box& box,
                              const Transform& pose) {
  const Vec3 from = inverse_transform_point(pose, origin);
  const Vec3 along = inverse_transform_direction(pose, direction);
  int face = -1;
  Real first = 0, last = kMaxReal;
  for (int i = 0; i < 3; ++i) {
    const Real h = box.half_extents[i];
    if (along[i] == 0) {
      if (absolute(from[i]) > h) return {};
      continue;
    }
    const Real near = ((along[i] > 0 ? -h : h) - from[i]) / along[i];
    const Real far = ((along[i] > 0 ? h : -h) - from[i]) / along[i];
    if (near > first) first = near, face = i;
    if (far < last) last = far;
  }
  if (first > last) return {};
  if (face < 0) return {true, 0, -direction};
  const Vec3 axis = pose.basis.column(face);
  return {true, first, along[face] > 0 ? -axis : axis};
}

JFPX_HD constexpr RayEntry enter(const Vec3& origin, const Vec3& direction,
                                 const HalfSpace& half_space) {
  const Real height = dot(half_space.normal, origin) - half_space.offset;
  if (!(height > 0)) return {true, 0, -direction};
  const Real descent = -dot(half_space.normal, direction);
  if (!(descent > 0)) return {};
  return {true, height / descent, half_space.normal};
}

/// The normal points to the side where the ray starts.
JFPX_HD constexpr RayEntry enter(const Vec3& origin, const Vec3& direction, const Plane& plane) {
  const bool behind = dot(plane.normal, origin) < plane.offset;
  return behind ? enter(origin, direction, HalfSpace{-plane.normal, -plane.offset})
                : enter(origin, direction, HalfSpace{plane.normal, plane.offset});
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
