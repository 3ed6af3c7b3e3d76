/// What may run at the same time: const functions of one world, and different worlds. Says most
/// under the thread sanitizer.
#include "tests/world/shape_zoo.hpp"

#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

Scene crowd(std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  for (int i = 0; i < 30; ++i) scene.bodies.push_back(random_body(&random, 2));
  scene.bodies.push_back(ground());
  scene.resolver.max_iterations = 50;
  return scene;
}

/// All that a const World can be asked.
struct Answers {
  std::uint64_t hash = 0;
  std::vector<BodyState> states;
  std::vector<RayHit> hits;
  std::vector<BodyId> touched;
  std::vector<Contact> contacts;
  std::size_t events = 0, awake = 0;
  friend bool operator==(const Answers&, const Answers&) = default;
};
Answers ask(const World& world) {
  Answers answers;
  answers.hash = world.state_hash();
  answers.states = world.states();
  answers.hits = world.cast_ray_through({.origin = {-9, 0, 0}, .direction = {1, 0, 0}});
  answers.touched = world.overlapping(Box{{1, 1, 1}}, {0, 0, 0});
  answers.contacts.assign(world.contacts().begin(), world.contacts().end());
  answers.events = world.contact_events().size();
  for (const BodyId id : world.bodies()) answers.awake += world.awake(id) ? 1 : 0;
  return answers;
}

TEST(Concurrency, ConstFunctionsOfAWorldRunBesideEachOther) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  World world(crowd(seed));
  for (int n = 0; n < 5; ++n) {
    world.step();
    const Answers expected = ask(world);
    std::vector<Answers> answers(4);
    {
      std::vector<std::jthread> threads;
      for (Answers& mine : answers) {
        threads.emplace_back([&mine, &world] {
          for (int i = 0; i < 20; ++i) mine = ask(world);
        });
      }
    }
    for (const Answers& theirs : answers) EXPECT_TRUE(theirs == expected) << n;
  }
}

TEST(Concurrency, WorldsInSeveralThreadsAreIndependent) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = crowd(seed);
  const auto run = [&scene] {
    World world(scene, {.collider = {.threads = 2}});
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

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
