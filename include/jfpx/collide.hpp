/// Pair tests between shapes, as pure functions. Sphere against sphere is the collider's
/// (sphere_collider.hpp).
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// How a sphere touches a solid. Without a touch the other fields are 0.
struct Touch {
  bool touching = false;
  Vec3 normal;        ///< [-], unit, from the solid to the sphere
  Vec3 point;         ///< [m], world, the middle of the overlap
  Real distance = 0;  ///< [m], <= 0: minus the penetration
  friend bool operator==(const Touch&, const Touch&) = default;
};

/// The touch that follows from its normal and distance.
JFPX_HD constexpr Touch make_touch(const SphereInstance& sphere, const Vec3& normal,
                                   Real distance) {
  return {true, normal, sphere.centre - normal * (sphere.radius + distance * Real(0.5)), distance};
}

/// Touching counts, however deep the sphere is inside.
JFPX_HD constexpr Touch collide(const SphereInstance& sphere, const HalfSpace& half_space) {
  const Real distance = (dot(half_space.normal, sphere.centre) - half_space.offset) - sphere.radius;
  if (!(distance <= 0)) return {};
  return make_touch(sphere, half_space.normal, distance);
}

/// The nearest point of the box decides (Ericson 2005, 5.2.5). A centre on or inside the box has
/// none that gives a direction: there the face of least depth does, x before y before z (E9).
JFPX_HD inline Touch collide(const SphereInstance& sphere, const Box& box, const Transform& pose) {
  const Vec3 local = transform_transpose(pose.basis, sphere.centre - pose.origin);
  Vec3 outside;
  for (int i = 0; i < 3; ++i) {
    const Real h = box.half_extents[i];
    outside[i] = local[i] > h ? local[i] - h : local[i] < -h ? local[i] + h : Real(0);
  }
  const Real gap = length(outside);
  if (!(gap <= sphere.radius)) return {};
  if (gap > kEpsilon) {
    return make_touch(sphere, pose.basis * (outside * (Real(1) / gap)), gap - sphere.radius);
  }
  int face = 0;
  Vec3 depth;
  for (int i = 0; i < 3; ++i) {
    depth[i] = box.half_extents[i] - absolute(local[i]);
    if (depth[i] < depth[face]) face = i;
  }
  const Vec3 axis = pose.basis.column(face);
  return make_touch(sphere, local[face] < 0 ? -axis : axis, -(sphere.radius + depth[face]));
}

/// A plane has no inside: the sphere is pushed to the side where its centre is, to the front if it
/// is on the plane.
JFPX_HD constexpr Touch collide(const SphereInstance& sphere, const Plane& plane) {
  const Real height = dot(plane.normal, sphere.centre) - plane.offset;
  const Real distance = (height < 0 ? -height : height) - sphere.radius;
  if (!(distance <= 0)) return {};
  return make_touch(sphere, height < 0 ? -plane.normal : plane.normal, distance);
}

/// One point of a manifold.
struct ManifoldPoint {
  Vec3 point;         ///< [m], world, the middle of the overlap
  Real distance = 0;  ///< [m], <= 0: minus the penetration
  friend bool operator==(const ManifoldPoint&, const ManifoldPoint&) = default;
};

/// How two solids touch: one normal, up to eight points, none without a touch.
struct Manifold {
  Vec3 normal;              ///< [-], unit, from b to a
  Real distance = 0;        ///< [m], <= 0: a moved by -distance along the normal no longer overlaps
  int count = 0;            ///< of points
  ManifoldPoint points[8];  ///< those beyond `count` are 0
  friend bool operator==(const Manifold&, const Manifold&) = default;
};

/// The corners of the box that are in the solid, each with its own depth (erratum E17), in the
/// order of their signs: ---, +--, -+-, ++-, --+, ...
JFPX_HD constexpr Manifold collide(const Box& box, const Transform& pose,
                                   const HalfSpace& half_space) {
  Manifold manifold;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3& h = box.half_extents;
    const Vec3 local{(corner & 1) != 0 ? h.x : -h.x, (corner & 2) != 0 ? h.y : -h.y,
                     (corner & 4) != 0 ? h.z : -h.z};
    const Vec3 vertex = transform_point(pose, local);
    const Real distance = dot(half_space.normal, vertex) - half_space.offset;
    if (!(distance <= 0)) continue;
    manifold.points[manifold.count++] = {vertex - half_space.normal * (distance * Real(0.5)),
                                         distance};
    if (distance < manifold.distance) manifold.distance = distance;
  }
  if (manifold.count > 0) manifold.normal = half_space.normal;
  return manifold;
}

/// As against the half-space behind the plane, on the side where the centre of the box is, the
/// front if it is on the plane.
JFPX_HD constexpr Manifold collide(const Box& box, const Transform& pose, const Plane& plane) {
  const bool behind = dot(plane.normal, pose.origin) < plane.offset;
  return behind ? collide(box, pose, HalfSpace{-plane.normal, -plane.offset})
                : collide(box, pose, HalfSpace{plane.normal, plane.offset});
}

/// Separating axes and clipping. Of equally good normals a face of a is preferred, then a face of
/// b, then a pair of edges; near ties count as ties. Boxes whose gap is smaller than the rounding
/// errors may touch; so may those with edges that are parallel but for less than
/// 2 sqrt(epsilon), when the gap is smaller than that times their size.
JFPX_API Manifold collide(const Box& a, const Transform& pose_a, const Box& b,
                          const Transform& pose_b);

}  // namespace JFPX_ABI
}  // namespace jfpx
