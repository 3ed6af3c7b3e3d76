/// What the rows of all joints have in common: impulses, springs, and the motion of anchors.
#pragma once

#include "src/contact_solver/soft_step/body_pair.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Fraction of a joint error that a bias sweep corrects. With a higher value, swinging chains gain
/// energy.
inline constexpr Real kJointCorrection = Real(0.2);

/// [m], [rad], largest correction of a sweep. In a substep, the sweeps together correct at most the
/// push-out speed [m/s], [rad/s] times its length.
JFPX_HD inline Real most_correction(const StepConstants& step) {
  return step.push_out_speed * step.h / static_cast<Real>(step.joint_sweeps + 1);
}

/// Square of half the largest angle [rad] by which a joint turns in a substep on an exact circle.
/// Larger angles are inexact, because the impulse changes the velocities too much.
inline constexpr Real kMostTurn = Real(1) / 16;

/// Inverse inertia in world axes of a body that has rotated since the start of the step. That of a
/// body with a locked rotation stays: it does not rotate with the body, and is the same at any time
/// if the body rotates about one axis.
JFPX_HD inline Mat3 turned_inertia(const SolverBody& body, const Mat3& at_start, const Quat& start,
                                   const Quat& now) {
  const bool is_isotropic = body.inverse_inertia > 0;
  if (is_isotropic || now == start || locks_rotation(at_start)) return at_start;
  const Mat3 turn = to_matrix(now * conjugate(start));
  return turn * (at_start * transposed(turn));
}

/// The bodies of a joint at the time of a sweep. Rows of contacts use the inertia at the start of
/// the step. For joints, which act all the time, its error would accumulate: a wheel that spins on
/// a vehicle that turns would gain speed.
template <bool kFixed>
class JointBodies {
 public:
  JFPX_HD JointBodies(const BodyPair& pair, const PairOrientations& orientations)
      : inertia_a_(
            turned_inertia(*pair.a, *pair.inertia_a, *orientations.start_a, *orientations.a)),
        pair_{pair.a, pair.b, &inertia_a_, &inertia_b_} {
    if constexpr (!kFixed) {
      inertia_b_ = turned_inertia(*pair.b, *pair.inertia_b, *orientations.start_b, *orientations.b);
    }
  }
  JointBodies(const JointBodies&) = delete;
  JointBodies& operator=(const JointBodies&) = delete;

  JFPX_HD const BodyPair& pair() const { return pair_; }

 private:
  Mat3 inertia_a_, inertia_b_;
  BodyPair pair_;
};

/// Change of the angular velocity of a body by an impulse at a point, negated; transposed, that of
/// the velocity of the point by an angular impulse, negated.
/// @param arm [m], from the centre to the point @param inertia inverse inertia, symmetric
JFPX_HD inline Mat3 arm_coupling(const Vec3& arm, const Mat3& inertia) {
  return {{cross(arm, inertia.row[0]), cross(arm, inertia.row[1]), cross(arm, inertia.row[2])}};
}

/// Change of the velocity of a point of a body by an impulse there, without the linear part.
/// @param coupling arm_coupling() of the point
JFPX_HD inline Mat3 arm_response(const Vec3& arm, const Mat3& coupling) {
  return {{cross(arm, coupling.column(0)), cross(arm, coupling.column(1)),
           cross(arm, coupling.column(2))}};
}

/// What a row has applied in a substep. The warm start of the bodies applies the same again.
struct JointSums {
  Vec3 impulse;         ///< [N s], on a; b has the opposite one
  Vec3 spun_a, spun_b;  ///< [rad/s], change of a's angular velocity, and against b's

  JFPX_HD JointSums& operator+=(const JointSums& other) {
    impulse += other.impulse;
    spun_a += other.spun_a;
    spun_b += other.spun_b;
    return *this;
  }
  JFPX_HD JointSums operator-(const JointSums& other) const {
    return {impulse - other.impulse, spun_a - other.spun_a, spun_b - other.spun_b};
  }
};

/// @param twist_a, twist_b [N m s], angular impulses on a and against b
template <bool kFixed>
JFPX_HD inline JointSums sums_of(const BodyPair& pair, const Vec3& impulse, const Vec3& twist_a,
                                 const Vec3& twist_b) {
  return {impulse, *pair.inertia_a * twist_a, kFixed ? Vec3{} : *pair.inertia_b * twist_b};
}

template <bool kFixed>
JFPX_HD inline void apply(const BodyPair& pair, const JointSums& sums) {
  pair.a->velocity += sums.impulse * pair.a->inverse_mass;
  pair.a->angular_velocity += sums.spun_a;
  if constexpr (!kFixed) {
    pair.b->velocity -= sums.impulse * pair.b->inverse_mass;
    pair.b->angular_velocity -= sums.spun_b;
  }
}

/// Translates b relative to a along a direction, without changing velocities. Keeps the common
/// centre of mass.
/// @param way [m]
template <bool kFixed>
JFPX_HD inline void separate(const BodyPair& pair, const Vec3& direction, Real way) {
  Real inverse_mass = pair.a->inverse_mass;
  if constexpr (!kFixed) inverse_mass += pair.b->inverse_mass;
  const Vec3 impulse = direction * (way / inverse_mass);
  pair.a->shift -= impulse * pair.a->inverse_mass;
  if constexpr (!kFixed) pair.b->shift += impulse * pair.b->inverse_mass;
}

/// Difference between the mean velocity of an arm that rotates with a body for a substep and
/// cross(w, arm), for integrated_orientation(), which rotates by the angle 2 atan(h w / 2).
/// @param w [rad/s], angular velocity of the body
JFPX_HD inline Vec3 turning(const Vec3& w, const Vec3& arm, Real h) {
  const Real half = h * Real(0.5), square = length_squared(w) * (half * half);
  const Vec3 first = cross(w, arm);
  const Real bound = square > kMostTurn ? kMostTurn / square : Real(1);
  return (cross(w, first) * half - first * square) * (bound / (1 + square));
}

/// A damped spring in a substep. Its force is that of the deflection at the start of the substep,
/// which preserves energy. The damping is that of the velocity at the end, which is stable. A
/// spring that oscillates by more than a quarter of a radian per substep is damped further, so that
/// it is stable even if dozens of springs act on a body.
struct Spring {
  Real stiffness, damping;  ///< [1/s], [-], per effective mass

  /// @param rate [1/s], angular frequency @param damp_rate [1/s], twice the damping ratio times it
  JFPX_HD Spring(Real rate, Real damp_rate, const StepConstants& step) {
    constexpr Real kLargest = Real(1) / 16;
    const Real angle = step.h * rate, square = angle * angle;
    const Real small = square < kLargest ? square : kLargest;
    // (2 sin(angle / 2))^2 = square * factor: the oscillation then has the given frequency.
    const Real factor = 1 - small * (Real(1) / 12);
    damping = step.h * damp_rate + (square - small);
    stiffness = factor * square * step.inverse_h;
  }

  /// Change of the impulse of the spring in a sweep.
  /// @param mass    effective mass @param error deflection at the start of the substep
  /// @param velocity rate of the deflection @param impulse so far in this substep
  /// @param ratio of the mass to the effective one of this direction, if several have one stiffness
  JFPX_HD Real change(Real mass, Real error, Real velocity, Real impulse, Real ratio = 1) const {
    const Real pull = mass * (stiffness * error + damping * velocity);
    return -(pull + impulse) / (1 + damping * ratio);
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
