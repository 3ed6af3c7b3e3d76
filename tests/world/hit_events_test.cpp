/// Tests of hit events: speeds against the states before a step, impacts of two bodies, order,
/// removal, failed steps and threads.
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

std::vector<HitEvent> hits_of(const World& world) {
  return {world.hit_events().begin(), world.hit_events().end()};
}

World falling_ball(Real restitution, const WorldSettings& settings) {
  Scene scene;
  BodyDef ball = heavy({0, 3, 0});
  ball.restitution = restitution;
  scene.bodies = {ball, ground()};
  scene.bodies[1].restitution = restitution;
  return World(scene, settings);
}

TEST(HitEvents, OfABallThatFallsHaveItsSpeedUntilItRests) {
  for (const Real restitution : {0.0_r, 0.5_r}) {
    World world = falling_ball(restitution, {.hit_speed = 1});
    Real before = 0;
    std::vector<Real> speeds;
    for (int n = 0; n < 600; ++n) {
      before = world.states()[0].velocity.y;
      world.step();
      const std::vector<HitEvent> hits = hits_of(world);
      if (hits.empty()) continue;
      ASSERT_EQ(hits.size(), 1u);
      EXPECT_EQ(hits[0].a, world.bodies()[0]);
      EXPECT_EQ(hits[0].b, world.bodies()[1]);
      EXPECT_EQ(hits[0].normal, (Vec3{0, 1, 0}));
      EXPECT_EQ(hits[0].approach_speed, -before);
      EXPECT_NEAR(hits[0].point.y, 0, 0.1);
      EXPECT_EQ(hits[0].point, world.contacts()[0].point);
      speeds.push_back(hits[0].approach_speed);
    }
    ASSERT_EQ(speeds.size(), restitution > 0 ? 3u : 1u);
    EXPECT_NEAR(double{speeds[0]}, std::sqrt(2 * kG * 2), 0.2);
    for (std::size_t i = 1; i < speeds.size(); ++i) {
      EXPECT_NEAR(speeds[i], restitution * speeds[i - 1], 0.2_r);
    }
  }
}

/// Two balls as one body fall on a mesh: the left one on its second triangle, deeper than the right
/// one, which is higher.
TEST(HitEvents, AndContactForcesHaveTheNumbersOfPartsAndTriangles) {
  Scene scene;
  BodyDef floor;
  floor.mass = 0;
  floor.shape = TriangleMesh({{-9, 0, -9}, {9, 0, -9}, {-9, 0, 9}, {9, 0, 9}},
                             {Triangle{1, 2, 3}, Triangle{0, 2, 1}});
  BodyDef pair;
  pair.shape = Compound{{{Sphere{0.5_r}, {1, 0, 0}, {}, 1}, {Sphere{0.5_r}, {-1, 0, 0}, {}, 1}}};
  pair.position = {-3, 1, -3};
  pair.orientation = normalized(Quat{1, 0, 0, 0.1_r});
  for (const bool swaps : {false, true}) {
    scene.bodies = swaps ? std::vector{pair, floor} : std::vector{floor, pair};
    World world(scene, {.hit_speed = 0.5_r});
    while (world.hit_events().empty()) {
      world.step();
      ASSERT_LT(world.steps(), 100u);
    }
    ASSERT_EQ(world.hit_events().size(), 1u);
    const HitEvent& hit = world.hit_events()[0];
    EXPECT_EQ(hit.part_a, 1u);  // the triangle and the ball both have number 1
    EXPECT_EQ(hit.part_b, 1u);
    for (int n = 0; n < 120; ++n) world.step();  // both balls rest
    ASSERT_EQ(world.contact_forces().size(), 2u);
    for (const ContactForce& force : world.contact_forces()) {
      const bool a_falls = world.mass(force.a) > 0;
      EXPECT_EQ(a_falls ? force.part_b : force.part_a, 1u);
      const Real arm = (a_falls ? force.arm_a : force.arm_b).x;
      EXPECT_EQ(a_falls ? force.part_a : force.part_b, arm > 0 ? 0u : 1u);
    }
  }
}

TEST(HitEvents, AreNoneWithoutAHitSpeed) {
  World world = falling_ball(0.5_r, {});
  for (int n = 0; n < 200; ++n) {
    world.step();
    ASSERT_TRUE(world.hit_events().empty());
  }
  for (const Real bad : {0.0_r, -1.0_r, kNan, -kInfinity}) {
    EXPECT_THROW(World(Scene{}, {.hit_speed = bad}), InvalidArgument);
  }
}

/// A step in which two free bodies push each other is a hit if, and only if, they approached fast
/// enough.
TEST(HitEvents, OfTwoBallsAreTheStepsInWhichTheyMeetFastEnough) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int found = 0, slow = 0;
  for (int n = 0; n < 600; ++n) {
    BodyDef ball;
    ball.mass = 1;
    ball.restitution = random.uniform(0, 1);
    ball.acceleration = {};
    ball.can_sleep = false;
    Scene scene;
    scene.bodies = {ball, ball};
    scene.bodies[1].position = {random.uniform(1.1_r, 1.6_r), random.uniform(-0.9_r, 0.9_r), 0};
    scene.bodies[1].velocity = {random.uniform(-6, -1), 0, random.uniform(-1, 1)};
    scene.bodies[1].angular_velocity = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
    World world(scene, {.hit_speed = 2});
    for (int k = 0; k < 90; ++k) {
      const std::vector<BodyState> before = world.states();
      world.step();
      const std::vector<HitEvent> hits = hits_of(world);
      if (world.contacts().empty() || world.states()[0].velocity == before[0].velocity) {
        ASSERT_TRUE(hits.empty()) << n;
        continue;
      }
      const Vec3 normal = world.contacts()[0].normal;
      const Real speed = dot(before[1].velocity - before[0].velocity, normal);
      if (absolute(speed - 2) < 1e-3_r) continue;
      ASSERT_EQ(hits.size(), speed > 2 ? 1u : 0u) << n;
      ++(speed > 2 ? found : slow);
      if (speed > 2) {
        EXPECT_NEAR(hits[0].approach_speed, speed, 1e-5_r);
      }
    }
  }
  EXPECT_GT(found, 50);
  EXPECT_GT(slow, 50);
}

/// The relative velocity of the points of two bodies, in double.
double approach_of(const HitEvent& hit, const BodyState& a, const BodyState& b) {
  const auto velocity_of = [&](const BodyState& s, int axis) {
    const Vec3 arm = hit.point - s.position;
    return static_cast<double>((s.velocity + cross(s.angular_velocity, arm))[axis]);
  };
  double speed = 0;
  for (int i = 0; i < 3; ++i) {
    speed += static_cast<double>(hit.normal[i]) * (velocity_of(b, i) - velocity_of(a, i));
  }
  return speed;
}

Scene crowded_room(Random* random) {
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    BodyDef def = random_body(random, 3);
    if (def.mass > 0) {
      def.velocity = random->uniform_in_box({-5, -5, -5}, {5, 5, 5});
      def.angular_velocity = random->uniform_in_box({-5, -5, -5}, {5, 5, 5});
    }
    def.restitution = random->uniform(0, 1);
    def.sensor = random->below(9) == 0;
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(ground());
  return scene;
}

TEST(HitEvents, OfBodiesOfAllShapesHaveTheSpeedsOfTheirPoints) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int overlaps = 0, impacts = 0;
  for (int run = 0; run < 30; ++run) {
    World world(crowded_room(&random), {.hit_speed = 0.5_r});
    for (int n = 0; n < 30; ++n) {
      std::vector<BodyState> before(world.bodies().size());
      for (const BodyId id : world.bodies()) before[id.index] = world.state(id);
      world.step();
      std::tuple<std::uint32_t, std::uint32_t> last{0, 0};
      for (const HitEvent& hit : world.hit_events()) {
        const std::tuple pair(hit.a.index, hit.b.index);
        EXPECT_LT(hit.a.index, hit.b.index);
        EXPECT_LT(last, pair);
        last = pair;
        EXPECT_FALSE(world.sensor(hit.a) || world.sensor(hit.b));
        EXPECT_GE(hit.approach_speed, 0.5_r);
        // Bodies that were still apart have the points of their impact, later in the step.
        const bool touched = std::ranges::any_of(world.contacts(), [&](const Contact& c) {
          const bool same = (c.a == hit.a && c.b == hit.b) || (c.a == hit.b && c.b == hit.a);
          return same && c.distance < 0 && length(c.point - hit.point) < 1e-4_r &&
                 absolute(dot(c.normal, hit.normal)) > 0.9999_r;
        });
        const BodyState &a = before[hit.a.index], &b = before[hit.b.index];
        const auto spin =
            static_cast<double>(length(a.angular_velocity) + length(b.angular_velocity));
        const auto motion = static_cast<double>(length(a.velocity) + length(b.velocity)) + 2 * spin;
        if (motion > 100) continue;  // a deep overlap has thrown them apart
        EXPECT_NEAR(static_cast<double>(hit.approach_speed), approach_of(hit, a, b),
                    1e-3 + spin * (touched ? 1e-3 : motion / 60));
        ++(touched ? overlaps : impacts);
        const auto events = world.contact_events();
        EXPECT_TRUE(std::ranges::any_of(events, [&](const ContactEvent& e) {
          return e.a == hit.a && e.b == hit.b && e.phase != ContactPhase::end;
        }));
      }
    }
  }
  EXPECT_GT(overlaps, 100);
  EXPECT_GT(impacts, 100);
}

TEST(HitEvents, AreTheSameForAllThreadsAndHaveNoEffectOnTheMotion) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  for (int run = 0; run < 5; ++run) {
    const Scene scene = crowded_room(&random);
    World one(scene, {.hit_speed = 1}), three(scene, {.threads = 3, .hit_speed = 1}), none(scene);
    for (int n = 0; n < 40; ++n) {
      one.step(), three.step(), none.step();
      ASSERT_EQ(hits_of(one), hits_of(three)) << n;
      ASSERT_EQ(one.state_hash(), none.state_hash()) << n;
    }
  }
}

TEST(HitEvents, RemainValidWhileBodiesComeAndGo) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int found = 0;
  for (int run = 0; run < 20; ++run) {
    const Scene scene = crowded_room(&random);
    World asked(scene, {.hit_speed = 1}), changed(scene, {.hit_speed = 1});
    for (int n = 0; n < 20; ++n) {
      asked.step(), changed.step();
      const std::vector<HitEvent> hits = hits_of(asked);
      found += static_cast<int>(hits.size());
      for (World* world : {&asked, &changed}) {
        if (world->bodies().size() > 20)
          world->remove(world->bodies()[static_cast<std::size_t>(run % 5)]);
        world->add(scene.bodies[3]);
        world->set_state(world->bodies()[4], {{9, 9, 9}, {}, {1, 2, 3}, {}});
        world->apply_impulse(world->bodies()[6], {100, 0, 0});
      }
      ASSERT_EQ(hits_of(changed), hits) << n;
      ASSERT_EQ(hits_of(asked), hits) << n;
    }
  }
  EXPECT_GT(found, 100);
}

TEST(HitEvents, AreEmptyAfterAFailedStepAndAfterRestore) {
  World world = falling_ball(0.5_r, {.hit_speed = 1});
  while (world.hit_events().empty()) world.step();
  const Snapshot snapshot = world.snapshot();
  EXPECT_EQ(hits_of(world).size(), 1u);
  world.restore(snapshot);
  EXPECT_TRUE(world.hit_events().empty());
  world.step();
  while (world.hit_events().empty()) world.step();
  world.apply_force(world.bodies()[0], {kMaxReal, 0, 0});
  EXPECT_EQ(hits_of(world).size(), 1u);
  EXPECT_TRUE(world.step().non_finite);
  EXPECT_TRUE(world.hit_events().empty());
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
