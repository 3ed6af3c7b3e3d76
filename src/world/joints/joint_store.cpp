/// Joints of a world; see the header.
#include "src/world/joints/joint_store.hpp"

#include <jfpx/error.hpp>
#include <jfpx/scene.hpp>

#include "src/base/reserve.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::DistanceInput;
using soft_step::FrameParameters;
using soft_step::JointInput;
using soft_step::kAllAngular;
using soft_step::kAllLinear;
using soft_step::kAngularX;
using soft_step::kLinearX;
using soft_step::kLinearY;

void set_input(const DistanceJoint& joint, JointInput* input) {
  const Real rate = 2 * kPi * joint.hertz;
  input->distance = {.anchor_a = joint.anchor_a,
                     .anchor_b = joint.anchor_b,
                     .min_length = joint.min_length,
                     .max_length = joint.max_length,
                     .rest_length = joint.rest_length,
                     .spring_rate = rate,
                     .damp_rate = 2 * joint.damping_ratio * rate};
  input->drives = rate > 0 ? 1 : 0;
}

constexpr std::uint32_t set_of(std::uint32_t axis) { return 1u << axis; }
constexpr Real angular_rate(Real hertz) { return 2 * kPi * hertz; }

/// w: cosine, x: sine of half an angle.
Quat half_angle(Real angle) { return from_axis_angle({1, 0, 0}, angle); }

void set_twist_limits(Real least, Real most, FrameParameters* to) {
  const Quat lower = half_angle(least), upper = half_angle(most);
  const bool is_limited = least > -kPi || most < kPi;
  to->limited = is_limited ? kAngularX : soft_step::kNoAxis;
  to->lower = lower.x, to->lower_cosine = lower.w;
  to->upper = upper.x, to->upper_cosine = upper.w;
}

void set_position_limits(std::uint32_t axis, Real least, Real most, FrameParameters* to) {
  to->has_lower = least > -kMaxCoordinate ? 1 : 0;
  to->has_upper = most < kMaxCoordinate ? 1 : 0;
  to->limited = to->has_lower + to->has_upper > 0 ? axis : soft_step::kNoAxis;
  to->lower = least, to->upper = most;
}

void set_motor(std::uint32_t axis, Real speed, Real limit, FrameParameters* to) {
  if (limit > 0) to->motor_axis = axis;
  to->motor_speed = speed;
  to->motor_limit = limit;
}

FrameParameters parameters_of(const BallJoint& joint) {
  FrameParameters p;
  p.locked = kAllLinear;
  set_twist_limits(joint.min_twist, joint.max_twist, &p);
  if (joint.hertz > 0) p.sprung = kAllAngular;
  p.angular_rate = angular_rate(joint.hertz);
  p.damping = 2 * joint.damping_ratio;
  p.friction_torque = joint.friction_torque;
  constexpr Real kNarrow = Real(0.005);  // a cone of no width would have no axis
  if (joint.cone_angle < kNarrow) {
    p.locked |= set_of(kAngularX + 1) | set_of(kAngularX + 2);
    p.sprung &= ~p.locked;
    set_motor(kAngularX, 0, p.friction_torque, &p);  // friction of the twist alone
    p.friction_torque = 0;
  } else if (joint.cone_angle < kPi) {
    const Quat half = half_angle(joint.cone_angle);
    p.has_cone = 1;
    p.cone_sine = half.x, p.cone_cosine = half.w;
  }
  const bool has_limits = p.limited != soft_step::kNoAxis || p.has_cone != 0;
  const bool is_free = p.locked == kAllLinear && p.sprung == 0 && p.friction_torque == 0;
  p.is_plain = is_free && !has_limits ? 1 : 0;
  return p;
}

FrameParameters parameters_of(const HingeJoint& joint) {
  FrameParameters p;
  p.locked = kAllLinear | set_of(kAngularX + 1) | set_of(kAngularX + 2);
  set_twist_limits(joint.min_angle, joint.max_angle, &p);
  if (joint.hertz > 0) p.sprung = set_of(kAngularX);
  p.angular_rate = angular_rate(joint.hertz);
  p.damping = 2 * joint.damping_ratio;
  p.target_twist = half_angle(joint.target_angle);
  set_motor(kAngularX, joint.motor_speed, joint.max_motor_torque, &p);
  return p;
}

FrameParameters parameters_of(const SliderJoint& joint) {
  FrameParameters p;
  p.locked = (kAllLinear & ~set_of(kLinearX)) | kAllAngular;
  set_position_limits(kLinearX, joint.min_position, joint.max_position, &p);
  if (joint.hertz > 0) p.sprung = set_of(kLinearX);
  p.linear_rate = angular_rate(joint.hertz);
  p.damping = 2 * joint.damping_ratio;
  p.target_position.x = joint.target_position;
  set_motor(kLinearX, joint.motor_speed, joint.max_motor_force, &p);
  return p;
}

FrameParameters parameters_of(const FixedJoint& joint) {
  FrameParameters p;
  (joint.linear_hertz > 0 ? p.sprung : p.locked) |= kAllLinear;
  (joint.angular_hertz > 0 ? p.sprung : p.locked) |= kAllAngular;
  p.linear_rate = angular_rate(joint.linear_hertz);
  p.angular_rate = angular_rate(joint.angular_hertz);
  p.damping = 2 * joint.damping_ratio;
  return p;
}

FrameParameters parameters_of(const WheelJoint& joint) {
  FrameParameters p;
  p.locked = (kAllLinear & ~set_of(kLinearY)) | (kAllAngular & ~set_of(kAngularX));
  set_position_limits(kLinearY, joint.min_position, joint.max_position, &p);
  if (joint.hertz > 0) p.sprung = set_of(kLinearY);
  p.linear_rate = angular_rate(joint.hertz);
  p.damping = 2 * joint.damping_ratio;
  set_motor(kAngularX, joint.motor_speed, joint.max_motor_torque, &p);
  return p;
}

Quat base_axes(const auto& joint) { return normalized(joint.axes_b); }
Quat base_axes(const WheelJoint& joint) {
  return normalized(joint.axes_b * from_axis_angle({0, 1, 0}, joint.steering_angle));
}

/// Whether the impulses of a joint keep their meaning after a change of its parameters.
bool have_same_constraints(const JointInput& x, const JointInput& y) {
  const auto of_distance = [](const DistanceInput& d) {
    return std::tuple(d.spring_rate > 0, d.min_length > 0, d.min_length == d.max_length);
  };
  const auto of_frames = [](const FrameParameters& p) {
    return std::tuple(p.locked, p.sprung, p.limited, p.has_lower, p.has_upper, p.has_cone,
                      p.motor_axis, p.friction_torque > 0);
  };
  return of_distance(x.distance) == of_distance(y.distance) &&
         of_frames(x.frames.parameters) == of_frames(y.frames.parameters);
}

/// Whether a joint moves its bodies by a spring or a motor.
std::uint32_t drives(const FrameParameters& p) {
  return p.sprung != 0 || (p.motor_axis != soft_step::kNoAxis && p.motor_speed != 0) ? 1 : 0;
}

void set_input(const auto& joint, JointInput* input) {
  input->frames = {.anchor_a = joint.anchor_a,
                   .anchor_b = joint.anchor_b,
                   .axes_a = normalized(joint.axes_a),
                   .axes_b = base_axes(joint),
                   .parameters = parameters_of(joint)};
  input->drives = drives(input->frames.parameters);
}

}  // namespace

JoinedBodies joined_bodies(const Joint& joint) noexcept {
  return std::visit(
      [](const auto& j) {
        return JoinedBodies{j.a.index, j.b ? j.b->index : soft_step::kWorld,
                            j.b.has_value() && !j.collide_connected};
      },
      joint);
}

std::uint32_t JointStore::require(JointId id) const {
  if (contains(id)) return id.index;
  throw InvalidArgument("joint id (index " + std::to_string(id.index) + ", generation " +
                        std::to_string(id.generation) +
                        ") is unknown; it must be of a joint of this world");
}

bool JointStore::any_frames() const noexcept {
  return std::ranges::any_of(ids(), [this](JointId id) { return has_frames(joint(id.index)); });
}

JointId JointStore::add(const Joint& joint) {
  const std::size_t slots = std::max(pool_.capacity(), std::size_t{pool_.next_index()} + 1);
  reserve_geometric(&joints_, slots);
  reserve_geometric(&inputs_, slots);
  reserve_geometric(&last_, slots);
  reserve_geometric(&now_, slots);
  BodyJoints added;
  const JoinedBodies bodies = joined_bodies(joint);
  bodies.for_each([&](std::uint32_t body) { added.emplace(body, pool_.next_index()); });
  if (pool_.is_full()) pool_.add_slot();
  // From here on, nothing throws.
  joints_.resize(slots);
  inputs_.resize(slots);
  last_.resize(slots);
  now_.resize(slots);
  of_body_.merge(added);
  const JointId id = pool_.add();
  last_[id.index] = {};
  put(id.index, joint);
  return id;
}

void JointStore::put(std::uint32_t slot, const Joint& joint) noexcept {
  joints_[slot] = joint;
  const JoinedBodies bodies = joined_bodies(joint);
  inputs_[slot] = {.is_used = 1,
                   .type = static_cast<std::uint32_t>(joint.index()),
                   .a = bodies.a,
                   .b = bodies.b};
  std::visit([&](const auto& j) { set_input(j, &inputs_[slot]); }, joint);
}

void JointStore::remove(std::uint32_t joint) noexcept {
  const JoinedBodies bodies = joined_bodies(joints_[joint]);
  bodies.for_each([&](std::uint32_t body) { of_body_.erase({body, joint}); });
  inputs_[joint] = {};
  last_[joint] = {};
  pool_.remove(id(joint));
}

void JointStore::set(std::uint32_t joint, const Joint& value) noexcept {
  const JointInput before = inputs_[joint];
  put(joint, value);
  // An impulse of a constraint that no longer exists would act for ever.
  if (!have_same_constraints(before, inputs_[joint])) {
    std::ranges::fill(last_[joint].impulses, Real(0));
  }
}

bool JointStore::excludes_contacts(std::uint32_t a, std::uint32_t b) const noexcept {
  // Traverses the joints of both bodies together, so that the shorter list determines the time.
  auto of_a = of_body_.lower_bound({a, 0}), of_b = of_body_.lower_bound({b, 0});
  const auto is_at = [this](auto at, std::uint32_t body) {
    return at != of_body_.end() && at->first == body;
  };
  const auto excludes = [&](std::uint32_t joint) {
    const JoinedBodies bodies = joined_bodies(joints_[joint]);
    return bodies.excludes_contacts &&
           ((bodies.a == a && bodies.b == b) || (bodies.a == b && bodies.b == a));
  };
  for (; is_at(of_a, a) && is_at(of_b, b); ++of_a, ++of_b) {
    if (excludes(of_a->second) || excludes(of_b->second)) return true;
  }
  return false;
}

soft_step::JointView JointStore::view() {
  return {inputs_.data(), last_.data(), now_.data(), static_cast<std::uint32_t>(inputs_.size())};
}

void JointStore::assign(const std::vector<std::uint32_t>& generations,
                        const std::vector<std::uint32_t>& unused) {
  const std::size_t slots = generations.size();
  pool_.assign(generations, unused);
  joints_.assign(slots, Joint{});
  inputs_.assign(slots, JointInput{});
  last_.assign(slots, soft_step::KeptJoint{});
  now_.assign(slots, soft_step::KeptJoint{});
  of_body_.clear();
}

void JointStore::restore(std::uint32_t slot, const Joint& joint, const soft_step::KeptJoint& kept) {
  const JoinedBodies bodies = joined_bodies(joint);
  of_body_.emplace(bodies.a, slot);
  if (bodies.b != soft_step::kWorld) of_body_.emplace(bodies.b, slot);
  pool_.use(slot);
  put(slot, joint);
  last_[slot] = kept;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
