/// Worlds that are stepped on a device have the bits of those of the processor. Without a GPU, the
/// programs of the device run on the host; with one, on the GPU too.
#include <jfpx/backend.hpp>
#include <jfpx/force.hpp>

#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"
#include "tests/world/host_device.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>

namespace jfpx {
namespace {

using test::operator""_r;

using MakeDevice = std::function<std::unique_ptr<DeviceWorld>(const Scene&)>;
struct Kind {
  std::string name;
  MakeDevice make;
};

class DeviceWorldTest : public testing::TestWithParam<Kind> {
 protected:
  World on_device(const Scene& scene) const {
    World world(scene, {.collider = {.backend = Backend::cpu, .threads = 1}});
    WorldAccess::impl(world).device = GetParam().make(scene);
    return world;
  }
  static World on_host(const Scene& scene) {
    return World(scene, {.collider = {.backend = Backend::cpu, .threads = 1}});
  }
};

std::vector<Kind> kinds() {
  std::vector<Kind> kinds{{"Host", test::make_host_device_world}};
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda && status.usable) {
      kinds.push_back({"Cuda", [](const Scene& scene) { return make_device_world(scene); }});
    }
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(Devices, DeviceWorldTest, testing::ValuesIn(kinds()),
                         [](const auto& row) { return row.param.name; });

/// Both worlds report the same step.
void expect_equal(const StepReport& host, const StepReport& device) {
  ASSERT_EQ(host.contacts, device.contacts);
  ASSERT_EQ(host.sphere_contacts, device.sphere_contacts);
  ASSERT_EQ(host.awake, device.awake);
  ASSERT_EQ(host.non_finite, device.non_finite);
}
void expect_equal_contacts(const World& host, const World& device) {
  const auto a = host.contacts(), b = device.contacts();
  ASSERT_EQ(std::vector(a.begin(), a.end()), std::vector(b.begin(), b.end()));
  const auto c = host.contact_events(), d = device.contact_events();
  ASSERT_EQ(std::vector(c.begin(), c.end()), std::vector(d.begin(), d.end()));
}

/// A scene of bodies of all kinds in a small room.
Scene random_scene(Random* random) {
  Scene scene;
  scene.soft_step.substeps =
      random->below(12) == 0 ? kMaxSubsteps : 1 + static_cast<std::uint32_t>(random->below(6));
  const std::uint64_t count = 2 + random->below(60);
  for (std::uint64_t i = 0; i < count; ++i) {
    BodyDef def = test::random_body(random, 3);
    def.velocity = def.mass > 0 ? random->uniform_in_box({-3, -3, -3}, {3, 3, 3}) : Vec3{};
    def.friction = random->uniform(0, 1);
    def.restitution = random->below(2) == 0 ? Real(0) : random->uniform(0, 1);
    if (random->below(8) == 0) def.rolling_friction = 0.05_r;
    if (random->below(8) == 0) def.sensor = true;
    if (random->below(8) == 0) def.filter = {.category = 2, .mask = 0xfffffff1u};
    if (def.mass == 0 && std::holds_alternative<Sphere>(def.shape) && random->below(2) == 0) {
      def.kinematic = true;
      def.velocity = {0.2_r, 0, 0};
    }
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::half_space({0, 1, 0}, -3));
  for (int k = 0; k < 3; ++k) {
    const auto a = static_cast<std::uint32_t>(random->below(count));
    const auto b = static_cast<std::uint32_t>(random->below(count));
    if (a != b) scene.ignored_pairs.push_back({a, b});
  }
  return scene;
}

TEST_P(DeviceWorldTest, RandomScenesHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 25; ++k) {
    const Scene scene = random_scene(&random);
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < 40; ++n) {
      const StepReport a = host.step(), b = device.step();
      ASSERT_NO_FATAL_FAILURE(expect_equal(a, b)) << "scene " << k << ", step " << n;
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k << ", step " << n;
      if (n % 3 != 0) continue;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
    }
    EXPECT_TRUE(WorldAccess::impl(device).resident);
  }
}

TEST_P(DeviceWorldTest, NamedScenesHaveTheBitsOfTheProcessor) {
  for (const char* name : {"pile", "mixed", "polydisperse", "columns", "overlap", "tower"}) {
    scenes::Options options;
    if (name != std::string("tower")) options.spheres = 60;
    const Scene scene = scenes::make(name, options);
    if (scene.solver != Solver::soft_step) continue;
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < 150; ++n) {
      host.step();
      device.step();
    }
    EXPECT_EQ(host.state_hash(), device.state_hash()) << name;
  }
}

/// So many contacts that a GPU uses all of its multiprocessors.
TEST_P(DeviceWorldTest, ManyBodiesHaveTheBitsOfTheProcessor) {
  const Scene scene = scenes::make("lattice", {.spheres = 4096});
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < 6; ++n) {
    host.step();
    EXPECT_GT(device.step().contacts, 8192u);
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
  }
}

TEST_P(DeviceWorldTest, ABodyWithMoreContactsThanColors) {
  Scene scene;
  BodyDef giant = test::ball({0, 0, 0}, 5, 100);
  scene.bodies.push_back(giant);
  Random random(7);
  for (int k = 0; k < 200; ++k) {
    BodyDef grain = test::ball(test::random_direction(&random) * 5.25_r, 0.3_r, 0.1_r);
    grain.velocity = -normalized(grain.position);
    grain.friction = 0.5_r;
    scene.bodies.push_back(grain);
  }
  World host = on_host(scene), device = on_device(scene);
  std::size_t most = 0;
  for (int n = 0; n < 20; ++n) {
    host.step();
    device.step();
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
    most = std::max(most, host.contacts().size());
  }
  EXPECT_GT(most, 100u);
}

TEST_P(DeviceWorldTest, ChangesBetweenStepsReachTheDevice) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 6; ++k) {
    const Scene scene = random_scene(&random);
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < 60; ++n) {
      const std::uint64_t action = random.below(13);
      const auto at = [&](const World& world, std::uint64_t i) {
        return world.bodies()[i % world.bodies().size()];
      };
      const std::uint64_t i = random.below(1000);
      const BodyDef def = test::random_body(&random, 3);
      const Vec3 force = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      for (World* world : {&host, &device}) {
        const BodyId id = at(*world, i);
        if (action == 0) world->add(def);
        if (action == 1 && world->bodies().size() > 2) world->remove(id);
        if (action == 2) world->apply_force(id, force);
        if (action == 3) world->set_friction(id, absolute(force.x));
        if (action == 4) {
          BodyState state = world->state(id);
          state.velocity = force;
          world->set_state(id, state);
        }
        if (action == 5) world->wake(id);
        if (action == 6) {
          for (const BodyId other : world->bodies()) world->apply_force_at_point(other, force, {});
        }
        if (action == 7) world->set_state(id, {def.position, def.orientation, force, {}});
        if (action == 8) {
          world->set_acceleration(id, force);
          world->set_damping(id, 0.5_r, 0.9_r);
          world->apply_torque(id, force);
          world->apply_torque(at(*world, i + 1), force);
        }
      }
      host.step();
      device.step();
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k << ", step " << n;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device)) << "action " << action;
    }
  }
}

/// Edits of the motion of single bodies: what the processor does at once happens on the device
/// before the next step, and queries in between see it.
TEST_P(DeviceWorldTest, EditsOfBodiesDoNotMoveTheWorld) {
  Scene scene = scenes::make("tower", {});
  scene.bodies.push_back(test::ball({20, 1, 0}));
  World host = on_host(scene), device = on_device(scene);
  const auto step = [&](int count) {
    for (int n = 0; n < count; ++n) {
      host.step();
      device.step();
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
      ASSERT_TRUE(WorldAccess::impl(device).resident);
    }
  };
  const BodyId ball = host.bodies().back(), box = host.body_at(5);
  const auto expect_equal_awake = [&] {
    for (const BodyId id : host.bodies()) EXPECT_EQ(host.awake(id), device.awake(id)) << id.index;
  };
  ASSERT_NO_FATAL_FAILURE(step(400));
  ASSERT_FALSE(host.awake(box)) << "the tower sleeps";
  host.step();
  device.step();
  for (World* world : {&host, &device}) {
    world->apply_force(ball, {1, 0, 0});
    world->apply_force(ball, {0, 30, 2});
    world->apply_force_at_point(ball, {0, 0, 3}, {20, 2, 0});
  }
  expect_equal_awake();
  ASSERT_NO_FATAL_FAILURE(step(1));
  ASSERT_TRUE(host.awake(ball));
  // The neighbours of the box wake with it.
  for (World* world : {&host, &device}) {
    BodyState state = world->state(box);
    state.velocity = {0, 0, 0.1_r};
    world->step();
    world->set_state(box, state);
  }
  expect_equal_awake();
  EXPECT_TRUE(device.awake(host.body_at(box.index + 1)));
  ASSERT_NO_FATAL_FAILURE(step(5));
  for (World* world : {&host, &device}) {
    world->set_acceleration(ball, {0, 3, 0});
    world->set_damping(ball, 0.5_r, 0.5_r);
    world->apply_torque(ball, {0, 0, 1});
  }
  ASSERT_NO_FATAL_FAILURE(step(5));
  EXPECT_TRUE(host.snapshot() == device.snapshot());
}

TEST_P(DeviceWorldTest, ForcesAndContactGeneratorsRunOnTheHost) {
  Scene scene;
  scene.bodies = {test::ball({0, 2, 0}), test::ball({0.5_r, 4.2_r, 0}), test::ground()};
  World host = on_host(scene), device = on_device(scene);
  for (World* world : {&host, &device}) {
    world->add_force(Drag{.linear = 0.1_r});
    world->add_force(Gravity{});
  }
  for (int n = 0; n < 50; ++n) {
    host.step();
    device.step();
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
  }
  EXPECT_TRUE(WorldAccess::impl(device).resident);
  std::vector<ContactGeneratorId> ids;
  for (World* world : {&host, &device}) {
    ids.push_back(world->add_contact_generator([](ContactContext&) {}));
  }
  host.step();
  device.step();
  EXPECT_FALSE(WorldAccess::impl(device).resident);
  host.remove_contact_generator(ids[0]);
  device.remove_contact_generator(ids[1]);
  for (int n = 0; n < 50; ++n) {
    host.step();
    device.step();
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
  }
  EXPECT_TRUE(WorldAccess::impl(device).resident);
}

TEST_P(DeviceWorldTest, SnapshotsAreThoseOfTheHostAndRestoreOnTheDevice) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const Scene scene = random_scene(&random);
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < 30; ++n) {
    host.step();
    device.step();
  }
  const Snapshot snapshot = host.snapshot();
  EXPECT_TRUE(device.snapshot() == snapshot);
  EXPECT_TRUE(WorldAccess::impl(device).resident) << "a snapshot does not move the world";
  Scene other;
  other.dt = scene.dt / 2;
  other.soft_step.substeps = 9;
  other.bodies = {test::ball({0, 0, 0}), test::ground()};
  World restored = on_device(other);
  restored.step();
  restored.restore(snapshot);
  for (int n = 0; n < 30; ++n) {
    expect_equal(host.step(), restored.step());
    expect_equal_contacts(host, restored);
    ASSERT_EQ(host.state_hash(), restored.state_hash()) << "step " << n;
  }
  EXPECT_TRUE(WorldAccess::impl(restored).resident);
  EXPECT_TRUE(restored.snapshot() == host.snapshot());
}

TEST_P(DeviceWorldTest, ARunawayBodyUndoesTheStep) {
  Scene scene;
  scene.bodies = {test::ball({0, 0, 0}), test::ball({kMaxCoordinate * 0.9_r, 0, 0})};
  scene.bodies[1].velocity = {kMaxCoordinate, 0, 0};
  scene.dt = 1;
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < 3; ++n) {
    const StepReport a = host.step(), b = device.step();
    EXPECT_TRUE(b.non_finite);
    EXPECT_EQ(a.non_finite_body, b.non_finite_body);
    EXPECT_EQ(host.state_hash(), device.state_hash());
  }
  for (World* world : {&host, &device}) world->remove(world->bodies()[1]);
  for (int n = 0; n < 3; ++n) {
    EXPECT_FALSE(host.step().non_finite);
    EXPECT_FALSE(device.step().non_finite);
    EXPECT_EQ(host.state_hash(), device.state_hash());
  }
}

TEST_P(DeviceWorldTest, AWorldWithoutBodies) {
  World device = on_device(Scene{});
  for (int n = 0; n < 3; ++n) EXPECT_EQ(device.step().contacts, 0u);
  const BodyId id = device.add(test::ball({0, 0, 0}));
  device.step();
  device.remove(id);
  device.step();
  EXPECT_TRUE(device.states().empty());
}

}  // namespace
}  // namespace jfpx
