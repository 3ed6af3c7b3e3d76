/// Collision tests of pairs of shapes, as pure functions. Sphere-sphere tests belong to
/// SphereCollider (sphere_collider.hpp).
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// The contact of a sphere with a solid. Without a contact the other fields are 0.
struct Touch {
  bool touching = false;
  Vec3 normal;        ///< [-], unit, from the solid to the sphere
  Vec3 point;         ///< [m], world, middle of the overlap
  Real distance = 0;  ///< [m], <= 0: negative penetration depth
  friend bool operator==(const Touch&, const Touch&) = default;
};

/// The contact of a sphere with the given normal and distance.
JFPX_HD constexpr Touch make_touch(const SphereInstance& sphere, const Vec3& normal,
                                   Real distance) {
  return {true, normal, sphere.centre - normal * (sphere.radius + distance * Real(0.5)), distance};
}

/// Sphere against half-space. A sphere that exactly touches the surface is in contact, and so is a
/// sphere at any depth inside.
JFPX_HD constexpr Touch collide(const SphereInstance& sphere, const HalfSpace& half_space) {
  const Real distance = (dot(half_space.normal, sphere.centre) - half_space.offset) - sphere.radius;
  if (!(distance <= 0)) return {};
  return make_touch(sphere, half_space.normal, distance);
}

/// Sphere against box, by the point of the box that is closest to the centre (Ericson 2005, 5.2.5).
/// If the centre is on or inside the box, the normal is that of the face of least depth, in the
/// order x, y, z (erratum E9).
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

/// Sphere against plane. A plane has no inside: the normal points to the side of the centre, or to
/// the front if the centre is on the plane.
JFPX_HD constexpr Touch collide(const SphereInstance& sphere, const Plane& plane) {
  const Real height = dot(plane.normal, sphere.centre) - plane.offset;
  const Real distance = (height < 0 ? -height : height) - sphere.radius;
  if (!(distance <= 0)) return {};
  return make_touch(sphere, height < 0 ? -plane.normal : plane.normal, distance);
}

/// One contact point of a manifold.
struct ManifoldPoint {
  Vec3 point;         ///< [m], world, middle of the overlap
  Real distance = 0;  ///< [m], <= 0: negative penetration depth
  /// Identifies the corners, edges and faces that form the point; constant while they form it.
  std::uint32_t feature = 0;
  friend bool operator==(const ManifoldPoint&, const ManifoldPoint&) = default;
};

/// The contact manifold of two solids: one normal and up to eight points; without a contact, no
/// points.
struct Manifold {
  Vec3 normal;              ///< [-], unit, from b to a
  Real distance = 0;        ///< [m], <= 0: moving a by -distance along the normal ends the overlap
  int count = 0;            ///< number of points
  ManifoldPoint points[8];  ///< points from `count` on are 0
  friend bool operator==(const Manifold&, const Manifold&) = default;
};

/// Box against half-space. The points are the corners of the box inside the solid, each with its
/// own depth (erratum E17), in the order of their signs: ---, +--, -+-, ++-, --+, ...
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
                                         distance, static_cast<std::uint32_t>(corner)};
    if (distance < manifold.distance) manifold.distance = distance;
  }
  if (manifold.count > 0) manifold.normal = half_space.normal;
  return manifold;
}

/// Box against plane. Equals the test against a half-space whose surface is the plane and whose
/// normal points to the side of the box's centre, or to the front if the centre is on the plane.
JFPX_HD constexpr Manifold collide(const Box& box, const Transform& pose, const Plane& plane) {
  const bool behind = dot(plane.normal, pose.origin) < plane.offset;
  return behind ? collide(box, pose, HalfSpace{-plane.normal, -plane.offset})
                : collide(box, pose, HalfSpace{plane.normal, plane.offset});
}

/// Box against box, by the separating-axis test over 15 axes (Gottschalk, Lin and Manocha 1996) and
/// clipping of faces (Sutherland and Hodgman 1974). Thread-safe. Among equally good normals, a face
/// of a precedes a face of b, which precedes a pair of edges; near ties count as ties. Separated
/// boxes may be reported as touching if the gap is smaller than the rounding errors, or if edges
/// deviate from parallel by less than 2 sqrt(epsilon) and the gap is smaller than that times their
/// size.
JFPX_API Manifold collide(const Box& a, const Transform& pose_a, const Box& b,
                          const Transform& pose_b);

/// Two solids of any kind. Thread-safe. Two capsules within 3 degrees of parallel, and a capsule
/// within 3 degrees of a face of a box, have two points if both touch; other pairs with a capsule
/// have one. The features are the numbers of the points.
JFPX_API Manifold collide(const SolidShape& a, const Transform& pose_a, const SolidShape& b,
                          const Transform& pose_b);
/// A solid of any kind against a half-space. A capsule has a point for each half ball that touches.
/// Thread-safe.
JFPX_API Manifold collide(const SolidShape& solid, const Transform& pose,
                          const HalfSpace& half_space);

/// The closest points of two solids, so that point_a = point_b + normal * distance.
struct ClosestPoints {
  Real distance = 0;      ///< [m]; of an overlap < 0: negative penetration depth
  Vec3 normal;            ///< [-], unit, from b to a
  Vec3 point_a, point_b;  ///< [m], world, of the surfaces of a and b
  friend bool operator==(const ClosestPoints&, const ClosestPoints&) = default;
};

/// The closest points of two solids of any kind, at any distance, by the algorithm of Gilbert,
/// Johnson and Keerthi (1988) in double, in both precisions. The error of the distance of solids
/// that are apart is below 10^-6 (in double 10^-8) of the sizes of both and of the distance of
/// their origins. Of several closest points, as those of parallel faces, one pair is returned.
///
/// If the solids overlap, moving a by -distance along the normal ends the overlap. The depth is the
/// least one for spheres and capsules whose segments do not overlap the other solid. Otherwise the
/// axis is that of collide(), or that of the algorithm if the solids overlap less along it.
/// Thread-safe; throws no exceptions.
/// @param a,b in the ranges that validate() requires; a sphere of radius 0 is a point
JFPX_API ClosestPoints closest_points(const SolidShape& a, const Transform& pose_a,
                                      const SolidShape& b, const Transform& pose_b);
/// The closest points of a solid (a) and a half-space (b).
JFPX_API ClosestPoints closest_points(const SolidShape& solid, const Transform& pose,
                                      const HalfSpace& half_space);

}  // namespace JFPX_ABI
}  // namespace jfpx
