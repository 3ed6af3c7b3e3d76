/// Tests of forces in a world: application, addition, order, validation, removal, errors, sleep.
#include "tests/world/force_support.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::ball_at;
using test::Erratum;
using test::expect_near;
using test::world_of;

JFPX_SOFT_STEP_SUITE(AppliedForce);
JFPX_SOFT_STEP_SUITE(Forces);

TEST_P(AppliedForce, AcceleratesForOneStepOnly) {
  World world = world_of({ball_at({0, 0, 0})});
  const BodyId id = world.bodies()[0];
  world.apply_force(id, {8, 0, 0});
  world.apply_force(id, {0, 4, 0});
  world.step();
  EXPECT_EQ(world.last_acceleration(id), (Vec3{4, 2, 0}));
  expect_near(world.state(id).velocity, {0.04_r, 0.02_r, 0}, 1e-7);
  world.step();
  EXPECT_EQ(world.last_acceleration(id), Vec3{});
  expect_near(world.state(id).velocity, {0.04_r, 0.02_r, 0}, 1e-7);
}

TEST_P(AppliedForce, TorqueAndForceAtAPointRotate) {
  // I = 0.4 m r^2 = 0.8; torque about the centre (0,1,0) x (8,0,0) = (0,0,-8).
  World world = world_of({ball_at({5, 0, 0}), ball_at({-5, 0, 0})});
  const BodyId a = world.bodies()[0], b = world.bodies()[1];
  world.apply_force_at_point(a, {8, 0, 0}, {5, 1, 0});
  world.apply_torque(b, {0, 0, -8});
  world.step();
  expect_near(world.state(a).velocity, {0.04_r, 0, 0}, 1e-7);
  expect_near(world.state(a).angular_velocity, {0, 0, -0.1_r}, 1e-7);
  expect_near(world.state(b).velocity, {0, 0, 0}, 0);
  expect_near(world.state(b).angular_velocity, {0, 0, -0.1_r}, 1e-7);
}

TEST_P(AppliedForce, RefusesUnknownBodiesAndBadNumbers) {
  World world = world_of({ball_at({0, 0, 0})});
  const BodyId id = world.bodies()[0];
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_THROW(world.apply_force({3, 0}, {}), InvalidArgument);
  EXPECT_THROW(world.apply_torque({3, 0}, {}), InvalidArgument);
  EXPECT_THROW(world.apply_force_at_point({3, 0}, {}, {}), InvalidArgument);
  EXPECT_THROW(world.last_acceleration({3, 0}), InvalidArgument);
  EXPECT_THROW(world.apply_force(id, {0, nan, 0}), InvalidArgument);
  EXPECT_THROW(world.apply_torque(id, {0, nan, 0}), InvalidArgument);
  EXPECT_THROW(world.apply_force_at_point(id, {}, {nan, 0, 0}), InvalidArgument);
  world.step();
  EXPECT_EQ(world.state(id), BodyState{});
}

TEST_P(Erratum, E19_nothing_pushes_an_immovable_body) {
  BodyDef rock = ball_at({0, 50, 0});
  rock.mass = 0;
  rock.acceleration = {0, -9.81_r, 0};
  World world = world_of({rock, ball_at({10, 0, 0})});
  const BodyId id = world.bodies()[0], other = world.bodies()[1];
  const BodyState before = world.state(id);
  world.add_force(Gravity{});
  world.add_force(Gravity{{1, 2, 3}, id});
  world.add_force(Drag{.linear = 1, .wind = {9, 9, 9}});
  world.add_force(Spring{.a = {id}, .b = {other}, .stiffness = 5});
  world.add_force(Aero{.body = id, .tensor = diagonal({1, 1, 1}), .wind = {5, 5, 5}});
  world.add_force(Explosion{.centre = {0, 49, 0}, .peak_force = 10000.0_r, .speed = 100});
  world.add_force([id](ForceContext& context) {
    context.wake(id);
    context.apply_force(id, {1, 1, 1});
    context.apply_torque(id, {1, 1, 1});
  });
  for (int n = 0; n < 50; ++n) {
    world.apply_force_at_point(id, {1, 2, 3}, {4, 5, 6});
    ASSERT_FALSE(world.step().non_finite);
  }
  EXPECT_EQ(world.state(id), before);
  EXPECT_EQ(world.last_acceleration(id), Vec3{});
  EXPECT_FALSE(world.awake(id));
}

TEST_P(Erratum, E20_every_force_can_be_made_and_checked) {
  static_assert(CheckedForce<Gravity> && CheckedForce<Drag> && CheckedForce<Spring>);
  static_assert(CheckedForce<Bungee> && CheckedForce<Aero> && CheckedForce<AeroControl>);
  static_assert(CheckedForce<Buoyancy> && CheckedForce<Explosion>);
  World world = world_of({ball_at({0, 10, 0})});
  const BodyId id = world.bodies()[0];
  world.add_force(Gravity{{0, -4, 0}, id});
  world.add_force(Spring{.a = {id}, .stiffness = 1});  // pulls to the origin with 10 N
  world.step();
  expect_near(world.last_acceleration(id), {0, -4 - 5, 0}, 1e-5);
}

TEST_P(Erratum, E29_a_small_steady_force_moves_a_body_that_may_sleep) {
  BodyDef def = ball_at({0, 0, 0});
  def.can_sleep = true;
  World world = world_of({def});
  const BodyId id = world.bodies()[0];
  for (int n = 0; n < 500; ++n) world.step();
  ASSERT_FALSE(world.awake(id));
  for (int n = 0; n < 100; ++n) {
    world.apply_force(id, {0.02_r, 0, 0});
    world.step();
    ASSERT_TRUE(world.awake(id));
  }
  EXPECT_NEAR(world.state(id).velocity.x, 0.01, 1e-5);  // 0.01 m/s^2 for 1 s
}

TEST_P(Forces, ActInTheOrderOfTheirAddition) {
  World world = world_of({ball_at({0, 0, 0})});
  const BodyId id = world.bodies()[0];
  std::vector<int> order;
  const auto note = [&order](int number) {
    return [&order, number](ForceContext&) { order.push_back(number); };
  };
  world.add_force(note(0));
  const ForceId one = world.add_force(note(1));
  world.add_force(note(2));
  world.step();
  world.remove_force(one);
  world.add_force(note(3));
  world.step();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 0, 2, 3}));

  // The small force is lost in the sum unless it is added last.
  const Real big = Real(4) / kEpsilon;
  for (const Real x : {big, -big, Real(2)}) {
    world.add_force([id, x](ForceContext& context) { context.apply_force(id, {x, 0, 0}); });
  }
  world.step();
  EXPECT_EQ(world.last_acceleration(id).x, 1);
}

TEST_P(Forces, AreRemovedOnceAndTheirIdsAreNeverReused) {
  World world = world_of({ball_at({0, 0, 0})});
  const ForceId first = world.add_force(Gravity{});
  world.remove_force(first);
  EXPECT_TRUE(world.forces().empty());
  EXPECT_THROW(world.remove_force(first), InvalidArgument);
  EXPECT_THROW(world.force<Gravity>(first), InvalidArgument);
  EXPECT_THROW(world.remove_force({99}), InvalidArgument);
  const ForceId second = world.add_force(Gravity{});
  EXPECT_NE(second, first);
  EXPECT_THROW(world.remove_force(first), InvalidArgument);
  EXPECT_THROW(world.force<Drag>(second), InvalidArgument);
  world.force<Gravity>(second).acceleration = {0, 0, 1};
  world.step();
  EXPECT_EQ(world.last_acceleration(world.bodies()[0]), (Vec3{0, 0, 1}));
}

/// As large as the local buffer of std::function.
struct Wind {
  Real strength = 0;
  void operator()(ForceContext& context) const {
    for (const BodyId id : context.bodies()) context.apply_force(id, {strength, 0, 0});
  }
};

TEST_P(Forces, KeepTheirAddressUntilTheyAreRemoved) {
  World world = world_of({ball_at({0, 0, 0})});
  const ForceId before = world.add_force(Drag{.linear = 0});
  const ForceId id = world.add_force(Wind{1});
  Wind& wind = world.force<Wind>(id);
  for (int i = 0; i < 100; ++i) world.add_force(Wind{0});
  world.remove_force(before);
  EXPECT_EQ(&world.force<Wind>(id), &wind);
  wind.strength = 6;
  world.step();
  EXPECT_GT(world.last_acceleration(world.bodies()[0]).x, 2);
}

TEST_P(Forces, OfARemovedBodyHaveNoEffect) {
  World world = world_of({ball_at({0, 0, 0}), ball_at({9, 0, 0})});
  const BodyId gone = world.bodies()[0], left = world.bodies()[1];
  world.add_force(Spring{.a = {gone}, .b = {left}, .stiffness = 5});
  world.add_force(Gravity{{0, -1, 0}, gone});
  world.add_force(Aero{.body = gone, .tensor = diagonal({1, 1, 1}), .wind = {1, 1, 1}});
  world.remove(gone);
  const BodyId successor = world.add(ball_at({0, 0, 0}));  // in the same slot
  ASSERT_EQ(successor.index, gone.index);
  world.step();
  EXPECT_EQ(world.last_acceleration(left), Vec3{});
  EXPECT_EQ(world.last_acceleration(successor), Vec3{});
}

/// The message of the InvalidArgument that adding `force` throws.
template <Force F>
std::string refusal(World* world, const F& force) {
  try {
    world->add_force(force);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "no error";
}

TEST_P(Forces, AreValidatedWhenTheyAreAdded) {
  World world = world_of({ball_at({0, 0, 0})});
  const BodyId id = world.bodies()[0], strange{5, 1};
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_EQ(refusal(&world, Spring{.a = {id}, .stiffness = -1}),
            "spring: stiffness is -1; it must be finite and >= 0");
  EXPECT_EQ(refusal(&world, Spring{.stiffness = 1}),
            "spring: no end has a body; it must join two bodies, or a body and the world");
  EXPECT_EQ(refusal(&world, Bungee{.a = {id}, .b = {id}}),
            "bungee: both ends are fixed to one body; it must join two bodies, or a body and the "
            "world");
  EXPECT_EQ(refusal(&world, Gravity{{0, -1, 0}, strange}),
            "gravity: body (index 5, generation 1) is unknown; it must be of a living body of this "
            "world");
  EXPECT_NE(refusal(&world, Gravity{{0, nan, 0}}), "no error");
  EXPECT_NE(refusal(&world, Bungee{.a = {id}, .rest_length = -1}), "no error");
  EXPECT_NE(refusal(&world, Spring{.a = {id}, .damping = -1}), "no error");
  EXPECT_NE(refusal(&world, Spring{.a = {id, {nan, 0, 0}}}), "no error");
  EXPECT_NE(refusal(&world, Drag{.linear = -1}), "no error");
  EXPECT_NE(refusal(&world, Drag{.quadratic = nan}), "no error");
  EXPECT_NE(refusal(&world, Drag{.wind = {nan, 0, 0}}), "no error");
  EXPECT_NE(refusal(&world, Aero{.body = strange}), "no error");
  EXPECT_NE(refusal(&world, Aero{.body = id, .tensor = diagonal({0, nan, 0})}), "no error");
  EXPECT_NE(refusal(&world, AeroControl{.body = id, .control = nan}), "no error");
  EXPECT_NE(refusal(&world, Buoyancy{.liquid = {{0, 2, 0}, 0}}), "no error");
  EXPECT_NE(refusal(&world, Buoyancy{.density = -1}), "no error");
  EXPECT_NE(refusal(&world, Explosion{.speed = 0}), "no error");
  EXPECT_NE(refusal(&world, Explosion{.thickness = -1}), "no error");
  EXPECT_NE(refusal(&world, Explosion{.duration = nan}), "no error");
  EXPECT_TRUE(world.forces().empty());
}

TEST_P(Forces, ThatThrowLeaveTheStateUnchanged) {
  World world = world_of({ball_at({0, 0, 0}, {1, 0, 0})});
  World twin = world_of({ball_at({0, 0, 0}, {1, 0, 0})});
  bool fails = true;
  for (World* w : {&world, &twin}) {
    w->add_force(Gravity{});
    w->add_force([&fails, w, &world](ForceContext&) {
      if (fails && w == &world) throw std::runtime_error("out of fuel");
    });
    w->apply_force(w->bodies()[0], {0, 0, 6});
  }
  EXPECT_THROW(world.step(), std::runtime_error);
  EXPECT_EQ(world.time(), 0);
  fails = false;
  for (int n = 0; n < 3; ++n) {
    world.step();
    twin.step();
    ASSERT_EQ(world.states(), twin.states());
  }
  EXPECT_NEAR(world.states()[0].velocity.z, 0.03, 1e-6);  // 6 N / 2 kg for one step
}

TEST_P(Forces, OnAnUnknownBodyUndoTheStep) {
  World world = world_of({ball_at({0, 0, 0}, {1, 0, 0})});
  const auto before = world.states();
  world.add_force([](ForceContext& context) { context.apply_force({7, 0}, {1, 0, 0}); });
  EXPECT_THROW(world.step(), InvalidArgument);
  EXPECT_EQ(world.states(), before);
}

TEST_P(Forces, WithoutAChangeLetABodySleep) {
  BodyDef def = ball_at({0, 1, 0});
  def.can_sleep = true;
  World world = world_of({def, test::ground()});
  world.add_force(Gravity{});
  for (int n = 0; n < 500; ++n) world.step();
  const BodyId id = world.bodies()[0];
  ASSERT_FALSE(world.awake(id));
  world.add_force(Gravity{{3, 0, 0}});  // a new force wakes all bodies
  EXPECT_TRUE(world.awake(id));
  for (int n = 0; n < 100; ++n) world.step();
  EXPECT_GT(world.states()[0].velocity.x, 1);
}

TEST_P(Forces, ASpringWakesTheBodyAtItsOtherEnd) {
  BodyDef a = ball_at({0, 0, 0}), b = ball_at({5, 0, 0});
  a.can_sleep = b.can_sleep = true;
  World world = world_of({a, b});
  const BodyId first = world.bodies()[0], second = world.bodies()[1];
  world.add_force(Spring{.a = {first}, .b = {second}, .stiffness = 20, .rest_length = 5});
  for (int n = 0; n < 500; ++n) world.step();
  ASSERT_FALSE(world.awake(first) || world.awake(second));
  world.apply_force(first, {-500, 0, 0});
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_TRUE(world.awake(second));
  EXPECT_LT(world.state(second).velocity.x, 0);
}

TEST_P(Forces, GiveTheSameBitsInEveryRun) {
  std::uint64_t hashes[2];
  for (std::uint64_t& hash : hashes) {
    World world = world_of({ball_at({0, 5, 0}, {1, 0, 0}), ball_at({4, 5, 0}), test::ground()});
    world.add_force(Gravity{});
    world.add_force(Drag{.linear = 0.1_r, .quadratic = 0.01_r, .wind = {1, 0, 1}});
    world.add_force(Spring{.a = {world.bodies()[0]}, .b = {world.bodies()[1]}, .stiffness = 9});
    world.add_force(Buoyancy{.liquid = {{0, 1, 0}, 2}, .density = 0.3_r});
    world.add_force(Explosion{.start = 0.5_r, .peak_force = 100, .speed = 30});
    for (int n = 0; n < 300; ++n) world.step();
    hash = world.state_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace jfpx
