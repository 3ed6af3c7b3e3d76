/// The capsule: mass, bounds, ray, submerged volume, and contacts with capsules, boxes, spheres and
/// half-spaces.
#pragma once

#include "src/collide/contact_basis.hpp"
#include "src/collide/shapes/box.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Capsule> = "capsule";

JFPX_HD inline Solid to_solid(const Capsule& capsule) {
  return {{0, capsule.half_height, 0}, capsule.radius};
}
JFPX_HD inline Capsule from_solid(const Solid& solid, std::type_identity<Capsule>) {
  return {solid.radius, solid.half_extents.y};
}

/// [m^3]
inline double volume(const Capsule& capsule) {
  const auto r = static_cast<double>(capsule.radius), h = static_cast<double>(capsule.half_height);
  return 3.14159265358979323846 * r * r * (2 * h + 4.0 / 3.0 * r);
}
/// [kg m^2], principal moments of a solid capsule: a cylinder and two half balls, whose centres of
/// mass are 3/8 of the radius from their plane faces.
JFPX_HD constexpr Vec3 moments_of_inertia(const Capsule& capsule, Real mass) {
  const Real r = capsule.radius, h = capsule.half_height;
  const Real cylinder = mass * (3 * h / (3 * h + 2 * r)), balls = mass - cylinder;
  const Real across =
      cylinder * (r * r / 4 + h * h / 3) + balls * (Real(0.4) * r * r + h * h + Real(0.75) * h * r);
  return {across, cylinder * (r * r / 2) + balls * (Real(0.4) * r * r), across};
}

inline Real outer_radius(const Capsule& capsule) { return capsule.radius + capsule.half_height; }
inline Real bounding_radius(const Capsule& capsule) {
  return outer_radius(capsule) * (1 + 64 * kEpsilon);
}
JFPX_HD inline Real least_half_width(const Capsule& capsule) { return capsule.radius; }
JFPX_HD inline Vec3 half_extents(const Capsule& capsule, const Transform& pose) {
  const auto along = [&](const Vec3& row) {
    return absolute(row.y) * capsule.half_height + capsule.radius;
  };
  return {along(pose.basis.row[0]), along(pose.basis.row[1]), along(pose.basis.row[2])};
}

/// The axis of a capsule in the world.
struct Segment {
  Vec3 centre, axis;     ///< [m]; unit
  Real half_length = 0;  ///< [m]

  JFPX_HD Vec3 point(Real t) const { return add_scaled(centre, axis, t); }
  /// The parameter of the closest point, in [-half_length, half_length].
  JFPX_HD Real closest(const Vec3& p) const { return clamp(dot(axis, p - centre)); }
  JFPX_HD Real clamp(Real t) const {
    return t > half_length ? half_length : t < -half_length ? -half_length : t;
  }
};
/// A part of a segment, as a range of its parameter; empty if lower > upper.
struct SegmentPart {
  Real lower = 0, upper = 0;

  JFPX_HD explicit SegmentPart(const Segment& segment)
      : lower(-segment.half_length), upper(segment.half_length) {}
  /// Clips the part to parameters t with height + t * climb <= 0 (Cyrus and Beck 1978).
  /// @returns false if a segment parallel to the plane is outside
  JFPX_HD bool clip(Real height, Real climb) {
    if (climb == 0) return !(height > 0);
    const Real at = -height / climb;
    if (climb < 0) {
      lower = at > lower ? at : lower;
    } else {
      upper = at < upper ? at : upper;
    }
    return true;
  }
};
JFPX_HD inline Segment axis_of(const Posed<Capsule>& capsule) {
  return {capsule.pose.origin, capsule.pose.basis.column(1), capsule.shape.half_height};
}

/// The first entry into the cylinder between the half balls, or into one of the balls. The half
/// chord of the cylinder is computed like that of a sphere.
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction, const Capsule& capsule,
                              const Transform& pose) {
  const Segment segment = axis_of({capsule, pose});
  const Real r = capsule.radius;
  const Vec3 offset = origin - segment.point(segment.closest(origin));
  if (!(length_squared(offset) > r * r)) return {true, 0, -direction};
  RayEntry first;
  for (const Real end : {-segment.half_length, segment.half_length}) {
    const RayEntry entry = enter(origin, direction, SphereInstance{segment.point(end), r});
    if (entry.hit && (!first.hit || entry.distance < first.distance)) first = entry;
  }
  const Vec3 from = origin - segment.centre;
  const Real height = dot(segment.axis, from), climb = dot(segment.axis, direction);
  const Vec3 across = add_scaled(from, segment.axis, -height);
  const Vec3 drift = add_scaled(direction, segment.axis, -climb);
  const Real speed = length(drift);
  if (!(speed > kEpsilon)) return first;
  const Vec3 heading = drift * (Real(1) / speed);
  const Real ahead = -dot(across, heading);
  if (!(ahead > 0)) return first;
  const Vec3 beside = add_scaled(across, heading, ahead) * (Real(1) / r);
  const Real half_chord2 = 1 - length_squared(beside);
  if (!(half_chord2 >= 0)) return first;
  const Real half_chord = square_root(half_chord2);
  const Real reach = ahead - half_chord * r, distance = (reach > 0 ? reach : Real(0)) / speed;
  if (!(absolute(height + climb * distance) <= segment.half_length)) return first;
  if (first.hit && !(distance < first.distance)) return first;
  return {true, distance, normalized(add_scaled(beside, heading, -half_chord))};
}

/// Volume below a plane, for a polyhedron with the volume of the capsule: its corners are those of
/// a regular polygon with twelve sides on each of six circles. The error of a partial volume is
/// below 1 % of the total volume.
/// @param basis axes of the capsule; its centre is the origin
JFPX_HD inline Submerged submerged(const Capsule& capsule, const Mat3& basis,
                                   const HalfSpace& liquid) {
  constexpr int kSides = 12, kRings = 6;
  constexpr Real kHalfRoot3 = Real(0.86602540378443864676);
  constexpr Real kCosines[4] = {1, kHalfRoot3, Real(0.5), 0};  // of 0, 30, 60 and 90 degrees
  // Factors of the radius with which the polygon has the area of the circle, and the stack of
  // prismatoids has the volume of the half ball.
  constexpr Real kAcross = Real(1.02332670794648848847), kAlong = Real(1.07179676972449087);
  const auto cosine = [&](int twelfths) {
    const int i = twelfths % kSides, mirrored = i > 6 ? kSides - i : i;
    return mirrored > 3 ? -kCosines[6 - mirrored] : kCosines[mirrored];
  };
  const auto corner = [&](int ring, int side) {
    // Rings 0 to 2 belong to the lower half ball, from the pole upwards, without the pole.
    const int latitude = ring < 3 ? 2 - ring : ring - 3;
    const Real sign = ring < 3 ? Real(-1) : Real(1);
    const Real across = capsule.radius * kAcross * kCosines[latitude];
    const Real along = capsule.half_height + capsule.radius * kAlong * kCosines[3 - latitude];
    const Vec3 point = basis * Vec3{across * cosine(side), sign * along, across * cosine(side + 9)};
    return Corner{point, dot(liquid.normal, point) - liquid.offset};
  };
  const auto pole = [&](Real sign) {
    const Vec3 point = basis * Vec3{0, sign * (capsule.half_height + capsule.radius * kAlong), 0};
    return Corner{point, dot(liquid.normal, point) - liquid.offset};
  };
  const Corner centre{{}, -liquid.offset};
  Submerged sum;
  const auto add = [&](const Corner& a, const Corner& b, const Corner& c) {
    Corner tetrahedron[4] = {centre, a, b, c};
    add_clipped(tetrahedron, &sum);
  };
  for (int side = 0; side < kSides; ++side) {
    add(pole(-1), corner(0, side), corner(0, side + 1));
    add(pole(1), corner(kRings - 1, side), corner(kRings - 1, side + 1));
    for (int ring = 0; ring + 1 < kRings; ++ring) {
      const Corner a = corner(ring, side), b = corner(ring, side + 1);
      const Corner c = corner(ring + 1, side), d = corner(ring + 1, side + 1);
      add(a, b, c);
      add(b, c, d);
    }
  }
  return sum;
}

/// Adds the contact point at which the surface of a capsule is closest to the other shape.
/// @param core     [m], point of the capsule's axis after the fraction `shift` of the motion
/// @param distance [m], after that fraction
JFPX_HD inline void add_point(const Posed<Capsule>& capsule, const Vec3& core, const Vec3& shift,
                              Real distance, std::uint32_t feature, const PairMotion& pair,
                              PairManifold* manifold) {
  const Real overlap = distance < 0 ? distance : Real(0);
  const Vec3 point = core - manifold->normal * (capsule.shape.radius + overlap * Real(0.5));
  manifold->add(point - shift - pair.origin_a, point - pair.origin_b,
                distance - dot(shift, manifold->normal), feature, point - shift);
}

/// The capsule after a fraction of the motion.
JFPX_HD inline Posed<Capsule> moved(const Posed<Capsule>& capsule, const PairMotion& pair, Real t) {
  return {capsule.shape, {capsule.pose.basis, moved(capsule.pose.origin, pair, t)}};
}

/// A capsule and a ball, by the closest point of the axis. If the centre is on the axis, the normal
/// is the x axis of the capsule.
JFPX_HD inline void find_contact(const Posed<Capsule>& a, const SphereInstance& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  Vec3 core;
  Separation closest;
  Real t = 0;
  const auto separation_at = [&](Real part) {
    const Segment segment = axis_of(moved(a, pair, part));
    core = segment.point(segment.closest(b.centre));
    const Vec3 offset = core - b.centre;
    const Real gap = length(offset);
    closest.normal = gap > kEpsilon ? offset * (Real(1) / gap) : a.pose.basis.column(0);
    closest.distance = gap - (a.shape.radius + b.radius);
    return closest;
  };
  if (!advance(pair, separation_at, &t)) return;
  manifold->normal = closest.normal;
  add_point(a, core, pair.motion * t, closest.distance, 0, pair, manifold);
}

/// The half balls of a capsule against a half-space.
JFPX_HD inline void find_contact(const Posed<Capsule>& a, const HalfSpace& wall,
                                 const PairMotion& pair, PairManifold* manifold) {
  const Segment segment = axis_of(a);
  add_corner(segment.point(-segment.half_length), a.shape.radius, wall, 0, pair, manifold);
  add_corner(segment.point(segment.half_length), a.shape.radius, wall, 1, pair, manifold);
}

/// Features of the points of a capsule: the lower and the upper end of the overlap of two axes, or
/// of an axis and a face, and a single point.
inline constexpr std::uint32_t kLowerPoint = 0, kUpperPoint = 1, kSinglePoint = 2;
/// [-], fraction of the radius. Two points replace the closest points only if one of them is as
/// deep as these up to this tolerance.
inline constexpr Real kNearlyDeepest = Real(0.01);

/// The normal of a capsule's contact within 3 degrees of that of a face makes it a contact with the
/// face.
inline constexpr Real kRestingCosine = Real(0.998);

/// Adds the ends of the part of a capsule's axis above a face, unless an end beside the face is
/// deeper.
/// @param distance [m], of the axis from the other shape
/// @param height   function from a parameter to the height above the face [m]
/// @param add      receives parameter, height and feature of a point, in this order
template <class Height, class Add>
JFPX_HD void add_ends(const SegmentPart& part, Real distance, Real radius, const PairMotion& pair,
                      const Height& height, const Add& add) {
  const Real low = height(part.lower), high = height(part.upper);
  if (!((low < high ? low : high) <= distance + kNearlyDeepest * radius)) return;
  const Real highest = pair.margin + radius;
  if (low <= highest) add(part.lower, low, kLowerPoint);
  if (high <= highest && part.upper > part.lower) add(part.upper, high, kUpperPoint);
}

/// Parameters of the closest points of two segments (Ericson 2005, 5.1.9).
struct ClosestPoints {
  Real a = 0, b = 0;
};
JFPX_HD inline ClosestPoints closest_points(const Segment& a, const Segment& b) {
  const Vec3 across = a.centre - b.centre;
  const Real cosine = dot(a.axis, b.axis), from_a = dot(a.axis, across),
             from_b = dot(b.axis, across);
  // For axes at a small angle, the sine loses half as few digits as 1 - cosine^2.
  const Real sine2 = length_squared(cross(a.axis, b.axis));
  ClosestPoints t;
  t.a = sine2 > 4 * kEpsilon ? a.clamp((cosine * from_b - from_a) / sine2) : Real(0);
  t.b = b.clamp(cosine * t.a + from_b);
  t.a = a.clamp(cosine * t.b - from_a);
  return t;
}

/// Two capsules. If their axes are within 3 degrees of parallel, two points at the ends of the
/// overlap of the axes, so that a capsule can rest on another one. Otherwise, or if the axes cross
/// between these ends, the closest points.
JFPX_HD inline void find_contact(const Posed<Capsule>& a, const Posed<Capsule>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  constexpr Real kParallelSine = Real(0.05);
  const Segment fixed = axis_of(b);
  const Real radii = a.shape.radius + b.shape.radius;
  Segment segment;
  ClosestPoints nearest;
  Separation closest;
  Real t = 0;
  const auto separation_at = [&](Real part) {
    segment = axis_of(moved(a, pair, part));
    nearest = closest_points(segment, fixed);
    const Vec3 offset = segment.point(nearest.a) - fixed.point(nearest.b);
    const Real gap = length(offset);
    if (gap > kEpsilon) {
      closest.normal = offset * (Real(1) / gap);
    } else {  // the axes intersect
      const Vec3 common = normalized(cross(segment.axis, fixed.axis));
      const Vec3 normal =
          length_squared(common) > Real(0.5) ? common : contact_basis(segment.axis).tangent;
      closest.normal = dot(normal, segment.centre - fixed.centre) < 0 ? -normal : normal;
    }
    closest.distance = gap - radii;
    return closest;
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3 shift = pair.motion * t;
  const auto add_single = [&] {
    manifold->normal = closest.normal;
    add_point(a, segment.point(nearest.a), shift, closest.distance, kSinglePoint, pair, manifold);
  };
  const Real sine2 = length_squared(cross(segment.axis, fixed.axis));
  if (!(sine2 < kParallelSine * kParallelSine)) return add_single();
  const Real middle = dot(segment.axis, fixed.centre - segment.centre);
  const Real half = absolute(dot(segment.axis, fixed.axis)) * fixed.half_length;
  const Real lower = segment.clamp(middle - half), upper = segment.clamp(middle + half);
  if (!(upper - lower > Real(0.01) * radii)) return add_single();
  const Vec3 low = segment.point(lower), high = segment.point(upper);
  const Vec3 low_offset = low - fixed.point(fixed.closest(low));
  const Vec3 high_offset = high - fixed.point(fixed.closest(high));
  const Real low_gap = length(low_offset), high_gap = length(high_offset);
  const Real least = low_gap < high_gap ? low_gap : high_gap;
  if (!(least <= closest.distance + radii * (1 + kNearlyDeepest))) return add_single();
  const Vec3 mean = low_offset + high_offset;
  const Real size = length(mean);
  if (!(size > kEpsilon)) return add_single();
  manifold->normal = mean * (Real(1) / size);
  const auto add_end = [&](const Vec3& core, Real distance, std::uint32_t feature) {
    if (distance <= pair.margin) add_point(a, core, shift, distance, feature, pair, manifold);
  };
  add_end(low, low_gap - radii, kLowerPoint);
  add_end(high, high_gap - radii, kUpperPoint);
  if (manifold->point_count == 0) add_single();
}

/// The axis of a capsule in the axes of a box, and the closest features of the axis and the box.
struct CapsuleOnBox {
  Segment segment;
  Real nearest = 0;   ///< parameter of the closest point of the axis
  Vec3 normal;        ///< unit, from the box to the capsule
  Real distance = 0;  ///< [m], of the axis from the box; < 0: depth
};

/// Parameter of the point of a segment that is closest to a box. The derivative of the squared
/// distance is piecewise linear and does not decrease; its breakpoints are the intersections with
/// the planes of the faces. The zero is therefore between two breakpoints.
JFPX_HD inline Real closest_to_box(const Segment& segment, const Box& box) {
  const auto slope = [&](Real t) {
    return dot(segment.axis, offset_from_box(segment.point(t), box));
  };
  Real below = -segment.half_length, above = segment.half_length;
  Real slope_below = slope(below), slope_above = slope(above);
  if (slope_below >= 0 && slope_above > 0) return below;
  if (slope_above <= 0 && slope_below < 0) return above;
  for (int i = 0; i < 3; ++i) {
    if (segment.axis[i] == 0) continue;
    for (const Real side : {-box.half_extents[i], box.half_extents[i]}) {
      const Real t = (side - segment.centre[i]) / segment.axis[i];
      if (!(t > below && t < above)) continue;
      const Real s = slope(t);
      if (s < 0) below = t, slope_below = s;
      if (s > 0) above = t, slope_above = s;
      if (s == 0) {  // the middle of the interval with constant distance
        if (slope_below < 0)
          below = t, slope_below = 0;
        else if (slope_above > 0)
          above = t, slope_above = 0;
      }
    }
  }
  const Real rise = slope_above - slope_below;
  if (!(rise > 0)) return (below + above) * Real(0.5);
  return below - slope_below * ((above - below) / rise);
}

/// For an axis that intersects the box: the axis of least depth, as for two boxes.
JFPX_HD inline void find_depth(const Box& box, CapsuleOnBox* state) {
  const Segment& s = state->segment;
  const Real size = length(box.half_extents) + s.half_length, error = 8 * kEpsilon * size;
  LeastOverlap faces, edges;
  const auto try_axis = [&](int index, const Vec3& axis, Real tolerance, LeastOverlap* best) {
    const Real along = dot(axis, s.centre);
    const Real distance = absolute(along) - projected_half_length(box.half_extents, axis) -
                          absolute(dot(axis, s.axis)) * s.half_length;
    if (best->axis < 0 || distance > best->distance) {
      *best = {index, distance, tolerance, along < 0 ? -axis : axis};
    }
  };
  for (int i = 0; i < 3; ++i) try_axis(i, unit_axis(i), error, &faces);
  for (int i = 0; i < 3; ++i) {
    const Vec3 axis = cross(unit_axis(i), s.axis);
    const Real sine = length(axis);
    if (sine * sine > 4 * kEpsilon) try_axis(3 + i, axis * (Real(1) / sine), error / sine, &edges);
  }
  const LeastOverlap& least = preferred(faces, edges);
  state->normal = least.normal;
  state->distance = least.distance;
  if (least.axis < 3) return;
  // The point of the capsule's axis closest to the box edge that is farthest along the normal.
  const Vec3 edge = unit_axis(least.axis - 3);
  Vec3 corner = support(box.half_extents, Mat3{}, {}, least.normal);
  corner[least.axis - 3] = 0;
  const Segment line{corner, edge, kMaxReal};
  state->nearest = closest_points(s, line).a;
}

/// A capsule and a box. If the normal is within 3 degrees of a face normal, the points are the ends
/// of the part of the axis above the face, so that a capsule can rest on a box. Otherwise, the
/// closest points.
JFPX_HD inline void find_contact(const Posed<Capsule>& a, const Posed<Box>& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  const Mat3& axes = b.pose.basis;
  const Real size = length(b.shape.half_extents) + a.shape.half_height;
  CapsuleOnBox state;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    const Segment segment = axis_of(moved(a, pair, part));
    state.segment = {transform_transpose(axes, segment.centre - b.pose.origin),
                     transform_transpose(axes, segment.axis), segment.half_length};
    state.nearest = closest_to_box(state.segment, b.shape);
    const Vec3 offset = offset_from_box(state.segment.point(state.nearest), b.shape);
    state.distance = length(offset);
    if (state.distance > 8 * kEpsilon * size) {
      state.normal = offset * (Real(1) / state.distance);
    } else {
      find_depth(b.shape, &state);
    }
    return {axes * state.normal, state.distance - a.shape.radius};
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3 shift = pair.motion * t;
  const Segment& segment = state.segment;
  const auto add = [&](Real at, Real distance, std::uint32_t feature) {
    const Vec3 core = axes * segment.point(at) + b.pose.origin;
    add_point(a, core, shift, distance - a.shape.radius, feature, pair, manifold);
  };
  int face = 0;
  for (int i = 1; i < 3; ++i) {
    if (absolute(state.normal[i]) > absolute(state.normal[face])) face = i;
  }
  // The part of the axis above the face.
  SegmentPart part(segment);
  for (int k = 1; k < 3; ++k) {
    const int i = (face + k) % 3;
    const Real h = b.shape.half_extents[i], along = segment.axis[i];
    if (along == 0) {
      if (absolute(segment.centre[i]) > h) part.lower = 1, part.upper = 0;
      continue;
    }
    const Real first = (-h - segment.centre[i]) / along, last = (h - segment.centre[i]) / along;
    const Real enters = first < last ? first : last, leaves = first < last ? last : first;
    part.lower = enters > part.lower ? enters : part.lower;
    part.upper = leaves < part.upper ? leaves : part.upper;
  }
  if (absolute(state.normal[face]) > kRestingCosine && part.lower <= part.upper) {
    const Real side = state.normal[face] < 0 ? Real(-1) : Real(1);
    manifold->normal = axes.column(face) * side;
    const auto height = [&](Real at) {
      return side * segment.point(at)[face] - b.shape.half_extents[face];
    };
    add_ends(part, state.distance, a.shape.radius, pair, height, add);
  }
  if (manifold->point_count > 0) return;
  manifold->normal = axes * state.normal;
  add(state.nearest, state.distance, kSinglePoint);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
