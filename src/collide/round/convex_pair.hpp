/// The axis of the largest separation, or of least overlap, of two convex solids that are known by
/// their farthest points in all directions. Where the surfaces are curved, the axes cannot be
/// listed as for two polyhedra.
///
/// The best of some axes (normals of flat faces, common normals of lines, the line of the centres)
/// is improved: the solids are translated along it until they are separated by a clear gap, and the
/// line of the closest points is the next axis. Its separation is at least that of the axis before,
/// because the closest points have the largest separation of all axes, and the translation adds to
/// the first axis at least as much as to any other one. Overlapping solids thus need no algorithm
/// of their own. The closest points are those of Gilbert, Johnson and Keerthi (1988).
///
/// Nearly all of the time goes into the farthest points. Hence an axis is found up to a tolerance,
/// the few axes that might become the best get two rounds each, and only the best one gets more.
#pragma once

#include "src/collide/polyhedron.hpp"
#include "src/collide/round/frustum.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The core of a capsule: a segment on the y axis.
struct CoreSegment {
  Real half_length = 0;  ///< [m]
};
/// A triangle in the axes of its partner.
struct TriangleFace {
  Vec3 corner[3];  ///< [m]
  Vec3 normal;     ///< unit; the corners are counterclockwise seen from it
};

JFPX_HD inline Vec3 support_point(const BoxPolyhedron& box, const Vec3& direction) {
  const Vec3& h = box.half;
  return {direction.x < 0 ? -h.x : h.x, direction.y < 0 ? -h.y : h.y, direction.z < 0 ? -h.z : h.z};
}
JFPX_HD inline Vec3 support_point(const HullPolyhedron& hull, const Vec3& direction) {
  int farthest = 0;
  Real most = dot(direction, hull.vertex(0));
  for (int i = 1; i < hull.vertex_count(); ++i) {
    const Real reach = dot(direction, hull.vertex(i));
    if (reach > most) most = reach, farthest = i;
  }
  return hull.vertex(farthest);
}
JFPX_HD inline Vec3 support_point(const CoreSegment& core, const Vec3& direction) {
  return {0, direction.y < 0 ? -core.half_length : core.half_length, 0};
}
JFPX_HD inline Vec3 support_point(const TriangleFace& triangle, const Vec3& direction) {
  const Real p = dot(direction, triangle.corner[0]), q = dot(direction, triangle.corner[1]);
  const Real r = dot(direction, triangle.corner[2]);
  const int pq = p < q ? 1 : 0;
  return triangle.corner[r > (p < q ? q : p) ? 2 : pq];
}

// The normals of flat faces.
JFPX_HD inline int face_count(const Frustum& frustum) { return frustum.cap_count(); }
JFPX_HD inline Vec3 face_normal(const Frustum& f, int cap) { return f.cap_normal(cap); }
template <class P>
JFPX_HD int face_count(const P& polyhedron) {
  return polyhedron.face_count();
}
template <class P>
JFPX_HD Vec3 face_normal(const P& polyhedron, int face) {
  return polyhedron.face_normal(face);
}
JFPX_HD inline int face_count(const CoreSegment&) { return 0; }
JFPX_HD inline Vec3 face_normal(const CoreSegment&, int) { return {}; }
JFPX_HD inline int face_count(const TriangleFace&) { return 1; }
JFPX_HD inline Vec3 face_normal(const TriangleFace& triangle, int) { return triangle.normal; }

// Directions of lines on the surface, whose common normals with those of the other solid are axes.
JFPX_HD inline int line_count(const Frustum&) { return 1; }
JFPX_HD inline Vec3 line(const Frustum&, int) { return {0, 1, 0}; }
JFPX_HD inline int line_count(const CoreSegment&) { return 1; }
JFPX_HD inline Vec3 line(const CoreSegment&, int) { return {0, 1, 0}; }
JFPX_HD inline int line_count(const BoxPolyhedron&) { return 3; }
JFPX_HD inline Vec3 line(const BoxPolyhedron&, int i) { return unit_axis(i); }
JFPX_HD inline int line_count(const HullPolyhedron&) { return 0; }
JFPX_HD inline Vec3 line(const HullPolyhedron&, int) { return {}; }
JFPX_HD inline int line_count(const TriangleFace&) { return 3; }
JFPX_HD inline Vec3 line(const TriangleFace& triangle, int i) {
  return normalized(triangle.corner[i == 2 ? 0 : i + 1] - triangle.corner[i]);
}

/// Two convex solids in the axes of the first. The columns of `rotation` are the axes of b.
template <class A, class B>
struct ConvexPair {
  A a;
  B b;
  Mat3 rotation;
  Vec3 offset;    ///< [m], of b
  Vec3 centre_a;  ///< [m], a point inside
  Vec3 centre_b;  ///< [m], a point inside, in the axes of b
  Real size = 0;  ///< [m], the scale of the rounding errors

  JFPX_HD Vec3 place(const Vec3& local) const { return rotation * local + offset; }
  /// The point of the Minkowski difference that is least far along the axis.
  JFPX_HD Vec3 lowest_difference(const Vec3& n) const {
    return support_point(a, -n) - place(support_point(b, transform_transpose(rotation, n)));
  }
  /// [m], distance of a from b along the axis.
  /// @param n unit, from b to a
  JFPX_HD Real separation(const Vec3& n) const { return dot(n, lowest_difference(n)); }
  JFPX_HD Real error() const { return 8 * kEpsilon * size; }
  /// [m], by which a separation may be less than the largest one near it.
  JFPX_HD Real tolerance() const { return Real(1e-4) * size; }
  /// [m], of solids whose closest points have an accurate direction.
  JFPX_HD Real clear_gap() const { return size * (Real(1) / 128); }
};

/// One to four points of the Minkowski difference, the newest last, and the point of their convex
/// hull that is closest to the origin.
struct Simplex {
  Vec3 point[4];
  Vec3 closest;
  int count = 0;

  JFPX_HD bool contains(const Vec3& p) const {
    for (int i = 0; i < count; ++i) {
      if (point[i] == p) return true;
    }
    return false;
  }
  /// Adds a point and removes those without which the closest point is the same. If the origin is
  /// outside, the closest point is on a triangle with the newest point; if not, it is the origin.
  JFPX_HD void add(const Vec3& p) {
    point[count++] = p;
    if (count < 3) {
      count == 1 ? set(p) : set_of_segment(p, point[0]);
    } else if (count == 3) {
      set_of_triangle(p, point[0], point[1]);
    } else {
      const Vec3 q[3] = {point[0], point[1], point[2]};
      Simplex best;
      for (int i = 0; i < 3; ++i) {
        const Vec3 &b = q[i], &c = q[i == 2 ? 0 : i + 1], &inner = q[i == 0 ? 2 : i - 1];
        if (is_hidden(p, b, c, inner)) continue;
        Simplex part;
        part.set_of_triangle(p, b, c);
        if (best.count == 0 || length_squared(part.closest) < length_squared(best.closest)) {
          best = part;
        }
      }
      *this = best;
    }
  }

 private:
  /// Whether the origin is on the side of `inner` of the triangle. False in flat or thin
  /// tetrahedra, in which the side is noise.
  JFPX_HD static bool is_hidden(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& inner) {
    constexpr Real kLeastVolume = Real(0.01);
    const Vec3 ab = b - a, ac = c - a, up = inner - a, n = cross(ab, ac);
    const Real volume = dot(n, up);
    const Real sizes2 = length_squared(ab) * length_squared(ac) * length_squared(up);
    return volume * volume > kLeastVolume * kLeastVolume * sizes2 && volume * -dot(n, a) > 0;
  }
  JFPX_HD void set(const Vec3& a) {
    count = 1;
    point[0] = closest = a;
  }
  JFPX_HD void set_of_segment(const Vec3& a, const Vec3& b) {
    const Vec3 along = b - a;
    const Real t = -dot(a, along), size = length_squared(along);
    if (!(t > 0)) return set(a);
    if (!(t < size)) return set(b);
    count = 2;
    point[0] = b;
    point[1] = a;
    closest = add_scaled(a, along, t / size);
  }
  /// By the regions of the triangle (Ericson 2005, 5.1.5).
  JFPX_HD void set_of_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a, n = cross(ab, ac);
    const Real ab_a = -dot(ab, a), ac_a = -dot(ac, a);
    if (ab_a <= 0 && ac_a <= 0) return set(a);
    const Real ab_b = -dot(ab, b), ac_b = -dot(ac, b);
    if (ab_b >= 0 && ac_b <= ab_b) return set(b);
    if (dot(n, cross(a, b)) <= 0 && ab_a >= 0 && ab_b <= 0) return set_of_segment(a, b);
    const Real ab_c = -dot(ab, c), ac_c = -dot(ac, c);
    if (ac_c >= 0 && ab_c <= ac_c) return set(c);
    if (dot(n, cross(c, a)) <= 0 && ac_a >= 0 && ac_c <= 0) return set_of_segment(a, c);
    if (dot(n, cross(b, c)) <= 0 && ac_b >= ab_b && ab_c >= ac_c) return set_of_segment(b, c);
    count = 3;
    point[0] = b;
    point[1] = c;
    point[2] = a;
    closest = n * (dot(n, a) / length_squared(n));
  }
};

/// The axis of the largest separation of two solids, of which a is translated by `shift`, if they
/// are separated. Otherwise an axis that is at least as good as the unit vector `start`. Not
/// inlined, because a device compiler copies it into each of its many callers.
template <class Pair>
[[gnu::noinline]] JFPX_HD Vec3 widest_of_separated(const Pair& pair, const Vec3& shift,
                                                   const Vec3& start) {
  constexpr int kMost = 32;
  Vec3 n = start, best = start;
  Real widest = 0, distance = kMaxReal;
  Simplex simplex;
  for (int i = 0; i < kMost; ++i) {
    const Vec3 lowest = pair.lowest_difference(n) + shift;
    const Real separation = dot(n, lowest);
    if (i == 0 || separation > widest) widest = separation, best = n;
    if (distance - widest <= pair.tolerance() || simplex.contains(lowest)) break;
    simplex.add(lowest);
    const Real closest = length(simplex.closest);
    if (!(closest < distance) || !(closest > 0)) break;
    distance = closest;
    n = simplex.closest * (Real(1) / closest);
  }
  return best;
}

/// The point of a that is closest to b when the solids are parted by a clear gap along the axis of
/// least overlap, in the axes of a. Rare, hence not inlined.
/// @param normal     unit, from b to a
/// @param separation [m], of the axis
template <class Pair>
[[gnu::noinline]] JFPX_HD Vec3 closest_point_of_a(const Pair& pair, const Vec3& normal,
                                                  Real separation) {
  constexpr int kMost = 32;
  const Real clear = pair.clear_gap();
  const Vec3 shift = separation < clear ? normal * (clear - separation) : Vec3{};
  Simplex simplex;
  // The points of the simplex, and those of a that they are differences of.
  Vec3 lowest[4], on_a[4] = {support_point(pair.a, -normal)}, n = normal;
  int size = 0;
  Real distance = kMaxReal;
  for (int i = 0; i < kMost; ++i) {
    const Vec3 p = pair.lowest_difference(n) + shift;
    if (distance - dot(n, p) <= pair.error() || simplex.contains(p)) break;
    Simplex next = simplex;
    next.add(p);
    const Real closest = length(next.closest);
    if (!(closest < distance) || !(closest > 0)) break;
    lowest[size] = p;
    on_a[size++] = support_point(pair.a, -n);
    int kept = 0;
    for (int k = 0; k < size; ++k) {
      if (next.contains(lowest[k])) lowest[kept] = lowest[k], on_a[kept++] = on_a[k];
    }
    size = kept;
    simplex = next;
    distance = closest;
    n = simplex.closest * (Real(1) / closest);
  }
  // The weights of the closest point are as the parts of the segment, or of the triangle.
  Real weight[3] = {1, 0, 0};
  if (size == 2) {
    weight[0] = length(simplex.closest - lowest[1]);
    weight[1] = length(simplex.closest - lowest[0]);
  } else if (size == 3) {
    const Vec3 across = cross(lowest[1] - lowest[0], lowest[2] - lowest[0]);
    for (int k = 0; k < 3; ++k) {
      const Vec3 q = lowest[(k + 1) % 3] - simplex.closest;
      const Real part = dot(across, cross(q, lowest[(k + 2) % 3] - simplex.closest));
      weight[k] = part > 0 ? part : Real(0);
    }
  }
  const Real sum = weight[0] + weight[1] + weight[2];
  if (!(sum > 0)) return on_a[0];  // a triangle so thin that its areas are 0
  const Real scale = Real(1) / sum;
  Vec3 result = on_a[0];
  for (int k = 1; k < size; ++k) {
    result = add_scaled(result, on_a[k] - on_a[0], weight[k] * scale);
  }
  return result;
}

/// Replaces an axis by one of larger separation, if there is one near it.
/// @param normal     unit, from b to a
/// @param separation [m], of the axis
/// @param limit      [m]; ends as soon as the separation is larger
/// @param most       number of rounds
template <class Pair>
JFPX_HD void improve(const Pair& pair, Real limit, int most, Vec3* normal, Real* separation) {
  const Real clear = pair.clear_gap();
  for (int i = 0; i < most; ++i) {
    const bool is_clear = *separation > clear;
    const Real shift = is_clear ? Real(0) : clear - *separation;
    const Vec3 n = widest_of_separated(pair, *normal * shift, *normal);
    const Real next = pair.separation(n);
    if (!(next > *separation)) return;
    const bool is_last = next - *separation < pair.tolerance();
    *normal = n;
    *separation = next;
    if (is_clear || is_last || next > limit) return;
  }
}

/// Replaces an axis of overlap by one that separates the solids, if there is one. It may be far
/// from the axis if a solid is thin.
template <class Pair>
JFPX_HD void find_separating_axis(const Pair& pair, Vec3* normal, Real* separation) {
  if (!(*separation < 0)) return;
  const Vec3 n = widest_of_separated(pair, {}, *normal);
  const Real found = pair.separation(n);
  if (found > *separation) *normal = n, *separation = found;
}

/// The axes of a contact of two convex solids.
struct ConvexAxes {
  enum Kind : std::uint8_t { face_of_b, face_of_a, other };
  Kind kind = other;
  LeastOverlap preferred;  ///< its number is that of the face; faces precede other axes
  LeastOverlap widest;     ///< of the largest separation, or of least overlap
};

/// Rounds of improve(), for each of several axes and for the best one of them.
inline constexpr int kFirstRounds = 2, kLastRounds = 6;

/// False if an axis separates the solids by more than `limit`.
/// @param radii [m], around both solids: not 0 for the core of a capsule
template <class A, class B>
JFPX_HD bool find_axes(const ConvexPair<A, B>& pair, Real radii, Real limit, ConvexAxes* axes) {
  LeastOverlap of_b, of_a, lines;
  bool is_far = false;
  const auto consider = [&](int index, const Vec3& n, LeastOverlap* best) {
    const Real distance = pair.separation(n);
    is_far |= distance > limit;
    if (best->axis < 0 || distance > best->distance) *best = {index, distance, pair.error(), n};
  };
  const Vec3 between = pair.centre_a - pair.place(pair.centre_b);
  const Real apart = length(between);
  consider(0, apart > kEpsilon * pair.size ? between * (Real(1) / apart) : Vec3{0, 1, 0}, &lines);
  if (is_far) return false;
  for (int i = 0; i < face_count(pair.b); ++i) {
    consider(i, pair.rotation * face_normal(pair.b, i), &of_b);
    if (is_far) return false;
  }
  for (int i = 0; i < face_count(pair.a); ++i) {
    consider(i, -face_normal(pair.a, i), &of_a);
    if (is_far) return false;
  }
  for (int i = 0; i < line_count(pair.a); ++i) {
    const Vec3 first = line(pair.a, i);
    const Vec3 across = add_scaled(between, first, -dot(first, between));
    const Real distance = length(across);
    // All directions across a common axis, which is the y axis, are alike.
    const bool is_apart = distance > kEpsilon * pair.size;
    consider(0, is_apart ? across * (Real(1) / distance) : Vec3{1, 0, 0}, &lines);
    if (is_far) return false;
    for (int k = 0; k < line_count(pair.b); ++k) {
      const Vec3 axis = cross(first, pair.rotation * line(pair.b, k));
      const Real sine = length(axis);
      if (!(sine * sine > 4 * kEpsilon)) continue;
      const Vec3 n = axis * (Real(1) / sine);
      consider(0, n, &lines);
      consider(0, -n, &lines);
      if (is_far) return false;
    }
  }
  // Deep in each other, the axis of least overlap may be far from the best one of the others. It is
  // rarely near an axis of much more overlap.
  LeastOverlap best{};
  const auto try_near = [&](LeastOverlap near, bool always) {
    const bool is_deep = best.distance < pair.clear_gap() * Real(-0.5);
    if (near.axis < 0 || !(always || (is_deep && near.distance > 3 * best.distance))) return;
    improve(pair, limit, kFirstRounds, &near.normal, &near.distance);
    if (best.axis < 0 || near.distance > best.distance) best = near;
  };
  const bool is_line = !(of_b.axis >= 0 && of_b.distance > lines.distance) &&
                       !(of_a.axis >= 0 && of_a.distance > lines.distance);
  const bool is_of_b = of_b.axis >= 0 && !(of_a.axis >= 0 && of_a.distance > of_b.distance);
  const LeastOverlap& first = is_line ? lines : is_of_b ? of_b : of_a;
  try_near(first, true);
  for (const LeastOverlap* near : {&lines, &of_b, &of_a}) {
    if (near != &first) try_near(*near, false);
  }
  if (best.distance < pair.clear_gap()) {
    improve(pair, limit, kLastRounds, &best.normal, &best.distance);
  }
  find_separating_axis(pair, &best.normal, &best.distance);
  if (best.distance > limit) return false;
  axes->widest = best;
  axes->widest.axis = 0;
  axes->kind = ConvexAxes::other;
  axes->preferred = axes->widest;
  // As preferred(), for the distances of the surfaces.
  const auto is_steady = [&](LeastOverlap face, LeastOverlap later) {
    face.distance -= radii;
    later.distance -= radii;
    return &preferred(face, later) == &face;
  };
  const auto is_preferred = [&](const LeastOverlap& face) {
    return face.axis >= 0 && is_steady(face, axes->widest);
  };
  if (is_preferred(of_b) && (of_a.axis < 0 || is_steady(of_b, of_a))) {
    axes->kind = ConvexAxes::face_of_b;
    axes->preferred = of_b;
  } else if (is_preferred(of_a)) {
    axes->kind = ConvexAxes::face_of_a;
    axes->preferred = of_a;
  }
  return true;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
