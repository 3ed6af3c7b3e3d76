/// A DistanceJoint in a soft step: a spring, and limits of the distance of two anchors.
///
/// The anchors rotate with their bodies within the step, and each sweep uses the current axis. The
/// limits are solved for the distance at the end of the substep, including the second order of the
/// motion across the axis. The positions thus follow the circle of a pendulum instead of its
/// tangent, whose projection would dissipate energy (as in RATTLE: Andersen 1983).
#pragma once

#include "src/contact_solver/soft_step/joint_motion.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// A sweep changes only the fields from `spring_impulse` on: see store_changes().
struct DistanceRow {
  using Part = NoPart;
  static constexpr bool kReadsRotation = false, kReadsOrientation = true;

  std::uint32_t a = 0, b = 0;  ///< bodies; a is movable, b may be kWorld
  Vec3 centres;                ///< [m], from b's centre to a's at the start of the step
  Vec3 anchor_a, anchor_b;     ///< [m], body axes; of the world: zero
  Real min_length = 0, max_length = 0, rest_length = 0;  ///< [m]
  Real spring_rate = 0, damp_rate = 0;                   ///< [1/s], as DistanceInput

  /// [N s]. A positive spring impulse pushes the bodies apart. The lower limit pushes, the upper
  /// limit pulls; a rod, whose limits are equal, may do both.
  Real spring_impulse = 0, lower_impulse = 0, upper_impulse = 0;
  Real spring_error = 0;  ///< [m], length of the spring minus its rest length, in this substep
  JointSums sums;         ///< of this substep

  JFPX_HD bool is_rod() const { return min_length == max_length; }
  JFPX_HD Real total_impulse() const { return spring_impulse + lower_impulse - upper_impulse; }
};

/// Writes the fields that a sweep changes.
JFPX_HD inline void store_changes(const DistanceRow& from, DistanceRow* to) {
  to->spring_impulse = from.spring_impulse;
  to->lower_impulse = from.lower_impulse;
  to->upper_impulse = from.upper_impulse;
  to->spring_error = from.spring_error;
  to->sums = from.sums;
}

/// The anchors at the time of a sweep.
struct DistanceAxis {
  Vec3 arm_a, arm_b;  ///< [m], world axes, from the centres
  Real length;        ///< [m]
  Vec3 direction;     ///< unit, from b's anchor to a's; x axis if they coincide
};

/// @param centres from b's centre to a's centre
JFPX_HD inline DistanceAxis axis_of(const DistanceRow& row, const Vec3& centres,
                                    const Quat& orientation_a, const Quat& orientation_b) {
  DistanceAxis axis;
  axis.arm_a = rotate(orientation_a, row.anchor_a);
  axis.arm_b = rotate(orientation_b, row.anchor_b);
  const Vec3 between = centres + (axis.arm_a - axis.arm_b);
  axis.length = length(between);
  axis.direction = axis.length > kEpsilon ? between * (1 / axis.length) : Vec3{1, 0, 0};
  return axis;
}

/// What the impulses of a row apply along an axis.
template <bool kFixed>
JFPX_HD inline JointSums sums_of(const DistanceRow& row, const BodyPair& pair,
                                 const DistanceAxis& axis) {
  const Vec3 impulse = axis.direction * row.total_impulse();
  return sums_of<kFixed>(pair, impulse, cross(axis.arm_a, impulse), cross(axis.arm_b, impulse));
}

template <bool kFixed>
JFPX_HD inline void warm_start(const DistanceRow& row, const BodyPair& pair) {
  apply<kFixed>(pair, row.sums);
}

/// Solves a DistanceRow in a sweep.
template <bool kFixed>
class DistanceSolver {
 public:
  JFPX_HD DistanceSolver(DistanceRow* row, const BodyPair& pair,
                         const PairOrientations& orientations, const StepConstants& step)
      : row_(row),
        bodies_(pair, orientations),
        pair_(bodies_.pair()),
        step_(step),
        axis_(axis_of(*row, row->centres + (pair.a->shift - pair.b->shift), *orientations.a,
                      *orientations.b)) {
    const Vec3& n = axis_.direction;
    const Vec3 turn_a = cross(axis_.arm_a, n);
    Real inverse_mass = pair.a->inverse_mass + dot(turn_a, *pair_.inertia_a * turn_a);
    if constexpr (!kFixed) {
      const Vec3 turn_b = cross(axis_.arm_b, n);
      inverse_mass += pair.b->inverse_mass + dot(turn_b, *pair_.inertia_b * turn_b);
    }
    mass_ = 1 / inverse_mass;
  }

  /// In the first sweep of a substep: replaces the impulse of the last substep, which was applied
  /// along the former axis, by an impulse along the current axis.
  JFPX_HD void turn_impulse() {
    const JointSums before = row_->sums;
    row_->sums = sums_of<kFixed>(*row_, pair_, axis_);
    apply<kFixed>(pair_, row_->sums - before);
    row_->spring_error = axis_.length - row_->rest_length;
  }

  JFPX_HD void solve(bool use_bias) {
    if (row_->spring_rate > 0 && !row_->is_rod()) solve_spring();
    if (row_->is_rod()) {
      solve_limit(&row_->upper_impulse, axis_.length - row_->max_length, 1, use_bias);
      return;
    }
    if (row_->min_length > 0) {
      solve_limit(&row_->lower_impulse, row_->min_length - axis_.length, -1, use_bias);
    }
    solve_limit(&row_->upper_impulse, axis_.length - row_->max_length, 1, use_bias);
  }

 private:
  JFPX_HD Vec3 velocity() const { return relative_velocity(pair_, axis_.arm_a, axis_.arm_b); }

  /// @param along impulse that pushes the bodies apart
  JFPX_HD void push(Real along) {
    const Vec3 impulse = axis_.direction * along;
    const JointSums pushed =
        sums_of<kFixed>(pair_, impulse, cross(axis_.arm_a, impulse), cross(axis_.arm_b, impulse));
    apply<kFixed>(pair_, pushed);
    row_->sums += pushed;
  }

  JFPX_HD void solve_spring() {
    const Spring spring(row_->spring_rate, row_->damp_rate, step_);
    const Real change = spring.change(mass_, row_->spring_error, dot(velocity(), axis_.direction),
                                      row_->spring_impulse);
    row_->spring_impulse += change;
    push(change);
  }

  /// Second-order part of the velocity by which the length grows within the substep: the anchors
  /// move across the axis, and rotate with their bodies. @param limit the length at the end
  JFPX_HD Real bend(Real limit, const Vec3& across) const {
    const Real arms = dot(turning(pair_.a->angular_velocity, axis_.arm_a, step_.h) -
                              turning(pair_.b->angular_velocity, axis_.arm_b, step_.h),
                          axis_.direction);
    if (!(limit > 0)) return arms;
    const Real square = limit * limit, way2 = length_squared(across) * (step_.h * step_.h);
    const Real most = 4 * kMostTurn * square, bounded = way2 < most ? way2 : most;
    return arms + bounded * step_.inverse_h / (limit + square_root(square - bounded));
  }

  /// Corrects a fraction of a length error by translating the bodies without changing velocities:
  /// one relax sweep would not remove the velocity from long chains, which would gain energy.
  /// @param excess [m], by which the length exceeds the limit; negative if a rod is too short
  JFPX_HD void project(Real excess, Real sign) {
    const Real most = most_correction(step_), wanted = kJointCorrection * excess;
    const Real way = wanted > most ? most : wanted < -most ? -most : wanted;
    separate<kFixed>(pair_, axis_.direction, way * sign);
  }

  /// @param excess [m], by which the length exceeds the limit
  /// @param sign   1: upper limit, -1: lower limit
  JFPX_HD void solve_limit(Real* impulse, Real excess, Real sign, bool use_bias) {
    const bool is_rod = row_->is_rod();
    const bool is_slack = !is_rod && excess <= 0;
    // See is_idle(): a slack limit acts only if the gap is about to close.
    if (!use_bias && is_slack && !(*impulse > 0)) return;
    const Vec3 all = velocity();
    const Real along = dot(all, axis_.direction);
    Real speed = along;
    if (use_bias) {
      const Real limit = sign > 0 ? row_->max_length : row_->min_length;
      speed += bend(limit, all - axis_.direction * along);
    }
    speed *= sign;
    if (use_bias && is_slack) speed += excess * step_.inverse_h;
    if (use_bias && !is_slack) project(excess, sign);
    const Real wanted = *impulse + mass_ * speed;
    const Real after = is_rod || wanted > 0 ? wanted : Real(0);
    push((*impulse - after) * sign);
    *impulse = after;
  }

  DistanceRow* row_;
  const JointBodies<kFixed> bodies_;
  const BodyPair& pair_;
  const StepConstants& step_;
  DistanceAxis axis_;
  Real mass_ = 0;  ///< [kg], effective, along the axis
};

/// @param starts whether it is the first sweep of a substep
template <bool kFixed>
JFPX_HD inline void solve(DistanceRow* row, const BodyPair& pair,
                          const PairOrientations& orientations, const StepConstants& step,
                          bool use_bias, bool starts) {
  DistanceSolver<kFixed> solver(row, pair, orientations, step);
  if (starts) solver.turn_impulse();
  solver.solve(use_bias);
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
