/// Contact of two shapes that touch, are closer than a margin, or will touch during a step.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
struct HullKernels;
}
namespace detail {

/// A solid with its pose in the world.
template <class Solid>
struct Posed {
  Solid shape;
  Transform pose;
};

/// The relative motion of two shapes in a step, and the distance up to which they have a contact.
struct PairMotion {
  Vec3 motion;      ///< [m], of a relative to b during the step
  Real margin = 0;  ///< [m], >= 0
  /// [m], distance beyond which a box has no contact with a sphere or another box, whatever their
  /// motion.
  Real limit = kMaxReal;
  Vec3 origin_a, origin_b;                         ///< [m], centres of mass of the bodies
  const cpu::HullKernels* hull_kernels = nullptr;  ///< null: scalar tests

  /// The motion of b relative to a.
  JFPX_HD PairMotion flipped() const {
    return {-motion, margin, limit, origin_b, origin_a, hull_kernels};
  }
};

/// A point of a manifold, as input of a solver.
struct SolverPoint {
  Vec3 arm_a, arm_b;          ///< [m], world axes, from the centres of mass
  Real distance = 0;          ///< [m]; > 0: a gap
  std::uint32_t feature = 0;  ///< identifies the point within its manifold
  Real tested_distance = 0;   ///< [m], distance at the last full test of a recyclable contact
};

/// Contact of two shapes with one normal: solver points at the start of the step, and points where
/// the shapes touch.
struct PairManifold {
  static constexpr std::uint32_t kMaxPoints = 8;
  /// A point in the middle of the overlap.
  struct Touch {
    Vec3 point;         ///< [m], world
    Real distance = 0;  ///< [m], <= 0
  };
  Vec3 normal;  ///< unit, from b to a
  std::uint32_t point_count = 0, touch_count = 0;
  /// Whether the contact of two solids with flat faces is between such faces, and may be recycled.
  bool is_steady = true;
  SolverPoint points[kMaxPoints];
  Touch touches[kMaxPoints];

  JFPX_HD void clear() {
    point_count = touch_count = 0;
    is_steady = true;
  }
  /// Adds a solver point, and a touch if the distance is <= 0. @param touch middle of the overlap
  JFPX_HD void add(const Vec3& arm_a, const Vec3& arm_b, Real distance, std::uint32_t feature,
                   const Vec3& touch) {
    points[point_count++] = {arm_a, arm_b, distance, feature};
    add_touch(touch, distance);
  }
  JFPX_HD void add_touch(const Vec3& point, Real distance) {
    if (distance <= 0) touches[touch_count++] = {point, distance};
  }
  /// Exchanges the shapes.
  JFPX_HD void flip() {
    if (point_count == 0 && touch_count == 0) return;  // the normal is not set
    normal = -normal;
    for (std::uint32_t i = 0; i < point_count; ++i) {
      const Vec3 arm_a = points[i].arm_a;
      points[i].arm_a = points[i].arm_b;
      points[i].arm_b = arm_a;
    }
  }
};

/// Distance of two shapes along the normal from b to a.
struct Separation {
  Vec3 normal;           ///< unit
  Real distance = 0;     ///< [m]; < 0: depth of penetration
  bool is_valid = true;  ///< false: values exceed the range of Real
};

/// Largest number of steps of a conservative advancement.
inline constexpr int kMaxAdvances = 16;

/// Conservative advancement (Mirtich 1996): the fraction t of the motion, in [0, 1], after which
/// the distance of the shapes is at most the margin.
/// @param separation_at function from t to the Separation after that fraction of the motion
/// @returns whether the shapes have a contact
template <class SeparationAt>
JFPX_HD bool advance(const PairMotion& pair, const SeparationAt& separation_at, Real* t) {
  *t = 0;
  for (int i = 0;; ++i) {
    const Separation s = separation_at(*t);
    if (!s.is_valid) return false;
    if (!(s.distance > pair.margin) || i == kMaxAdvances) return true;
    const Real closing = -dot(pair.motion, s.normal);
    if (!(closing > 0)) return false;
    *t += s.distance / closing;
    if (!(*t <= 1)) return false;
  }
}
/// A point after a fraction t of the motion; unchanged for t = 0.
JFPX_HD inline Vec3 moved(const Vec3& point, const PairMotion& pair, Real t) {
  return t > 0 ? add_scaled(point, pair.motion, t) : point;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
