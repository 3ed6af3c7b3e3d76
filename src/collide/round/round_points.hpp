/// Contact points of two convex solids, of which at least one is round.
///
/// If the axis is the normal of a flat face, the points are on the supporting feature of the other
/// solid, clipped against the face. The feature of a frustum is a cap or a line on its side. The
/// line is the one that is farthest along the axis, so that a rolling cylinder has exact contacts.
/// A cap is a polygon whose corners are fixed in the solid, so that they keep their features, and
/// the deepest point of the rim, if the cap is tilted. Other axes have a point, or two points on
/// lines that are nearly parallel.
#pragma once

#include "src/collide/face_points.hpp"
#include "src/collide/round/convex_pair.hpp"
#include "src/collide/shapes/capsule.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The corners of the polygon that stands for a disc. A distance from its sides is at most 2 % of
/// the radius less than that from the rim.
inline constexpr int kCapCorners = 16;

/// The unit vector to a corner.
JFPX_HD inline Vec3 cap_direction(int k) {
  constexpr Real kCosines[5] = {1, Real(0.92387953251128675613), Real(0.70710678118654752440),
                                Real(0.38268343236508977173), 0};
  const auto cosine = [&](int sixteenths) {
    const int i = sixteenths % kCapCorners, mirrored = i > 8 ? kCapCorners - i : i;
    return mirrored > 4 ? -kCosines[8 - mirrored] : kCosines[mirrored];
  };
  return {cosine(k), 0, cosine(k + 12)};
}
/// The corners in counterclockwise order, seen from outside.
JFPX_HD inline Vec3 cap_corner(const Frustum& frustum, int cap, int k) {
  return frustum.rim_point(cap == 1, cap_direction(cap == 1 ? kCapCorners - k : k));
}

/// A line on the surface of a solid, or a point if both ends are equal.
struct SupportingLine {
  Vec3 from, to;         ///< [m]
  Real disc_radius = 0;  ///< [m]; not 0: the point is the middle of a cap that is hardly tilted

  JFPX_HD bool is_point() const { return from == to; }
  JFPX_HD bool is_disc() const { return disc_radius > 0; }
};

/// Directions within 1.7 degrees of a right angle to a line are normals of the line.
inline constexpr Real kLineSine = Real(0.03);

/// The line or the point that is farthest in a direction.
/// @param direction unit
JFPX_HD inline SupportingLine supporting_line(const Frustum& f, const Vec3& direction) {
  const Radial radial = radial_of(direction);
  const Real slope = f.side_cosine * direction.y - f.side_sine * radial.distance;
  if (!(absolute(slope) <= kLineSine)) {
    const bool is_upper = f.is_upper_farthest(radial.distance, direction.y);
    const Real radius = is_upper ? f.upper_radius : f.lower_radius;
    const bool is_disc = radial.distance <= kLineSine && radius > 0;
    const Vec3 p = f.rim_point(is_upper, is_disc ? Vec3{} : radial.direction);
    return {p, p, is_disc ? radius : Real(0)};
  }
  return {f.rim_point(false, radial.direction), f.rim_point(true, radial.direction)};
}
JFPX_HD inline SupportingLine supporting_line(const CoreSegment& core, const Vec3& direction) {
  if (!(absolute(direction.y) <= kLineSine)) {
    const Vec3 p = support_point(core, direction);
    return {p, p};
  }
  return {{0, -core.half_length, 0}, {0, core.half_length, 0}};
}
/// @param edge_of function from a number to the ends of an edge
template <class S, class EdgeOf>
JFPX_HD SupportingLine supporting_edge(const S& solid, int count, const EdgeOf& edge_of,
                                       const Vec3& direction) {
  const Vec3 farthest = support_point(solid, direction);
  const Real reach = dot(direction, farthest);
  SupportingLine result{farthest, farthest};
  Real most = -kMaxReal;
  for (int i = 0; i < count; ++i) {
    const SupportingLine edge = edge_of(i);
    const Real from = dot(direction, edge.from), to = dot(direction, edge.to);
    const Real lowest = from < to ? from : to;
    if (!(reach - lowest <= kLineSine * length(edge.to - edge.from))) continue;
    if (from + to > most) most = from + to, result = edge;
  }
  return result;
}
template <class P>
JFPX_HD SupportingLine supporting_line(const P& polyhedron, const Vec3& direction) {
  const auto edge_of = [&](int i) -> SupportingLine {
    const PolyhedronEdge edge = polyhedron.edge(i);
    return {polyhedron.vertex(edge.a), polyhedron.vertex(edge.b)};
  };
  return supporting_edge(polyhedron, polyhedron.edge_count(), edge_of, direction);
}
JFPX_HD inline SupportingLine supporting_line(const TriangleFace& triangle, const Vec3& direction) {
  const auto edge_of = [&](int i) -> SupportingLine {
    return {triangle.corner[i], triangle.corner[i == 2 ? 0 : i + 1]};
  };
  return supporting_edge(triangle, 3, edge_of, direction);
}

/// Numbers of points, unique for a pair of faces, after those of PointFeature: the deepest point of
/// a rim, and the ends of a line.
inline constexpr std::uint32_t kRimPoint = PointFeature::kCount, kLineStart = kRimPoint + 1,
                               kLineEnd = kRimPoint + 2, kRoundFeatures = kRimPoint + 3;
/// Sine of the tilt of a cap from which the deepest point of the rim is a point of the contact. At
/// smaller tilts, the corners are nearly as deep, and the direction of the deepest point is noise.
inline constexpr Real kCapTilt = Real(0.01);
/// Number of the side of a frustum, as that of a face.
inline constexpr int kSideFace = 2;
/// Number of the first point of a face.
JFPX_HD constexpr std::uint32_t first_point_of(int face) {
  return static_cast<std::uint32_t>(face) * kRoundFeatures;
}
/// The function `add` for the points of an incident face.
template <class Add>
JFPX_HD auto points_of(int face, const Add& add) {
  return [&add, first = first_point_of(face)](const Vec3& p, Real height, std::uint32_t feature) {
    add(p, height, first + feature);
  };
}

/// A reference face, with the sides whose points are kept; see visit_face_points().
template <class CornerOf, class IsKept>
struct ReferenceFace {
  FacePolygon<CornerOf> polygon;
  IsKept is_kept;
  Real slack = 0;  ///< [m], of sides whose points are not kept

  /// Calls visit(outward, limit, side) for the sides: inside is dot(outward, p) <= limit.
  template <class Visit>
  JFPX_HD void visit_sides(const Visit& visit) const {
    for (int j = 0; j < polygon.count; ++j) {
      const Vec3 start = polygon.corner(j);
      const Vec3 outward = cross(polygon.corner(polygon.next(j)) - start, polygon.normal);
      const Real wider = is_kept(j) ? Real(0) : slack * length(outward);
      visit(outward, dot(outward, start) + wider, j);
    }
  }
  JFPX_HD Real height(const Vec3& p) const { return dot(polygon.normal, p - polygon.corner(0)); }
};
template <class CornerOf, class IsKept>
JFPX_HD ReferenceFace<CornerOf, IsKept> make_reference(const FacePolygon<CornerOf>& polygon,
                                                       const IsKept& is_kept, Real slack) {
  return {polygon, is_kept, slack};
}

/// Adds the ends of the part of a line above or below a face, except those on sides whose points
/// are not kept.
template <class Reference, class Add>
JFPX_HD void visit_line_points(const Reference& face, const Vec3& from, const Vec3& to,
                               const Add& add) {
  Real enter = 0, leave = 1;
  bool is_inside = true, keeps_start = true, keeps_end = true;
  face.visit_sides([&](const Vec3& outward, Real limit, int side) {
    const Real d_from = dot(outward, from) - limit, d_to = dot(outward, to) - limit;
    if (d_from > 0 && d_to > 0) is_inside = false;
    if ((d_from > 0) == (d_to > 0)) return;
    const Real t = d_from / (d_from - d_to);
    if (d_from > 0 && t > enter) enter = t, keeps_start = face.is_kept(side);
    if (d_to > 0 && t < leave) leave = t, keeps_end = face.is_kept(side);
  });
  if (!is_inside || enter > leave) return;
  const Vec3 start = add_scaled(from, to - from, enter), end = add_scaled(from, to - from, leave);
  if (keeps_start) add(start, face.height(start), kLineStart);
  if (keeps_end && leave > enter) add(end, face.height(end), kLineEnd);
}

/// Whether a face with a normal lies on a face with the opposite direction.
JFPX_HD inline bool is_flat_on(const Vec3& normal, const Vec3& direction) {
  return length_squared(cross(normal, direction)) <= kCapTilt * kCapTilt &&
         dot(normal, direction) > 0;
}

/// Calls add(point, height, feature) for the points of a solid that are above or below the
/// reference face of the other one.
/// @param place     function from a point in the axes of the solid to those of the face
/// @param direction unit, opposite to the normal of the face, in the axes of the solid
/// @returns whether the solid lies on the face with a flat face
template <class Reference, class Place, class Add>
JFPX_HD bool visit_incident(const Reference& face, const Frustum& f, const Place& place,
                            const Vec3& direction, const Add& add) {
  const Radial radial = radial_of(direction);
  const int cap = direction.y > 0 ? 1 : 0;
  if (!f.rests_on_cap(radial.distance, direction.y)) {
    visit_line_points(face, place(f.rim_point(false, radial.direction)),
                      place(f.rim_point(true, radial.direction)), points_of(kSideFace, add));
    return false;
  }
  const Vec3 origin = place({});
  const auto polygon = make_face(
      kCapCorners, [&](int k) { return place(cap_corner(f, cap, k)); },
      place(f.cap_normal(cap)) - origin);
  const auto add_point_of_cap = points_of(cap, add);
  visit_face_points(face.polygon, polygon, face.is_kept, face.slack, add_point_of_cap);
  if (!(radial.distance > kCapTilt)) return true;
  const Vec3 lowest = place(f.rim_point(cap == 1, radial.direction));
  bool is_inside = true;
  face.visit_sides(
      [&](const Vec3& outward, Real limit, int) { is_inside &= dot(outward, lowest) <= limit; });
  if (is_inside) add_point_of_cap(lowest, face.height(lowest), kRimPoint);
  return false;
}
template <class Reference, class Place, class Add>
JFPX_HD bool visit_incident(const Reference& face, const CoreSegment& core, const Place& place,
                            const Vec3&, const Add& add) {
  visit_line_points(face, place({0, -core.half_length, 0}), place({0, core.half_length, 0}), add);
  return false;
}
template <class Reference, class Place, class Add>
JFPX_HD bool visit_incident(const Reference& face, const TriangleFace& triangle, const Place& place,
                            const Vec3& direction, const Add& add) {
  const auto polygon = make_face(
      3, [&](int k) { return place(triangle.corner[k]); }, place(triangle.normal) - place({}));
  visit_face_points(face.polygon, polygon, face.is_kept, face.slack, add);
  return is_flat_on(triangle.normal, direction);
}
template <class Reference, class P, class Place, class Add>
JFPX_HD bool visit_incident(const Reference& face, const P& polyhedron, const Place& place,
                            const Vec3& direction, const Add& add) {
  const int index = incident_face(polyhedron, -direction);
  const auto polygon = make_face(
      polyhedron.corner_count(index), [&](int k) { return place(polyhedron.corner(index, k)); },
      place(polyhedron.face_normal(index)) - place({}));
  visit_face_points(face.polygon, polygon, face.is_kept, face.slack, points_of(index, add));
  return is_flat_on(polyhedron.face_normal(index), direction);
}

/// Calls add(point, feature) for the supporting feature in a direction: both ends of a line of the
/// side, or the corners of a cap and the deepest point of its rim.
/// @param direction unit
template <class Add>
JFPX_HD void visit_lowest_points(const Frustum& f, const Vec3& direction, const Add& add) {
  const Radial radial = radial_of(direction);
  const int cap = direction.y > 0 ? 1 : 0;
  if (!f.rests_on_cap(radial.distance, direction.y)) {
    add(f.rim_point(false, radial.direction), first_point_of(kSideFace) + kLineStart);
    add(f.rim_point(true, radial.direction), first_point_of(kSideFace) + kLineEnd);
    return;
  }
  for (int k = 0; k < kCapCorners; ++k) {
    add(cap_corner(f, cap, k), first_point_of(cap) + PointFeature::corner(k));
  }
  if (radial.distance > kCapTilt) {
    add(f.rim_point(cap == 1, radial.direction), first_point_of(cap) + kRimPoint);
  }
}

JFPX_HD inline int corner_count(const Frustum&, int) { return kCapCorners; }
JFPX_HD inline Vec3 corner(const Frustum& f, int cap, int k) { return cap_corner(f, cap, k); }
JFPX_HD inline int corner_count(const CoreSegment&, int) { return 0; }
JFPX_HD inline Vec3 corner(const CoreSegment&, int, int) { return {}; }
JFPX_HD inline int corner_count(const TriangleFace&, int) { return 3; }
JFPX_HD inline Vec3 corner(const TriangleFace& t, int, int k) { return t.corner[k]; }
template <class P>
JFPX_HD int corner_count(const P& polyhedron, int face) {
  return polyhedron.corner_count(face);
}
template <class P>
JFPX_HD Vec3 corner(const P& polyhedron, int face, int k) {
  return polyhedron.corner(face, k);
}

JFPX_HD inline Segment segment_between(const Vec3& from, const Vec3& to) {
  const Vec3 along = to - from;
  const Real size = length(along);
  return {(from + to) * Real(0.5), along * (Real(1) / size), size * Real(0.5)};
}

/// The point of a line that is closest to another point.
JFPX_HD inline Vec3 closest_of_line(const SupportingLine& line, const Vec3& p) {
  if (line.is_point()) return line.from;
  const Segment segment = segment_between(line.from, line.to);
  return segment.point(segment.closest(p));
}

/// The points of an axis that is not the normal of a face: where two lines are closest, or two
/// points on lines that are nearly parallel. Where the lines are not opposite to each other along
/// the axis, the closest points of the solids: a face that is hardly tilted has several supporting
/// edges, and a long line that is hardly tilted leaves the other solid.
/// @param normal   unit, from b to a, in the axes of a
/// @param distance [m], along the axis
/// @param add      receives point on a, height above b, feature
template <class A, class B, class Add>
JFPX_HD void visit_line_pair(const ConvexPair<A, B>& pair, const Vec3& normal, Real distance,
                             const Add& add) {
  const SupportingLine a = supporting_line(pair.a, -normal);
  const SupportingLine local = supporting_line(pair.b, transform_transpose(pair.rotation, normal));
  const SupportingLine b{pair.place(local.from), pair.place(local.to), local.disc_radius};
  const auto across = [&](const Vec3& on_a, const Vec3& on_b) {
    const Vec3 offset = on_a - on_b;
    return add_scaled(offset, normal, -dot(normal, offset));
  };
  const auto add_single = [&](const Vec3& on_a) { add(on_a, distance, kRimPoint); };
  // A point of a, if it is opposite to a point of b up to a distance across the axis.
  const auto add_opposite = [&](const Vec3& on_a, const Vec3& from, const Vec3& to, Real most) {
    const bool is_opposite = length_squared(across(from, to)) <= most * most;
    add_single(is_opposite ? on_a : closest_point_of_a(pair, normal, distance));
  };
  const Real gap = pair.clear_gap();
  // Where a cap is hardly tilted, the direction of its deepest point is noise.
  if (a.is_disc() && b.is_disc()) {
    const Real radius = a.disc_radius < b.disc_radius ? a.disc_radius : b.disc_radius;
    const Vec3 middle = add_scaled(a.from, across(b.from, a.from), Real(0.5));
    return add_opposite(middle, a.from, b.from, 2 * radius);
  }
  if (a.is_disc()) {
    const Vec3 on_b = closest_of_line(b, a.from);
    return add_opposite(add_scaled(on_b, normal, distance), a.from, on_b, a.disc_radius);
  }
  if (b.is_disc()) {
    const Vec3 on_a = closest_of_line(a, b.from);
    return add_opposite(on_a, on_a, b.from, b.disc_radius);
  }
  if (a.is_point()) return add_opposite(a.from, a.from, closest_of_line(b, a.from), gap);
  if (b.is_point()) {
    const Vec3 on_a = add_scaled(b.from, normal, distance);
    return add_opposite(on_a, closest_of_line(a, on_a), b.from, gap);
  }
  const Vec3 along_a = a.to - a.from, along_b = b.to - b.from, common = cross(along_a, along_b);
  const Real sizes = length_squared(along_a) * length_squared(along_b);
  if (length_squared(common) > kLineSine * kLineSine * sizes) {
    const Segment first = segment_between(a.from, a.to), second = segment_between(b.from, b.to);
    const ClosestPoints t = closest_points(first, second);
    const Vec3 on_a = first.point(t.a), on_b = second.point(t.b);
    const Vec3 middle = (on_a + on_b) * Real(0.5);
    return add_opposite(add_scaled(middle, normal, distance * Real(0.5)), on_a, on_b, gap);
  }
  // The common part of both lines, as parameters of a.
  const Real scale = Real(1) / length_squared(along_a);
  const Real p = dot(along_a, b.from - a.from) * scale, q = dot(along_a, b.to - a.from) * scale;
  const Real lower = p < q ? p : q, upper = p < q ? q : p;
  const Real start = lower > 0 ? lower : Real(0), end = upper < 1 ? upper : Real(1);
  const auto on_a = [&](Real t) { return add_scaled(a.from, along_a, t); };
  const auto on_b = [&](Real t) { return add_scaled(b.from, along_b, (t - p) / (q - p)); };
  if (!(start < end)) {
    const Vec3 nearest = on_a(start > 1 ? Real(1) : end < 0 ? Real(0) : start);
    return add_opposite(nearest, nearest, closest_of_line(b, nearest), gap);
  }
  const Vec3 starts[2] = {on_a(start), on_b(start)}, ends[2] = {on_a(end), on_b(end)};
  if (length_squared(across(starts[0], starts[1])) > gap * gap ||
      length_squared(across(ends[0], ends[1])) > gap * gap) {
    return add_single(closest_point_of_a(pair, normal, distance));
  }
  add(starts[0], dot(normal, starts[0] - starts[1]), kLineStart);
  add(ends[0], dot(normal, ends[0] - ends[1]), kLineEnd);
}

/// The points of a contact. add() receives a point in the middle of the overlap in the axes of a,
/// distance and feature.
/// @param radius_a,radius_b [m], around the solids: not 0 for the core of a capsule
/// @param margin            [m], largest distance of a point
/// @returns whether two flat faces lie on each other
template <class A, class B, class Add>
JFPX_HD bool visit_contact_points(const ConvexPair<A, B>& pair, ConvexAxes::Kind kind,
                                  const LeastOverlap& axis, Real radius_a, Real radius_b,
                                  Real margin, const Add& add) {
  constexpr std::uint32_t kLines = 0x80000000u;
  const Vec3& normal = axis.normal;
  const Real radii = radius_a + radius_b;
  // Half the distance of the surfaces from a point on the core of a.
  const auto add_on_a = [&](const Vec3& p, Real height, std::uint32_t feature) {
    const Real distance = height - radii;
    if (!(distance <= margin)) return;
    add(add_scaled(p, normal, -(radius_a + distance * Real(0.5))), distance, feature);
  };
  if (kind == ConvexAxes::other) {
    visit_line_pair(pair, normal, axis.distance,
                    [&](const Vec3& p, Real height, std::uint32_t feature) {
                      add_on_a(p, height, kLines + feature);
                    });
    return false;
  }
  const auto all = [](int) { return true; };
  // Unique up to a collision of the products, which only moves impulses.
  const std::uint32_t faces =
      (2 * static_cast<std::uint32_t>(axis.axis) + (kind == ConvexAxes::face_of_b ? 0 : 1)) *
      (256 * kRoundFeatures);
  if (kind == ConvexAxes::face_of_b) {
    const auto polygon = make_face(
        corner_count(pair.b, axis.axis),
        [&](int k) { return pair.place(corner(pair.b, axis.axis, k)); }, normal);
    const auto same = [](const Vec3& p) { return p; };
    return visit_incident(make_reference(polygon, all, 0), pair.a, same, -normal,
                          [&](const Vec3& p, Real height, std::uint32_t feature) {
                            add_on_a(p, height, (faces + feature) & 0x7fffffffu);
                          });
  }
  const auto polygon = make_face(
      corner_count(pair.a, axis.axis), [&](int k) { return corner(pair.a, axis.axis, k); },
      -normal);
  return visit_incident(
      make_reference(polygon, all, 0), pair.b, [&](const Vec3& p) { return pair.place(p); },
      transform_transpose(pair.rotation, normal),
      [&](const Vec3& p, Real height, std::uint32_t feature) {
        add_on_a(add_scaled(p, normal, height), height, (faces + feature) & 0x7fffffffu);
      });
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
