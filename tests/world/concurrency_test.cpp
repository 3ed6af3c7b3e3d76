/// Tests of concurrent use: const functions of one world, and different worlds. Most useful with
/// the thread sanitizer.
#include "tests/world/random_bodies.hpp"

#include <functional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

JFPX_SOFT_STEP_SUITE(Concurrency);

Scene dense_scene(std::uint64_t seed) {
  Random random(seed);
  Scene scene = empty_scene();
  for (int i = 0; i < 30; ++i) scene.bodies.push_back(random_body(&random, 2));
  scene.bodies.push_back(ground());
  scene.resolver.max_iterations = 50;
  return scene;
}

/// Results of the const functions of a World.
struct Results {
  std::uint64_t hash = 0;
  std::vector<BodyState> states;
  std::vector<RayHit> hits;
  std::vector<ShapeHit> casts;
  std::vector<BodyDistance> nearby;
  std::vector<BodyId> touched;
  std::vector<Contact> contacts;
  std::vector<ContactForce> forces;
  std::vector<HitEvent> impacts;
  std::size_t events = 0, awake = 0;
  Snapshot snapshot;
  friend bool operator==(const Results&, const Results&) = default;
};
Results query(const World& world) {
  Results results;
  results.hash = world.state_hash();
  world.states(&results.states);
  results.hits = world.cast_ray_through({.origin = {-9, 0, 0}, .direction = {1, 0, 0}});
  results.casts = world.cast_shape_through(
      {.shape = Capsule{}, .position = {-9, 0, 0}, .translation = {18, 0, 0}});
  results.nearby = world.bodies_within({.shape = Capsule{}, .max_distance = 3});
  results.touched = world.overlapping(Box{{1, 1, 1}}, {0, 0, 0});
  results.contacts.assign(world.contacts().begin(), world.contacts().end());
  results.forces.assign(world.contact_forces().begin(), world.contact_forces().end());
  results.impacts.assign(world.hit_events().begin(), world.hit_events().end());
  results.events = world.contact_events().size();
  results.snapshot = world.snapshot();
  for (const BodyId id : world.bodies()) results.awake += world.awake(id) ? 1 : 0;
  return results;
}

TEST_P(Concurrency, ConstFunctionsOfAWorldRunConcurrently) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  World world(dense_scene(seed), {.hit_speed = 1}), twin(dense_scene(seed), {.hit_speed = 1});
  for (int n = 0; n < 20; ++n) {
    world.step();
    twin.step();
    // Then the threads list the ids of the others, too.
    for (World* w : {&world, &twin}) w->remove(w->bodies()[7]);
    // Of a world of its own, so that the threads build the tree of the queries.
    const Results expected = query(twin);
    std::vector<Results> results(4);
    {
      std::vector<std::jthread> threads;
      for (Results& mine : results) {
        threads.emplace_back([&mine, &world] {
          for (int i = 0; i < 5; ++i) mine = query(world);
        });
      }
    }
    for (const Results& found : results) EXPECT_TRUE(found == expected) << n;
  }
}

TEST_P(Concurrency, WorldsInSeveralThreadsAreIndependent) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed);
  const auto run = [&scene] {
    World world(scene, {.threads = 2});
    for (int n = 0; n < 50; ++n) world.step();
    return world.state_hash();
  };
  const std::uint64_t expected = run();
  std::vector<std::uint64_t> hashes(4);
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t& hash : hashes) threads.emplace_back([&hash, &run] { hash = run(); });
  }
  for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, expected);
}

/// A heap with more balls, rows and pairs of boxes than a chunk of any parallel loop.
TEST(SoftStepConcurrency, AHeapOfThousandsStepsOnSeveralThreads) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  Scene scene;
  scene.bodies.push_back(ground());
  const auto place = [&random](int i, int width) {
    const auto at = [](int n) { return static_cast<Real>(n) * 0.99_r; };
    const Vec3 noise = random.uniform_in_box({-0.02_r, -0.02_r, -0.02_r}, {0.02_r, 0.02_r, 0.02_r});
    return Vec3{at(i % width), 0.5_r + at(i / (width * width)), at(i / width % width)} + noise;
  };
  for (int i = 0; i < 9000; ++i) {
    scene.bodies.push_back(ball(place(i, 30), 0.5_r));
  }
  for (int i = 0; i < 1500; ++i) {
    BodyDef& box = scene.bodies.emplace_back();
    box.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
    box.position = place(i, 20) + Vec3{-30, 0, 0};
  }
  std::uint64_t expected = 0;
  for (const unsigned threads : {1u, 3u}) {
    World world(scene, {.threads = threads});
    for (int n = 0; n < 4; ++n) world.step();
    EXPECT_GT(world.contacts().size(), 20000u);
    if (threads == 1) expected = world.state_hash();
    EXPECT_EQ(world.state_hash(), expected);
  }
}

/// Each step runs in a thread of its own, beside two that run its tasks.
TEST_P(Concurrency, TasksOfTheProgramTakePartInStepsWithTheSameBits) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed);
  World expected(scene);
  std::vector<std::function<void()>> late;
  {
    std::vector<std::jthread> tasks;
    World world(scene, {.threads = 3, .enqueue_task = [&](std::function<void()> task) {
                          late.push_back(task);  // a second call has no effect
                          tasks.emplace_back(std::move(task));
                        }});
    for (int n = 0; n < 40; ++n) {
      std::jthread([&] { world.step(); }).join();
      expected.step();
      EXPECT_EQ(tasks.size(), 2u * (static_cast<unsigned>(n) + 1));
    }
    EXPECT_EQ(world.state_hash(), expected.state_hash());
  }
  for (const auto& task : late) task();
}

TEST_P(Concurrency, AStepIsUndoneIfItCannotEnqueueTasks) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed);
  bool is_full = false;
  World expected(scene);
  World world(scene, {.threads = 2, .enqueue_task = [&](const std::function<void()>&) {
                        if (is_full) throw std::runtime_error("full");
                      }});
  for (int n = 0; n < 10; ++n) {
    is_full = true;
    EXPECT_THROW(world.step(), std::runtime_error);
    is_full = false;
    EXPECT_TRUE(world.states() == expected.states());
    world.step();
    expected.step();
    EXPECT_EQ(world.state_hash(), expected.state_hash());
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
