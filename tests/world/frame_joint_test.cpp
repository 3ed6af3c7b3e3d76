/// Motion of bodies with ball, hinge, slider, fixed and wheel joints, against mechanics.
#include "src/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <ostream>
#include <type_traits>
#include <vector>

namespace jfpx {
namespace {

using test::kG;
using test::kPiD;
using test::operator""_r;
using ::testing::HasSubstr;

BodyDef bar(const Vec3& position, const Vec3& half_extents, Real mass = 1) {
  BodyDef def;
  def.shape = Box{half_extents};
  def.mass = mass;
  def.position = position;
  def.acceleration = {0, -9.81_r, 0};
  return def;
}

/// A joint of body a with body b or the world, in its zero position.
template <class J>
J joint_at(const Scene& scene, std::uint32_t a, std::optional<std::uint32_t> b, const Vec3& point,
           const Vec3& axis) {
  const auto pose = [&](std::uint32_t i) {
    return BodyState{scene.bodies[i].position, scene.bodies[i].orientation, {}, {}};
  };
  J joint;
  joint.a = {a, 0};
  if (b) joint.b = BodyId{*b, 0};
  place_joint(&joint, pose(a), b ? pose(*b) : BodyState{}, point, axis);
  return joint;
}

/// Moments of inertia of a box.
Vec3 moments(const BodyDef& def) {
  const Vec3 h = std::get<Box>(def.shape).half_extents;
  const Real k = def.mass / 3;
  return {k * (h.y * h.y + h.z * h.z), k * (h.x * h.x + h.z * h.z), k * (h.x * h.x + h.y * h.y)};
}

double energy(const Scene& scene, const World& world) {
  double sum = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyDef& def = scene.bodies[i];
    const BodyState state = world.states()[i];
    const Vec3 w = rotate(conjugate(state.orientation), state.angular_velocity);
    sum += static_cast<double>(def.mass * length_squared(state.velocity) * 0.5_r -
                               def.mass * dot(def.acceleration, state.position) +
                               dot(component_product(moments(def), w), w) * 0.5_r);
  }
  return sum;
}

double largest_gap(const World& world) {
  Real gap = 0;
  for (const JointId id : world.joints()) gap = std::max(gap, world.joint_state(id).length);
  return static_cast<double>(gap);
}

/// Bars in a row along x, each with a joint at its left end; the first one with the world.
template <class J>
Scene chain(std::uint32_t count, Real length) {
  Scene scene;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Real x = length * (static_cast<Real>(i) + 0.5_r);
    scene.bodies.push_back(bar({x, 0, 0}, {length / 2, length * 0.15_r, length * 0.15_r}));
    const auto before = i > 0 ? std::optional(i - 1) : std::nullopt;
    const Vec3 point{length * static_cast<Real>(i), 0, 0};
    scene.joints.push_back(joint_at<J>(scene, i, before, point, {0, 0, 1}));
  }
  return scene;
}

/// @returns the ratio of the last amplitude to the first one
double amplitude_after_a_minute(const Scene& scene, double angle) {
  World world(scene);
  double last = 0;
  for (int n = 0; n < 60 * 60; ++n) {
    world.step();
    const Vec3 x = world.states()[0].position;
    const double now = std::atan2(static_cast<double>(x.x), -static_cast<double>(x.y));
    if (n >= 57 * 60) last = std::max(last, std::abs(now));
  }
  EXPECT_LT(largest_gap(world), 1e-5);
  return last / angle;
}

TEST(FrameJoint, PendulumsOnABallAndAHingeKeepTheirAmplitude) {
  const double angle = 10 * kPiD / 180;
  Scene scene;
  scene.bodies = {bar({static_cast<Real>(std::sin(angle)), -static_cast<Real>(std::cos(angle)), 0},
                      {0.05_r, 0.5_r, 0.05_r})};
  scene.bodies[0].orientation = from_axis_angle({0, 0, 1}, static_cast<Real>(angle));
  scene.joints = {joint_at<BallJoint>(scene, 0, {}, {}, {1, 0, 0})};
  EXPECT_NEAR(amplitude_after_a_minute(scene, angle), 1, 0.002);
  scene.joints = {joint_at<HingeJoint>(scene, 0, {}, {}, {0, 0, 1})};
  EXPECT_NEAR(amplitude_after_a_minute(scene, angle), 1, 0.002);
}

template <class J>
void expect_energy_of_a_double_pendulum() {
  const Scene scene = chain<J>(2, 1);
  World world(scene);
  const double before = energy(scene, world), scale = 2 * kG;
  for (int n = 0; n < 10 * 60; ++n) world.step();
  EXPECT_NEAR(energy(scene, world), before, 0.02 * scale);
}
TEST(FrameJoint, DoublePendulumsKeepTheirEnergy) {
  expect_energy_of_a_double_pendulum<BallJoint>();
  expect_energy_of_a_double_pendulum<HingeJoint>();
}

TEST(FrameJoint, AReleasedChainStaysTogether) {
  for (const Scene& scene : {chain<BallJoint>(20, 0.2_r), chain<HingeJoint>(20, 0.2_r)}) {
    World world(scene);
    double gap = 0;
    for (int n = 0; n < 20 * 60; ++n) {
      world.step();
      gap = std::max(gap, largest_gap(world));
    }
    EXPECT_LT(gap / 0.2, 0.25);
    EXPECT_LT(largest_gap(world) / 0.2, 0.03);
  }
}

TEST(FrameJoint, AChainCarriesABallOfAHundredTimesTheMassOfALink) {
  constexpr std::uint32_t kLinks = 20;
  Scene scene;
  const Vec3 link{0.03_r, 0.1_r, 0.03_r};
  for (std::uint32_t i = 0; i <= kLinks; ++i) {
    const Real top = -0.2_r * static_cast<Real>(i);
    scene.bodies.push_back(i < kLinks ? bar({0, top - 0.1_r, 0}, link, 0.1_r)
                                      : bar({0, top - 0.2_r, 0}, {0.2_r, 0.2_r, 0.2_r}, 10));
    const auto before = i > 0 ? std::optional(i - 1) : std::nullopt;
    scene.joints.push_back(joint_at<BallJoint>(scene, i, before, {0, top, 0}, {1, 0, 0}));
  }
  scene.soft_step.substeps = 16;
  World world(scene);
  for (int n = 0; n < 20 * 60; ++n) world.step();
  EXPECT_LT(largest_gap(world) / 0.2, 0.01);
  const double weight = kG * (10 + 0.1 * kLinks);
  const Vec3 force = world.joint_state(world.joints()[0]).force;
  EXPECT_NEAR(static_cast<double>(force.y) / weight, 1, 0.15);
}

/// A beam of fixed joints carries its weight: the joint at the wall has its force and torque.
TEST(FrameJoint, FixedJointsHoldABeam) {
  const Scene scene = chain<FixedJoint>(4, 0.2_r);
  World world(scene);
  for (int n = 0; n < 10 * 60; ++n) world.step();
  EXPECT_NEAR(static_cast<double>(world.states()[3].position.y), 0, 0.002);
  const JointState wall = world.joint_state(world.joints()[0]);
  EXPECT_NEAR(static_cast<double>(wall.force.y) / (4 * kG), 1, 0.05);
  EXPECT_NEAR(static_cast<double>(wall.torque.z) / (4 * kG * 0.4), 1, 0.05);
}

TEST(FrameJoint, AMotorReachesItsSpeedWithItsTorque) {
  Scene scene;
  scene.bodies = {bar({}, {0.1_r, 0.5_r, 0.2_r}, 2)};
  scene.bodies[0].acceleration = {};
  auto joint = joint_at<HingeJoint>(scene, 0, {}, {}, {1, 0, 0});
  joint.motor_speed = 5;
  joint.max_motor_torque = 0.5_r;
  scene.joints = {joint};
  World world(scene);
  const JointId id = world.joints()[0];
  const double inertia = static_cast<double>(moments(scene.bodies[0]).x);
  for (int n = 0; n < 60; ++n) world.step();
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).speed), 0.5 / inertia, 1e-3);
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).torque.x), 0.5, 1e-4);
  for (int n = 0; n < 240; ++n) world.step();
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).speed), 5, 0.005);
  // Full turns, with the angle in [-pi, pi].
  Real largest = 0;
  for (int n = 0; n < 120; ++n) {
    world.step();
    largest = std::max(largest, absolute(world.joint_state(id).position));
  }
  EXPECT_GT(largest, 3);
  EXPECT_LE(largest, kPi);
}

TEST(FrameJoint, LimitsOfAHingeAndASliderHold) {
  Scene scene;
  scene.bodies = {bar({0, -0.5_r, 0}, {0.05_r, 0.5_r, 0.05_r}),
                  bar({5, 0, 0}, {0.1_r, 0.1_r, 0.2_r})};
  scene.bodies[0].angular_velocity = {0, 0, 20};
  scene.bodies[0].velocity = {10, 0, 0};
  auto hinge = joint_at<HingeJoint>(scene, 0, {}, {}, {0, 0, 1});
  hinge.min_angle = -0.5_r, hinge.max_angle = 0.5_r;
  auto slider = joint_at<SliderJoint>(scene, 1, {}, {5, 0.3_r, 0}, {1, 1, 0});
  slider.min_position = -1, slider.max_position = 1;
  scene.joints = {hinge, slider};
  World world(scene);
  Real angle = 0, position = 0, aside = 0;
  for (int n = 0; n < 10 * 60; ++n) {
    world.step();
    angle = std::max(angle, absolute(world.joint_state(world.joints()[0]).position));
    const JointState state = world.joint_state(world.joints()[1]);
    position = std::max(position, absolute(state.position));
    aside = std::max(aside, absolute(state.length - absolute(state.position)));
  }
  EXPECT_LT(static_cast<double>(angle), 0.5 + 0.2 * kPiD / 180);
  EXPECT_LT(static_cast<double>(position), 1.001);
  EXPECT_LT(static_cast<double>(aside), 1e-4);
}

TEST(FrameJoint, AConeAndTwistLimitsHold) {
  Scene scene;
  scene.bodies = {bar({0.5_r, 0, 0}, {0.5_r, 0.1_r, 0.2_r})};
  scene.bodies[0].angular_velocity = {8, 2, -3};
  auto joint = joint_at<BallJoint>(scene, 0, {}, {}, {1, 0, 0});
  joint.cone_angle = 0.6_r;
  joint.min_twist = -0.2_r, joint.max_twist = 0.3_r;
  scene.joints = {joint};
  World world(scene);
  Real cone = 0;
  for (int n = 0; n < 10 * 60; ++n) {
    world.step();
    cone = std::max(cone, world.joint_state(world.joints()[0]).position);
    const Quat q = world.states()[0].orientation;
    const Real twist = 2 * std::atan2(q.x, q.w);
    ASSERT_GT(twist, -0.21_r) << n;
    ASSERT_LT(twist, 0.31_r) << n;
  }
  EXPECT_GT(cone, 0.55_r) << "it falls to the limit";
  EXPECT_LT(cone, 0.6_r + 0.01_r);
}

TEST(FrameJoint, SpringsHaveTheirFrequency) {
  Scene scene;
  scene.bodies = {bar({}, {0.1_r, 0.5_r, 0.2_r}, 2)};
  scene.bodies[0].acceleration = {};
  auto joint = joint_at<HingeJoint>(scene, 0, {}, {}, {1, 0, 0});
  joint.hertz = 1;
  joint.target_angle = 1;
  scene.joints = {joint};
  World world(scene);
  double amplitude = 0;
  for (int n = 1; n <= 10 * 60; ++n) {
    world.step();
    const auto angle = static_cast<double>(world.joint_state(world.joints()[0]).position);
    amplitude = std::max(amplitude, std::abs(angle - 1));
    ASSERT_NEAR(angle, 1 - std::cos(2 * kPiD * n / 60), 0.03) << n;
  }
  EXPECT_NEAR(amplitude, 1, 1e-3);
}

/// A body far from the axis of a joint: springs, motors and limits are as strong as for a body on
/// the axis, with the world and with a second body.
struct Lever {
  Shape shape;
  Vec3 centre;  ///< [m], from the joint
  bool has_base = false;
};
void PrintTo(const Lever& lever, std::ostream* out) {
  *out << "shape " << lever.shape.index() << " at " << lever.centre.x << ", " << lever.centre.y
       << ", " << lever.centre.z << (lever.has_base ? " on a body" : "");
}

class BodyOnALever : public ::testing::TestWithParam<Lever> {
 protected:
  /// A world without gravity, with a joint about or along z at the origin.
  template <class J>
  World world_with(const J& properties, const Vec3& acceleration = {}) const {
    Scene scene;
    const auto add = [&](const Shape& shape, const Vec3& position, Real mass) {
      BodyDef def;
      def.shape = shape;
      def.mass = mass;
      def.position = position;
      def.acceleration = acceleration;
      scene.bodies.push_back(def);
    };
    add(GetParam().shape, GetParam().centre, 2);
    if (GetParam().has_base) add(Box{{1, 0.5_r, 2}}, {-1, -2, 0.5_r}, 50);
    const auto b = GetParam().has_base ? std::optional(1u) : std::nullopt;
    J joint = properties;
    const J frames = joint_at<J>(scene, 0, b, {}, {0, 0, 1});
    joint.a = frames.a, joint.b = frames.b;
    joint.anchor_a = frames.anchor_a, joint.anchor_b = frames.anchor_b;
    joint.axes_a = frames.axes_a, joint.axes_b = frames.axes_b;
    scene.joints = {joint};
    return World(scene);
  }
  /// The motor has its speed after a step, and the joint is closed.
  template <class J>
  void expect_motor_speed(const J& joint) const {
    World world = world_with(joint);
    const JointId id = world.joints()[0];
    for (int n = 0; n < 60; ++n) {
      world.step();
      ASSERT_NEAR(static_cast<double>(world.joint_state(id).speed), 3, 0.01)
          << n << (std::is_same_v<J, HingeJoint> ? " hinge" : " slider");
    }
    if constexpr (std::is_same_v<J, HingeJoint>) {
      EXPECT_LT(world.joint_state(id).length, 1e-3_r);
    }
  }
  /// A spring to 0.1 has a frequency of 2 Hz.
  template <class J>
  void expect_frequency(const J& joint) const {
    World world = world_with(joint);
    for (int n = 1; n <= 60; ++n) {
      world.step();
      const auto position = static_cast<double>(world.joint_state(world.joints()[0]).position);
      ASSERT_NEAR(position, 0.1 * (1 - std::cos(2 * 2 * kPiD * n / 60)), 0.02) << n;
    }
  }
};

TEST_P(BodyOnALever, AMotorHasItsSpeed) {
  HingeJoint hinge;
  hinge.motor_speed = 3, hinge.max_motor_torque = 1e4_r;
  expect_motor_speed(hinge);
  SliderJoint slider;
  slider.motor_speed = 3, slider.max_motor_force = 1e4_r;
  expect_motor_speed(slider);
}

TEST_P(BodyOnALever, ASpringHasItsFrequency) {
  HingeJoint hinge;
  hinge.hertz = 2, hinge.damping_ratio = 0, hinge.target_angle = 0.1_r;
  expect_frequency(hinge);
  SliderJoint slider;
  slider.hertz = 2, slider.damping_ratio = 0, slider.target_position = 0.1_r;
  expect_frequency(slider);
}

// All angles have one stiffness and damping, but inertias that differ by the square of the lever.
TEST_P(BodyOnALever, ASpringOfAllAnglesIsStable) {
  for (const Real hertz : {2.0_r, 10.0_r, 60.0_r}) {
    for (const Real damping : {0.0_r, 1.0_r, 5.0_r}) {
      BallJoint ball;
      ball.hertz = hertz, ball.damping_ratio = damping;
      World world = world_with(ball);
      BodyState state = world.states()[0];
      state.angular_velocity = {1, 0.5_r, 0.3_r};
      state.velocity = cross(state.angular_velocity, GetParam().centre);
      world.set_state(world.bodies()[0], state);
      for (int n = 0; n < 5 * 60; ++n) {
        world.step();
        ASSERT_LT(length(world.states()[0].angular_velocity), 2) << hertz << " Hz, " << damping;
      }
    }
  }
}

// The swing is locked, and has no part in the friction of the twist.
TEST(FrameJoint, FrictionOfANarrowBallJointHasItsTorque) {
  Scene scene;
  BodyDef def;
  def.mass = 2;
  def.shape = Sphere{0.1_r};
  def.position = {1, 0, 0};
  def.acceleration = {};
  scene.bodies = {def};
  const Vec3 axis = normalized(Vec3{1, 0, 1});
  auto joint = joint_at<BallJoint>(scene, 0, {}, {}, axis);
  joint.cone_angle = 0;
  joint.friction_torque = 1;
  scene.joints = {joint};
  World world(scene);
  BodyState state = world.states()[0];
  state.angular_velocity = axis * 10;
  state.velocity = cross(state.angular_velocity, def.position);
  world.set_state(world.bodies()[0], state);
  for (int n = 0; n < 60; ++n) world.step();
  const double inertia = 0.4 * 2 * 0.01 + 2 * 0.5;  // about the axis
  EXPECT_NEAR(static_cast<double>(length(world.states()[0].angular_velocity)), 10 - 1 / inertia,
              0.02);
}

INSTANTIATE_TEST_SUITE_P(FrameJoint, BodyOnALever,
                         ::testing::Values(Lever{Sphere{0.1_r}, {1, 0, 0}},
                                           Lever{Sphere{0.1_r}, {1, 0, 1}},
                                           Lever{Box{{0.5_r, 0.05_r, 0.3_r}}, {1, 0, 0.3_r}},
                                           Lever{Sphere{0.1_r}, {1, 0, 0}, true},
                                           Lever{Box{{0.5_r, 0.05_r, 0.3_r}}, {1, 0, 0}, true}));

class FallingLever : public BodyOnALever {};

TEST_P(FallingLever, RestsAtALimitOfAHinge) {
  HingeJoint hinge;
  hinge.min_angle = -0.5_r, hinge.max_angle = 0.5_r;
  World world = world_with(hinge, {0, -9.81_r, 0});
  for (int n = 0; n < 2 * 60; ++n) world.step();
  EXPECT_FALSE(world.awake(world.bodies()[0]));
  const double lever = static_cast<double>(GetParam().centre.x) * std::cos(0.5);
  EXPECT_NEAR(static_cast<double>(absolute(world.joint_state(world.joints()[0]).torque.z)),
              2 * kG * lever, 0.05);
}

// The body may move along the cone.
TEST_P(FallingLever, GainsNoEnergyAtLimitsOfABallJoint) {
  BallJoint ball;
  ball.cone_angle = 0.3_r, ball.min_twist = -0.5_r, ball.max_twist = 0.5_r;
  World world = world_with(ball, {0, -9.81_r, 0});
  for (int n = 0; n < 10 * 60; ++n) {
    world.step();
    const BodyState state = world.states()[0];
    const Real kinetic = length_squared(state.velocity) / 2;
    ASSERT_LT(kinetic + 9.81_r * state.position.y, 0.05_r) << n;
    ASSERT_LT(world.joint_state(world.joints()[0]).position, 0.3006_r) << n;
  }
}

TEST_P(FallingLever, IsHeldByAFixedJoint) {
  World world = world_with(FixedJoint{}, {0, -9.81_r, 0});
  for (int n = 0; n < 60; ++n) {
    world.step();
    ASSERT_LT(length(world.states()[0].position - GetParam().centre), 1e-4_r) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(FrameJoint, FallingLever,
                         ::testing::Values(Lever{Sphere{0.1_r}, {1, 0, 0}},
                                           Lever{Sphere{0.1_r}, {1, 0, 1}},
                                           Lever{Sphere{0.03_r}, {1, 0, 0.3_r}},
                                           Lever{Box{{0.5_r, 0.05_r, 0.3_r}}, {1, 0, 0.3_r}}));

/// A wheel on a vehicle that turns keeps its speed: its inertia turns within the step.
TEST(FrameJoint, AWheelOnATurningBodyKeepsItsSpeed) {
  Scene scene;
  scene.bodies = {bar({}, {0.5_r, 0.1_r, 0.3_r}, 5), bar({0, 0.3_r, 0}, {0.02_r, 0.2_r, 0.2_r})};
  for (BodyDef& def : scene.bodies) def.acceleration = {};
  scene.bodies[0].angular_velocity = {0, 3, 0};
  scene.bodies[1].angular_velocity = {60, 3, 0};
  scene.joints = {joint_at<HingeJoint>(scene, 1, 0, {0, 0.3_r, 0}, {1, 0, 0})};
  World world(scene);
  for (int n = 0; n < 30 * 60; ++n) world.step();
  const JointState state = world.joint_state(world.joints()[0]);
  EXPECT_NEAR(static_cast<double>(state.speed), 60, 1);
  EXPECT_LT(state.length, 1e-5_r);
}

/// The angular momentum of bodies that tumble and pull each other is that of the middle of a
/// substep, so it drifts.
TEST(FrameJoint, AFreeChainKeepsItsMomentum) {
  Scene scene = chain<BallJoint>(6, 0.2_r);
  scene.joints.erase(scene.joints.begin());
  for (std::uint32_t i = 0; i < 6; ++i) {
    scene.bodies[i].acceleration = {};
    scene.bodies[i].velocity = {0, static_cast<Real>(i) - 2.5_r, 0.5_r};
    scene.bodies[i].angular_velocity = {2, 1, 4};
  }
  World world(scene);
  const auto momenta = [&] {
    Vec3 linear, angular;
    for (std::size_t i = 0; i < 6; ++i) {
      const BodyState s = world.states()[i];
      const Vec3 w = rotate(conjugate(s.orientation), s.angular_velocity);
      linear += s.velocity;
      angular += cross(s.position, s.velocity) +
                 rotate(s.orientation, component_product(moments(scene.bodies[i]), w));
    }
    return std::pair(linear, angular);
  };
  const auto [linear, angular] = momenta();
  for (int n = 0; n < 20 * 60; ++n) world.step();
  const auto [linear_after, angular_after] = momenta();
  EXPECT_LT(length(linear_after - linear), 1e-4_r);
  EXPECT_LT(length(angular_after - angular), 0.15_r * length(angular));
}

/// A wheel of a car: the motor drives it, the suspension carries a quarter of the weight.
TEST(FrameJoint, ACarDrivesOnItsWheels) {
  Scene scene;
  BodyDef ground;
  ground.shape = HalfSpace{{0, 1, 0}, 0};
  ground.mass = 0;
  ground.friction = 1;
  scene.bodies = {ground, bar({0, 0.8_r, 0}, {1, 0.2_r, 0.5_r}, 20)};
  for (int i = 0; i < 4; ++i) {
    BodyDef wheel = bar({i < 2 ? -0.8_r : 0.8_r, 0.35_r, i % 2 == 0 ? -0.7_r : 0.7_r}, {}, 1);
    wheel.shape = Sphere{0.35_r};
    wheel.friction = 1;
    scene.bodies.push_back(wheel);
    const auto index = static_cast<std::uint32_t>(scene.bodies.size() - 1);
    auto joint = joint_at<WheelJoint>(scene, index, 1, wheel.position, {0, 0, 1});
    joint.hertz = 4, joint.damping_ratio = 0.7_r;
    joint.motor_speed = -10, joint.max_motor_torque = 20;
    scene.joints.push_back(joint);
  }
  World world(scene);
  for (int n = 0; n < 5 * 60; ++n) world.step();
  const BodyState car = world.states()[1];
  EXPECT_NEAR(static_cast<double>(car.velocity.x), 3.5, 0.05);
  EXPECT_NEAR(static_cast<double>(car.orientation.w), 1, 1e-3);
  double carried = 0;
  for (const JointId id : world.joints()) {
    carried -= static_cast<double>(world.joint_state(id).force.y);
  }
  EXPECT_NEAR(carried / (20 * kG), 1, 0.02);
}

/// Corrections by several joints of a body take account of each other.
TEST(FrameJoint, ADoorWithFiveHingesIsSetUpright) {
  Scene scene;
  scene.bodies = {bar({0.5_r, 0, 0}, {0.5_r, 1, 0.05_r}, 5)};
  for (int i = -2; i <= 2; ++i) {
    const Vec3 place{0, 0.4_r * static_cast<Real>(i), 0};
    scene.joints.push_back(joint_at<HingeJoint>(scene, 0, {}, place, {0, 1, 0}));
  }
  scene.bodies[0].orientation = from_axis_angle({0, 0, 1}, 0.05_r);
  World world(scene);
  for (int n = 0; n < 2 * 60; ++n) world.step();
  EXPECT_LT(absolute(world.states()[0].orientation.z), 1e-4_r);
  EXPECT_LT(largest_gap(world), 1e-4);
}

/// The correction of a joint does not depend on its free degrees of freedom.
TEST(FrameJoint, AnOpenDoorIsSetUprightAsFastAsAClosedOne) {
  for (const Real angle : {0.0_r, 2.0_r}) {
    Scene scene;
    scene.bodies = {bar({}, {0.05_r, 1, 0.5_r}, 5)};
    scene.bodies[0].acceleration = {};
    scene.joints = {joint_at<HingeJoint>(scene, 0, {}, {}, {0, 1, 0})};
    scene.bodies[0].orientation =
        from_axis_angle({0, 0, 1}, 0.02_r) * from_axis_angle({0, 1, 0}, angle);
    World world(scene);
    for (int n = 0; n < 10; ++n) world.step();
    const Vec3 axis = rotate(world.states()[0].orientation, {0, 1, 0});
    EXPECT_LT(length(axis - Vec3{0, 1, 0}), 1e-4_r) << angle;
  }
}

/// A slider that is flung out along a rod which turns: r(t) = r cosh(w t), to second order in the
/// step.
TEST(FrameJoint, ASliderOnATurntableIsFlungOut) {
  Scene scene;
  BodyDef table = bar({}, {2, 0.1_r, 0.1_r}, 0);
  table.kinematic = true;
  table.angular_velocity = {0, 0, 2};
  BodyDef bead = bar({0.5_r, 0, 0}, {0.1_r, 0.1_r, 0.1_r});
  bead.acceleration = {};
  bead.velocity = {0, 1, 0};
  bead.angular_velocity = {0, 0, 2};
  scene.bodies = {table, bead};
  scene.joints = {joint_at<SliderJoint>(scene, 1, 0, {0.5_r, 0, 0}, {1, 0, 0})};
  World world(scene);
  for (int n = 0; n < 60; ++n) world.step();
  const JointState state = world.joint_state(world.joints()[0]);
  EXPECT_NEAR(static_cast<double>(state.position) + 0.5, 0.5 * std::cosh(2.0), 0.01);
  EXPECT_LT(absolute(state.length - state.position), 1e-4_r);
}

TEST(FrameJoint, AWideRangeOfAngleHasLimitsOnBothSides) {
  Scene scene;
  scene.bodies = {bar({}, {0.1_r, 0.5_r, 0.2_r})};
  scene.bodies[0].acceleration = {};
  auto joint = joint_at<HingeJoint>(scene, 0, {}, {}, {1, 0, 0});
  joint.min_angle = -1;
  for (const Real most : {3.1_r, kPi}) {
    joint.max_angle = most;
    scene.joints = {joint};
    scene.bodies[0].angular_velocity = {2, 0, 0};
    World world(scene);
    for (int n = 0; n < 5 * 60; ++n) {
      world.step();
      const Real angle = world.joint_state(world.joints()[0]).position;
      ASSERT_TRUE(angle > -0.01_r || angle < -3.13_r) << angle;
    }
    EXPECT_NEAR(static_cast<double>(absolute(world.joint_state(world.joints()[0]).position)),
                static_cast<double>(most), 0.01);
  }
}

/// A constraint that is removed from a joint leaves no impulse.
TEST(FrameJoint, AChangedJointHasNoImpulseOfTheOldOne) {
  Scene scene;
  scene.bodies = {bar({}, {0.1_r, 0.1_r, 0.1_r})};
  auto slider = joint_at<SliderJoint>(scene, 0, {}, {}, {0, 1, 0});
  slider.hertz = 2, slider.damping_ratio = 1;
  scene.joints = {slider};
  World world(scene);
  for (int n = 0; n < 60; ++n) world.step();
  const JointId id = world.joints()[0];
  slider.hertz = 0;
  world.set_joint(id, slider);
  const Real before = world.joint_state(id).speed;
  for (int n = 0; n < 30; ++n) world.step();
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).speed - before), -kG / 2, 0.01);
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).force.y), 0, 1e-6);
}

/// A slow motor and a soft spring keep their bodies awake.
TEST(FrameJoint, SlowMotorsAndSpringsDoNotFallAsleep) {
  Scene scene;
  scene.bodies = {bar({}, {0.1_r, 0.5_r, 0.2_r}), bar({5, 0, 0}, {0.1_r, 0.5_r, 0.2_r})};
  for (BodyDef& def : scene.bodies) def.acceleration = {};
  auto motor = joint_at<HingeJoint>(scene, 0, {}, {}, {1, 0, 0});
  motor.motor_speed = 0.1_r, motor.max_motor_torque = 10;
  auto spring = joint_at<HingeJoint>(scene, 1, {}, {5, 0, 0}, {1, 0, 0});
  spring.hertz = 0.2_r, spring.damping_ratio = 1, spring.target_angle = 1;
  scene.joints = {motor, spring};
  World world(scene);
  for (int n = 0; n < 10 * 60; ++n) world.step();
  EXPECT_NEAR(static_cast<double>(world.joint_state(world.joints()[0]).position), 1, 0.01);
  EXPECT_NEAR(static_cast<double>(world.joint_state(world.joints()[1]).position), 1, 0.02);
}

// If contacts projected the bodies, joints would be 14 cm open, and the bars would still overlap.
TEST(FrameJoint, StaysClosedWhileBarsThatItHoldsArePushedApart) {
  for (const Real overlap : {0.06_r, 0.12_r, 0.2_r}) {
    Scene scene;
    const auto add = [&scene](const Vec3& position, const Vec3& half_extents) {
      scene.bodies.push_back(bar(position, half_extents));
      scene.bodies.back().acceleration = {};
      return BodyId{static_cast<std::uint32_t>(scene.bodies.size() - 1), 0};
    };
    const BodyId post = add({-0.7_r, 0, 0}, {0.1_r, 1, 0.1_r});
    for (const Real side : {Real(-1), Real(1)}) {
      const Real height = side * (0.1_r - overlap / 2);
      scene.joints.push_back(BallJoint{.a = add({0, height, 0}, {0.5_r, 0.1_r, 0.1_r}),
                                       .b = post,
                                       .anchor_a = {-0.6_r, 0, 0},
                                       .anchor_b = {0.1_r, height, 0}});
    }
    World world(scene);
    double gap = 0;
    for (int n = 0; n < 240; ++n) {
      world.step();
      gap = std::max(gap, largest_gap(world));
    }
    EXPECT_LT(gap, 0.005) << overlap;
    for (const Contact& contact : world.contacts()) EXPECT_GT(contact.distance, -0.001_r);
  }
}

TEST(FrameJoint, RagdollsComeToRest) {
  World world(scenes::make("ragdolls", {.spheres = 20}));
  for (int n = 0; n < 10 * 60; ++n) world.step();
  for (const BodyId id : world.bodies()) {
    ASSERT_FALSE(world.mass(id) > 0 && world.awake(id)) << id.index;
  }
  EXPECT_LT(largest_gap(world), 0.002);
}

TEST(FrameJoint, InvalidFieldsAreNamed) {
  Scene scene;
  scene.bodies = {bar({}, {1, 1, 1})};
  World world(scene);
  const auto complaint = [&](const Joint& joint) -> std::string {
    try {
      world.add_joint(joint);
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return "none";
  };
  const BodyId a = world.bodies()[0];
  EXPECT_THAT(complaint(HingeJoint{.a = a, .axes_a = {2, 0, 0, 0}}), HasSubstr("axes_a is"));
  EXPECT_THAT(complaint(HingeJoint{.a = a, .min_angle = 1, .max_angle = 0}),
              HasSubstr("min_angle is 1; it must be at most max_angle, which is 0"));
  EXPECT_THAT(complaint(HingeJoint{.a = a, .min_angle = -4}), HasSubstr("min_angle is -4"));
  EXPECT_THAT(complaint(BallJoint{.a = a, .cone_angle = test::kNan}), HasSubstr("cone_angle"));
  EXPECT_THAT(complaint(SliderJoint{.a = a, .min_position = 1, .max_position = 0}),
              HasSubstr("min_position is 1; it must be at most max_position"));
  EXPECT_THAT(complaint(WheelJoint{.a = a, .max_motor_torque = -1}),
              HasSubstr("max_motor_torque is -1"));
  EXPECT_THAT(complaint(FixedJoint{.a = a, .b = a}), HasSubstr("it must be another body than a"));
}

}  // namespace
}  // namespace jfpx
