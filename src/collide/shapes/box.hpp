/// The box: mass, bounds, ray, submerged volume, and contacts with boxes, spheres and half-spaces.
#pragma once

#include "src/collide/box_pair.hpp"
#include "src/collide/shapes/sphere.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Box> = "box";
template <>
inline constexpr bool kHasFlatFaces<Box> = true;

JFPX_HD inline Solid to_solid(const Box& box) { return {box.half_extents, 0}; }
JFPX_HD inline Box from_solid(const Solid& solid, std::type_identity<Box>) {
  return {solid.half_extents};
}

/// [m^3]
inline double volume(const Box& box) {
  const Vec3& h = box.half_extents;
  return 8.0 * static_cast<double>(h.x) * static_cast<double>(h.y) * static_cast<double>(h.z);
}
/// [kg m^2], principal moments of a solid box: m/3 (b^2 + c^2) for half extents b and c (erratum
/// E23).
JFPX_HD constexpr Vec3 moments_of_inertia(const Box& box, Real mass) {
  const Vec3 h2 = component_product(box.half_extents, box.half_extents);
  return Vec3{h2.y + h2.z, h2.z + h2.x, h2.x + h2.y} * (mass / 3);
}

inline Real outer_radius(const Box& box) { return length(box.half_extents); }
/// Enlarged by more than the rounding errors of the pair tests, so that bounds never exclude a
/// contact.
inline Real bounding_radius(const Box& box) {
  constexpr Real kUnderflowLimit = Real(1e-15);  // below it, squares of floats are inexact or 0
  const Vec3& h = box.half_extents;
  const Real xy = h.x < h.y ? h.y : h.x, largest = xy < h.z ? h.z : xy;
  return largest < kUnderflowLimit ? 2 * largest : length(h) * (1 + 64 * kEpsilon);
}
JFPX_HD inline Real least_half_width(const Box& box) {
  const Vec3& h = box.half_extents;
  const Real xy = h.y < h.x ? h.y : h.x;
  return h.z < xy ? h.z : xy;
}
JFPX_HD inline Vec3 half_extents(const Box& box, const Transform& pose) {
  return {projected_half_length(box.half_extents, pose.basis.row[0]),
          projected_half_length(box.half_extents, pose.basis.row[1]),
          projected_half_length(box.half_extents, pose.basis.row[2])};
}

/// Slab test (Kay and Kajiya 1986). A ray that enters through an edge hits the face with the lower
/// axis index.
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

/// Divides the box into six tetrahedra around its diagonal from corner --- to corner +++, one for
/// each order of the axes on a path along three edges (Kuhn's triangulation).
/// @param basis  axes of the box; its centre is the origin
JFPX_HD inline Submerged submerged(const Box& box, const Mat3& basis, const HalfSpace& liquid) {
  const auto corner = [&](int signs) {
    const Vec3& h = box.half_extents;
    const Vec3 local{(signs & 1) != 0 ? h.x : -h.x, (signs & 2) != 0 ? h.y : -h.y,
                     (signs & 4) != 0 ? h.z : -h.z};
    const Vec3 point = basis * local;
    return Corner{point, dot(liquid.normal, point) - liquid.offset};
  };
  Submerged sum;
  for (int first = 0; first < 3; ++first) {
    for (int second = 0; second < 3; ++second) {
      if (second == first) continue;
      Corner path[4] = {corner(0), corner(1 << first), corner((1 << first) | (1 << second)),
                        corner(7)};
      add_clipped(path, &sum);
    }
  }
  return sum;
}

/// Vector from the closest point of a box to a point, in the axes of the box; zero inside.
JFPX_INLINE inline Vec3 offset_from_box(const Vec3& point, const Box& box) {
  Vec3 offset;
  for (int i = 0; i < 3; ++i) {
    const Real h = box.half_extents[i];
    offset[i] = point[i] > h ? point[i] - h : point[i] < -h ? point[i] + h : Real(0);
  }
  return offset;
}
/// Distance of a sphere from a box, with the arithmetic of collide(sphere, box, pose). Invalid if
/// larger than `limit`.
JFPX_HD inline Separation separation(const Vec3& centre, Real radius, const Posed<Box>& box,
                                     Real limit) {
  const Vec3 local = transform_transpose(box.pose.basis, centre - box.pose.origin);
  const Vec3 outside = offset_from_box(local, box.shape);
  const Real gap = length(outside);
  if (gap > radius + limit) return {{}, 0, false};
  if (gap > kEpsilon) return {box.pose.basis * (outside * (Real(1) / gap)), gap - radius};
  int face = 0;
  Vec3 depth;
  for (int i = 0; i < 3; ++i) {
    depth[i] = box.shape.half_extents[i] - absolute(local[i]);
    if (depth[i] < depth[face]) face = i;
  }
  const Vec3 axis = box.pose.basis.column(face);
  return {local[face] < 0 ? -axis : axis, -(radius + depth[face])};
}

JFPX_HD inline void find_contact(const SphereInstance& a, const Posed<Box>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  Vec3 centre;
  Separation closest;
  Real t = 0;
  const auto separation_at = [&](Real part) {
    centre = moved(a.centre, pair, part);
    return closest = separation(centre, a.radius, b, pair.limit);
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3& n = closest.normal;
  const Real overlap = closest.distance < 0 ? closest.distance : Real(0);
  const Vec3 arm = n * -(a.radius + overlap * Real(0.5));
  manifold->normal = n;
  manifold->add(arm + (a.centre - pair.origin_a), centre + arm - pair.origin_b,
                closest.distance - t * dot(pair.motion, n), 0, a.centre + arm);
}

/// Removes redundant points of a manifold: points whose triangle with their neighbors has less than
/// 5 % of the area of the polygon. At nearly coincident corners of two boxes, rounding decides
/// whether clipping yields one, two or three points. A corner with three points would be three
/// times as stiff, and a stack with a varying number of points would not come to rest. The depth is
/// linear in the polygon, so a removed point is hardly deeper than the kept ones.
JFPX_HD inline void remove_redundant_points(Manifold* manifold) {
  constexpr Real kLeastShare = Real(0.05);
  const auto point = [&](int i) {
    return manifold->points[(i + manifold->count) % manifold->count].point;
  };
  const auto area = [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return length(cross(b - a, c - a));
  };
  Real total = 0;
  for (int i = 2; i < manifold->count; ++i) total += area(point(0), point(i - 1), point(i));
  while (manifold->count > 4) {
    int least = 0;
    Real least_area = kMaxReal;
    for (int i = 0; i < manifold->count; ++i) {
      const Real part = area(point(i - 1), point(i), point(i + 1));
      if (part < least_area) least = i, least_area = part;
    }
    if (!(least_area < kLeastShare * total)) return;
    --manifold->count;
    for (int i = least; i < manifold->count; ++i) manifold->points[i] = manifold->points[i + 1];
  }
}

/// Two boxes, by conservative advancement along separating axes.
JFPX_HD inline void find_contact(const Posed<Box>& a, const Posed<Box>& b, const PairMotion& pair,
                                 PairManifold* manifold) {
  Transform pose = a.pose;
  BoxPair boxes;
  LeastOverlap least;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    pose.origin = moved(a.pose.origin, pair, part);
    boxes = make_box_pair(a.shape, pose, b.shape, b.pose);
    if (!least_overlap(boxes, pair.limit, true, &least)) return {{}, 0, false};
    return {a.pose.basis * least.normal, least.distance};
  };
  if (!advance(pair, separation_at, &t)) return;
  Manifold points = box_manifold(boxes, least, pose, b.pose, pair.margin);
  const Vec3 shift = pair.motion * t;
  const Real gap = -dot(shift, points.normal);
  for (int i = 0; i < points.count; ++i) {
    manifold->add_touch(points.points[i].point, points.points[i].distance + gap);
  }
  remove_redundant_points(&points);
  manifold->normal = points.normal;
  for (int i = 0; i < points.count; ++i) {
    const ManifoldPoint& p = points.points[i];
    manifold->points[manifold->point_count++] = {
        p.point - shift - pair.origin_a, p.point - pair.origin_b, p.distance + gap, p.feature};
  }
}

/// The corners have the order of collide(box, pose, half_space).
JFPX_HD inline void find_contact(const Posed<Box>& a, const HalfSpace& wall, const PairMotion& pair,
                                 PairManifold* manifold) {
  const Vec3& h = a.shape.half_extents;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const Vec3 local{(corner & 1) != 0 ? h.x : -h.x, (corner & 2) != 0 ? h.y : -h.y,
                     (corner & 4) != 0 ? h.z : -h.z};
    add_corner(transform_point(a.pose, local), 0, wall, corner, pair, manifold);
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
