/// A joint with frames in a soft step: BallJoint, HingeJoint, SliderJoint, FixedJoint, WheelJoint.
///
/// A frame is an anchor and axes in a body. The constraints are of the motion of one frame relative
/// to the other, the base, along and about the axes of the base. Some of these six degrees of
/// freedom are locked; others have a spring, a limit or a motor. The type of a joint is thus a
/// choice of parameters.
///
/// The rotation of the frame relative to the base is a twist about x, followed by a swing about an
/// axis in the y-z plane: the components of the angular degrees of freedom. No function computes an
/// angle from its sine, except for springs.
///
/// As in a DistanceRow, frames rotate with their bodies within the step, and the bias sweep solves
/// for the relative pose at the end of the substep, including the second order of the motion.
#pragma once

#include "src/contact_solver/soft_step/joint_motion.hpp"
#include "src/contact_solver/soft_step/joint_set.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// A sweep changes only the fields from `linear` on: see store_changes().
struct FrameRow {
  using Part = NoPart;
  static constexpr bool kReadsRotation = true, kReadsOrientation = true;

  std::uint32_t a = 0, b = 0;  ///< bodies; a is movable, b may be kWorld
  /// Whether the frame in a is the base, because the body of the base is movable and the other is
  /// not. The row is then one with a fixed body.
  std::uint32_t is_flipped = 0;
  FrameParameters parameters;
  Vec3 centres;             ///< [m], from b's centre to a's at the start of the step
  Vec3 anchor_a, anchor_b;  ///< [m], body axes; of the world: zero
  Quat axes_a, axes_b;      ///< from joint axes to body axes

  FrameImpulses impulses;
  Vec3 linear_error, angular_error;  ///< [m], [rad], deflection of the springs in this substep
  JointSums sums;                    ///< of this substep
  Vec3 turned_a, turned_b;           ///< [rad], SolverBody::rotation after the last move
};

/// Writes the fields that a sweep changes.
JFPX_HD inline void store_changes(const FrameRow& from, FrameRow* to) {
  to->impulses = from.impulses;
  to->linear_error = from.linear_error;
  to->angular_error = from.angular_error;
  to->sums = from.sums;
  to->turned_a = from.turned_a;
  to->turned_b = from.turned_b;
}

/// [rad], the angle whose half has the given sine and cosine. Uses no function of the C library:
/// two halvings of the angle and the series of the arc tangent. The error is below 1e-7 rad in
/// float, and 1e-14 in double.
/// @param cosine >= 0: the angle is in [-pi, pi]
JFPX_HD inline Real angle_of_half(Real sine, Real cosine) {
  const Real quarter = sine / (1 + cosine);  // tangent of a quarter of the angle
  const Real t = quarter / (1 + square_root(1 + quarter * quarter));
  constexpr int kTerms = sizeof(Real) == 4 ? 9 : 20;
  const Real square = t * t;
  Real sum = 0;
  for (int k = kTerms; k-- > 0;) sum = Real(1) / static_cast<Real>(2 * k + 1) - square * sum;
  return 8 * t * sum;
}

/// The frames of a row at the time of a sweep.
struct FramePose {
  Vec3 arm_frame, arm_base;  ///< [m], world axes, from both centres to the anchor of the frame
  /// [m], from the anchor of the base to that of the frame, in linear axes: those of the base, or
  /// those of the world if the anchors are held together.
  Vec3 offset;
  bool has_world_axes = false;
  Mat3 axes;   ///< of the base, as columns; of a plain joint: not set, and so are the next ones
  Quat twist;  ///< about x; w >= 0
  /// Components of the rotation: twice the sine of half the angle of the twist, and of the swing
  /// times its axis.
  Vec3 angular;
  Vec3 tilted;            ///< x axis of the frame, in base axes
  Real swing_cosine = 1;  ///< of half the angle between the x axes

  /// @param centres from b's centre to a's centre
  JFPX_HD static FramePose of(const FrameRow& row, const Vec3& centres, const Quat& orientation_a,
                              const Quat& orientation_b) {
    const Vec3 arm_a = rotate(orientation_a, row.anchor_a);
    const Vec3 arm_b = rotate(orientation_b, row.anchor_b);
    const bool is_flipped = row.is_flipped != 0;
    const Vec3 between = centres + (arm_a - arm_b);  // from b's anchor to a's
    const Vec3 from_base = is_flipped ? -between : between;
    FramePose pose;
    pose.arm_frame = is_flipped ? arm_b : arm_a;
    pose.arm_base = (is_flipped ? arm_a : arm_b) + from_base;
    pose.has_world_axes = (row.parameters.locked & kAllLinear) == kAllLinear;
    pose.offset = from_base;
    if (row.parameters.is_plain != 0) return pose;
    const Quat axes_a = orientation_a * row.axes_a, axes_b = orientation_b * row.axes_b;
    const Quat& base = is_flipped ? axes_a : axes_b;
    pose.axes = to_matrix(base);
    pose.offset = pose.in_linear(from_base);
    pose.set_rotation(conjugate(base) * (is_flipped ? axes_b : axes_a));
    return pose;
  }

  /// A vector of world axes in linear axes, and the reverse.
  JFPX_HD Vec3 in_linear(const Vec3& world) const {
    return has_world_axes ? world : transform_transpose(axes, world);
  }
  JFPX_HD Vec3 from_linear(const Vec3& v) const { return has_world_axes ? v : axes * v; }

  /// @param q of the frame relative to the base
  JFPX_HD void set_rotation(Quat q) {
    if (q.w < 0) q = {-q.w, -q.x, -q.y, -q.z};
    const Real size = square_root(q.w * q.w + q.x * q.x);
    swing_cosine = size;
    twist = size > kEpsilon ? Quat{q.w / size, q.x / size, 0, 0} : Quat{};
    const Quat swing = q * conjugate(twist);
    angular = {2 * twist.x, 2 * swing.y, 2 * swing.z};
    tilted = to_matrix(q).column(0);
  }

  /// [rad], angle of the twist in [-pi, pi].
  JFPX_HD Real twist_angle() const { return angle_of_half(twist.x, twist.w); }
  /// Sine of half the angle between the x axes.
  JFPX_HD Real swing_sine() const {
    return Real(0.5) * square_root(angular.y * angular.y + angular.z * angular.z);
  }
  /// Axis of the angular velocity of which a component is the rate of the twist, base axes.
  JFPX_HD Vec3 twist_axis() const {
    constexpr Real kLeast = Real(0.02);
    const Real sum = 1 + tilted.x;
    return Vec3{sum, tilted.y, tilted.z} * (1 / (sum > kLeast ? sum : kLeast));
  }
  /// Axis about which the frame has swung, base axes.
  JFPX_HD Vec3 swing_axis() const {
    const Real size = square_root(tilted.y * tilted.y + tilted.z * tilted.z);
    if (!(size > kEpsilon)) return {0, 1, 0};
    return Vec3{0, -tilted.z, tilted.y} * (1 / size);
  }
};

/// @param axis in [0, 3)
JFPX_HD inline Vec3 unit_axis(std::uint32_t axis) {
  return {axis == 0 ? Real(1) : Real(0), axis == 1 ? Real(1) : Real(0),
          axis == 2 ? Real(1) : Real(0)};
}

/// The impulse on the frame's body, and the angular impulses, from those of a row.
struct FrameSum {
  Vec3 impulse, twist_frame, twist_base;

  JFPX_HD FrameSum(const FrameParameters& p, const FrameImpulses& i, const FramePose& pose) {
    Vec3 linear = i.linear, torque = i.angular;
    const Real limit = i.lower - i.upper;
    if (p.limited < kAngularX) linear += unit_axis(p.limited) * limit;
    if (p.limited == kAngularX) torque += pose.twist_axis() * limit;
    if (p.motor_axis < kAngularX) linear += unit_axis(p.motor_axis) * i.motor.x;
    if (p.motor_axis == kAngularX) torque.x += i.motor.x;
    if (p.friction_torque > 0) torque += i.motor;
    if (i.cone > 0) torque -= pose.swing_axis() * i.cone;
    impulse = pose.from_linear(linear);
    const Vec3 turn = p.is_plain != 0 ? Vec3{} : pose.axes * torque;
    twist_frame = cross(pose.arm_frame, impulse) + turn;
    twist_base = cross(pose.arm_base, impulse) + turn;
  }
};

/// What an impulse on the body of the frame and angular impulses on it and against the body of the
/// base [N m s] apply to the bodies of a row.
template <bool kFixed>
JFPX_HD inline JointSums sums_of(bool is_flipped, const BodyPair& pair, const Vec3& impulse,
                                 const Vec3& twist_frame, const Vec3& twist_base) {
  // A flipped row has a fixed body.
  if (kFixed && is_flipped) return sums_of<true>(pair, -impulse, -twist_base, Vec3{});
  return sums_of<kFixed>(pair, impulse, twist_frame, twist_base);
}

/// What the impulses of a row apply in a pose.
template <bool kFixed>
JFPX_HD inline JointSums sums_of(const FrameRow& row, const BodyPair& pair, const FramePose& pose) {
  const FrameSum sum(row.parameters, row.impulses, pose);
  return sums_of<kFixed>(row.is_flipped != 0, pair, sum.impulse, sum.twist_frame, sum.twist_base);
}

template <bool kFixed>
JFPX_HD inline void warm_start(const FrameRow& row, const BodyPair& pair) {
  apply<kFixed>(pair, row.sums);
}

/// Factors L D L^T of the locked rows and columns of a symmetric, positive definite matrix.
class LockedFactors {
 public:
  LockedFactors() = default;
  /// @param locked bits 0 to 2
  /// @param whole matrix from which `m` was computed: pivots that are small compared with its
  ///   diagonal are errors of rounding
  JFPX_HD LockedFactors(const Mat3& m, std::uint32_t locked, const Mat3& whole) {
    const auto inverse_of = [&](std::uint32_t i, Real pivot, Real response) {
      const bool is_regular = (locked >> i & 1u) != 0 && pivot > 16 * kEpsilon * response;
      return is_regular ? 1 / pivot : Real(0);
    };
    inverse_.x = inverse_of(0, m(0, 0), whole(0, 0));
    const Real d_x = inverse_.x != 0 ? m(0, 0) : Real(0);
    yx_ = inverse_.x != 0 ? m(1, 0) * inverse_.x : Real(0);
    zx_ = inverse_.x != 0 ? m(2, 0) * inverse_.x : Real(0);
    const Real pivot_y = m(1, 1) - yx_ * yx_ * d_x;
    inverse_.y = inverse_of(1, pivot_y, whole(1, 1));
    const Real d_y = inverse_.y != 0 ? pivot_y : Real(0);
    zy_ = inverse_.y != 0 ? (m(2, 1) - zx_ * yx_ * d_x) * inverse_.y : Real(0);
    inverse_.z = inverse_of(2, m(2, 2) - zx_ * zx_ * d_x - zy_ * zy_ * d_y, whole(2, 2));
  }
  JFPX_HD LockedFactors(const Mat3& m, std::uint32_t locked) : LockedFactors(m, locked, m) {}

  /// Solves m * x = v for the locked components; the other components of x are 0. So are those for
  /// which the matrix is singular to rounding, for example of rotations about an axis without
  /// inertia.
  JFPX_HD Vec3 solve(const Vec3& v) const {
    const bool has_x = inverse_.x != 0, has_y = inverse_.y != 0, has_z = inverse_.z != 0;
    Vec3 x;
    if (has_x) x.x = v.x;
    if (has_y) x.y = v.y - yx_ * x.x;
    if (has_z) x.z = v.z - zx_ * x.x - zy_ * x.y;
    x = component_product(x, inverse_);
    if (has_y) x.y -= zy_ * x.z;
    if (has_x) x.x = x.x - yx_ * x.y - zx_ * x.z;
    return x;
  }

 private:
  // A component that is not locked has a zero column in L, and 1 / D = 0.
  Vec3 inverse_;  ///< 1 / D
  Real yx_ = 0, zx_ = 0, zy_ = 0;
};

/// An impulse [N s] and an angular impulse [N m s] on the body of the frame, which act against the
/// body of the base: in linear axes, and in axes of the base.
struct FrameImpulse {
  Vec3 linear, angular;
  JFPX_HD FrameImpulse operator*(Real s) const { return {linear * s, angular * s}; }
  JFPX_HD FrameImpulse operator+(const FrameImpulse& o) const {
    return {linear + o.linear, angular + o.angular};
  }
};

/// Solves a FrameRow in a sweep. Vectors are in the axes of the base, except where they are named
/// after the world.
///
/// The locked degrees of freedom are one block: with K the response of the velocities to impulses,
/// the factors are of its linear part and of the angular part that is left when the anchors are
/// held, K_angular - K_coupling K_linear^-1 K_coupling^T. Springs, motors, limits and friction
/// apply the impulses that keep the velocities of the locked degrees of freedom, too. Their
/// effective masses are thus those of bodies that turn about an anchor or slide along an axis.
template <bool kFixed>
class FrameSolver {
 public:
  JFPX_HD FrameSolver(FrameRow* row, const BodyPair& pair, const PairOrientations& orientations,
                      const StepConstants& step)
      : row_(row),
        bodies_(pair, orientations),
        pair_(bodies_.pair()),
        step_(step),
        is_flipped_(row->is_flipped != 0),
        pose_(FramePose::of(*row, row->centres + (pair.a->shift - pair.b->shift),
                            projected(*orientations.a, pair.a->rotation - row->turned_a),
                            kFixed
                                ? *orientations.b
                                : projected(*orientations.b, pair.b->rotation - row->turned_b))) {
    Mat3 coupling;
    linear_factors_ = {linear_response(&coupling), row->parameters.locked & kAllLinear};
    if (row->parameters.is_plain != 0) return;
    Mat3 inertia = *pair_.inertia_a;
    if constexpr (!kFixed) inertia = inertia + *pair_.inertia_b;
    rotation_response_ = in_base(regular_response(inertia));
    Vec3 held[3];
    for (int i = 0; i < 3; ++i) {
      coupling_.row[i] = pose_.in_linear(-transform_transpose(coupling, pose_.axes.column(i)));
      held[i] = -linear_factors_.solve(coupling_.row[i]);
    }
    hold_ = from_columns(held[0], held[1], held[2]);
    angular_response_ = rotation_response_ + coupling_ * hold_;
    angular_factors_ = {angular_response_, row->parameters.locked >> kAngularX, rotation_response_};
  }

  /// In the first sweep of a substep: replaces the impulses of the last substep, which were applied
  /// along the former axes, by impulses along the current axes.
  [[gnu::noinline]] JFPX_HD void turn_impulse() {
    const JointSums before = row_->sums;
    row_->sums = sums_of<kFixed>(*row_, pair_, pose_);
    apply<kFixed>(pair_, row_->sums - before);
    const FrameParameters& p = row_->parameters;
    if (p.sprung == 0) return;
    row_->linear_error = pose_.offset;
    for (int i = 0; i < 3; ++i) row_->linear_error[i] -= p.target_position[i];
    // The target rotates about x.
    const Quat to_target = conjugate(p.target_twist) * pose_.twist;
    const bool is_back = to_target.w < 0;
    const Real sine = pose_.swing_sine();
    const Real scale =
        sine > kEpsilon ? angle_of_half(sine, pose_.swing_cosine) / (2 * sine) : Real(1);
    row_->angular_error = {
        angle_of_half(is_back ? -to_target.x : to_target.x, is_back ? -to_target.w : to_target.w),
        pose_.angular.y * scale, pose_.angular.z * scale};
  }

  JFPX_HD void solve(bool use_bias) {
    const FrameParameters& p = row_->parameters;
    const std::uint32_t locked = p.locked >> kAngularX;
    if (locked != 0) {
      solve_block(use_bias);
    } else if (p.locked != 0) {
      solve_points(use_bias);
    }
    if (p.is_plain == 0) {
      if (p.sprung != 0) solve_springs();
      if (p.motor_axis != kNoAxis) solve_motor();
      if (p.friction_torque > 0) solve_friction();
      if (p.limited != kNoAxis) solve_limits(use_bias);
      if (p.has_cone != 0) solve_cone(use_bias);
    }
    if (!use_bias) return;
    if (locked != 0) {
      const Vec3 error = bounded(locked_part(pose_.angular, locked));
      project_rotation(LockedFactors(rotation_response_, locked).solve(error), 1);
    }
    project_points();
  }

 private:
  /// An orientation with the rotations by rows of this substep, which the next move applies.
  JFPX_HD static Quat projected(const Quat& orientation, const Vec3& rotation) {
    return rotation == Vec3{} ? orientation : rotated_by(orientation, rotation);
  }

  JFPX_HD const SolverBody& frame_body() const { return is_flipped_ ? *pair_.b : *pair_.a; }
  JFPX_HD const SolverBody& base_body() const { return is_flipped_ ? *pair_.a : *pair_.b; }

  /// A symmetric matrix of world axes in base axes.
  JFPX_HD Mat3 in_base(const Mat3& world) const {
    return transposed(pose_.axes) * (world * pose_.axes);
  }
  JFPX_HD Vec3 in_base(const Vec3& world) const { return transform_transpose(pose_.axes, world); }

  /// Change of the relative velocity of the anchors by an impulse, linear axes.
  /// @param coupling receives the sum of arm_coupling()
  [[gnu::noinline]] JFPX_HD Mat3 linear_response(Mat3* coupling) const {
    const Vec3& arm_a = is_flipped_ ? pose_.arm_base : pose_.arm_frame;
    *coupling = arm_coupling(arm_a, *pair_.inertia_a);
    Mat3 response = arm_response(arm_a, *coupling);
    Real inverse_mass = pair_.a->inverse_mass;
    if constexpr (!kFixed) {
      const Mat3 of_base = arm_coupling(pose_.arm_base, *pair_.inertia_b);
      response = response + arm_response(pose_.arm_base, of_base);
      *coupling = *coupling + of_base;
      inverse_mass += pair_.b->inverse_mass;
    }
    for (int i = 0; i < 3; ++i) response(i, i) += inverse_mass;
    return pose_.has_world_axes ? response : in_base(response);
  }

  /// Velocity of the frame's anchor relative to the base, linear axes. With bias, the mean over the
  /// substep.
  [[gnu::noinline]] JFPX_HD Vec3 linear_velocity(bool use_bias) const {
    const SolverBody &frame = frame_body(), &base = base_body();
    Vec3 velocity = (frame.velocity + cross(frame.angular_velocity, pose_.arm_frame)) -
                    (base.velocity + cross(base.angular_velocity, pose_.arm_base));
    if (use_bias) {
      velocity += turning(frame.angular_velocity, pose_.arm_frame, step_.h) -
                  turning(base.angular_velocity, pose_.arm_base, step_.h);
      // The axes of the base turn under a frame that moves along them.
      if (!pose_.has_world_axes) {
        const Real square = length_squared(base.angular_velocity) * (step_.h * step_.h);
        const Real bound = square > kMostTurn ? kMostTurn / square : Real(1);
        velocity -= cross(base.angular_velocity, velocity) * (step_.h * bound);
      }
    }
    return pose_.in_linear(velocity);
  }

  /// Angular velocity of the frame relative to the base. With bias, the relative rotation of the
  /// substep, divided by its length: rotations about different axes do not commute.
  [[gnu::noinline]] JFPX_HD Vec3 angular_velocity(bool use_bias) const {
    const Vec3 frame = in_base(frame_body().angular_velocity);
    const Vec3 base = in_base(base_body().angular_velocity);
    Vec3 velocity = frame - base;
    if (use_bias) {
      const Real half = step_.h * Real(0.5);
      const Real square = (length_squared(frame) + length_squared(base)) * (half * half);
      const Real bound = square > kMostTurn ? kMostTurn / square : Real(1);
      velocity -= cross(base, frame) * (half * bound);
    }
    return velocity;
  }

  JFPX_HD void push(const Vec3& impulse_in_linear) {
    const Vec3 impulse = pose_.from_linear(impulse_in_linear);
    push_sum(impulse, cross(pose_.arm_frame, impulse), cross(pose_.arm_base, impulse));
  }
  JFPX_HD void push(const FrameImpulse& pushed) {
    const Vec3 impulse = pose_.from_linear(pushed.linear), torque = pose_.axes * pushed.angular;
    push_sum(impulse, cross(pose_.arm_frame, impulse) + torque,
             cross(pose_.arm_base, impulse) + torque);
  }
  [[gnu::noinline]] JFPX_HD void push_sum(const Vec3& impulse, const Vec3& twist_frame,
                                          const Vec3& twist_base) {
    const JointSums pushed = sums_of<kFixed>(is_flipped_, pair_, impulse, twist_frame, twist_base);
    apply<kFixed>(pair_, pushed);
    row_->sums += pushed;
  }

  /// An impulse along or about an axis, and that by which the locked degrees of freedom keep their
  /// velocities.
  struct AxisImpulse {
    FrameImpulse own, held;
    Real mass;  ///< effective mass or moment of inertia
  };
  [[gnu::noinline]] JFPX_HD AxisImpulse about(const Vec3& axis) const {
    const Vec3 velocity = angular_response_ * axis;
    const Vec3 held = -angular_factors_.solve(velocity), torque = axis + held;
    return {{{}, axis},
            {hold_ * torque, held},
            inverse_of(dot(velocity, torque), dot(axis, rotation_response_ * axis))};
  }
  /// @param i of the linear axis, which is not locked
  [[gnu::noinline]] JFPX_HD AxisImpulse along(std::uint32_t i) const {
    Mat3 coupling;
    const Vec3 axis = unit_axis(i), velocity = linear_response(&coupling) * axis;
    const Vec3 turn = coupling_ * axis, held = -linear_factors_.solve(velocity);
    const Vec3 torque = -angular_factors_.solve(turn + coupling_ * held);
    const Vec3 impulse = held + hold_ * torque;
    return {{axis, {}},
            {impulse, torque},
            inverse_of(dot(velocity, axis + impulse) + dot(turn, torque), dot(axis, velocity))};
  }
  [[gnu::noinline]] JFPX_HD void push(const AxisImpulse& axis, Real size) {
    const FrameImpulse held = axis.held * size;
    row_->impulses.linear += held.linear;
    row_->impulses.angular += held.angular;
    push(axis.own * size + held);
  }

  [[gnu::noinline]] JFPX_HD void solve_springs() {
    const FrameParameters& p = row_->parameters;
    if ((p.sprung & kAllLinear) != 0) {
      const Spring spring(p.linear_rate, p.damping * p.linear_rate, step_);
      for (std::uint32_t i = 0; i < 3; ++i) {
        if ((p.sprung >> i & 1u) == 0) continue;
        const AxisImpulse axis = along(i);
        Real& impulse = row_->impulses.linear[static_cast<int>(i)];
        const Real change = spring.change(axis.mass, row_->linear_error[static_cast<int>(i)],
                                          dot(unit_axis(i), linear_velocity(false)), impulse);
        impulse += change;
        push(axis, change);
      }
    }
    if ((p.sprung & kAllAngular) == 0) return;
    const Spring spring(p.angular_rate, p.damping * p.angular_rate, step_);
    // A spring of all angles has one stiffness; with one of each axis, it would have no potential.
    const bool has_all = (p.sprung & kAllAngular) == kAllAngular;
    const Mat3& response = angular_response_;
    const Real of_all = 3 * inverse_of(response(0, 0) + response(1, 1) + response(2, 2), 0);
    for (std::uint32_t i = 0; i < 3; ++i) {
      if ((p.sprung >> (kAngularX + i) & 1u) == 0) continue;
      const AxisImpulse axis = about(unit_axis(i));
      Real& impulse = row_->impulses.angular[static_cast<int>(i)];
      const Real mass = has_all ? of_all : axis.mass;
      const Real ratio = has_all ? of_all * dot(unit_axis(i), response * unit_axis(i)) : Real(1);
      const Real change = spring.change(mass, row_->angular_error[static_cast<int>(i)],
                                        dot(unit_axis(i), angular_velocity(false)), impulse, ratio);
      impulse += change;
      push(axis, change);
    }
  }

  /// The effective mass of a response; 0 for a rotation without inertia.
  /// @param free response of the unlocked bodies, whose rounding errors are the least response
  JFPX_HD static Real inverse_of(Real response, Real free) {
    const Real least = 16 * kEpsilon * free, used = response > least ? response : least;
    return used > 0 ? 1 / used : Real(0);
  }

  [[gnu::noinline]] JFPX_HD void solve_motor() {
    const FrameParameters& p = row_->parameters;
    const Real most = p.motor_limit * step_.h;
    const auto drive = [&](const AxisImpulse& axis, Real speed) {
      Real& impulse = row_->impulses.motor.x;
      const Real before = impulse, wanted = before - axis.mass * (speed - p.motor_speed);
      impulse = wanted > most ? most : wanted < -most ? -most : wanted;
      push(axis, impulse - before);
    };
    if (p.motor_axis == kAngularX) {
      drive(about(unit_axis(0)), angular_velocity(false).x);
    } else {
      const std::uint32_t i = p.motor_axis;
      drive(along(i), dot(unit_axis(i), linear_velocity(false)));
    }
  }

  /// A torque against all rotations, none of which is locked.
  [[gnu::noinline]] JFPX_HD void solve_friction() {
    const Real most = row_->parameters.friction_torque * step_.h;
    const Vec3 before = row_->impulses.motor;
    Vec3 after = before - LockedFactors(angular_response_, 7).solve(angular_velocity(false));
    const Real size2 = length_squared(after);
    if (size2 > most * most) after *= most / square_root(size2);
    row_->impulses.motor = after;
    const Vec3 torque = after - before;
    push(AxisImpulse{{{}, torque}, {hold_ * torque, {}}, 0}, 1);
  }

  /// Whether a limit acts, and the rate of its gap that its impulse removes.
  /// @param gap [m], [rad]; negative if the limit is violated @param speed rate of the gap
  /// @param impulse of the limit, which stays positive or zero
  JFPX_HD bool acts(Real gap, Real* speed, Real impulse, bool use_bias) const {
    if (use_bias && gap > 0) *speed += gap * step_.inverse_h;
    // In a relax sweep, a slack limit without an impulse does not act. See is_idle().
    return impulse > 0 || ((use_bias || !(gap > 0)) && *speed < 0);
  }
  JFPX_HD void limit(const AxisImpulse& axis, Real side, Real speed, Real* impulse) {
    const Real before = *impulse, wanted = before - axis.mass * speed;
    *impulse = wanted > 0 ? wanted : Real(0);
    push(axis, side * (*impulse - before));
  }

  /// A limit of an angle about an axis.
  /// @param side 1: the angle increases the gap, -1: it decreases the gap
  JFPX_HD void solve_angle_limit(const Vec3& axis, Real gap, Real side, bool use_bias,
                                 Real* impulse) {
    Real speed = side * dot(axis, angular_velocity(use_bias));
    if (acts(gap, &speed, *impulse, use_bias)) limit(about(axis), side, speed, impulse);
    if (use_bias && gap < 0) {
      project_rotation(bounded(axis * (side * gap)),
                       inverse_of(dot(axis, rotation_response_ * axis), 0));
    }
  }

  /// A limit of the position along an axis. @param side as above
  JFPX_HD void solve_position_limit(std::uint32_t i, Real gap, Real side, bool use_bias,
                                    Real* impulse) {
    Real speed = side * dot(unit_axis(i), linear_velocity(use_bias));
    if (acts(gap, &speed, *impulse, use_bias)) limit(along(i), side, speed, impulse);
    if (use_bias && gap < 0) project(bounded(unit_axis(i) * (side * gap)));
  }

  [[gnu::noinline]] JFPX_HD void solve_limits(bool use_bias) {
    const FrameParameters& p = row_->parameters;
    FrameImpulses& impulses = row_->impulses;
    if (p.limited == kAngularX) {
      // 2 sin((angle - limit) / 2) has the sign of the difference. The angle is that within half a
      // turn of the middle of the range.
      Real s = pose_.twist.x, c = pose_.twist.w;
      if (s * (p.lower + p.upper) + c * (p.lower_cosine + p.upper_cosine) < 0) s = -s, c = -c;
      const auto gap_to = [&](Real sine, Real cosine, Real side) {
        constexpr Real kFar = 2;  // more than half a turn
        return c * cosine + s * sine < 0 ? kFar : 2 * side * (s * cosine - c * sine);
      };
      const Vec3 axis = pose_.twist_axis();
      solve_angle_limit(axis, gap_to(p.lower, p.lower_cosine, 1), 1, use_bias, &impulses.lower);
      solve_angle_limit(axis, gap_to(p.upper, p.upper_cosine, -1), -1, use_bias, &impulses.upper);
      return;
    }
    const std::uint32_t i = p.limited;
    const Real position = dot(unit_axis(i), pose_.offset);
    if (p.has_lower != 0) {
      solve_position_limit(i, position - p.lower, 1, use_bias, &impulses.lower);
    }
    if (p.has_upper != 0) {
      solve_position_limit(i, p.upper - position, -1, use_bias, &impulses.upper);
    }
  }

  [[gnu::noinline]] JFPX_HD void solve_cone(bool use_bias) {
    const FrameParameters& p = row_->parameters;
    const Real gap = 2 * (p.cone_sine * pose_.swing_cosine - p.cone_cosine * pose_.swing_sine());
    solve_angle_limit(pose_.swing_axis(), gap, -1, use_bias, &row_->impulses.cone);
  }

  /// Solves for all locked degrees of freedom.
  [[gnu::noinline]] JFPX_HD void solve_block(bool use_bias) {
    const Vec3 held = -linear_factors_.solve(linear_velocity(use_bias));
    const Vec3 torque = -angular_factors_.solve(angular_velocity(use_bias) + coupling_ * held);
    const FrameImpulse change{held + hold_ * torque, torque};
    row_->impulses.linear += change.linear;
    row_->impulses.angular += change.angular;
    push(change);
  }

  /// Solves for the locked linear degrees of freedom of a joint without other locked ones.
  JFPX_HD void solve_points(bool use_bias) {
    const Vec3 change = -linear_factors_.solve(linear_velocity(use_bias));
    row_->impulses.linear += change;
    push(change);
  }

  JFPX_HD void project_points() {
    const std::uint32_t locked = row_->parameters.locked & kAllLinear;
    // The rotations of this row have moved the anchors, too.
    project(bounded(locked_part(pose_.offset, locked)) +
            locked_part(pose_.in_linear(moved_), locked));
  }

  /// The locked components of a vector; the others are 0. @param locked bits 0 to 2
  JFPX_HD static Vec3 locked_part(const Vec3& v, std::uint32_t locked) {
    return {(locked & 1u) != 0 ? v.x : Real(0), (locked & 2u) != 0 ? v.y : Real(0),
            (locked & 4u) != 0 ? v.z : Real(0)};
  }

  /// The fraction of an error [m], [rad] that a sweep corrects.
  JFPX_HD Vec3 bounded(const Vec3& error) const {
    const Vec3 way = error * kJointCorrection;
    const Real most = most_correction(step_), size2 = length_squared(way);
    return size2 > most * most ? way * (most / square_root(size2)) : way;
  }

  /// Corrects an error of the anchors by translating the bodies; see DistanceSolver.
  /// @param way [m], to remove from the position of the frame
  JFPX_HD void project(const Vec3& way) {
    separate<kFixed>(pair_, pose_.from_linear(way), is_flipped_ ? Real(-1) : Real(1));
  }

  /// Corrects an angular error by rotating the bodies without changing velocities.
  /// @param mass of the rotation: an effective moment of inertia, by which the error is multiplied
  [[gnu::noinline]] JFPX_HD void project_rotation(const Vec3& error, Real mass) {
    const Vec3 torque = pose_.axes * (error * (is_flipped_ ? -mass : mass));
    const Vec3 turn_a = *pair_.inertia_a * torque;
    pair_.a->rotation -= turn_a;
    Vec3 moved = cross(turn_a, is_flipped_ ? pose_.arm_base : pose_.arm_frame);
    if constexpr (!kFixed) {
      const Vec3 turn_b = *pair_.inertia_b * torque;
      pair_.b->rotation += turn_b;
      moved += cross(turn_b, pose_.arm_base);
    }
    moved_ += is_flipped_ ? moved : -moved;
  }

  FrameRow* row_;
  const JointBodies<kFixed> bodies_;
  const BodyPair& pair_;
  const StepConstants& step_;
  const bool is_flipped_;
  FramePose pose_;
  Vec3 moved_;  ///< [m], world axes, way of the frame's anchor by project_rotation()
  LockedFactors linear_factors_;
  // Of joints that are not plain. Changes of the relative angular velocity by an angular impulse:
  Mat3 rotation_response_;  ///< of unlocked bodies
  Mat3 angular_response_;   ///< if the locked linear degrees of freedom keep their velocities
  Mat3 coupling_;           ///< change of the relative angular velocity by an impulse
  Mat3 hold_;               ///< the impulse by which they keep them, by an angular impulse
  LockedFactors angular_factors_;
};

/// @param starts whether it is the first sweep of a substep
template <bool kFixed>
JFPX_HD inline void solve(FrameRow* row, const BodyPair& pair, const PairOrientations& orientations,
                          const StepConstants& step, bool use_bias, bool starts) {
  if (!use_bias) {  // the bodies have moved, and rows rotate them in bias sweeps only
    row->turned_a = pair.a->rotation;
    row->turned_b = pair.b->rotation;
  }
  FrameSolver<kFixed> solver(row, pair, orientations, step);
  if (starts) solver.turn_impulse();
  solver.solve(use_bias);
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
