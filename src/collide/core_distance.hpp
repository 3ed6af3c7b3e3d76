/// The closest points of two convex shapes that are known by their farthest points (Gilbert,
/// Johnson and Keerthi 1988), in double.
#pragma once

#include "src/collide/convex_core.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A vector in double, in both precisions: a small solid may touch a triangle that is ten thousand
/// times as large.
struct Wide {
  double x = 0, y = 0, z = 0;

  Wide() = default;
  Wide(double a, double b, double c) : x(a), y(b), z(c) {}
  explicit Wide(const Vec3& v)
      : x(static_cast<double>(v.x)), y(static_cast<double>(v.y)), z(static_cast<double>(v.z)) {}
  friend bool operator==(const Wide&, const Wide&) = default;
};
inline Wide operator+(const Wide& a, const Wide& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Wide operator-(const Wide& a, const Wide& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Wide operator-(const Wide& a) { return {-a.x, -a.y, -a.z}; }
inline Wide operator*(const Wide& a, double k) { return {a.x * k, a.y * k, a.z * k}; }
inline double dot(const Wide& a, const Wide& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
inline Wide cross(const Wide& a, const Wide& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Wide& v) { return square_root(dot(v, v)); }
inline Vec3 to_vec3(const Wide& v) {
  return {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z)};
}

struct WideMatrix {
  Wide row[3];

  explicit WideMatrix(const Mat3& m) : row{Wide(m.row[0]), Wide(m.row[1]), Wide(m.row[2])} {}
  Wide operator*(const Wide& v) const { return {dot(row[0], v), dot(row[1], v), dot(row[2], v)}; }
  Wide transpose_times(const Wide& v) const { return row[0] * v.x + row[1] * v.y + row[2] * v.z; }
};

// The farthest point of a core in a direction.
inline Wide support_of(const CorePoint&, const Wide&) { return {}; }
inline Wide support_of(const CoreSegment& core, const Wide& d) {
  const auto half = static_cast<double>(core.half_length);
  return {0, d.y < 0 ? -half : half, 0};
}
inline Wide support_of(const BoxPolyhedron& box, const Wide& d) {
  const Wide h(box.half);
  return {d.x < 0 ? -h.x : h.x, d.y < 0 ? -h.y : h.y, d.z < 0 ? -h.z : h.z};
}
inline Wide farthest_of(const Vec3* points, int count, const Wide& d) {
  Wide farthest(points[0]);
  double most = dot(d, farthest);
  for (int i = 1; i < count; ++i) {
    const Wide point(points[i]);
    const double reach = dot(d, point);
    if (reach > most) most = reach, farthest = point;
  }
  return farthest;
}
inline Wide support_of(const HullPolyhedron& hull, const Wide& d) {
  return farthest_of(hull.hull->vertices, hull.vertex_count(), d);
}
inline Wide support_of(const TriangleFace& triangle, const Wide& d) {
  return farthest_of(triangle.corner, 3, d);
}
inline Wide support_of(const Frustum& f, const Wide& d) {
  const double across = square_root(d.x * d.x + d.z * d.z);
  const auto upper = static_cast<double>(f.upper), lower = static_cast<double>(f.lower);
  const auto upper_radius = static_cast<double>(f.upper_radius);
  const auto lower_radius = static_cast<double>(f.lower_radius);
  const bool is_upper = upper_radius * across + upper * d.y > lower_radius * across + lower * d.y;
  const double radius = is_upper ? upper_radius : lower_radius, y = is_upper ? upper : lower;
  if (!(across > 0)) return {radius, y, 0};
  return {radius * (d.x / across), y, radius * (d.z / across)};
}
inline Wide support_of(const ConvexCore& shape, const Wide& d) {
  return std::visit([&](const auto& core) { return support_of(core, d); }, shape.core);
}

inline int face_count(const CorePoint&) { return 0; }
inline Vec3 face_normal(const CorePoint&, int) { return {}; }

/// Two cores in the axes of the first.
struct CorePair {
  const ConvexCore& a;
  const ConvexCore& b;
  WideMatrix rotation;
  Wide offset;      ///< [m], of b
  double size = 0;  ///< [m], scale of the rounding errors

  /// The point of a that is least far along the axis. @param n unit, from b to a
  Wide lowest_of_a(const Wide& n) const { return support_of(a, -n); }
  Wide highest_of_b(const Wide& n) const {
    return rotation * support_of(b, rotation.transpose_times(n)) + offset;
  }
  /// [m], distance of a from b along the axis.
  double separation(const Wide& n) const { return dot(n, lowest_of_a(n) - highest_of_b(n)); }
  double error() const { return size * (sizeof(Real) == 4 ? 0x1p-26 : 0x1p-49); }
  /// [m], of cores whose closest points have an accurate direction.
  double clear_gap() const { return size * 0x1p-12; }
};

/// A point of the Minkowski difference of two cores, and that of the first core.
struct DifferencePoint {
  Wide point, on_a;
};

/// One to three points of the difference, the newest last, and the point of their convex hull that
/// is closest to the origin.
class DifferenceSimplex {
 public:
  const Wide& closest() const { return closest_; }
  /// The point of the first core that belongs to the closest point.
  const Wide& on_a() const { return on_a_; }
  bool contains(const Wide& p) const {
    return std::any_of(points_, points_ + count_,
                       [&](const DifferencePoint& c) { return c.point == p; });
  }
  /// Adds a point and removes those without which the closest point is the same. Of a tetrahedron,
  /// the closest point is on a triangle with the newest point, if the origin is outside.
  void add(const DifferencePoint& p) {
    const DifferencePoint q[3] = {points_[0], points_[1], points_[2]};
    if (count_ == 0) {
      set(p);
    } else if (count_ == 1) {
      set(p, q[0]);
    } else if (count_ == 2) {
      set(p, q[0], q[1]);
    } else {
      DifferenceSimplex best;
      for (int i = 0; i < 3; ++i) {
        const DifferencePoint &b = q[i], &c = q[(i + 1) % 3], &inner = q[(i + 2) % 3];
        if (is_hidden(p.point, b.point, c.point, inner.point)) continue;
        DifferenceSimplex part;
        part.set(p, b, c);
        if (best.count_ == 0 || length(part.closest_) < length(best.closest_)) best = part;
      }
      *this = best;
    }
  }

 private:
  /// Whether the origin is on the side of `inner` of the triangle. False in flat or thin
  /// tetrahedra, in which the side is noise.
  static bool is_hidden(const Wide& a, const Wide& b, const Wide& c, const Wide& inner) {
    const Wide ab = b - a, ac = c - a, up = inner - a, n = cross(ab, ac);
    const double volume = dot(n, up), sizes = length(ab) * length(ac) * length(up);
    return std::abs(volume) > 1e-9 * sizes && volume * -dot(n, a) > 0;
  }
  void set(const DifferencePoint& a) {
    count_ = 1;
    points_[0] = a;
    closest_ = a.point;
    on_a_ = a.on_a;
  }
  void set(const DifferencePoint& a, const DifferencePoint& b) {
    const Wide along = b.point - a.point;
    const double t = -dot(a.point, along), size = dot(along, along);
    if (!(t > 0)) return set(a);
    if (!(t < size)) return set(b);
    count_ = 2;
    points_[0] = b;
    points_[1] = a;
    closest_ = a.point + along * (t / size);
    on_a_ = a.on_a + (b.on_a - a.on_a) * (t / size);
  }
  /// By the regions of the triangle (Ericson 2005, 5.1.5).
  void set(const DifferencePoint& p, const DifferencePoint& q, const DifferencePoint& r) {
    const Wide &a = p.point, &b = q.point, &c = r.point;
    const Wide ab = b - a, ac = c - a, n = cross(ab, ac);
    const double ab_a = -dot(ab, a), ac_a = -dot(ac, a);
    if (ab_a <= 0 && ac_a <= 0) return set(p);
    const double ab_b = -dot(ab, b), ac_b = -dot(ac, b);
    if (ab_b >= 0 && ac_b <= ab_b) return set(q);
    const double of_c = dot(n, cross(a, b));
    if (of_c <= 0 && ab_a >= 0 && ab_b <= 0) return set(p, q);
    const double ab_c = -dot(ab, c), ac_c = -dot(ac, c);
    if (ac_c >= 0 && ab_c <= ac_c) return set(r);
    const double of_b = dot(n, cross(c, a));
    if (of_b <= 0 && ac_a >= 0 && ac_c <= 0) return set(p, r);
    const double of_a = dot(n, cross(b, c));
    if (of_a <= 0 && ac_b >= ab_b && ab_c >= ac_c) return set(q, r);
    count_ = 3;
    points_[0] = q;
    points_[1] = r;
    points_[2] = p;
    closest_ = n * (dot(n, a) / dot(n, n));
    const double scale = 1 / (of_a + of_b + of_c);
    on_a_ = p.on_a * (of_a * scale) + q.on_a * (of_b * scale) + r.on_a * (of_c * scale);
  }

  DifferencePoint points_[3];
  Wide closest_, on_a_;
  int count_ = 0;
};

/// The axis of the largest separation of two cores, of which a is translated by `shift`, if they
/// are separated. Otherwise an axis that is at least as good as the unit vector `start`.
struct WidestAxis {
  Wide axis;
  Wide direction;  ///< of the closest points, which is more accurate than an axis that is as good
  Wide on_a;       ///< [m], the closest point of a, before its translation
  /// [m], separation along the axis, and distance of the closest points; they bound the distance
  /// of the cores from below and above.
  double widest = 0, distance = std::numeric_limits<double>::infinity();
};
/// @param enough [m], separation from which on the closest points are not needed
inline WidestAxis widest_of_separated(const CorePair& pair, const Wide& shift, const Wide& start,
                                      double tolerance,
                                      double enough = std::numeric_limits<double>::infinity()) {
  constexpr int kMost = 48;
  WidestAxis result{start, start, {}};
  Wide n = start;
  DifferenceSimplex simplex;
  for (int i = 0; i < kMost; ++i) {
    const Wide of_a = pair.lowest_of_a(n), lowest = of_a - pair.highest_of_b(n) + shift;
    const double separation = dot(n, lowest);
    if (i == 0) result.on_a = of_a;
    if (i == 0 || separation > result.widest) result.widest = separation, result.axis = n;
    if (result.widest > enough || result.distance - result.widest <= tolerance) break;
    if (simplex.contains(lowest)) break;
    DifferenceSimplex next = simplex;
    next.add({lowest, of_a});
    const double closest = length(next.closest());
    if (!(closest < result.distance) || !(closest > 0)) break;
    simplex = next;
    result.distance = closest;
    n = simplex.closest() * (1 / closest);
    result.on_a = simplex.on_a();
    result.direction = n;
  }
  return result;
}

/// Replaces an axis by that of the closest points. The search may end early if edges are nearly
/// parallel, and the direction of points that are very close is not accurate. Before the shapes
/// count as touching, the search is therefore repeated from the axis, and with cores that are
/// parted along it, as convex_pair.hpp explains.
/// @param enough [m], separation at which the shapes do not touch
/// @returns [m], the separation along the axis
inline double find_widest(const CorePair& pair, double enough, Wide* axis) {
  constexpr int kMostRounds = 8;
  const double tolerance = pair.error() * 0.5;
  *axis = widest_of_separated(pair, {}, *axis, tolerance).axis;
  double widest = pair.separation(*axis);
  int failures = 0;
  for (int i = 0; i < kMostRounds && failures < 2 && !(widest > enough); ++i) {
    const double gap = std::max(pair.clear_gap() - widest, pair.clear_gap());
    const Wide n =
        widest_of_separated(pair, i % 2 == 0 ? *axis * gap : Wide(), *axis, tolerance).axis;
    const double separation = pair.separation(n);
    failures = separation > widest ? 0 : failures + 1;
    if (failures > 0) continue;
    *axis = n;
    widest = separation;
  }
  return widest;
}

/// The normal of a face that the axis nearly is, if the cores are as far apart along it: it has no
/// rounding errors.
inline Wide exact_axis(const CorePair& pair, const Wide& direction, const Wide& axis) {
  constexpr double kParallelCosine = 0.9999;
  const double least = pair.separation(axis) - pair.error();
  Wide best = axis;
  const auto consider = [&](const Wide& n) {
    if (!(dot(n, axis) > kParallelCosine) || !(dot(n, direction) > 0)) return;
    if (best == axis && pair.separation(n) >= least) best = n;
  };
  const auto visit_faces = [&](const ConvexCore& shape, const auto& to_axis) {
    std::visit(
        [&](const auto& core) {
          for (int i = 0; i < face_count(core); ++i) consider(to_axis(Wide(face_normal(core, i))));
        },
        shape.core);
  };
  visit_faces(pair.a, [](const Wide& n) { return -n; });
  if (std::holds_alternative<TriangleFace>(pair.a.core)) {
    visit_faces(pair.a, [](const Wide& n) { return n; });
  }
  visit_faces(pair.b, [&](const Wide& n) { return pair.rotation * n; });
  return best;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
