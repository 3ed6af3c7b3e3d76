/// Conversion between a FrameRow and a lane of a bundle: see frame_sweep.hpp.
#pragma once

#include "src/contact_solver/soft_step/cpu/frame_sweep.hpp"
#include "src/contact_solver/soft_step/frame_row.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Whether the vector kernels solve a row. Rows whose anchors may move apart are solved one by one.
inline bool has_lane(const FrameParameters& p) { return (p.locked & kAllLinear) == kAllLinear; }

/// One lane of a bundle.
class FrameLane {
 public:
  /// @param bundle of kCount vectors
  FrameLane(cpu::FrameNumbers* numbers, Real* bundle, unsigned lane)
      : numbers_(numbers), first_(bundle + lane), lane_(lane) {}

  /// Writes a row to the vectors of plain joints, except those that depend on the orientations of
  /// the bodies.
  /// @param is_used false if the lane repeats the row of another one
  void pack(const FrameRow& row, bool is_used) const {
    using namespace cpu::frame_vector;
    const FrameParameters& p = row.parameters;
    numbers_->a[lane_] = row.a;
    numbers_->b[lane_] = row.b == kWorld ? row.a : row.b;
    const auto add = [&](std::uint32_t* set, bool is_in) { *set |= is_in ? 1u << lane_ : 0; };
    add(&numbers_->used, is_used);
    add(&numbers_->left, !has_lane(p));
    add(&numbers_->is_of_world, row.b == kWorld);
    add(&numbers_->is_flipped, row.is_flipped != 0);
    add(&numbers_->has_axes, p.is_plain == 0);
    for (std::uint32_t i = 0; i < 3; ++i) {
      add(&numbers_->locked[i], (p.locked >> (kAngularX + i) & 1u) != 0);
      add(&numbers_->sprung[i], (p.sprung >> (kAngularX + i) & 1u) != 0);
    }
    add(&numbers_->has_motor, p.motor_axis == kAngularX);
    add(&numbers_->has_friction, p.friction_torque > 0);
    add(&numbers_->has_limits, p.limited == kAngularX);
    add(&numbers_->has_cone, p.has_cone != 0);
    put(kCentres, row.centres);
    put(kAnchorA, row.anchor_a);
    put(kAnchorB, row.anchor_b);
    put(kLinear, row.impulses.linear);
    put(kImpulse, row.sums.impulse);
    put(kSpunA, row.sums.spun_a);
    put(kSpunB, row.sums.spun_b);
    put(kTurnedA, row.turned_a);
    put(kTurnedB, row.turned_b);
  }

  /// Writes the other vectors. Those of a bundle of plain joints are not read.
  void pack_axes(const FrameRow& row, const StepConstants& step) const {
    using namespace cpu::frame_vector;
    const FrameParameters& p = row.parameters;
    put(kAxesA, row.axes_a);
    put(kAxesB, row.axes_b);
    put(kAngular, row.impulses.angular);
    put(kMotor, row.impulses.motor);
    put(kLower, row.impulses.lower);
    put(kUpper, row.impulses.upper);
    put(kCone, row.impulses.cone);
    put(kLowerSine, p.lower);
    put(kUpperSine, p.upper);
    put(kLowerCosine, p.lower_cosine);
    put(kUpperCosine, p.upper_cosine);
    put(kConeSine, p.cone_sine);
    put(kConeCosine, p.cone_cosine);
    put(kMotorSpeed, p.motor_speed);
    put(kMotorLimit, p.motor_limit);
    put(kFrictionTorque, p.friction_torque);
    const Spring spring(p.angular_rate, p.damping * p.angular_rate, step);
    put(kStiffness, spring.stiffness);
    put(kDamping, spring.damping);
    put(kTargetTwist, p.target_twist);
    put(kAngularError, row.angular_error);
  }

  void unpack_impulses(FrameRow* row) const {
    using namespace cpu::frame_vector;
    row->impulses.linear = vector(kLinear);
    if (row->parameters.is_plain != 0) return;
    row->impulses = {vector(kLinear), vector(kAngular), vector(kMotor),
                     get(kLower),     get(kUpper),      get(kCone)};
  }

 private:
  void put(std::size_t k, Real v) const { first_[k * cpu::kBundle] = v; }
  void put(std::size_t k, const Vec3& v) const { put(k, v.x), put(k + 1, v.y), put(k + 2, v.z); }
  void put(std::size_t k, const Quat& q) const { put(k, q.w), put(k + 1, Vec3{q.x, q.y, q.z}); }
  Real get(std::size_t k) const { return first_[k * cpu::kBundle]; }
  Vec3 vector(std::size_t k) const { return {get(k), get(k + 1), get(k + 2)}; }

  cpu::FrameNumbers* numbers_;
  Real* first_;
  unsigned lane_;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
