/// The distance of two convex shapes by GJK, equal to that of btGjkPairDetector.
///
/// GJK in two parts, as in Bullet 3.24 (btGjkPairDetector.cpp): an intersection test of the cores,
/// which are the shapes without their margins, and the distance between them (G. van den Bergen,
/// "A Fast and Robust GJK Implementation for Collision Detection of Convex Objects", 1999). The
/// first part follows libccd's GJK, which Bullet uses, including the triangle distance in double
/// and the fuzzy comparisons. The arithmetic uses Bullet's inline functions.
#pragma once

#include <jfpx/config.hpp>
#include <jfpx/math.hpp>

#include "src/bullet/dispatch/voronoi_simplex.hpp"

#include <LinearMath/btTransform.h>

#include <cstdint>

extern btScalar gGjkEpaPenetrationTolerance;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The input of the detector besides the cores, whose poses are relative to `offset`.
struct DetectorInput {
  btScalar margin_a, margin_b;
  btScalar maximum_distance_squared;
  btVector3 offset;
  /// Whether a plane is known between the cores, see are_clear(). Changes no result.
  bool are_clear = false;
};

/// Whether a gap between the cores along some direction is so large that the distance of the origin
/// and a triangle of support points is not near 0 (btFuzzyZero), so that it need not be computed.
/// `gap2` is the square of the gap, `reach2` an upper bound of the squared lengths of the
/// differences of points of the two cores.
///
/// A triangle of support points is at least as far from the origin as the gap. In units of the
/// rounding error e of btScalar, each dot product in triangle_distance2() differs by less than
/// 12 e reach2 from its exact value, since the edges are not longer than two reaches. With s and t
/// in [0, 1], where the polynomial is used, its nine products differ by less than 108 e reach2
/// together, or 1.3e-5 reach2 in float; the distance to a segment differs by less.
inline bool are_clear(btScalar gap2, btScalar reach2) {
  constexpr bool kDouble = sizeof(btScalar) == 8;
  return gap2 > (kDouble ? btScalar(1e-8) : btScalar(1e-4)) * reach2 &&
         gap2 > (kDouble ? btScalar(1e-12) : btScalar(1e-6));
}

struct DetectorContact {
  btVector3 normal_on_b;
  btVector3 point_on_b;
  btScalar distance;
};

enum class DetectorResult : std::uint8_t {
  apart,
  contact,
  unknown,  ///< deep or degenerate: Bullet continues with its penetration depth solver
};

namespace gjk {

inline constexpr btScalar kRelativeError =
    sizeof(btScalar) == 8 ? btScalar(1.0e-12) : btScalar(1.0e-6);
inline constexpr int kMaxIterations = 1000;

/// Two cores. support(direction) of a core returns its point that is furthest along a direction.
template <class CoreA, class CoreB>
class Cores {
 public:
  Cores(const CoreA& a, const CoreB& b) : a_(a), b_(b) {}
  /// The support point of a along `axis` minus the support point of b along -`axis`.
  btVector3 support(const btVector3& axis, btVector3* on_a, btVector3* on_b) const {
    *on_a = a_.support(axis);
    *on_b = b_.support(-axis);
    return *on_a - *on_b;
  }
  btVector3 support(const btVector3& axis) const {
    btVector3 on_a, on_b;
    return support(axis, &on_a, &on_b);
  }

 private:
  const CoreA& a_;
  const CoreB& b_;
};

inline bool nearly_equal(btScalar p, btScalar q) {
  const btScalar difference = btFabs(p - q);
  if (btFabs(difference) < SIMD_EPSILON) return true;
  const btScalar a = btFabs(p), b = btFabs(q);
  return difference < SIMD_EPSILON * (b > a ? b : a);
}
inline bool nearly_equal(const btVector3& p, const btVector3& q) {
  return nearly_equal(p.x(), q.x()) && nearly_equal(p.y(), q.y()) && nearly_equal(p.z(), q.z());
}
inline bool not_negative(btScalar x) { return btFuzzyZero(x) || x > btScalar(0); }
inline int sign(btScalar x) { return btFuzzyZero(x) ? 0 : x < btScalar(0) ? -1 : 1; }
inline btVector3 triple_cross(const btVector3& a, const btVector3& b, const btVector3& c) {
  return a.cross(b).cross(c);
}

/// Squared distance of `p` and the segment from `x0` to `b`. Bullet uses both orders of rounding.
inline btScalar segment_distance2(const btVector3& p, const btVector3& x0, const btVector3& b,
                                  bool by_point) {
  btVector3 d = b - x0;
  const btVector3 a = x0 - p;
  btScalar t = -btScalar(1) * a.dot(d);
  t /= d.dot(d);
  if (t < btScalar(0) || btFuzzyZero(t)) return a.dot(a);
  if (t > btScalar(1) || nearly_equal(t, btScalar(1))) {
    const btVector3 e = b - p;
    return e.dot(e);
  }
  d *= t;
  d += by_point ? x0 : a;
  if (by_point) d -= p;
  return d.dot(d);
}

/// Squared distance of `p` and a triangle.
inline btScalar triangle_distance2(const btVector3& p, const btVector3& x0, const btVector3& b,
                                   const btVector3& c) {
  const btVector3 d1 = b - x0, d2 = c - x0, a = x0 - p;
  const double u = a.dot(a), v = d1.dot(d1), w = d2.dot(d2);
  const double pd = a.dot(d1), q = a.dot(d2), r = d1.dot(d2);
  const double s = (q * r - w * pd) / (w * v - r * r);
  const double t = (-s * r - q) / w;
  const auto in_unit = [](double x) {
    const auto rounded = static_cast<btScalar>(x);
    return (btFuzzyZero(rounded) || x > 0) && (nearly_equal(rounded, btScalar(1)) || x < 1);
  };
  double distance;
  if (in_unit(s) && in_unit(t) &&
      (nearly_equal(static_cast<btScalar>(t + s), btScalar(1)) || t + s < 1)) {
    distance = s * s * v;
    distance += t * t * w;
    distance += 2 * s * t * r;
    distance += 2 * s * pd;
    distance += 2 * t * q;
    distance += u;
  } else {
    distance = segment_distance2(p, x0, b, false);
    const double second = segment_distance2(p, x0, c, true);
    if (second < distance) distance = second;
    const double third = segment_distance2(p, b, c, true);
    if (third < distance) distance = third;
  }
  return static_cast<btScalar>(distance);
}

enum class Step : std::uint8_t { go_on, intersect, apart };

/// Up to four support points, the newest last.
class CoreSimplex {
 public:
  explicit CoreSimplex(bool are_clear) : are_clear_(are_clear) {}
  void add(const btVector3& v) { points_[size_++] = v; }
  /// Removes points that cannot contribute and sets the next direction.
  Step reduce(btVector3* direction) {
    switch (size_) {
      case 2:
        return reduce2(direction);
      case 3:
        return reduce3(direction);
      default:
        return reduce4(direction);
    }
  }

 private:
  void set(const btVector3& p) {
    points_[0] = p;
    size_ = 1;
  }
  void set(const btVector3& p, const btVector3& q) {
    points_[0] = p;
    points_[1] = q;
    size_ = 2;
  }

  Step reduce2(btVector3* direction) {
    const btVector3 a = points_[1], b = points_[0];
    const btVector3 ab = b - a, ao = a * -btScalar(1);
    const btScalar dot = ab.dot(ao);
    const btVector3 across = ab.cross(ao);
    if (btFuzzyZero(across.dot(across)) && dot > btScalar(0)) return Step::intersect;
    if (btFuzzyZero(dot) || dot < btScalar(0)) {
      set(a);
      *direction = ao;
    } else {
      *direction = across.cross(ab);
    }
    return Step::go_on;
  }

  Step reduce3(btVector3* direction) {
    const btVector3 a = points_[2], b = points_[1], c = points_[0];
    if (contains_origin(a, b, c)) return Step::intersect;
    if (nearly_equal(a, b) || nearly_equal(a, c)) return Step::apart;
    const btVector3 ao = a * -btScalar(1), ab = b - a, ac = c - a;
    const btVector3 abc = ab.cross(ac);
    if (not_negative(abc.cross(ac).dot(ao))) {
      if (not_negative(ac.dot(ao))) {
        set(c, a);
        *direction = triple_cross(ac, ao, ac);
      } else {
        leave_edge(a, b, ab, ao, direction);
      }
    } else if (not_negative(ab.cross(abc).dot(ao))) {
      leave_edge(a, b, ab, ao, direction);
    } else if (not_negative(abc.dot(ao))) {
      *direction = abc;
    } else {
      points_[0] = b;
      points_[1] = c;
      *direction = abc * -btScalar(1);
    }
    return Step::go_on;
  }
  void leave_edge(const btVector3& a, const btVector3& b, const btVector3& ab, const btVector3& ao,
                  btVector3* direction) {
    if (not_negative(ab.dot(ao))) {
      set(b, a);
      *direction = triple_cross(ab, ao, ab);
    } else {
      set(a);
      *direction = ao;
    }
  }

  Step reduce4(btVector3* direction) {
    const btVector3 a = points_[3], b = points_[2], c = points_[1], d = points_[0];
    if (btFuzzyZero(triangle_distance2(a, b, c, d))) return Step::apart;
    if (contains_origin(a, b, c) || contains_origin(a, c, d) || contains_origin(a, b, d) ||
        contains_origin(b, c, d)) {
      return Step::intersect;
    }
    const btVector3 ao = a * -btScalar(1), ab = b - a, ac = c - a, ad = d - a;
    const btVector3 abc = ab.cross(ac), acd = ac.cross(ad), adb = ad.cross(ab);
    const bool b_side = sign(acd.dot(ao)) == sign(acd.dot(ab));
    const bool c_side = sign(adb.dot(ao)) == sign(adb.dot(ac));
    const bool d_side = sign(abc.dot(ao)) == sign(abc.dot(ad));
    if (b_side && c_side && d_side) return Step::intersect;
    points_[2] = a;
    size_ = 3;
    if (b_side) {
      points_[1] = c_side ? b : d;
      points_[0] = c_side ? c : b;
    }
    return reduce3(direction);
  }

  bool contains_origin(const btVector3& a, const btVector3& b, const btVector3& c) const {
    return !are_clear_ && btFuzzyZero(triangle_distance2(btVector3(0, 0, 0), a, b, c));
  }

  btVector3 points_[4];
  int size_ = 0;
  bool are_clear_;
};

/// Bullet's test for intersecting cores.
template <class Cores>
bool cores_intersect(const Cores& cores, bool are_clear) {
  CoreSimplex simplex(are_clear);
  btVector3 v = cores.support(btVector3(1, 0, 0));
  simplex.add(v);
  btVector3 direction = -v;
  for (int i = 0; i < kMaxIterations; ++i) {
    v = cores.support(direction);
    if (v.dot(direction) < 0) return false;
    simplex.add(v);
    const Step step = simplex.reduce(&direction);
    if (step != Step::go_on) return step == Step::intersect;
    if (direction.length2() < SIMD_EPSILON) return false;
  }
  return false;
}

/// Bullet's distance iteration. Returns false if it ends without a valid simplex.
template <class Cores>
bool find_closest_simplex(const Cores& cores, btScalar maximum_distance_squared,
                          VoronoiSimplex* simplex, btVector3* axis, btScalar* squared_distance) {
  *axis = btVector3(0, 1, 0);
  *squared_distance = BT_LARGE_FLOAT;
  for (int i = 0; i <= kMaxIterations; ++i) {
    btVector3 on_a, on_b;
    const btVector3 w = cores.support(-*axis, &on_a, &on_b);
    const btScalar delta = axis->dot(w);
    if (delta > btScalar(0) && delta * delta > *squared_distance * maximum_distance_squared) {
      return true;
    }
    if (simplex->contains(w)) return true;
    if (*squared_distance - delta <= *squared_distance * kRelativeError) return true;
    simplex->add(w, on_a, on_b);
    btVector3 closest;
    if (!simplex->find_closest(&closest)) return true;
    if (closest.length2() < kRelativeError) {
      *axis = closest;
      return true;
    }
    const btScalar previous = *squared_distance;
    *squared_distance = closest.length2();
    if (previous - *squared_distance <= SIMD_EPSILON * previous) return true;
    *axis = closest;
    if (simplex->is_full()) return false;
  }
  return false;
}

}  // namespace gjk

/// Reproduces btGjkPairDetector::getClosestPointsNonVirtual of Bullet 3.24, operation by operation,
/// up to the call of the penetration depth solver.
template <class CoreA, class CoreB>
DetectorResult find_closest_points(const CoreA& a, const CoreB& b, const DetectorInput& input,
                                   DetectorContact* contact) {
  const gjk::Cores<CoreA, CoreB> cores(a, b);
  if (gjk::cores_intersect(cores, input.are_clear)) return DetectorResult::unknown;
  gjk::VoronoiSimplex simplex;
  btVector3 axis;
  btScalar squared_distance;
  if (!gjk::find_closest_simplex(cores, input.maximum_distance_squared, &simplex, &axis,
                                 &squared_distance)) {
    return DetectorResult::unknown;
  }
  if (simplex.is_empty()) return DetectorResult::unknown;  // the distance exceeds BT_LARGE_FLOAT
  const btScalar length2 = axis.length2();
  if (!(length2 > SIMD_EPSILON * SIMD_EPSILON)) return DetectorResult::unknown;
  const btScalar margin = input.margin_a + input.margin_b;
  const btScalar k = btScalar(1) / btSqrt(length2);
  const btScalar distance = (btScalar(1) / k) - margin;
  if (!(distance + margin >= gGjkEpaPenetrationTolerance)) return DetectorResult::unknown;
  if (!(distance < 0 || distance * distance < input.maximum_distance_squared)) {
    return DetectorResult::apart;
  }
  btVector3 on_b = simplex.closest_on_b();
  on_b += axis * (input.margin_b / btSqrt(squared_distance));
  btVector3 normal = axis;
  normal *= k;
  // The normal must point from b to a: compares the gaps along the normal and its opposite.
  const btScalar gap = normal.dot(cores.support(-normal)) - margin;
  const btScalar opposite_gap = (-normal).dot(cores.support(normal)) - margin;
  if (opposite_gap > gap) normal *= -1;
  *contact = {normal, on_b + input.offset, distance};
  // The compiler determines which of two NaNs an operation returns.
  const btVector3 sum = contact->normal_on_b + contact->point_on_b;
  if (!is_finite(sum.x() + sum.y() + sum.z())) return DetectorResult::unknown;
  return DetectorResult::contact;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
