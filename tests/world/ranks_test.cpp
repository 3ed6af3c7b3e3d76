/// Worlds that several ranks hold together have the bits of one rank.
#include <jfpx/recorded_world.hpp>
#include <jfpx/trajectory.hpp>
#include <jfpx/world.hpp>

#include "src/base/file.hpp"
#include "src/scenes/scenes.hpp"
#include "tests/support/seed.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/thread_ranks.hpp"
#include "tests/world/equal_worlds.hpp"
#include "tests/world/random_changes.hpp"
#include "tests/world/several_blocks.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace jfpx {
namespace {

using test::ThreadRanks;
using test::operator""_r;

WorldSettings settings_of(const std::shared_ptr<Communicator>& communicator, unsigned threads = 1) {
  WorldSettings settings;
  settings.threads = threads;
  settings.hit_speed = 1;
  settings.communicator = communicator;
  return settings;
}

/// JFPX_TEST_RANK_STEPS, or a default.
std::uint64_t steps_of_random_worlds() {
  const char* given = std::getenv("JFPX_TEST_RANK_STEPS");
  return given == nullptr ? 40 : std::strtoull(given, nullptr, 10);
}

/// Whether the test has failed on any rank.
bool any_failure(Communicator* communicator) {
  const std::byte own{testing::Test::HasFailure()};
  std::vector<std::byte> all(communicator->size());
  communicator->gather(std::span(&own, 1), all);
  return std::ranges::any_of(all, [](std::byte b) { return b != std::byte{0}; });
}

class RanksTest : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Ranks, RanksTest, testing::Values(2, 5));

TEST_P(RanksTest, NamedScenesHaveTheBitsOfOneRank) {
  for (const scenes::Entry& entry : scenes::all()) {
    const Scene scene = scenes::make(entry.name, {.spheres = 40});
    if (scene.solver != Solver::soft_step) continue;
    World one(scene);
    test::make_steps(&one, 60);
    const std::uint64_t hash = one.state_hash();
    ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
      World world(scene, settings_of(communicator));
      test::make_steps(&world, 60);
      EXPECT_EQ(world.state_hash(), hash) << entry.name << ", rank " << communicator->rank();
    });
    if (HasFailure()) return;
  }
}

TEST_P(RanksTest, RandomWorldsWithChangesHaveTheBitsOfOneRank) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const std::uint64_t steps = steps_of_random_worlds();
  for (std::uint64_t k = 0; k < 6; ++k) {
    ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
      Random random(seed + k);
      const Scene scene = test::random_room(&random);
      World one(scene, settings_of(nullptr)), world(scene, settings_of(communicator));
      for (std::uint64_t step = 0; step < steps; ++step) {
        if (random.below(4) == 0) {
          const test::Change change(&random, one.time());
          change.make(&one);
          change.make(&world);
        }
        const StepReport expected = one.step(), report = world.step();
        test::expect_equal(expected, report);
        if (random.below(3) == 0) test::expect_equal_contacts(one, world);
        if (random.below(5) == 0) test::expect_equal_forces(one, world);
        if (random.below(2) == 0) {
          EXPECT_EQ(one.state_hash(), world.state_hash());
        }
        if (any_failure(communicator.get())) {
          ADD_FAILURE() << "world " << k << ", step " << step << ", rank " << communicator->rank();
          return;
        }
      }
    });
    if (HasFailure()) return;
  }
}

/// Makes steps of a world on several ranks and of a reference on each of them.
void expect_equal_steps(std::uint32_t ranks, const Scene& scene, std::uint64_t steps,
                        unsigned threads = 1) {
  ThreadRanks::run(ranks, [&](const std::shared_ptr<Communicator>& communicator) {
    World one(scene), world(scene, settings_of(communicator, threads));
    for (std::uint64_t step = 0; step < steps; ++step) {
      test::expect_equal(one.step(), world.step());
      if (step % 8 == 0) {
        EXPECT_EQ(one.state_hash(), world.state_hash());
      }
      if (any_failure(communicator.get())) {
        ADD_FAILURE() << "step " << step << ", rank " << communicator->rank();
        return;
      }
    }
    EXPECT_EQ(one.state_hash(), world.state_hash());
  });
}

/// Conveyors are on all ranks, and keep their pose on each.
TEST_P(RanksTest, ConveyorsCarryTheBodiesOfAllRanks) {
  Scene scene = scenes::make("mixed", {.spheres = 60});
  BodyDef belt;
  belt.shape = Box{{30, 1, 30}};
  belt.mass = 0;
  belt.kinematic = true;
  belt.position = {0, 0.2_r, 0};
  belt.velocity = {2, 0, 1};
  belt.motion_locks = kFixedPose;
  scene.bodies.push_back(belt);
  expect_equal_steps(GetParam(), scene, 60);
}

/// The rows of the giant do not all get a color; one rank solves the others.
TEST_P(RanksTest, AGiantTouchesTheBodiesOfAllRanks) {
  expect_equal_steps(GetParam(), scenes::make("giant", {.spheres = 1500}), 40);
}

TEST_P(RanksTest, TwoGiantsOfDifferentRanksTouch) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  for (const Real x : {Real(-3.1), Real(3.1)}) {
    scene.bodies.push_back(test::ball({x, 3, 0}, 3));
    scene.bodies.back().mass = 50;
    for (int i = 0; i < 400; ++i) {
      const Vec3 direction = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
      if (length(direction) < 0.1_r) continue;
      scene.bodies.push_back(
          test::ball(Vec3{x, 3, 0} + direction * (3.2_r / length(direction)), 0.2_r));
    }
  }
  scene.bodies.push_back(test::half_space({0, 1, 0}, -0.5_r));
  expect_equal_steps(GetParam(), scene, 40);
}

TEST_P(RanksTest, AHeapFallsAsleepInTheSameStep) {
  const Scene scene = scenes::make("heap", {.spheres = 60});
  World one(scene);
  ASSERT_EQ(test::make_steps(&one, 550).awake, 0u);
  expect_equal_steps(GetParam(), scene, 550, 2);
}

TEST_P(RanksTest, SeveralBlocksHaveTheBitsOfOneRank) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const test::SeveralBlocks blocks(500);
  ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
    Random random(seed);
    const Scene scene = scenes::make("pile", {.spheres = 3000});
    World one(scene), world(scene, settings_of(communicator));
    for (int round = 0; round < 4; ++round) {
      // Enough new bodies for a renewal of the partition.
      for (int i = 0; i < 400; ++i) {
        const std::uint64_t removed = random.below(one.bodies().size());
        const BodyDef def = scene.bodies[random.below(scene.bodies.size())];
        for (World* w : {&one, &world}) {
          if (w->mass(w->bodies()[removed]) > 0) w->remove(w->bodies()[removed]);
          if (def.mass > 0) w->add(def);
        }
      }
      for (int n = 0; n < 20; ++n) test::expect_equal(one.step(), world.step());
      EXPECT_EQ(one.state_hash(), world.state_hash());
      EXPECT_TRUE(one.snapshot() == world.snapshot());
      if (any_failure(communicator.get())) return;
    }
  });
}

/// A snapshot does not depend on the number of ranks, and any number of ranks continues from it.
TEST_P(RanksTest, SnapshotsAreThoseOfOneRank) {
  const Scene scene = scenes::make("ragdolls", {.spheres = 60});
  World one(scene);
  test::make_steps(&one, 70);
  const Snapshot middle = one.snapshot();
  test::make_steps(&one, 70);
  const Snapshot end = one.snapshot();
  ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
    World world(scene, settings_of(communicator));
    test::make_steps(&world, 70);
    EXPECT_TRUE(world.snapshot() == middle);
    test::make_steps(&world, 70);
    EXPECT_TRUE(world.snapshot() == end);
    world.restore(middle);
    test::make_steps(&world, 70);
    EXPECT_TRUE(world.snapshot() == end);
  });
}

TEST_P(RanksTest, RecordingsAreThoseOfOneRank) {
  const test::TemporaryFolder folder;
  const Scene scene = scenes::make("ragdolls", {.spheres = 30});
  const auto record = [&](const std::string& path,
                          const std::shared_ptr<Communicator>& communicator) {
    RecordedWorld world(path, scene, settings_of(communicator));
    for (int step = 0; step < 60; ++step) {
      const BodyId id = world.world().bodies()[static_cast<std::size_t>(step)];
      if (step % 7 == 0) world.apply_impulse(id, {1, 2, 3});
      if (step == 20) world.remove(id);
      if (step == 40) world.add(test::ball({0, 5, 0}, 0.2_r));
      world.step();
    }
    world.finish();
  };
  record(folder.file("one.rec"), nullptr);
  ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
    record(folder.file("ranks.rec"), communicator);
  });
  const std::string expected = read_file(folder.file("one.rec"));
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(read_file(folder.file("ranks.rec")), expected);
}

TEST_P(RanksTest, FilesOfStatesAreThoseOfOneRank) {
  const test::TemporaryFolder folder;
  const Scene scene = scenes::make("mixed", {.spheres = 60});
  World one(scene);
  const auto change = [](World* world, int part) {
    if (part == 1) world->remove(world->bodies()[3]);
    if (part == 2) world->add(test::ball({0, 5, 0}, 0.2_r));
    if (part == 3) test::make_steps(world, 30);
  };
  for (int part = 0; part < 4; ++part) {
    change(&one, part);
    write_states(one, folder.file("one" + std::to_string(part)));
  }
  ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
    World world(scene, settings_of(communicator));
    for (int part = 0; part < 4; ++part) {
      change(&world, part);
      write_states(world, folder.file("ranks" + std::to_string(part)));
      EXPECT_THROW(write_states(world, folder.file("none/states.npy")), FileError);
    }
  });
  for (int part = 0; part < 4; ++part) {
    const std::string expected = read_file(folder.file("one" + std::to_string(part)));
    EXPECT_GT(expected.size(), 3000u);
    EXPECT_EQ(read_file(folder.file("ranks" + std::to_string(part))), expected) << part;
  }
  EXPECT_EQ(folder.entries(), 8u);
}

/// The ball crosses the domains of all ranks, and a wall of boxes that falls wakes all.
TEST_P(RanksTest, AFastBallCrossesAllDomains) {
  Scene scene = scenes::make("lattice", {.spheres = 343});
  for (BodyDef& def : scene.bodies) def.velocity = {};
  BodyDef ball = test::ball({-40, 0, 0}, 1);
  ball.mass = 200;
  ball.velocity = {60, 3, 2};
  scene.bodies.push_back(ball);
  expect_equal_steps(GetParam(), scene, 100);
}

TEST_P(RanksTest, ARunawayBodyUndoesTheStep) {
  Scene scene = scenes::make("pile", {.spheres = 40});
  BodyDef runaway = test::ball({0, 400, 0}, 1);
  runaway.velocity = {0, kMaxReal / 4, 0};
  scene.bodies.push_back(runaway);
  ThreadRanks::run(GetParam(), [&](const std::shared_ptr<Communicator>& communicator) {
    World one(scene), world(scene, settings_of(communicator));
    const StepReport expected = one.step(), report = world.step();
    EXPECT_TRUE(report.non_finite);
    EXPECT_EQ(report.non_finite_body, expected.non_finite_body);
    for (World* w : {&one, &world}) w->remove(report.non_finite_body);
    test::expect_equal(one.step(), world.step());
    EXPECT_EQ(one.state_hash(), world.state_hash());
  });
}

TEST(Ranks, SettingsThatSeveralRanksDoNotSupportAreRefused) {
  ThreadRanks::run(2, [](const std::shared_ptr<Communicator>& communicator) {
    WorldSettings settings = settings_of(communicator);
    settings.collider.backend = Backend::cuda;
    EXPECT_THROW(World({}, settings), InvalidArgument);
    settings = settings_of(communicator);
    settings.collider.backend = Backend::automatic;
    settings.devices = {0, 1};
    EXPECT_THROW(World({}, settings), InvalidArgument);
    World world({}, settings_of(communicator));
    EXPECT_THROW(world.add_contact_generator([](ContactContext&) {}), InvalidArgument);
  });
}

}  // namespace
}  // namespace jfpx
