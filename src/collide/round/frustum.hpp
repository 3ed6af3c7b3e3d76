/// The frustum: the convex hull of two discs about the y axis. It is the common form of the solids
/// of revolution with flat ends, the cylinder and the cone.
#pragma once

#include "src/collide/pair_manifold.hpp"
#include "src/collide/shapes/box.hpp"

#include <concepts>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A frustum in its axes. The lower disc is at least as large as the upper one, which may be a
/// point.
struct Frustum {
  Real lower = 0, upper = 0;                ///< [m], y of the discs
  Real lower_radius = 0, upper_radius = 0;  ///< [m]
  Real side_cosine = 1, side_sine = 0;      ///< radial and axial part of the normals of the side

  /// Whether the direction of the farthest point is upwards.
  JFPX_HD bool is_upper_farthest(Real across, Real along) const {
    return upper_radius * across + upper * along > lower_radius * across + lower * along;
  }
  /// Whether a cap is more perpendicular to a direction than the side is.
  /// @param across,along radial and axial part of the direction
  JFPX_HD bool rests_on_cap(Real across, Real along) const {
    if (along > 0 && !(upper_radius > 0)) return false;
    return absolute(along) >= side_cosine * across + side_sine * along;
  }
  JFPX_HD Vec3 rim_point(bool is_upper, const Vec3& radial) const {
    const Real radius = is_upper ? upper_radius : lower_radius;
    return {radius * radial.x, is_upper ? upper : lower, radius * radial.z};
  }
  JFPX_HD Vec3 side_normal(const Vec3& radial) const {
    return {side_cosine * radial.x, side_sine, side_cosine * radial.z};
  }
  /// [m], distance of the farthest point from the origin.
  JFPX_HD Real outer_radius() const {
    const Real low = square_root(lower * lower + lower_radius * lower_radius);
    const Real high = square_root(upper * upper + upper_radius * upper_radius);
    return low < high ? high : low;
  }
  JFPX_HD int cap_count() const { return upper_radius > 0 ? 2 : 1; }
  /// Cap 0 is the lower disc.
  JFPX_HD Vec3 cap_normal(int cap) const { return {0, cap == 0 ? Real(-1) : Real(1), 0}; }
};

JFPX_HD inline Frustum make_frustum(Real lower, Real upper, Real lower_radius, Real upper_radius) {
  const Real height = upper - lower, taper = lower_radius - upper_radius;
  Frustum result{lower, upper, lower_radius, upper_radius};
  if (taper == 0) return result;
  // Squares of tiny lengths would underflow.
  const Real size = height < taper ? taper : height, across = taper / size, along = height / size;
  const Real scale = Real(1) / square_root(along * along + across * across);
  result.side_cosine = along * scale;
  result.side_sine = across * scale;
  return result;
}

/// The direction from the y axis to a point; the x axis for a point on the axis.
struct Radial {
  Vec3 direction{1, 0, 0};  ///< unit, perpendicular to the y axis
  Real distance = 0;        ///< [m], from the axis
};
JFPX_HD inline Radial radial_of(const Vec3& p) {
  const Real distance = square_root(p.x * p.x + p.z * p.z);
  if (!(distance > 0)) return {};
  const Real scale = Real(1) / distance;
  if (!is_finite(scale)) return {};
  return {{p.x * scale, 0, p.z * scale}, distance};
}

/// The farthest point in a direction.
JFPX_HD inline Vec3 support_point(const Frustum& f, const Vec3& direction) {
  const Radial radial = radial_of(direction);
  return f.rim_point(f.is_upper_farthest(radial.distance, direction.y), radial.direction);
}

/// Distance of a point from a frustum, and the normal at the closest point of the surface. Exact:
/// the closest point of the profile, which has two radii and a side.
/// @returns < 0 inside: minus the depth below the nearest part of the surface
JFPX_HD inline Separation closest_to(const Frustum& f, const Vec3& p) {
  const Radial radial = radial_of(p);
  const Vec3& out = radial.direction;
  const Real above = p.y - f.upper, below = f.lower - p.y;
  const Real beyond = radial.distance - f.lower_radius;
  const Real beside = f.side_cosine * beyond - f.side_sine * below;
  if (!(above > 0) && !(below > 0) && !(beside > 0)) {
    if (beside >= above && beside >= below) return {f.side_normal(out), beside};
    return above > below ? Separation{{0, 1, 0}, above} : Separation{{0, -1, 0}, below};
  }
  if (above >= 0 && radial.distance <= f.upper_radius) return {{0, 1, 0}, above};
  if (below >= 0 && radial.distance <= f.lower_radius) return {{0, -1, 0}, below};
  const Real from_lower = -f.side_sine * beyond - f.side_cosine * below;
  const Real from_upper = -f.side_sine * (radial.distance - f.upper_radius) + f.side_cosine * above;
  if (from_lower > 0 && from_upper < 0) return {f.side_normal(out), beside};
  const Vec3 offset = p - f.rim_point(from_lower > 0, out);
  const Real distance = length(offset);
  if (!(distance > 0)) return {f.side_normal(out), 0};
  return {offset * (Real(1) / distance), distance};
}

/// The part of a line in the range of an inequality, as an interval of its parameter.
struct RayPart {
  Real first = -kMaxReal, last = kMaxReal;
  Vec3 normal;  ///< outward, where the line enters; not set if first is not a limit

  JFPX_HD void enter_at(Real t, const Vec3& n) {
    if (t > first) first = t, normal = n;
  }
  JFPX_HD void leave_at(Real t) { last = t < last ? t : last; }
};

/// The first entry of a ray. Its parameters are relative to the point that is closest to the
/// origin of the frustum, where squares have the size of those of the frustum: far from a small
/// solid, the coefficients of the quadratic equation of the side would be inaccurate.
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction, const Frustum& f,
                              const Transform& pose) {
  const Vec3 start = inverse_transform_point(pose, origin);
  const Vec3 along = inverse_transform_direction(pose, direction);
  if (!(closest_to(f, start).distance > 0)) return {true, 0, -direction};
  const Real ahead = -dot(start, along);
  const Vec3 from = add_scaled(start, along, ahead);
  const Real size = f.outer_radius();
  if (!(length_squared(from) <= size * size * Real(1.0001))) return {};
  RayPart part;
  // The caps.
  if (along.y != 0) {
    const Real to_lower = (f.lower - from.y) / along.y, to_upper = (f.upper - from.y) / along.y;
    const bool climbs = along.y > 0;
    part.enter_at(climbs ? to_lower : to_upper, {0, climbs ? Real(-1) : Real(1), 0});
    part.leave_at(climbs ? to_upper : to_lower);
  } else if (from.y < f.lower || from.y > f.upper) {
    return {};
  }
  // The side: distance from the axis at most `radius + taper t`.
  const Real ratio = f.side_sine / f.side_cosine;
  const Real radius = f.lower_radius - ratio * (from.y - f.lower), taper = -ratio * along.y;
  const Real a = along.x * along.x + along.z * along.z - taper * taper;
  const Real b = from.x * along.x + from.z * along.z - radius * taper;
  const Real c = from.x * from.x + from.z * from.z - radius * radius;
  const auto normal_at = [&](Real t) {
    return f.side_normal(radial_of(add_scaled(from, along, t)).direction);
  };
  const Real discriminant = b * b - a * c;
  const bool is_steep = absolute(a) > 4 * kEpsilon * (1 + ratio * ratio);
  if (is_steep && a > 0) {
    if (!(discriminant >= 0)) return {};
    const Real root = square_root(discriminant), q = b > 0 ? -b - root : root - b;
    const Real p = q / a, r = q != 0 ? c / q : p;
    const Real first = p < r ? p : r, last = p < r ? r : p;
    part.enter_at(first, normal_at(first));
    part.leave_at(last);
  } else if (is_steep) {
    // The line crosses both parts of the double cone, of which the frustum is in one.
    const Real root = square_root(discriminant > 0 ? discriminant : Real(0));
    const Real q = b > 0 ? -b - root : root - b;
    const Real p = q / a, r = q != 0 ? c / q : p;
    if (taper > 0) {
      const Real at = p < r ? r : p;
      part.enter_at(at, normal_at(at));
    } else {
      part.leave_at(p < r ? p : r);
    }
  } else if (b != 0) {
    const Real at = -c / (2 * b);
    if (b < 0) {
      part.enter_at(at, normal_at(at));
    } else {
      part.leave_at(at);
    }
  } else if (c > 0) {
    return {};
  }
  if (!(part.first <= part.last)) return {};
  const Real distance = ahead + part.first;
  if (!(ahead + part.last > 0) || !(part.first > -kMaxReal)) return {};
  return {true, distance > 0 ? distance : Real(0), normalized(pose.basis * part.normal)};
}

/// Volume below a plane, for a polyhedron with the volume of the frustum: its discs are replaced by
/// regular polygons with twelve sides and the area of the discs. The error of a partial volume is
/// below 1 % of the total volume.
/// @param basis axes of the frustum, whose origin is that of the world
JFPX_HD inline Submerged submerged(const Frustum& f, const Mat3& basis, const HalfSpace& liquid) {
  constexpr int kSides = 12;
  constexpr Real kHalfRoot3 = Real(0.86602540378443864676);
  constexpr Real kCosines[4] = {1, kHalfRoot3, Real(0.5), 0};  // of 0, 30, 60 and 90 degrees
  constexpr Real kAcross = Real(1.02332670794648848847);
  const auto cosine = [&](int twelfths) {
    const int i = twelfths % kSides, mirrored = i > 6 ? kSides - i : i;
    return mirrored > 3 ? -kCosines[6 - mirrored] : kCosines[mirrored];
  };
  const auto corner_of = [&](const Vec3& local) {
    const Vec3 point = basis * local;
    return Corner{point, dot(liquid.normal, point) - liquid.offset};
  };
  const auto corner = [&](bool is_upper, int side) {
    return corner_of(f.rim_point(is_upper, Vec3{cosine(side), 0, cosine(side + 9)} * kAcross));
  };
  const Corner bottom = corner_of({0, f.lower, 0}), top = corner_of({0, f.upper, 0});
  Submerged sum;
  for (int side = 0; side < kSides; ++side) {
    const Corner a = corner(false, side), b = corner(false, side + 1);
    const Corner c = corner(true, side), d = corner(true, side + 1);
    Corner of_base[4] = {bottom, a, b, top};
    Corner of_side[4] = {top, a, b, c};
    Corner of_rest[4] = {top, b, c, d};
    add_clipped(of_base, &sum);
    add_clipped(of_side, &sum);
    add_clipped(of_rest, &sum);
  }
  return sum;
}

JFPX_HD inline Frustum to_frustum(const Cylinder& cylinder) {
  return {-cylinder.half_height, cylinder.half_height, cylinder.radius, cylinder.radius};
}

JFPX_HD inline Frustum to_frustum(const Cone& cone) {
  return make_frustum(cone.half_height * Real(-0.5), cone.half_height * Real(1.5), cone.radius, 0);
}

/// The solids of revolution with flat ends.
template <class S>
concept Round = requires(const S& solid) {
  { to_frustum(solid) } -> std::same_as<Frustum>;
};

template <Round S>
JFPX_HD RayEntry enter(const Vec3& origin, const Vec3& direction, const S& solid,
                       const Transform& pose) {
  return enter(origin, direction, to_frustum(solid), pose);
}
template <Round S>
JFPX_HD Submerged submerged(const S& solid, const Mat3& basis, const HalfSpace& liquid) {
  return submerged(to_frustum(solid), basis, liquid);
}
/// Half extents of a box around the origin of the solid.
template <Round S>
JFPX_HD Vec3 half_extents(const S& solid, const Transform& pose) {
  const Frustum frustum = to_frustum(solid);
  const auto along = [&](const Vec3& row) {
    const Real up = dot(row, support_point(frustum, row));
    const Real down = -dot(row, support_point(frustum, -row));
    return up < down ? down : up;
  };
  return {along(pose.basis.row[0]), along(pose.basis.row[1]), along(pose.basis.row[2])};
}
template <Round S>
Real outer_radius(const S& solid) {
  return to_frustum(solid).outer_radius();
}
template <Round S>
Real bounding_radius(const S& solid) {
  const Frustum frustum = to_frustum(solid);
  const Real up = frustum.upper, down = -frustum.lower;
  return bounding_radius(Box{{frustum.lower_radius, up < down ? down : up, 0}});
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
