/// The triangle mesh and the heightfield: names, and contacts of their triangles with spheres,
/// capsules and boxes.
#pragma once

#include "src/collide/box_triangle.hpp"
#include "src/collide/mesh_bounds.hpp"
#include "src/collide/shapes/capsule.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<TriangleMesh> = "triangle_mesh";
template <>
inline constexpr const char* kShapeName<Heightfield> = "heightfield";

/// A ball and a triangle, by the closest point of the triangle.
JFPX_HD inline void find_contact(const SphereInstance& a, const TriangleInstance& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  ClosestOnTriangle closest;
  Separation s;
  Real t = 0;
  const auto separation_at = [&](Real part) {
    closest = closest_on(b, pair.motion * part);
    const Real gap =
        closest.feature == kFace ? dot(b.normal, closest.offset) : length(closest.offset);
    const bool is_normal = closest.feature != kFace && gap > kEpsilon;
    s.normal = is_normal ? closest.offset * (Real(1) / gap) : b.normal;
    s.distance = gap - a.radius;
    return s;
  };
  if (!advance(pair, separation_at, &t) || !b.is_proximal(closest.feature, s.normal)) return;
  const Real overlap = s.distance < 0 ? s.distance : Real(0);
  const Vec3 arm = s.normal * -(a.radius + overlap * Real(0.5));
  manifold->normal = s.normal;
  manifold->add(arm + (a.centre - pair.origin_a),
                (arm + pair.motion * t) + (a.centre - pair.origin_b),
                s.distance - t * dot(pair.motion, s.normal), 0, a.centre + arm);
}

/// The axis of a capsule, and its closest points to a triangle.
struct CapsuleOnTriangle {
  Segment segment;    ///< relative to the centre of the capsule at the start of the step
  Real nearest = 0;   ///< parameter of the closest point of the axis
  Vec3 normal;        ///< unit, from the triangle to the capsule
  Real distance = 0;  ///< [m], of the axis from the triangle; < 0: depth
  int feature = kFace;
};

/// Clips a segment to the part above the face of a triangle. @returns false if there is none
JFPX_HD inline bool clip_to_face(const Segment& segment, const TriangleInstance& triangle,
                                 SegmentPart* part) {
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = triangle.corner[next_corner(k)] - triangle.corner[k];
    Vec3 inward = cross(triangle.normal, edge);
    const Vec3& third = triangle.corner[next_corner(next_corner(k))];
    if (dot(inward, third - triangle.corner[k]) < 0) inward = -inward;
    const Real height = dot(inward, segment.centre - triangle.corner[k]);
    if (!part->clip(-height, -dot(inward, segment.axis))) return false;
  }
  return part->lower <= part->upper;
}

/// The closest points of an axis and a triangle: those of an end of the axis and the triangle, or
/// those of the axis and an edge. An axis that intersects the triangle has the normal of the face.
JFPX_HD inline void find_closest(const TriangleInstance& triangle, CapsuleOnTriangle* state) {
  const Segment& s = state->segment;
  Real least = kMaxReal;
  const auto consider = [&](Real at, const Vec3& offset, int feature) {
    const Real distance2 = length_squared(offset);
    if (!(distance2 < least)) return;
    least = distance2;
    state->nearest = at;
    state->normal = offset;
    state->feature = feature;
  };
  for (const Real end : {-s.half_length, s.half_length}) {
    const ClosestOnTriangle closest = closest_on(triangle, s.point(end));
    const bool is_behind = closest.feature == kFace && dot(triangle.normal, closest.offset) < 0;
    if (!is_behind) consider(end, closest.offset, closest.feature);
  }
  for (int k = 0; k < 3; ++k) {
    const Vec3 &from = triangle.corner[k], &to = triangle.corner[next_corner(k)];
    const Real size = length(to - from);
    const Segment edge{(from + to) * Real(0.5), (to - from) * (Real(1) / size), size * Real(0.5)};
    const ClosestPoints t = closest_points(s, edge);
    const int feature = t.b == -edge.half_length  ? kVertex + k
                        : t.b == edge.half_length ? kVertex + next_corner(k)
                                                  : kEdge + k;
    consider(t.a, s.point(t.a) - edge.point(t.b), feature);
  }
  const auto height = [&](Real at) {
    return dot(triangle.normal, s.point(at) - triangle.corner[0]);
  };
  SegmentPart part(s);
  const Real low = height(-s.half_length), high = height(s.half_length);
  if ((low < 0) != (high < 0) && clip_to_face(s, triangle, &part)) {
    const Real at_lower = height(part.lower), at_upper = height(part.upper);
    if ((at_lower < 0) != (at_upper < 0)) {
      state->nearest = at_lower < at_upper ? part.lower : part.upper;
      state->distance = at_lower < at_upper ? at_lower : at_upper;
      state->normal = triangle.normal;
      state->feature = kFace;
      return;
    }
  }
  state->distance = square_root(least);
  state->normal = state->feature != kFace && state->distance > kEpsilon
                      ? state->normal * (Real(1) / state->distance)
                      : triangle.normal;
}

/// A capsule and a triangle. If the normal is within 3 degrees of that of the face, the points are
/// the ends of the part of the axis above the face, so that a capsule can rest on a mesh.
/// Otherwise, the closest points.
JFPX_HD inline void find_contact(const Posed<Capsule>& a, const TriangleInstance& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  const Real radius = a.shape.radius;
  CapsuleOnTriangle state;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    state.segment = {pair.motion * part, a.pose.basis.column(1), a.shape.half_height};
    find_closest(b, &state);
    return {state.normal, state.distance - radius};
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3 shift = pair.motion * t;
  const Segment& segment = state.segment;
  const auto add = [&](Real at, Real distance, std::uint32_t feature) {
    add_point(a, segment.point(at) + a.pose.origin, shift, distance - radius, feature, pair,
              manifold);
  };
  SegmentPart part(segment);
  if (dot(state.normal, b.normal) > kRestingCosine && clip_to_face(segment, b, &part)) {
    manifold->normal = b.normal;
    const auto height = [&](Real at) { return dot(b.normal, segment.point(at) - b.corner[0]); };
    add_ends(part, state.distance, radius, pair, height, add);
  }
  if (manifold->point_count > 0 || !b.is_proximal(state.feature, state.normal)) return;
  manifold->normal = state.normal;
  add(state.nearest, state.distance, kSinglePoint);
}

/// A box and a triangle, by conservative advancement along separating axes.
JFPX_HD inline void find_contact(const Posed<Box>& a, const TriangleInstance& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  const Mat3& axes = a.pose.basis;
  BoxTriangle boxed;
  LeastOverlap widest;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    boxed = make_box_triangle(a.shape, axes, b, pair.motion * part);
    if (!widest_separation(boxed, pair.limit, &widest)) return {{}, 0, false};
    return {axes * widest.normal, widest.distance};
  };
  if (!advance(pair, separation_at, &t)) return;
  LeastOverlap axis;
  if (!find_contact_axis(boxed, b, axes, widest, &axis)) return;
  Manifold points = triangle_manifold(boxed, axis, pair.margin);
  if (points.count == 0) return;
  manifold->normal = axes * points.normal;
  const Vec3 shift = pair.motion * t;
  const Real gap = -dot(shift, manifold->normal);
  const auto from_centre = [&](const ManifoldPoint& p) { return axes * p.point; };
  for (int i = 0; i < points.count; ++i) {
    manifold->add_touch(from_centre(points.points[i]) + a.pose.origin,
                        points.points[i].distance + gap);
  }
  remove_redundant_points(&points);
  for (int i = 0; i < points.count; ++i) {
    const ManifoldPoint& p = points.points[i];
    const Vec3 arm = from_centre(p);
    manifold->points[manifold->point_count++] = {arm + (a.pose.origin - pair.origin_a),
                                                 (arm + shift) + (a.pose.origin - pair.origin_b),
                                                 p.distance + gap, p.feature};
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
