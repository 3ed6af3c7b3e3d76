/// The convex hull: mass, bounds, ray, submerged volume, and contacts with spheres, capsules,
/// boxes, hulls, half-spaces and triangles.
#pragma once

#include "src/collide/hull_point.hpp"
#include "src/collide/hull_triangle.hpp"
#include "src/collide/polyhedron_pair.hpp"
#include "src/collide/round/convex_pair.hpp"
#include "src/collide/shapes/capsule.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Hull> = "hull";
template <>
inline constexpr bool kHasFlatFaces<Hull> = true;

/// A hull in flat arrays, in host memory or on a device.
struct HullReference {
  const HullView* hull = nullptr;
};

inline Solid to_solid(const Hull& hull) {
  const HullView& view = hull.data().view;
  return {view.half_extents, 0, &view};
}
JFPX_HD inline HullReference from_solid(const Solid& solid, std::type_identity<Hull>) {
  return {solid.hull};
}

/// [m^3]
inline double volume(const Hull& hull) { return hull.volume(); }
inline Real outer_radius(const Hull& hull) { return hull.data().view.outer_radius; }
inline Real bounding_radius(const Hull& hull) { return outer_radius(hull) * (1 + 64 * kEpsilon); }
JFPX_HD inline Real least_half_width(const HullReference& hull) {
  return hull.hull->least_half_width;
}
/// Half extents of a box around the origin of the hull.
JFPX_HD inline Vec3 half_extents(const HullReference& hull, const Transform& pose) {
  return half_extents(Box{hull.hull->half_extents}, pose);
}
inline Vec3 half_extents(const Hull& hull, const Transform& pose) {
  return half_extents(HullReference{&hull.data().view}, pose);
}
inline Posed<HullReference> instance(const Hull& hull, const Transform& pose) {
  return {{&hull.data().view}, pose};
}

/// The part of the ray that is behind all faces (Cyrus and Beck 1978). Of faces that are entered at
/// the same distance, the first is hit.
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction, const HullReference& shape,
                              const Transform& pose) {
  const HullView& hull = *shape.hull;
  const Vec3 from = inverse_transform_point(pose, origin);
  const Vec3 along = inverse_transform_direction(pose, direction);
  Real first = 0, last = kMaxReal;
  std::uint32_t face = hull.face_count;
  for (std::uint32_t i = 0; i < hull.face_count; ++i) {
    const Real height = dot(hull.faces[i].normal, from) - hull.faces[i].offset;
    const Real climb = dot(hull.faces[i].normal, along);
    if (climb == 0) {
      if (height > 0) return {};
      continue;
    }
    const Real at = -height / climb;
    if (climb < 0) {
      if (at > first) first = at, face = i;
    } else if (at < last) {
      last = at;
    }
  }
  if (first > last) return {};
  if (face == hull.face_count) return {true, 0, -direction};
  return {true, first, pose.basis * hull.faces[face].normal};
}
inline RayEntry enter(const Vec3& origin, const Vec3& direction, const Hull& hull,
                      const Transform& pose) {
  return enter(origin, direction, HullReference{&hull.data().view}, pose);
}

/// Divides the hull into tetrahedra from its first vertex to the triangles of its faces.
JFPX_HD inline Submerged submerged(const HullReference& shape, const Mat3& basis,
                                   const HalfSpace& liquid) {
  const HullPolyhedron hull{shape.hull};
  const auto corner = [&](const Vec3& local) {
    const Vec3 point = basis * local;
    return Corner{point, dot(liquid.normal, point) - liquid.offset};
  };
  const Corner apex = corner(hull.vertex(0));
  Submerged sum;
  for (int face = 0; face < hull.face_count(); ++face) {
    for (int k = 2; k < hull.corner_count(face); ++k) {
      Corner tetrahedron[4] = {apex, corner(hull.corner(face, 0)), corner(hull.corner(face, k - 1)),
                               corner(hull.corner(face, k))};
      add_clipped(tetrahedron, &sum);
    }
  }
  return sum;
}

/// A sphere and a hull, by the closest point of the hull.
JFPX_HD inline void find_contact(const SphereInstance& a, const Posed<HullReference>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  Vec3 centre;
  Separation closest;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    centre = moved(a.centre, pair, part);
    const HullPoint point = closest_to(*b.shape.hull, inverse_transform_point(b.pose, centre));
    return closest = {b.pose.basis * point.normal, point.distance - a.radius};
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3& n = closest.normal;
  const Real overlap = closest.distance < 0 ? closest.distance : Real(0);
  const Vec3 arm = n * -(a.radius + overlap * Real(0.5));
  manifold->normal = n;
  manifold->add(arm + (a.centre - pair.origin_a), centre + arm - pair.origin_b,
                closest.distance - t * dot(pair.motion, n), 0, a.centre + arm);
}

/// The vertices of a hull below or near a half-space: at most eight of them.
JFPX_HD inline void find_contact(const Posed<HullReference>& a, const HalfSpace& wall,
                                 const PairMotion& pair, PairManifold* manifold) {
  const HullPolyhedron hull{a.shape.hull};
  PointSelection selection(wall.normal);
  const Real closing = -dot(wall.normal, pair.motion);
  const Real most = pair.margin + (closing > 0 ? closing : Real(0));
  for (int i = 0; i < hull.vertex_count(); ++i) {
    const Vec3 corner = transform_point(a.pose, hull.vertex(i));
    const Real distance = dot(wall.normal, corner) - wall.offset;
    if (distance <= most) selection.add(corner, distance, static_cast<std::uint32_t>(i));
  }
  selection.visit([&](const Vec3& corner, Real, std::uint32_t feature) {
    add_corner(corner, 0, wall, feature, pair, manifold);
  });
}

/// The contact points of a, in its axes, as points of a manifold.
/// @param shift motion of a at the time of the points
template <int kDirections>
JFPX_HD void add_selected(const DirectedSelection<kDirections>& selection, const Transform& pose_a,
                          const Vec3& shift, const PairMotion& pair, PairManifold* manifold) {
  const Real gap = -dot(shift, manifold->normal);
  selection.visit([&](const Vec3& local, Real distance, std::uint32_t feature) {
    const Vec3 point = transform_point(pose_a, local);
    manifold->add(point - pair.origin_a, (point + shift) - pair.origin_b, distance + gap, feature,
                  point);
  });
}

/// Two polyhedra, at least one of them a hull, by conservative advancement along separating axes.
template <class A, class B>
JFPX_HD void find_contact_of_polyhedra(const A& a, const Transform& pose_a, const B& b,
                                       const Transform& pose_b, const PairMotion& pair,
                                       PairManifold* manifold) {
  PolyhedronPair<A, B> polyhedra{
      a, b, transposed(pose_a.basis) * pose_b.basis, {}, a.size() + b.size()};
  PolyhedronAxes axes;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    polyhedra.offset =
        transform_transpose(pose_a.basis, pose_b.origin - moved(pose_a.origin, pair, part));
    if (!find_axes(polyhedra, pair.limit, pair.hull_kernels, &axes)) return {{}, 0, false};
    const LeastOverlap& overlap = axes.preferred.overlap;
    return {pose_a.basis * overlap.normal, overlap.distance};
  };
  if (!advance(pair, separation_at, &t)) return;
  PointSelection selection(axes.preferred.overlap.normal);
  const auto add = [&](const Vec3& p, Real distance, std::uint32_t feature) {
    selection.add(p, distance, feature);
  };
  PolyhedronAxis axis = axes.preferred;
  visit_contact_points(polyhedra, axis, pair.margin, add);
  // Faces that are not the widest axis may not overlap. Then the widest axis has a point. If it is
  // not on the incident face, or is removed by rounding, it is the closest point of the solids.
  if (selection.is_empty()) {
    axis = axes.widest;
    visit_contact_points(polyhedra, axis, pair.margin, add);
  }
  const Real distance = axis.overlap.distance;
  if (selection.is_empty() && distance <= pair.margin) {
    const ConvexPair<A, B> solids{a,  b,  polyhedra.rotation, polyhedra.offset,
                                  {}, {}, polyhedra.size};
    const Vec3& n = axis.overlap.normal;
    const Vec3 on_a = closest_point_of_a(solids, n, distance);
    add(add_scaled(on_a, n, distance * Real(-0.5)), distance, PointFeature::kCount - 1);
  }
  manifold->normal = pose_a.basis * axis.overlap.normal;
  add_selected(selection, pose_a, pair.motion * t, pair, manifold);
}
JFPX_HD inline void find_contact(const Posed<HullReference>& a, const Posed<HullReference>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  find_contact_of_polyhedra(HullPolyhedron{a.shape.hull}, a.pose, HullPolyhedron{b.shape.hull},
                            b.pose, pair, manifold);
}
JFPX_HD inline void find_contact(const Posed<HullReference>& a, const Posed<Box>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  find_contact_of_polyhedra(HullPolyhedron{a.shape.hull}, a.pose,
                            BoxPolyhedron{b.shape.half_extents}, b.pose, pair, manifold);
}

/// A hull and a triangle of a mesh.
JFPX_HD inline void find_contact(const Posed<HullReference>& a, const TriangleInstance& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  const Mat3& axes = a.pose.basis;
  HullTriangle triangle;
  LeastOverlap widest;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    triangle = make_hull_triangle(*a.shape.hull, axes, b, pair.motion * part);
    if (!widest_separation(triangle, pair.limit, &widest)) return {{}, 0, false};
    return {axes * widest.normal, widest.distance};
  };
  if (!advance(pair, separation_at, &t)) return;
  LeastOverlap axis;
  if (!find_contact_axis(triangle, b, axes, widest, &axis)) return;
  PointSelection selection(axis.normal);
  visit_contact_points(triangle, axis, pair.margin,
                       [&](const Vec3& p, Real distance, std::uint32_t feature) {
                         selection.add(p, distance, feature);
                       });
  manifold->normal = axes * axis.normal;
  add_selected(selection, a.pose, pair.motion * t, pair, manifold);
}

/// The axis of a capsule in the axes of a hull, and the closest points of both.
struct CapsuleOnHull {
  Segment segment;
  Real nearest = 0;   ///< parameter of the closest point of the axis
  Vec3 normal;        ///< unit, from the hull to the capsule
  Real distance = 0;  ///< [m], of the axis from the hull; < 0: depth
};

/// For an axis that intersects the hull: the direction of least depth, as for two polyhedra.
JFPX_HD inline void find_depth(const HullPolyhedron& hull, CapsuleOnHull* state) {
  const Segment& s = state->segment;
  const Vec3 low = s.point(-s.half_length), high = s.point(s.half_length);
  const Real error = 8 * kEpsilon * (hull.size() + s.half_length);
  LeastOverlap faces, edges;
  Real at_face = 0, at_edge = 0;
  for (int i = 0; i < hull.face_count(); ++i) {
    const Vec3 n = hull.face_normal(i);
    const Real from = dot(n, low), to = dot(n, high);
    const Real distance = (from < to ? from : to) - hull.face_offset(i);
    if (faces.axis >= 0 && !(distance > faces.distance)) continue;
    faces = {i, distance, error, n};
    at_face = from < to ? -s.half_length : s.half_length;
  }
  for (int i = 0; i < hull.edge_count(); ++i) {
    const PolyhedronEdge edge = hull.edge(i);
    const Vec3 a = hull.vertex(edge.a), along = hull.vertex(edge.b) - a;
    Vec3 n = cross(along, s.axis);
    const Real across2 = length_squared(n), size2 = length_squared(along);
    if (!(across2 > 4 * kEpsilon * size2)) continue;
    n = n * (Real(1) / square_root(across2));
    const Vec3 u = hull.face_normal(edge.face), v = hull.face_normal(edge.other_face);
    if (dot(n, u + v) < 0) n = -n;
    const Vec3 uv = cross(u, v);
    if (dot(cross(u, n), uv) < 0 || dot(cross(n, v), uv) < 0) continue;  // not on the arc
    const Real distance = dot(n, s.centre - a);
    if (edges.axis >= 0 && !(distance > edges.distance)) continue;
    edges = {i, distance, error * square_root(size2 / across2), n};
    const Real edge_length = square_root(size2);
    at_edge = closest_points(s, {a, along * (1 / edge_length), kMaxReal}).a;
  }
  const bool is_edge = &preferred(faces, edges) == &edges;
  state->normal = is_edge ? edges.normal : faces.normal;
  state->distance = is_edge ? edges.distance : faces.distance;
  state->nearest = is_edge ? at_edge : at_face;
}

/// Whether a segment intersects a hull.
JFPX_HD inline bool intersects(const HullPolyhedron& hull, const Segment& s) {
  SegmentPart part(s);
  for (int i = 0; i < hull.face_count(); ++i) {
    const Vec3 n = hull.face_normal(i);
    if (!part.clip(dot(n, s.centre) - hull.face_offset(i), dot(n, s.axis))) return false;
  }
  return part.lower <= part.upper;
}

JFPX_HD inline void find_closest(const HullView& view, CapsuleOnHull* state) {
  const HullPolyhedron hull{&view};
  const Segment& s = state->segment;
  if (intersects(hull, s)) return find_depth(hull, state);
  Real least = kMaxReal;
  for (const Real end : {-s.half_length, s.half_length}) {
    const HullPoint point = closest_to(view, s.point(end));
    if (!(point.distance < least)) continue;
    least = point.distance;
    state->nearest = end;
    state->normal = point.normal;
  }
  for (int i = 0; i < hull.edge_count(); ++i) {
    const PolyhedronEdge edge = hull.edge(i);
    const Vec3 a = hull.vertex(edge.a), b = hull.vertex(edge.b);
    const Real size = length(b - a);
    const Segment along{(a + b) * Real(0.5), (b - a) * (Real(1) / size), size * Real(0.5)};
    const ClosestPoints t = closest_points(s, along);
    const Vec3 offset = s.point(t.a) - along.point(t.b);
    const Real distance = length(offset);
    if (!(distance < least) || !(distance > kEpsilon * view.outer_radius)) continue;
    least = distance;
    state->nearest = t.a;
    state->normal = offset * (Real(1) / distance);
  }
  state->distance = least;
}

/// Clips a segment to the part above a face. @returns false if there is none
JFPX_HD inline bool clip_to_face(const HullPolyhedron& hull, int face, const Segment& segment,
                                 SegmentPart* part) {
  const Vec3 n = hull.face_normal(face);
  const int count = hull.corner_count(face);
  for (int k = 0; k < count; ++k) {
    const Vec3 from = hull.corner(face, k), to = hull.corner(face, k + 1 == count ? 0 : k + 1);
    const Vec3 outward = cross(to - from, n);
    if (!part->clip(dot(outward, segment.centre - from), dot(outward, segment.axis))) return false;
  }
  return part->lower <= part->upper;
}

/// A capsule and a hull. If the normal is within 3 degrees of a face normal, the points are the
/// ends of the part of the axis above the face, so that a capsule can rest on a hull. Otherwise,
/// the closest points.
JFPX_HD inline void find_contact(const Posed<Capsule>& a, const Posed<HullReference>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  const Mat3& axes = b.pose.basis;
  const HullPolyhedron hull{b.shape.hull};
  const Real radius = a.shape.radius;
  CapsuleOnHull state;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    const Segment segment = axis_of(moved(a, pair, part));
    state.segment = {transform_transpose(axes, segment.centre - b.pose.origin),
                     transform_transpose(axes, segment.axis), segment.half_length};
    find_closest(*b.shape.hull, &state);
    return {axes * state.normal, state.distance - radius};
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3 shift = pair.motion * t;
  const Segment& segment = state.segment;
  const auto add = [&](Real at, Real distance, std::uint32_t feature) {
    const Vec3 core = axes * segment.point(at) + b.pose.origin;
    add_point(a, core, shift, distance - radius, feature, pair, manifold);
  };
  const int face = facing_face(hull, -state.normal);
  const Vec3 n = hull.face_normal(face);
  SegmentPart part(segment);
  if (dot(n, state.normal) > kRestingCosine && clip_to_face(hull, face, segment, &part)) {
    manifold->normal = axes * n;
    const auto height = [&](Real at) { return dot(n, segment.point(at)) - hull.face_offset(face); };
    add_ends(part, state.distance, radius, pair, height, add);
  }
  if (manifold->point_count > 0) return;
  manifold->normal = axes * state.normal;
  add(state.nearest, state.distance, kSinglePoint);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
