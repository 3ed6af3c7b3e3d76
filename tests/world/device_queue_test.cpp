/// Steps of a world on a device that do not wait for the host: enqueued ones, and those of captured
/// graphs. Without a GPU, the programs of the device run on the host; with one, on the GPU too.
#include <jfpx/backend.hpp>
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"
#include "tests/support/soak.hpp"
#include "tests/world/bouncing_bodies.hpp"
#include "tests/world/device_kinds.hpp"
#include "tests/world/equal_worlds.hpp"
#include "tests/world/random_changes.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace jfpx {
namespace {

using test::expect_equal;
using test::expect_equal_contacts;
using test::make_steps;
using test::operator""_r;

class DeviceQueueTest : public testing::TestWithParam<test::DeviceKind> {
 protected:
  World on_device(const Scene& scene) const {
    World world(scene, {.collider = {.backend = Backend::cpu}, .hit_speed = 0.5_r});
    WorldAccess::impl(world).device = GetParam().make(scene);
    return world;
  }
  static World on_host(const Scene& scene) {
    return World(scene, {.collider = {.backend = Backend::cpu}, .hit_speed = 0.5_r});
  }

 private:
  test::SeveralBlocks several_blocks_{GetParam().most_in_one_block};
};
INSTANTIATE_TEST_SUITE_P(Devices, DeviceQueueTest, testing::ValuesIn(test::device_kinds()),
                         [](const auto& row) { return row.param.name; });

class DeviceGraphTest : public DeviceQueueTest {
 protected:
  /// A graph of steps, which the returned function launches.
  std::function<void()> graph_of(World* world, std::uint32_t steps) const {
    return GetParam().capture(
        world, [&](cuda::Stream stream) { cuda::enqueue_steps(*world, steps, stream); });
  }
};
INSTANTIATE_TEST_SUITE_P(Devices, DeviceGraphTest, testing::ValuesIn([] {
                           std::vector<test::DeviceKind> kinds = test::device_kinds();
                           std::erase_if(kinds, [](const auto& kind) { return !kind.capture; });
                           return kinds;
                         }()),
                         [](const auto& row) { return row.param.name; });

/// Queues between single steps, changes of all kinds, looks at everything, and snapshots.
TEST_P(DeviceQueueTest, EnqueuedStepsHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 10; ++k) {
    const Scene scene = test::random_room(&random);
    World host = on_host(scene), device = on_device(scene);
    for (int n = 0; n < 40; ++n) {
      SCOPED_TRACE("scene " + std::to_string(k) + ", round " + std::to_string(n));
      StepReport a, b;
      for (std::uint64_t queues = random.below(3); queues > 0; --queues) {
        const auto count = static_cast<std::uint32_t>(random.below(5));
        cuda::enqueue_steps(device, count, nullptr);
        if (count > 0) a = make_steps(&host, count);
        if (random.below(3) == 0) cuda::device_states(device);
      }
      if (a.step > 0 && random.below(2) == 0) {
        b = cuda::finish_steps(device);
        ASSERT_NO_FATAL_FAILURE(expect_equal(a, b));
      }
      if (random.below(3) == 0) {
        a = host.step(), b = device.step();
        ASSERT_NO_FATAL_FAILURE(expect_equal(a, b));
      }
      if (random.below(3) == 0) {
        ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
      }
      if (random.below(6) == 0) {
        ASSERT_TRUE(host.snapshot() == device.snapshot());
      }
      if (random.below(20) == 0) {
        const Snapshot snapshot = host.snapshot();
        cuda::enqueue_steps(device, 2, nullptr);
        for (World* world : {&host, &device}) world->restore(snapshot);
      }
      if (random.below(2) == 0) {
        const test::Change change(&random, host.time());
        for (World* world : {&host, &device}) change.make(world);
      }
      if (random.below(2) == 0) {
        ASSERT_EQ(host.state_hash(), device.state_hash());
      }
    }
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k;
    ASSERT_EQ(host.time(), device.time());
  }
}

/// Graphs of one to three steps, between queues, single steps and changes.
TEST_P(DeviceGraphTest, ReplayedStepsHaveTheBitsOfTheProcessor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t replayed = 0;
  for (int k = 0; k < 6; ++k) {
    const Scene scene = test::random_room(&random);
    World host = on_host(scene), device = on_device(scene);
    std::function<void()> graph;
    std::uint32_t size = 0;
    std::uint64_t version = 0;
    for (int n = 0; n < 60; ++n) {
      SCOPED_TRACE("scene " + std::to_string(k) + ", round " + std::to_string(n));
      if (size == 0 || cuda::device_states(device).version != version) {
        for (World* world : {&host, &device}) {
          for (const BodyId id : world->bodies()) world->wake(id);
        }
        host.step();
        const StepReport report = device.step();
        if (report.awake == 0 || report.non_finite) continue;  // no step was made on the device
        version = cuda::device_states(device).version;
        size = 1 + static_cast<std::uint32_t>(random.below(3));
        graph = graph_of(&device, size);
        ASSERT_EQ(cuda::device_states(device).version, version);
      }
      const std::uint64_t action = random.below(8);
      if (action < 4) {
        for (std::uint64_t launches = 1 + random.below(4); launches > 0; --launches) {
          graph();
          make_steps(&host, size);
          replayed += size;
        }
      }
      if (action == 4) host.step(), device.step();
      if (action == 5) make_steps(&host, 2), cuda::enqueue_steps(device, 2, nullptr);
      if (action == 6) {
        const test::Change change(&random, host.time());
        for (World* world : {&host, &device}) change.make(world);
      }
      if (action == 7) {
        ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
      }
      if (random.below(2) == 0) {
        ASSERT_EQ(host.state_hash(), device.state_hash());
      }
      // A graph that is not valid must not be launched.
      if (random.below(3) == 0) cuda::finish_steps(device);
      if (cuda::device_states(device).version != version) size = 0;
    }
    ASSERT_EQ(host.state_hash(), device.state_hash()) << "scene " << k;
    ASSERT_TRUE(host.snapshot() == device.snapshot());
  }
  EXPECT_GT(replayed, 50u);
}

TEST_P(DeviceGraphTest, AGraphOfTwoStepsMovesAPile) {
  const Scene scene = scenes::make("pile", {.spheres = 200});
  World host = on_host(scene), device = on_device(scene);
  make_steps(&host, 400), make_steps(&device, 400);  // then the lists of contacts are long enough
  const std::uint64_t version = cuda::device_states(device).version;
  const auto graph = graph_of(&device, 2);
  for (int n = 0; n < 50; ++n) graph();
  const StepReport a = make_steps(&host, 100), b = cuda::finish_steps(device);
  ASSERT_NO_FATAL_FAILURE(expect_equal(a, b));
  EXPECT_EQ(host.state_hash(), device.state_hash());
  EXPECT_EQ(cuda::device_states(device).version, version);
}

/// Balls that meet all at once need room for contacts in the middle of a queue, or of replays.
TEST_P(DeviceGraphTest, AStepWithoutRoomIsRepeatedBeforeItCanBeSeen) {
  Scene scene;
  for (int i = 0; i < 400; ++i) {
    const Vec3 place{static_cast<Real>(i % 20), static_cast<Real>(i / 20), 0};
    BodyDef def = test::ball(place * Real(4), 0.5_r);
    def.velocity = place * Real(-8);
    def.acceleration = {};
    scene.bodies.push_back(def);
  }
  for (const bool is_graph : {false, true}) {
    World host = on_host(scene), device = on_device(scene);
    make_steps(&host, 2), make_steps(&device, 2);
    const std::uint64_t version = cuda::device_states(device).version;
    if (is_graph) {
      const auto graph = graph_of(&device, 1);
      for (int n = 0; n < 31; ++n) graph();
    } else {
      cuda::enqueue_steps(device, 31, nullptr);
    }
    std::uint64_t deferred = 0;
    const test::StreamOfUser stream(GetParam(), true);
    cuda::enqueue_steps(device, 1, stream.get());
    stream.read(&deferred, cuda::device_states(device).deferred_steps, sizeof deferred);
    EXPECT_GT(deferred, 0u);
    const StepReport a = make_steps(&host, 32), b = cuda::finish_steps(device);
    ASSERT_GT(a.contacts, 200u);
    ASSERT_NO_FATAL_FAILURE(expect_equal(a, b));
    ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
    EXPECT_TRUE(host.snapshot() == device.snapshot());
    EXPECT_NE(cuda::device_states(device).version, version) << "lists have grown";
  }
}

/// Each step after the one in which a body runs away is undone, as step() would undo it. What the
/// first of them has changed of the other body before it failed is restored.
TEST_P(DeviceGraphTest, ARunawayBodyUndoesTheRestOfTheQueue) {
  Scene scene;
  scene.bodies = {test::ball({0, 0, 0}), test::ball({kMaxCoordinate * 0.9_r, 0, 0})};
  scene.bodies[0].can_sleep = false;
  scene.bodies[0].acceleration = {};
  scene.bodies[1].velocity = {kMaxCoordinate * 0.03_r, 0, 0};
  scene.dt = 1;
  for (const int variant : {0, 1, 2, 3}) {
    SCOPED_TRACE(variant);
    const bool is_graph = variant % 2 == 1, has_blast = variant >= 2;
    World host = on_host(scene), device = on_device(scene);
    for (World* world : {&host, &device}) {
      if (has_blast) {
        world->add_force(Explosion{.centre = {-1, 0, 0},
                                   .start = 2.5_r,
                                   .peak_force = 0.1_r,
                                   .speed = 1,
                                   .thickness = 8,
                                   .duration = 10});
      }
      make_steps(world, 3);  // the next one fails
      if (!has_blast) world->apply_force(world->bodies()[0], {0, 0.01_r, 0});
    }
    const Vec3 acceleration = host.last_acceleration(host.bodies()[0]);
    cuda::device_states(device);
    if (is_graph) {
      const auto graph = graph_of(&device, 3);
      for (int n = 0; n < 3; ++n) graph();
    } else {
      cuda::enqueue_steps(device, 9, nullptr);
    }
    const StepReport a = make_steps(&host, 9), b = cuda::finish_steps(device);
    ASSERT_TRUE(a.non_finite);
    EXPECT_TRUE(b.non_finite);
    EXPECT_EQ(a.step, 3u);
    EXPECT_EQ(b.step, 3u);
    EXPECT_EQ(a.non_finite_body, b.non_finite_body);
    EXPECT_EQ(device.last_acceleration(device.bodies()[0]), acceleration);
    EXPECT_TRUE(host.snapshot() == device.snapshot());
    EXPECT_TRUE(device.contacts().empty());
    for (World* world : {&host, &device}) world->remove(world->bodies()[1]);
    make_steps(&host, 3);
    cuda::enqueue_steps(device, 3, nullptr);
    EXPECT_TRUE(host.snapshot() == device.snapshot());
    EXPECT_NE(device.state(device.bodies()[0]).velocity, Vec3{});
    EXPECT_TRUE(WorldAccess::impl(device).resident());
  }
}

/// A blast reaches sleeping bodies, which only the host can wake, and its time counts on.
TEST_P(DeviceQueueTest, ForcesThatWakeABodyAreLeftToTheHost) {
  Scene scene;
  scene.dt = 0.01_r;
  for (int i = 0; i < 4; ++i) {
    BodyDef def = test::ball({3 * static_cast<Real>(i), 0, 0});
    def.acceleration = {};
    def.can_sleep = i < 3;
    scene.bodies.push_back(def);
  }
  World host = on_host(scene), device = on_device(scene);
  for (World* world : {&host, &device}) {
    world->add_force(Drag{.linear = 0.1_r});
    world->add_force(Explosion{.centre = {-2, 0, 0},
                               .start = 2,
                               .peak_force = 9,
                               .speed = 5,
                               .thickness = 1,
                               .duration = 2});
  }
  make_steps(&host, 400);
  for (int n = 0; n < 4; ++n) cuda::enqueue_steps(device, 100, nullptr);
  EXPECT_TRUE(host.snapshot() == device.snapshot());
  EXPECT_NE(device.state(device.bodies()[2]).velocity, Vec3{});
  EXPECT_TRUE(WorldAccess::impl(device).resident());
}

/// A replay after a change of the host must see it, though the graph has no part of it.
TEST_P(DeviceGraphTest, ReplaysSeeTheChangesBeforeThem) {
  const Scene scene = scenes::make("pile", {.spheres = 30});
  World host = on_host(scene), device = on_device(scene);
  std::vector<ForceId> ids;
  for (World* world : {&host, &device}) ids.push_back(world->add_force(Gravity{{1, 0, 0}}));
  make_steps(&host, 40), make_steps(&device, 40);
  const std::uint64_t version = cuda::device_states(device).version;
  const auto graph = graph_of(&device, 1);
  const BodyId ball = host.bodies()[3];
  for (int n = 0; n < 30; ++n) {
    for (World* world : {&host, &device}) {
      if (n % 3 == 0) world->apply_force(ball, {0, 40, 0});
      if (n % 5 == 0) world->force<Gravity>(ids[world == &device]).acceleration.x += 1;
    }
    if (n % 2 == 0) cuda::device_states(device);  // sends the change
    graph();
    host.step();
    if (n % 4 == 0) {
      ASSERT_EQ(host.state_hash(), device.state_hash()) << n;
    }
  }
  EXPECT_TRUE(host.snapshot() == device.snapshot());
  EXPECT_EQ(cuda::device_states(device).version, version);
}

TEST_P(DeviceQueueTest, TheVersionChangesWhenAGraphIsNoLongerValid) {
  const Scene scene = scenes::make("mixed", {.spheres = 20});
  World world = on_device(scene);
  make_steps(&world, 60);
  std::uint64_t version = cuda::device_states(world).version;
  const auto changes = [&] {
    const std::uint64_t before = std::exchange(version, cuda::device_states(world).version);
    return version != before;
  };
  EXPECT_FALSE(changes());
  const Vec3* const before = cuda::device_states(world).positions;
  world.step();
  cuda::enqueue_steps(world, 3, nullptr);
  EXPECT_FALSE(changes());
  EXPECT_EQ(cuda::device_states(world).positions, before);
  world.apply_force(world.bodies()[0], {1, 2, 3});
  world.set_state(world.bodies()[1], {{0, 9, 0}, {}, {}, {}});
  EXPECT_FALSE(changes());
  world.set_filter(world.bodies()[0], {.category = 2, .mask = 1});
  EXPECT_TRUE(changes()) << "filters were not in use";
  world.set_pair_ignored(world.bodies()[0], world.bodies()[1], true);
  EXPECT_TRUE(changes());
  world.remove(world.bodies()[0]);
  EXPECT_TRUE(changes());
  world.add(test::ball({0, 20, 0}));
  EXPECT_TRUE(changes());
  const ForceId spring = world.add_force(Spring{.a = {world.bodies()[0]}, .stiffness = 1});
  world.add_force(Gravity{});
  EXPECT_TRUE(changes());
  world.force<Spring>(spring).stiffness = 2;
  EXPECT_FALSE(changes());
  world.force<Spring>(spring).b.body = world.bodies()[2];
  EXPECT_TRUE(changes());
  world.set_mass(world.bodies()[0], 7);
  EXPECT_TRUE(changes());
  world.restore(world.snapshot());
  EXPECT_TRUE(changes());
}

#if JFPX_HAS_CUDA
TEST(DeviceGraph, OfAWorldOnSeveralDevicesIsRefused) {
  const test::SeveralBlocks several_blocks(8);
  const Scene scene = scenes::make("pile", {.spheres = 20});
  for (const test::CudaDevices& devices : test::several_cuda_devices()) {
    World world(scene, {.collider = {.backend = Backend::cpu}});
    WorldAccess::impl(world).device = devices(scene);
    world.step();
    cuda::device_states(world);
    EXPECT_THROW(test::capture_on_cuda(
                     &world, [&](cuda::Stream stream) { cuda::enqueue_steps(world, 1, stream); }),
                 InvalidArgument);
    world.step();
  }
}
#endif

TEST_P(DeviceGraphTest, ACaptureNeedsAWorldThatIsOnTheDevice) {
  const Scene scene = scenes::make("pile", {.spheres = 20});
  World world = on_device(scene);
  EXPECT_THROW(graph_of(&world, 1), InvalidArgument) << "not uploaded";
  cuda::device_states(world);
  EXPECT_THROW(graph_of(&world, 1), InvalidArgument) << "no step";
  make_steps(&world, 1);
  cuda::device_states(world);
  graph_of(&world, 1);
  world.apply_force(world.bodies()[0], {1, 0, 0});
  EXPECT_THROW(graph_of(&world, 1), InvalidArgument) << "an edit";
  cuda::device_states(world);
  graph_of(&world, 1);
  const ForceId force = world.add_force([](ForceContext&) {});
  make_steps(&world, 1);
  cuda::device_states(world);
  EXPECT_THROW(graph_of(&world, 1), InvalidArgument) << "a user-defined force";
  world.remove_force(force);
  const ContactGeneratorId generator = world.add_contact_generator([](ContactContext&) {});
  make_steps(&world, 1);
  cuda::device_states(world);
  EXPECT_THROW(graph_of(&world, 1), InvalidArgument) << "a contact generator";
  world.remove_contact_generator(generator);
  make_steps(&world, 1);
  cuda::device_states(world);
  EXPECT_EQ(world.steps(), 4u);
  graph_of(&world, 1)();
  EXPECT_EQ(world.steps(), 5u);
}

/// A world that sleeps launches nothing, except in a graph.
TEST_P(DeviceGraphTest, ASleepingWorldIsLeftAlone) {
  Scene scene;
  scene.bodies = {test::ground(), test::heavy({0, 1, 0})};
  World host = on_host(scene), device = on_device(scene);
  make_steps(&host, 300), make_steps(&device, 300);
  auto& impl = WorldAccess::impl(device);
  ASSERT_TRUE(impl.is_at_rest());
  cuda::enqueue_steps(device, 7, nullptr);
  EXPECT_FALSE(impl.is_launched());
  EXPECT_EQ(cuda::finish_steps(device).step, 307u);
  make_steps(&host, 7);
  cuda::device_states(device);
  const auto graph = graph_of(&device, 3);
  graph();
  make_steps(&host, 3);
  EXPECT_NO_FATAL_FAILURE(expect_equal_contacts(host, device));
  EXPECT_EQ(device.steps(), 310u);
  make_steps(&host, 4), make_steps(&device, 4);  // the last of them are left out
  ASSERT_TRUE(impl.is_at_rest());
  cuda::device_states(device);
  const auto other_graph = graph_of(&device, 3);
  other_graph();
  make_steps(&host, 3);
  EXPECT_EQ(device.steps(), 317u);
  EXPECT_EQ(host.state_hash(), device.state_hash());
  for (World* world : {&host, &device}) world->apply_force(world->bodies()[1], {0, 5000, 0});
  graph();
  make_steps(&host, 3);
  EXPECT_TRUE(host.snapshot() == device.snapshot());
  EXPECT_TRUE(device.awake(device.bodies()[1]));
}

TEST_P(DeviceQueueTest, StepsThatNeedTheHostAreMadeAtOnce) {
  const Scene scene = scenes::make("pile", {.spheres = 20});
  World host = on_host(scene), device = on_device(scene);
  for (World* world : {&host, &device}) {
    world->add_force([](ForceContext& context) {
      for (const BodyId id : context.bodies()) context.apply_force(id, {1, 0, 0});
    });
  }
  cuda::enqueue_steps(device, 5, nullptr);
  const StepReport a = make_steps(&host, 5), b = cuda::finish_steps(device);
  ASSERT_NO_FATAL_FAILURE(expect_equal(a, b));
  EXPECT_TRUE(host.snapshot() == device.snapshot());
  const std::uint64_t departures = WorldAccess::impl(device).mirror.departures;
  for (World* world : {&host, &device}) world->add_contact_generator([](ContactContext&) {});
  cuda::device_states(device);
  cuda::enqueue_steps(device, 2, nullptr);
  EXPECT_GT(WorldAccess::impl(device).mirror.departures, departures)
      << "arrays of before are invalid";
  make_steps(&host, 2);
  EXPECT_TRUE(host.snapshot() == device.snapshot());
}

/// The arrays of device_states() are those after the queue, in the order of the user's stream.
TEST_P(DeviceQueueTest, StatesAreUpdatedInTheOrderOfTheStream) {
  const Scene scene = scenes::make("pile", {.spheres = 100});
  World host = on_host(scene), device = on_device(scene);
  make_steps(&host, 400), make_steps(&device, 400);
  for (std::size_t n = 0; n < 5; ++n) {
    for (World* world : {&host, &device}) world->apply_force(world->bodies()[n], {0, 50, 0});
    const test::StreamOfUser stream(GetParam());
    cuda::enqueue_steps(device, 4, stream.get());
    const cuda::DeviceStates states = cuda::device_states(device);
    std::vector<Vec3> positions(states.slots);
    stream.read(positions.data(), states.positions, states.slots * sizeof(Vec3));
    std::uint64_t deferred = 1;
    stream.read(&deferred, states.deferred_steps, sizeof deferred);
    ASSERT_EQ(deferred, 0u);
    make_steps(&host, 4);
    for (const BodyId id : host.bodies()) {
      ASSERT_EQ(positions[id.index], host.state(id).position) << n;
    }
    EXPECT_TRUE(WorldAccess::impl(device).is_launched()) << "nothing has waited for the queue";
  }
}

TEST_P(DeviceGraphTest, ConcurrentReadersFinishAQueueOnce) {
  const Scene scene = scenes::make("pile", {.spheres = 60});
  World host = on_host(scene), device = on_device(scene);
  make_steps(&host, 300), make_steps(&device, 300);
  const std::uint64_t version = cuda::device_states(device).version;
  const auto graph = graph_of(&device, 12);
  for (int n = 0; n < 10; ++n) {
    for (World* world : {&host, &device}) world->apply_force(world->bodies()[5], {0, 60, 0});
    ASSERT_EQ(cuda::device_states(device).version, version);
    n % 2 == 0 ? graph() : cuda::enqueue_steps(device, 12, nullptr);
    make_steps(&host, 12);
    if (n % 3 == 0) {  // the readers find an edit that the device does not have yet
      cuda::finish_steps(device);
      for (World* world : {&host, &device})
        world->set_mass(world->bodies()[5], 2 + static_cast<Real>(n));
    }
    const std::uint64_t hash = host.state_hash();
    const std::size_t contacts = host.contacts().size();
    std::vector<std::thread> readers;
    for (int k = 0; k < 4; ++k) {
      readers.emplace_back([&, k] {
        if (k % 2 == 0) {
          EXPECT_EQ(device.contacts().size(), contacts);
        }
        EXPECT_EQ(device.steps(), host.steps());
        EXPECT_EQ(device.state_hash(), hash);
      });
    }
    for (std::thread& reader : readers) reader.join();
  }
}

TEST(DeviceQueue, NeedsADevice) {
  World world(scenes::make("pile", {.spheres = 5}), {.collider = {.backend = Backend::cpu}});
  EXPECT_THROW(cuda::enqueue_steps(world, 1, nullptr), BackendUnavailable);
  EXPECT_EQ(world.steps(), 0u);
}

/// Whichever program of a queue cannot be started, the processor completes the steps.
TEST(DeviceQueue, AFailingDeviceIsReplacedInTheMiddleOfAQueue) {
  const Scene scene = scenes::make("mixed", {.spheres = 20});
  World host(scene, {.collider = {.backend = Backend::cpu}});
  const auto prepare = [](World* world) {
    world->add_force(Gravity{{0, 0, 1}});
    make_steps(world, 3);
    world->apply_force(world->bodies()[1], {3, 4, 5});
    world->remove(world->bodies()[4]);
  };
  prepare(&host);
  make_steps(&host, 5);
  bool was_reached = true;
  for (int runs = 0; was_reached; ++runs) {
    ASSERT_LT(runs, 100);
    World world(scene, {.collider = {.backend = Backend::cpu}});
    auto& impl = WorldAccess::impl(world);
    impl.device = test::make_host_device_world(scene);
    prepare(&world);
    test::host_device_of(&world).fail_after(runs);
    cuda::enqueue_steps(world, 3, nullptr);
    if (impl.device != nullptr) {
      cuda::enqueue_steps(world, 2, nullptr);
    } else {
      EXPECT_THROW(cuda::enqueue_steps(world, 2, nullptr), BackendUnavailable);
      make_steps(&world, 2);
    }
    was_reached = impl.device == nullptr;
    ASSERT_EQ(cuda::finish_steps(world).device_failure.empty(), !was_reached) << runs;
    ASSERT_TRUE(cuda::finish_steps(world).device_failure.empty()) << "reported once";
    ASSERT_EQ(world.steps(), host.steps());
    ASSERT_EQ(world.state_hash(), host.state_hash()) << runs;
    ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, world));
  }
}

/// A device that has received a world does not have the contacts that only the lists of the host
/// contain, such as those of a compound.
TEST_P(DeviceQueueTest, NeighborsWakeRightAfterAnUpload) {
  Compound compound;
  for (const int x : {-1, 1}) compound.parts.push_back({Sphere{}, {Real(x), 0, 0}});
  Scene scene;
  scene.bodies.resize(2);
  scene.bodies[0].shape = Box{{5, 1, 5}};
  scene.bodies[0].mass = 0;
  scene.bodies[1].shape = compound;
  scene.bodies[1].position = {0, Real(1.9),
                              0};  // deep, so that the contact is detected as touching
  for (const bool removes : {false, true}) {
    World host = on_host(scene), device = on_device(scene);
    make_steps(&host, 25);
    ASSERT_FALSE(host.contacts().empty());
    const Snapshot snapshot = host.snapshot();
    for (World* world : {&host, &device}) world->restore(snapshot);
    cuda::device_states(device);
    for (World* world : {&host, &device}) {
      const BodyId floor = world->bodies()[0];
      removes ? world->remove(floor) : world->set_filter(floor, {.category = 4});
      world->step();
    }
    EXPECT_TRUE(host.snapshot() == device.snapshot()) << removes;
  }
}

/// Parts of removed compounds stay in the arrays of the device until the world is sent again.
TEST_P(DeviceQueueTest, CompoundsThatComeAndGoTakeNoMoreMemory) {
  Compound compound;
  for (const int x : {-1, 0, 1}) compound.parts.push_back({Sphere{}, {Real(x), 0, 0}});
  Scene scene;
  scene.bodies.emplace_back().shape = compound;
  World world = on_device(scene);
  BodyId last = world.bodies().front();
  const auto replace = [&](int times) {
    for (int n = 0; n < times; ++n) {
      world.remove(last);
      last = world.add(scene.bodies.front());
      ASSERT_TRUE(world.step().device_failure.empty());
    }
  };
  replace(500);
  const std::size_t before = test::bytes_in_use();
  replace(2000);
  EXPECT_LE(test::bytes_in_use(), before + 1024);
}

/// Several worlds, whose steps run at the same time.
TEST_P(DeviceQueueTest, WorldsWithChangingBodiesKeepTheirMemoryFlat) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  constexpr std::size_t kWorlds = 8;
  constexpr std::uint32_t kSteps = 20;
  constexpr Real kRoom = 3;
  constexpr std::size_t kMostGrowth = std::size_t{32} << 20;
  struct Running {
    Running(World on_device, const test::DeviceKind& kind)
        : world(std::move(on_device)), stream(kind) {}
    World world;
    test::StreamOfUser stream;
    std::deque<BodyId> bodies;
  };
  std::deque<Running> running;
  Scene scene;
  scene.bodies = test::walls(kRoom);
  while (running.size() < kWorlds) {
    Running& one = running.emplace_back(on_device(scene), GetParam());
    for (int i = 0; i < 12; ++i) {
      one.bodies.push_back(one.world.add(test::bouncing_body(&random, kRoom - 2)));
    }
  }
  // Without a GPU, a step takes much longer.
  const std::uint64_t steps = test::soak_steps() / (GetParam().is_cuda ? 1 : 2);
  const std::uint64_t rounds = steps / (kWorlds * kSteps) + 1;
  std::uint64_t contacts = 0;
  std::size_t before = 0;
  const auto step_all = [&](std::uint64_t round) {
    if (round == rounds / 2) before = test::device_bytes_in_use(GetParam());
    for (Running& one : running) {
      const StepReport report = cuda::finish_steps(one.world);
      ASSERT_FALSE(report.non_finite);
      ASSERT_TRUE(report.device_failure.empty()) << report.device_failure;
      contacts += report.contacts;
      one.world.remove(one.bodies.front());
      one.bodies.pop_front();
      one.bodies.push_back(one.world.add(test::bouncing_body(&random, kRoom - 2)));
      cuda::enqueue_steps(one.world, kSteps, one.stream.get());
    }
  };
  test::expect_flat_memory(rounds, step_all, kWorlds);
  for (Running& one : running) cuda::finish_steps(one.world);
  EXPECT_LE(test::device_bytes_in_use(GetParam()), before + kMostGrowth);
  EXPECT_GT(contacts, rounds);
}

}  // namespace
}  // namespace jfpx
