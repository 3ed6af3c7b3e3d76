/// Worlds that are stepped on a device have the bits of those of the processor. Without a GPU, the
/// programs of the device run on the host; with one, on the GPU too.
#include <jfpx/force.hpp>
#include <jfpx/recorded_world.hpp>

#include "src/scene/compound.hpp"
#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"
#include "tests/world/chambers.hpp"
#include "tests/world/cuda_devices.hpp"
#include "tests/world/equal_worlds.hpp"
#include "tests/world/host_device.hpp"
#include "tests/world/random_bodies.hpp"
#include "tests/world/several_blocks.hpp"
#include "tests/world/tiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
namespace {

using test::expect_equal;
using test::expect_equal_contacts;
using test::expect_equal_forces;
using test::operator""_r;

using MakeDevice = std::function<std::unique_ptr<DeviceWorld>(const Scene&)>;
struct Kind {
  friend void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
  std::string name;
  MakeDevice make;
  std::uint32_t most_in_one_block = soft_step::kMostBodiesInOneBlock;
};

class DeviceWorldTest : public testing::TestWithParam<Kind> {
 protected:
  World on_device(const Scene& scene) const {
    World world(scene, {.collider = {.backend = Backend::cpu}, .hit_speed = 0.5_r});
    WorldAccess::impl(world).device = GetParam().make(scene);
    return world;
  }
  static World on_host(const Scene& scene) {
    return World(scene, {.collider = {.backend = Backend::cpu}, .hit_speed = 0.5_r});
  }
  void compare_random_scenes(int scenes) const;
  void compare_named_scenes(int steps) const;
  void compare_heap(int steps) const;

 private:
  test::SeveralBlocks several_blocks_{GetParam().most_in_one_block};
};

std::vector<Kind> kinds() {
  std::vector<Kind> kinds{{"Host", test::make_host_device_world}};
  for (const auto& devices : test::one_cuda_device()) kinds.push_back({devices.name, devices});
  for (std::size_t i = kinds.size(); i-- > 0;) {
    kinds.push_back({kinds[i].name + "WithBlocks", kinds[i].make, 8});
  }
  for (const auto& devices : test::several_cuda_devices()) {
    kinds.push_back({devices.name, devices, 8});
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(Devices, DeviceWorldTest, testing::ValuesIn(kinds()),
                         [](const auto& row) { return row.param.name; });

/// Two parts on the host, as threads. Their barriers take long on a busy machine, so there are only
/// some tests, in float.
class HostPartsTest : public DeviceWorldTest {};
#if !defined(JFPX_DOUBLE_PRECISION)
INSTANTIATE_TEST_SUITE_P(Devices, HostPartsTest,
                         testing::Values(Kind{"HostTwoParts", test::make_two_part_world, 8}),
                         [](const auto& row) { return row.param.name; });
#else
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(HostPartsTest);
#endif

/// A scene of bodies of all kinds in a small room.
Scene random_scene(Random* random) {
  Scene scene;
  scene.soft_step.substeps =
      random->below(12) == 0 ? kMaxSubsteps : 1 + static_cast<std::uint32_t>(random->below(6));
  const std::uint64_t count = 2 + random->below(60);
  const bool any_locks = random->below(3) == 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    BodyDef def = test::random_body(random, 3);
    if (any_locks) def.motion_locks = test::random_locks(random);
    def.velocity = def.mass > 0 ? random->uniform_in_box({-3, -3, -3}, {3, 3, 3}) : Vec3{};
    def.friction = random->uniform(0, 1);
    def.restitution = random->below(2) == 0 ? Real(0) : random->uniform(0, 1);
    if (random->below(8) == 0) def.rolling_friction = 0.05_r;
    if (random->below(8) == 0) def.sensor = true;
    if (random->below(8) == 0) def.filter = {.category = 2, .mask = 0xfffffff1u};
    const bool is_wall =
        std::holds_alternative<HalfSpace>(def.shape) || std::holds_alternative<Plane>(def.shape);
    if (def.mass == 0 && !is_wall && random->below(2) == 0) {
      def.kinematic = true;
      def.velocity = random->uniform_in_box({-0.3_r, -0.3_r, -0.3_r}, {0.3_r, 0.3_r, 0.3_r});
      if (random->below(2) == 0) def.angular_velocity = {0.3_r, -0.5_r, 0.2_r};
    }
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::half_space({0, 1, 0}, -3));
  for (int k = 0; k < 3; ++k) {
    const auto a = static_cast<std::uint32_t>(random->below(count));
    const auto b = static_cast<std::uint32_t>(random->below(count));
    if (a != b) scene.ignored_pairs.push_back({a, b});
  }
  if (random->below(2) == 0) test::add_random_joints(random, &scene);
  return scene;
}

/// Number of steps of each random scene: JFPX_TEST_SCENE_STEPS, or a default.
int scene_steps(int otherwise) {
  const char* given = std::getenv("JFPX_TEST_SCENE_STEPS");
  return given != nullptr ? std::atoi(given) : otherwise;
}

/// Makes a step of two worlds, which must have the same report and the same state.
/// @param contacts null, or a sum to which the number of contacts is added
void step_both(World* host, World* device, std::uint64_t* contacts = nullptr) {
  const StepReport a = host->step(), b = device->step();
  ASSERT_NO_FATAL_FAILURE(expect_equal(a, b));
  ASSERT_EQ(host->state_hash(), device->state_hash());
  if (contacts != nullptr) *contacts += a.contacts;
}

void DeviceWorldTest::compare_random_scenes(int scenes) const {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < scenes; ++k) {
    const Scene scene = random_scene(&random);
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < scene_steps(40); ++n) {
      ASSERT_NO_FATAL_FAILURE(step_both(&host, &device)) << "scene " << k << ", step " << n;
      if (n % 3 != 0) continue;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
      if (n % 9 == 0) {
        ASSERT_NO_FATAL_FAILURE(expect_equal_forces(host, device));
      }
    }
    EXPECT_TRUE(WorldAccess::impl(device).resident());
  }
}
TEST_P(DeviceWorldTest, RandomScenesHaveTheBitsOfTheProcessor) { compare_random_scenes(25); }
TEST_P(HostPartsTest, RandomScenesHaveTheBitsOfTheProcessor) { compare_random_scenes(4); }

/// Heightfields of several tiles, one of which moves, with slow and fast bodies.
TEST_P(DeviceWorldTest, BodiesOnHeightfieldsHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t contacts = 0;
  for (int k = 0; k < 3; ++k) {
    Scene scene;
    BodyDef ground;
    ground.mass = 0;
    ground.shape = Heightfield(test::random_heightfield(&random, 60));
    scene.bodies.push_back(ground);
    ground.shape = Heightfield(test::random_heightfield(&random, 20));
    ground.kinematic = true;
    ground.position.y = 1;
    ground.angular_velocity = {0.2_r, 1, 0};
    scene.bodies.push_back(ground);
    for (int i = 0; i < 120; ++i) {
      BodyDef def = test::random_body(&random, 6);
      if (!test::has_volume(def.shape)) def.shape = Sphere{0.3_r};
      def.mass = 1;
      def.position.y = random.uniform(1, 4);
      def.velocity.y = i % 4 == 0 ? -100.0_r : 0.0_r;
      scene.bodies.push_back(def);
    }
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < scene_steps(40); ++n) {
      ASSERT_NO_FATAL_FAILURE(step_both(&host, &device, &contacts)) << "step " << n;
    }
    ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
    EXPECT_TRUE(WorldAccess::impl(device).resident());
  }
  EXPECT_GT(contacts, 1000u);
}

/// Enough immovable and kinematic solids for trees of several levels, which come, go and move.
TEST_P(DeviceWorldTest, ManyFixedBodiesHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const auto fixed = [&random] {
    BodyDef def;
    def.shape = random.below(3) == 0 ? Shape(Capsule{0.2_r, 0.3_r}) : Box{{0.5_r, 0.3_r, 0.5_r}};
    def.mass = 0;
    def.kinematic = random.below(3) == 0;
    def.position = random.uniform_in_box({-5, -0.5_r, -5}, {5, 0.5_r, 5});
    def.orientation = test::random_rotation(&random);
    def.velocity = {0.3_r, 0.1_r, 0};
    def.angular_velocity = {0, 0.5_r, 0};
    return def;
  };
  Scene scene;
  for (int i = 0; i < 600; ++i) {
    if (i % 6 != 0) {
      scene.bodies.push_back(fixed());
      continue;
    }
    BodyDef def = test::random_body(&random, 4);
    if (!test::has_volume(def.shape)) def.shape = Sphere{0.3_r};
    def.mass = 1;
    def.position.y += 3;
    scene.bodies.push_back(def);
  }
  World host = on_host(scene), device = on_device(scene);
  std::uint64_t contacts = 0;
  for (int n = 0; n < scene_steps(90); ++n) {
    ASSERT_NO_FATAL_FAILURE(step_both(&host, &device, &contacts)) << "step " << n;
    if (n % 4 != 3) continue;
    const BodyDef def = fixed();
    const BodyId id = host.bodies()[random.below(host.bodies().size())];
    const std::uint64_t action = random.below(3);
    for (World* world : {&host, &device}) {
      if (action == 0) world->add(def);
      if (action == 1 && world->mass(id) == 0) world->remove(id);
      if (action == 2) world->set_state(id, {def.position, def.orientation, def.velocity, {}});
    }
  }
  EXPECT_GT(contacts, 1000u);
  EXPECT_TRUE(WorldAccess::impl(device).resident());
}

/// Bodies whose contacts at seams are hidden, on boxes, hulls and parts of compounds.
TEST_P(DeviceWorldTest, BodiesOnFlushTilesHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (const auto tiles : {test::Tiles::boxes, test::Tiles::hulls, test::Tiles::parts}) {
    SCOPED_TRACE(test::name_of(tiles));
    Scene scene;
    scene.bodies = test::tiled_floor(tiles, 12, 0.3_r);
    for (int i = 0; i < 80; ++i) {
      BodyDef def = test::random_body(&random, 4);
      if (!test::has_volume(def.shape)) def.shape = Sphere{0.3_r};
      def.mass = 1;
      def.position.y = random.uniform(0.3_r, 1.5_r);
      def.velocity = random.uniform_in_box({-4, 0, -4}, {4, 0, 4});
      def.acceleration = {0, -9.81_r, 0};
      scene.bodies.push_back(def);
    }
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < scene_steps(60); ++n) {
      ASSERT_NO_FATAL_FAILURE(step_both(&host, &device)) << "step " << n;
    }
    ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
    EXPECT_TRUE(WorldAccess::impl(device).resident());
  }
}

TEST_P(DeviceWorldTest, FastBodiesInRoomsHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 4 * test::kRoomCount; ++k) {
    const int room = k % test::kRoomCount;
    Scene scene = test::throw_scene(&random, room).scene;
    const bool is_turning = room > 1 && random.below(2) == 0;
    if (is_turning) {
      scene.bodies[0].kinematic = true;
      scene.bodies[0].velocity = {1, 0.5_r, 0};
      scene.bodies[0].angular_velocity = test::random_direction(&random) * 3;
    }
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < 8; ++n) {
      host.step();
      device.step();
      ASSERT_EQ(host.state_hash(), device.state_hash()) << test::kRooms[room] << ", step " << n;
    }
    EXPECT_TRUE(WorldAccess::impl(device).resident());
  }
}

void DeviceWorldTest::compare_named_scenes(int steps) const {
  for (const char* name : {"pile", "mixed", "polydisperse", "columns", "overlap", "tower",
                           "capsules", "terrain", "bridge"}) {
    scenes::Options options;
    if (name != std::string("tower")) options.spheres = 60;
    const Scene scene = scenes::make(name, options);
    if (scene.solver != Solver::soft_step) continue;
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < steps; ++n) {
      host.step();
      device.step();
    }
    EXPECT_EQ(host.state_hash(), device.state_hash()) << name;
  }
}
TEST_P(DeviceWorldTest, NamedScenesHaveTheBitsOfTheProcessor) { compare_named_scenes(150); }
TEST_P(HostPartsTest, NamedScenesHaveTheBitsOfTheProcessor) { compare_named_scenes(25); }

/// A step whose lists are too short is repeated, and allocates memory.
TEST_P(DeviceWorldTest, FewStepsOfAFallingHeapAreRepeated) {
  World world = on_device(scenes::make("mixed", {.spheres = 400}));
  const DeviceWorld& device = *WorldAccess::impl(world).device;
  int repeated = 0;
  for (int n = 0; n < 90; ++n) {
    const std::uint64_t before = device.states().version;
    world.step();
    if (device.states().version != before) ++repeated;
  }
  EXPECT_LE(repeated, 18);
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

// Steps without manifolds do not integrate the rotation of bodies on a device.
TEST_P(DeviceWorldTest, SpinningBodiesFallAsleepInTheSameStep) {
  Scene scene;
  scene.bodies = {test::half_space({0, 1, 0}, 0)};
  for (int k = 0; k < 24; ++k) {
    BodyDef def;
    def.position = {static_cast<Real>(2 * k), 0.5_r, 0};
    def.shape = Sphere{0.5_r};
    if (k % 4 == 3) {  // a box that touches nothing
      def.shape = Box{{0.5_r, 0.4_r, 0.3_r}};
      def.position.y = 5;
      def.acceleration = {};
    }
    def.angular_velocity = Vec3{0, 0.2_r * static_cast<Real>(k), 0};
    scene.bodies.push_back(def);
  }
  World host = on_host(scene), device = on_device(scene);
  std::uint32_t most = 0, least = 24;
  for (int n = 0; n < 90; ++n) {
    const StepReport report = host.step();
    ASSERT_EQ(device.step().awake, report.awake) << n;
    ASSERT_EQ(device.state_hash(), host.state_hash()) << n;
    most = std::max(most, report.awake);
    least = std::min(least, report.awake);
  }
  EXPECT_EQ(most, 24u);
  EXPECT_GT(least, 0u);
  EXPECT_LT(least, 24u);
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
    if (k % 2 == 0) grain.rolling_friction = 0.01_r;  // then the rows are those of manifolds
    scene.bodies.push_back(grain);
  }
  World host = on_host(scene), device = on_device(scene);
  bool has_overflow[2] = {};
  for (int n = 0; n < 20; ++n) {
    host.step();
    device.step();
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
    const soft_step::ContactView contacts =
        WorldAccess::impl(host).soft_step.last_contacts().view();
    for (std::uint32_t i = 0; i < contacts.size(); ++i) {
      if (contacts.colors[i] != soft_step::kOverflowColor) continue;
      has_overflow[std::max(contacts.key(i).a, contacts.key(i).b) % 2] = true;
    }
  }
  EXPECT_TRUE(has_overflow[0] && has_overflow[1]) << "rows of spheres, and of manifolds";
}

TEST_P(DeviceWorldTest, ChangesBetweenStepsReachTheDevice) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 6; ++k) {
    const Scene scene = random_scene(&random);
    World host = on_host(scene), device = on_device(scene);
    int uploads = 0;
    for (int n = 0; n < scene_steps(60); ++n) {
      for (std::uint64_t changes = 1 + random.below(3); changes > 0; --changes) {
        const std::uint64_t action = random.below(22);
        const auto at = [&](const World& world, std::uint64_t i) {
          return world.bodies()[i % world.bodies().size()];
        };
        const std::uint64_t i = random.below(1000);
        const BodyDef def = test::random_body(&random, 3);
        const MotionLocks locks = test::random_locks(&random);
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
            for (const BodyId other : world->bodies())
              world->apply_force_at_point(other, force, {});
          }
          if (action == 7) world->set_state(id, {def.position, def.orientation, force, {}});
          if (action == 8) {
            world->set_acceleration(id, force);
            world->set_damping(id, 0.5_r, 0.9_r);
            world->apply_torque(id, force);
            world->apply_torque(at(*world, i + 1), force);
          }
          if (action == 9) world->set_restitution(id, absolute(force.y) / 9);
          if (action == 10) world->set_filter(id, {.category = 2, .mask = 0xfffffffdu});
          if (action == 11) {
            const BodyId other = at(*world, i + 1);
            if (other != id) world->set_pair_ignored(id, other, !world->pair_ignored(id, other));
          }
          if (action == 12 && world->mass(id) > 0) world->set_mass(id, 0.3_r + absolute(force.z));
          if (action >= 20) world->set_motion_locks(id, locks);
          if (action == 18) world->apply_impulse_at_point(id, force, def.position);
          if (action == 19) {
            world->apply_impulse(id, force);
            world->apply_angular_impulse(id, force);
          }
          if (action == 13) {
            world->set_inertia(id, diagonal({3 + 0.1_r * absolute(force.x), 4, 5}));
          }
        }
      }
      if (!WorldAccess::impl(device).resident()) ++uploads;
      host.step();
      device.step();
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k << ", step " << n;
      if (random.below(2) == 0) continue;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device)) << "step " << n;
    }
    // Memory for more bodies grows by half of their number.
    EXPECT_LE(uploads, 4 + scene_steps(60) / 10);
    EXPECT_TRUE(host.snapshot() == device.snapshot());
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
      ASSERT_TRUE(WorldAccess::impl(device).resident());
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

/// Bodies of all kinds come and go between steps, also several times before a step and in the same
/// slot, and the world stays on the device.
TEST_P(DeviceWorldTest, BodiesComeAndGoOnTheDevice) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 8; ++k) {
    Scene scene = random_scene(&random);
    World host = on_host(scene), device = on_device(scene);
    int uploads = 0;
    for (int n = 0; n < scene_steps(50); ++n) {
      const bool shows_events = random.below(2) == 0, asks_between = random.below(3) == 0;
      for (std::uint64_t changes = random.below(6); changes > 0; --changes) {
        const std::uint64_t action = random.below(7), i = random.below(1000);
        BodyDef def = test::random_body(&random, 3);
        def.velocity = def.mass > 0 ? random.uniform_in_box({-3, -3, -3}, {3, 3, 3}) : Vec3{};
        def.restitution = random.uniform(0, 1);
        def.sensor = random.below(8) == 0;
        const bool is_posed = !std::holds_alternative<Plane>(def.shape) &&
                              !std::holds_alternative<HalfSpace>(def.shape);
        def.kinematic = def.mass == 0 && is_posed && random.below(2) == 0;
        if (def.kinematic) def.velocity = {0.2_r, 0, 0};
        if (random.below(20) == 0) def = test::half_space({0, 1, 0}, -3.5_r);
        for (World* world : {&host, &device}) {
          const BodyId id = world->bodies()[i % world->bodies().size()];
          if (action < 3) world->add(def);
          if (action >= 3 && action < 6 && world->bodies().size() > 4) world->remove(id);
          if (action == 6) world->set_state(id, {def.position, def.orientation, def.velocity, {}});
        }
        if (!asks_between) continue;
        ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k << ", step " << n;
        ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device)) << "step " << n;
        for (const BodyId id : host.bodies()) ASSERT_EQ(host.awake(id), device.awake(id));
      }
      if (random.below(8) == 0) {
        ASSERT_TRUE(host.snapshot() == device.snapshot()) << "step " << n;
      }
      if (!WorldAccess::impl(device).resident()) ++uploads;
      ASSERT_NO_FATAL_FAILURE(step_both(&host, &device)) << "scene " << k << ", step " << n;
      if (!shows_events) continue;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device)) << "step " << n;
    }
    // Memory for more bodies grows by half of their number.
    EXPECT_LE(uploads, 8 + scene_steps(50) / 10) << "of " << scene_steps(50) << " steps";
    EXPECT_TRUE(host.snapshot() == device.snapshot());
  }
}

/// Inner rows of all kinds in blocks that do not start at place 0, holes in blocks, and more bodies
/// without a place than a partition that is not due leaves.
TEST_P(DeviceWorldTest, SeveralBlocksOfBodiesHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  constexpr std::uint32_t kBodies = soft_step::kBodiesPerBlock + 150, kRow = 11;
  std::uint32_t number = 0;
  const auto next_body = [&] {
    BodyDef def = test::random_body(&random, 1);
    while (def.mass == 0) def = test::random_body(&random, 1);
    const std::uint32_t i = number++ % kBodies;
    def.position = Vec3{static_cast<Real>(i % kRow), static_cast<Real>(i / kRow / kRow),
                        static_cast<Real>(i / kRow % kRow)} *
                   1.5_r;
    def.velocity = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
    def.restitution = random.uniform(0, 1);
    return def;
  };
  Scene scene;
  for (std::uint32_t i = 0; i < kBodies; ++i) scene.bodies.push_back(next_body());
  scene.bodies.push_back(test::half_space({0, 1, 0}, -1));
  test::add_random_joints(&random, &scene);
  World host = on_host(scene), device = on_device(scene);
  const auto step = [&](int steps) {
    for (int n = 0; n < steps; ++n) {
      host.step(), device.step();
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << host.steps();
    }
  };
  ASSERT_NO_FATAL_FAILURE(step(3));
  for (std::uint32_t i = 0; i + 100 < kBodies; ++i) {
    const std::uint64_t removed = random.below(kBodies);
    const BodyDef def = next_body();
    for (World* world : {&host, &device}) {
      world->remove(world->bodies()[removed]);
      world->add(def);
    }
  }
  ASSERT_NO_FATAL_FAILURE(step(3));
  EXPECT_TRUE(host.snapshot() == device.snapshot());
}

/// A falling heap whose partition into blocks is renewed, with boxes, which have rows of manifolds.
void DeviceWorldTest::compare_heap(int steps) const {
  Scene scene = scenes::make("heap", {.spheres = 6000});
  for (std::size_t i = 0; i < 6000; i += 7) scene.bodies[i].shape = Box{{0.4_r, 0.4_r, 0.4_r}};
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < steps; ++n) {
    host.step(), device.step();
    if (n % 5 == 0) {
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
    }
  }
  EXPECT_TRUE(host.snapshot() == device.snapshot());
}
TEST_P(DeviceWorldTest, AHeapOfManyBlocksHasTheBitsOfTheProcessor) { compare_heap(70); }
TEST_P(HostPartsTest, AHeapOfManyBlocksHasTheBitsOfTheProcessor) { compare_heap(30); }

TEST(DeviceWorld, PartsHaveAsManyContactsAndBodies) {
  const test::SeveralBlocks several_blocks(8);
  constexpr std::uint32_t kSide = 20, kResting = kSide * kSide * 10, kFalling = 4000;
  Scene scene;
  for (std::uint32_t i = 0; i < kResting + kFalling; ++i) {  // only the first ones touch others
    const Vec3 site{static_cast<Real>(i % kSide), static_cast<Real>(i / (kSide * kSide)),
                    static_cast<Real>(i / kSide % kSide)};
    BodyDef body;
    body.shape = Sphere{0.5_r};
    body.position = i < kResting ? site * 0.99_r : site * 3 + Vec3{100, 0, 0};
    scene.bodies.push_back(body);
  }
  World world(scene, {.collider = {.backend = Backend::cpu}});
  WorldAccess::impl(world).device = test::make_two_part_world(scene);
  for (int n = 0; n < 3; ++n) world.step();  // bodies have places after the first one
  auto& step = static_cast<device::DeviceStep<test::HostDevice>&>(*WorldAccess::impl(world).device);
  const device::Divisions& divisions = step.device().divisions();
  const std::uint32_t slots = divisions.slots.begin[1];
  EXPECT_EQ(divisions.slots.begin[0], 0u);
  const std::span<const Contact> contacts = world.contacts();
  const auto of_first = static_cast<std::uint64_t>(
      std::ranges::count_if(contacts, [&](const Contact& c) { return c.a.index < slots; }));
  const double all = static_cast<double>(2 * contacts.size() + 5 * scene.bodies.size());
  EXPECT_GT(contacts.size(), scene.bodies.size());
  EXPECT_NEAR(static_cast<double>(2 * of_first + 5 * slots) / all, 0.5, 0.02);
  EXPECT_EQ(divisions.bodies.begin[1], slots);
  EXPECT_EQ(divisions.sub_shapes.begin[1], slots);
  const auto is_close = [](std::uint64_t value, std::uint64_t expected) {
    return value > expected - expected / 20 && value < expected + expected / 20;
  };
  EXPECT_PRED2(is_close, divisions.spheres.begin[1], of_first);
  EXPECT_PRED2(is_close, divisions.pairs.begin[1], of_first);
  EXPECT_NEAR(divisions.places.begin[1], slots, soft_step::kBodiesPerBlock);
}

TEST(DeviceWorld, GpusThatShareAWorldChangeNoBit) {
  const auto all = test::several_cuda_devices();
  if (all.empty()) GTEST_SKIP() << "no GPU";
  const test::SeveralBlocks several_blocks(8);
  const Scene scene = scenes::make("heap", {.spheres = 6000});
  World host(scene, {.collider = {.backend = Backend::cpu}});
  StepReport expected;
  for (int n = 0; n < 60; ++n) expected = host.step();
  for (const auto& [name, devices] : all) {
    World world(scene, {.devices = devices});
    StepReport report;
    for (int n = 0; n < 60; ++n) report = world.step();
    EXPECT_EQ(report.backend, Backend::cuda) << name << ": " << report.device_failure;
    EXPECT_EQ(report.contacts, expected.contacts) << name;
    EXPECT_EQ(world.state_hash(), host.state_hash()) << name;
  }
}

/// A body in the slot of a removed one does not take over its impulses or its neighbors.
TEST_P(DeviceWorldTest, ABodyInTheSlotOfARemovedOneStartsWithoutContacts) {
  const Scene scene = scenes::make("tower", {});
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < 60; ++n) host.step(), device.step();
  const BodyDef crate = scene.bodies[5];
  for (int n = 0; n < 4; ++n) {
    for (World* world : {&host, &device}) {
      const BodyState state = world->state(world->body_at(5));
      world->remove(world->body_at(5));
      BodyDef same = crate;
      same.position = state.position;
      same.orientation = state.orientation;
      EXPECT_EQ(world->add(same).index, 5u);
    }
    host.step(), device.step();
    ASSERT_TRUE(WorldAccess::impl(device).resident());
    ASSERT_EQ(host.state_hash(), device.state_hash());
    ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
  }
  EXPECT_TRUE(host.snapshot() == device.snapshot());
}

/// Contacts of a removed sensor wake no body when another body has its slot.
TEST_P(DeviceWorldTest, ABodyInTheSlotOfASensorDoesNotWakeWhatTheSensorTouched) {
  Scene scene;
  scene.bodies = {test::ground(), test::heavy({0, 1, 0}), test::ball({0, 1.5_r, 0})};
  scene.bodies[2].sensor = true;
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < 20; ++n) host.step(), device.step();
  for (World* world : {&host, &device}) {
    world->remove(world->body_at(2));
    EXPECT_TRUE(world->awake(world->body_at(1)));  // a query, which makes the device edit
    const BodyId body = world->add(test::ball({9, 9, 9}));
    EXPECT_EQ(body.index, 2u);
    world->set_state(body, {{9, 8, 9}, {}, {}, {}});
  }
  EXPECT_TRUE(host.snapshot() == device.snapshot());
}

/// Steps of a world that sleeps are left out, on the processor and on a device. They would have
/// changed nothing.
TEST_P(DeviceWorldTest, StepsOfASleepingWorldAreLeftOut) {
  Scene scene;
  scene.bodies = {test::half_space({0, 1, 0}, 0), test::half_space({1, 0, 0}, -1)};
  for (int k = 0; k < 3; ++k) {
    BodyDef crate;
    crate.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
    crate.position = {0.01_r * static_cast<Real>(k), 0.5_r + static_cast<Real>(k), 0};
    scene.bodies.push_back(crate);
  }
  for (int k = 0; k < 3; ++k) {  // a ball falls between two others
    BodyDef ball;
    ball.shape = Sphere{0.5_r};
    ball.position = {2 + 0.9_r * static_cast<Real>(k), k == 1 ? 1.3_r : 0.5_r, 0.1_r};
    scene.bodies.push_back(ball);
  }
  for (BodyDef& def : scene.bodies) def.rolling_friction = 0.05_r;
  World whole = on_host(scene), host = on_host(scene), device = on_device(scene);
  const auto make_step = [&](World& world) {
    const StepReport report = world.step();
    WorldAccess::impl(whole).steps_at_rest = 0;
    return report;
  };
  int left_out = 0;
  for (int n = 0; n < 700; ++n) {
    const std::uint64_t steps = host.steps() + 1;
    if (WorldAccess::impl(host).is_at_rest()) ++left_out;
    ASSERT_EQ(WorldAccess::impl(host).is_at_rest(), WorldAccess::impl(device).is_at_rest());
    const StepReport a = make_step(whole), b = make_step(host), c = make_step(device);
    ASSERT_EQ(b.step, steps);
    ASSERT_NO_FATAL_FAILURE(expect_equal(a, b)) << "step " << n;
    ASSERT_NO_FATAL_FAILURE(expect_equal(a, c)) << "step " << n;
    ASSERT_EQ(whole.state_hash(), host.state_hash()) << "step " << n;
    ASSERT_EQ(whole.state_hash(), device.state_hash()) << "step " << n;
    if (left_out > 0 && n % 7 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(whole, host)) << "step " << n;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(whole, device)) << "step " << n;
      ASSERT_TRUE(whole.snapshot() == host.snapshot()) << "step " << n;
      ASSERT_TRUE(whole.snapshot() == device.snapshot()) << "step " << n;
    }
    if (left_out != 0 && left_out % 20 == 0) {
      for (World* world : {&whole, &host, &device}) {
        const BodyId last = world->bodies().back();
        if (left_out == 20) world->apply_force(last, {3, 0, 0});
        if (left_out == 40) world->set_state(last, world->state(last));
        if (left_out == 60) world->remove(last);
        if (left_out == 80) world->restore(world->snapshot());
        if (left_out == 100) world->add_force(Gravity{{0.1_r, 0, 0}});
      }
      ++left_out;
    }
  }
  EXPECT_GT(left_out, 100) << "the world must sleep after each change";
}

/// Whether the host has applied the forces of the last step.
bool used_host_forces(World& world) { return WorldAccess::impl(world).is_saved; }

/// A force of any kind on bodies of the world.
RecordableForce random_force(Random* random, const World& world) {
  const auto body = [&] { return world.bodies()[random->below(world.bodies().size())]; };
  const auto body_or_all = [&]() -> std::optional<BodyId> {
    return random->below(2) == 0 ? std::optional(body()) : std::nullopt;
  };
  const auto vector = [&](Real size) {
    return random->uniform_in_box({-size, -size, -size}, {size, size, size});
  };
  const auto tensor = [&] {
    return diagonal({-random->uniform(0, 1), -random->uniform(0, 1), -random->uniform(0, 1)});
  };
  const auto spring = [&]<class S>(S made) {
    const BodyId a = body(), b = body();
    made.a = {a, vector(0.5_r)};
    made.b = a == b ? Attachment{{}, vector(3)} : Attachment{b, vector(0.5_r)};
    if (random->below(2) == 0) std::swap(made.a, made.b);
    made.stiffness = random->uniform(0, 20);
    made.damping = random->uniform(0, 1);
    made.rest_length = random->uniform(0, 3);
    return made;
  };
  switch (random->below(8)) {
    case 0:
      return Gravity{vector(5), body_or_all()};
    case 1:
      return Drag{random->uniform(0, 1), random->uniform(0, 1), vector(3), body_or_all()};
    case 2:
      return spring(Spring{});
    case 3:
      return spring(Bungee{});
    case 4:
      return Aero{body(), tensor(), vector(1), vector(3)};
    case 5:
      return AeroControl{
          body(), tensor(), tensor(), tensor(), vector(1), vector(3), random->uniform(-2, 2)};
    case 6:
      return Buoyancy{
          {{0, 1, 0}, random->uniform(-3, 3)}, random->uniform(0, 2), 9.81_r, body_or_all()};
    default:
      return Explosion{.centre = vector(3),
                       .start = static_cast<Real>(world.time()),
                       .peak_force = random->uniform(0, 50),
                       .speed = random->uniform(1, 30),
                       .thickness = random->uniform(1, 3),
                       .duration = random->uniform(0.05_r, 0.3_r)};
  }
}

/// Random worlds with forces that come, go and change, while bodies do.
TEST_P(DeviceWorldTest, RandomForcesHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int on_host_steps = 0, on_device_steps = 0;
  for (int k = 0; k < 12; ++k) {
    const Scene scene = random_scene(&random);
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < scene_steps(60); ++n) {
      const std::uint64_t action = random.below(8);
      const std::uint64_t i = random.below(1000);
      const Vec3 vector = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      const BodyDef def = test::random_body(&random, 3);
      const RecordableForce force = random_force(&random, host);
      for (World* world : {&host, &device}) {
        const BodyId id = world->bodies()[i % world->bodies().size()];
        const auto forces = world->forces();
        if (action < 2 && forces.size() < 12) {
          std::visit([&](const auto& f) { world->add_force(f); }, force);
        }
        if (action == 2 && !forces.empty() && i % 4 == 0) {
          world->remove_force(forces[i % forces.size()]);
        }
        if (action == 3 && world->bodies().size() > 2) world->remove(id);
        if (action == 4) world->add(def);
        if (action == 5) world->apply_force_at_point(id, vector, {});
        if (action == 6 && world->mass(id) > 0) world->set_mass(id, 1 + absolute(vector.x));
        if (action == 7 && !forces.empty()) {  // without a call that the world can notice
          const ForceId changed = forces[i % forces.size()];
          std::visit(
              [&](const auto& f) {
                auto& function = *WorldAccess::impl(*world).forces.find(changed);
                auto* target = function.template target<std::remove_cvref_t<decltype(f)>>();
                if (target != nullptr) *target = f;
              },
              force);
        }
      }
      const StepReport a = host.step(), b = device.step();
      if (!host.forces().empty()) ++(used_host_forces(device) ? on_host_steps : on_device_steps);
      ASSERT_EQ(a.non_finite, b.non_finite) << "scene " << k << ", step " << n;
      if (a.non_finite) {  // strong drag reverses velocities
        ASSERT_EQ(a.non_finite_body, b.non_finite_body);
        ASSERT_TRUE(host.snapshot() == device.snapshot()) << "scene " << k << ", step " << n;
        for (World* world : {&host, &device}) world->remove(a.non_finite_body);
        if (host.bodies().empty()) break;
        continue;
      }
      ASSERT_NO_FATAL_FAILURE(expect_equal(a, b)) << "scene " << k << ", step " << n;
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k << ", step " << n;
      if (n % 8 == 0) {
        ASSERT_TRUE(host.snapshot() == device.snapshot()) << "scene " << k << ", step " << n;
      }
    }
  }
  EXPECT_GT(on_device_steps, on_host_steps);
}

/// Balls that do not touch each other.
Scene rows_of_balls(int count) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    BodyDef def = test::ball({Real(i) * 3, 0, 0});
    def.acceleration = {};
    scene.bodies.push_back(def);
  }
  return scene;
}

/// Steps both worlds. @returns the number of steps in which the host has applied forces
int steps_with_host_forces(World* host, World* device, int count) {
  int found = 0;
  for (int n = 0; n < count; ++n) {
    host->step();
    device->step();
    EXPECT_EQ(host->state_hash(), device->state_hash()) << "step " << n;
    found += used_host_forces(*device) ? 1 : 0;
  }
  EXPECT_TRUE(host->snapshot() == device->snapshot());
  return found;
}

TEST_P(DeviceWorldTest, ForcesThatWakeABodyRunOnTheHostInThatStep) {
  Scene scene = rows_of_balls(4);
  scene.dt = 0.01_r;
  for (std::size_t i = 0; i < 3; ++i) scene.bodies[i].can_sleep = true;
  World host = on_host(scene), device = on_device(scene);
  for (World* world : {&host, &device}) {
    world->add_force(Drag{.linear = 0.1_r});
    world->add_force(Spring{.a = {world->bodies()[0]},
                            .b = {world->bodies()[1]},
                            .stiffness = 1,
                            .damping = 2,
                            .rest_length = 3});
    world->add_force(Explosion{.centre = {-2, 0, 0},
                               .start = 2,
                               .peak_force = 9,
                               .speed = 5,
                               .thickness = 1,
                               .duration = 2});
  }
  EXPECT_EQ(steps_with_host_forces(&host, &device, 200), 0);
  EXPECT_FALSE(host.awake(host.bodies()[0]));
  // The blast wakes the first ball, this wakes the second by the spring, and the blast the third.
  EXPECT_EQ(steps_with_host_forces(&host, &device, 200), 3);
  EXPECT_TRUE(WorldAccess::impl(device).resident());
}

TEST_P(DeviceWorldTest, UserDefinedForcesRunOnTheHost) {
  const Scene scene = rows_of_balls(3);
  World host = on_host(scene), device = on_device(scene);
  std::vector<ForceId> ids;
  for (World* world : {&host, &device}) {
    world->add_force(Drag{.linear = 0.1_r});
    ids.push_back(world->add_force([](ForceContext& context) {
      for (const BodyId id : context.bodies()) context.apply_force(id, {1, 0, 0});
    }));
    world->add_force(Gravity{});
  }
  EXPECT_EQ(steps_with_host_forces(&host, &device, 20), 20);
  host.remove_force(ids[0]);
  device.remove_force(ids[1]);
  EXPECT_EQ(steps_with_host_forces(&host, &device, 20), 0);
  EXPECT_TRUE(WorldAccess::impl(device).resident());
}

TEST_P(DeviceWorldTest, ChangedParametersOfForcesReachTheDevice) {
  const Scene scene = rows_of_balls(3);
  World host = on_host(scene), device = on_device(scene);
  std::vector<ForceId> surface, spring;
  for (World* world : {&host, &device}) {
    surface.push_back(world->add_force(AeroControl{.body = world->bodies()[0],
                                                   .lowest = diagonal({-2, -1, -1}),
                                                   .base = diagonal({-1, -1, -1}),
                                                   .highest = diagonal({-1, -3, -1}),
                                                   .point = {0.1_r, 0.2_r, 0.3_r},
                                                   .wind = {1, 2, 3}}));
    spring.push_back(
        world->add_force(Spring{.a = {world->bodies()[0]}, .stiffness = 3, .rest_length = 1}));
  }
  EXPECT_EQ(steps_with_host_forces(&host, &device, 5), 0);
  host.force<AeroControl>(surface[0]).control = 0.5_r;
  device.force<AeroControl>(surface[1]).control = 0.5_r;
  EXPECT_EQ(steps_with_host_forces(&host, &device, 5), 0);
  host.force<Spring>(spring[0]).b.body = host.bodies()[2];
  device.force<Spring>(spring[1]).b.body = device.bodies()[2];
  EXPECT_EQ(steps_with_host_forces(&host, &device, 5), 0);
  for (World* world : {&host, &device}) {
    EXPECT_NE(world->state(world->bodies()[2]).velocity, Vec3{});
    world->remove(world->bodies()[2]);
  }
  EXPECT_EQ(steps_with_host_forces(&host, &device, 5), 0);
  EXPECT_TRUE(WorldAccess::impl(device).resident());
}

/// The step in which a body runs away is undone: no force acts twice, and the blast, which keeps
/// the first ball awake, has no effect on its time of rest.
TEST_P(DeviceWorldTest, ForcesOfAnUndoneStepHaveNoEffect) {
  for (const bool by_user : {false, true}) {
    Scene scene = rows_of_balls(2);
    scene.dt = 0.01_r;
    scene.bodies[0].can_sleep = true;
    scene.bodies[1].position = {0.955_r * kMaxCoordinate, 0, 0};
    scene.bodies[1].velocity = {kMaxCoordinate, 0, 0};
    World host = on_host(scene), device = on_device(scene);
    for (World* world : {&host, &device}) {
      world->add_force(Explosion{.centre = {-1, 0, 0},
                                 .start = 0.025_r,
                                 .peak_force = 0.1_r,
                                 .speed = 1,
                                 .thickness = 8,
                                 .duration = 10});
      if (by_user) world->add_force([](ForceContext&) {});
    }
    for (World* world : {&host, &device}) {  // without a look at the states between the steps
      for (int n = 0; n < 4; ++n) EXPECT_FALSE(world->step().non_finite);
    }
    for (int n = 0; n < 3; ++n) {
      for (World* world : {&host, &device}) {
        if (n == 1) world->apply_force(world->bodies()[0], {0, 0.01_r, 0});
      }
      EXPECT_TRUE(host.step().non_finite);
      EXPECT_TRUE(device.step().non_finite);
      ASSERT_TRUE(host.snapshot() == device.snapshot());
    }
    for (World* world : {&host, &device}) world->remove(world->bodies()[1]);
    EXPECT_EQ(steps_with_host_forces(&host, &device, 3), by_user ? 3 : 0);
    EXPECT_GT(host.state(host.bodies()[0]).velocity.y, 0);
  }
}

TEST_P(DeviceWorldTest, ContactGeneratorsRunOnTheHost) {
  Scene scene;
  scene.bodies = {test::heavy({0, 1.2_r, 0}), test::heavy({0.5_r, 3.4_r, 0}), test::ground()};
  World host = on_host(scene), device = on_device(scene);
  std::vector<ContactGeneratorId> ids;
  for (World* world : {&host, &device}) {
    ids.push_back(world->add_contact_generator([](ContactContext& context) {
      for (DetectedContact& contact : context.detected()) contact.friction = 0.9_r;
    }));
  }
  for (int n = 0; n < 20; ++n) {
    host.step();
    device.step();
    ASSERT_EQ(host.state_hash(), device.state_hash());
  }
  EXPECT_FALSE(WorldAccess::impl(device).resident());
  ASSERT_FALSE(device.contacts().empty());
  EXPECT_EQ(device.contacts()[0].friction, 0.9_r);
  host.remove_contact_generator(ids[0]);
  device.remove_contact_generator(ids[1]);
  for (int n = 0; n < 50; ++n) {
    host.step();
    device.step();
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
    ASSERT_TRUE(std::ranges::equal(host.contacts(), device.contacts())) << "step " << n;
  }
  EXPECT_TRUE(WorldAccess::impl(device).resident());
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
  EXPECT_TRUE(WorldAccess::impl(device).resident()) << "a snapshot does not move the world";
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
  EXPECT_TRUE(WorldAccess::impl(restored).resident());
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

// The states are a part of the motion, and are fetched without the rest.
TEST_P(DeviceWorldTest, TheRestOfTheMotionIsFetchedAfterTheStates) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const Scene scene = random_scene(&random);
  World host = on_host(scene), device = on_device(scene);
  for (int n = 0; n < 40; ++n) {
    host.step();
    device.step();
    if (n % 3 != 0) {
      ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
    }
    for (const BodyId id : host.bodies()) {
      ASSERT_EQ(host.awake(id), device.awake(id));
      ASSERT_EQ(host.last_acceleration(id), device.last_acceleration(id));
      ASSERT_EQ(host.inverse_inertia(id), device.inverse_inertia(id));
    }
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "step " << n;
  }
}

TEST_P(DeviceWorldTest, AWorldThatIsRestoredToTheOtherSolverHasNoDevice) {
  Scene scene = scenes::make("pile", {.spheres = 10});
  World device = on_device(scene);
  device.step();
  scene.solver = Solver::worst_first;
  World host = on_host(scene);
  device.restore(host.snapshot());
  EXPECT_THROW(cuda::device_states(device), BackendUnavailable);
  EXPECT_THROW(cuda::enqueue_steps(device, 1, nullptr), BackendUnavailable);
  host.step();
  device.step();
  EXPECT_EQ(host.state_hash(), device.state_hash());
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
