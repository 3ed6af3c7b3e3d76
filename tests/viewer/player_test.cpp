/// Playback of runs: stepping back, exchanging engines and backends, recordings, and forces.
#include "src/viewer/player.hpp"

#include <jfpx/error.hpp>
#include <jfpx/recorded_world.hpp>

#include "src/scenes/scenes.hpp"
#include "src/sphere_collider/cost_cache.hpp"
#include "src/viewer/exchangeable_collider.hpp"
#include "src/viewer/forces.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/seed.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace jfpx {
namespace {

using namespace view;

Player player_of(const Scene& scene, const EngineChoice& choice = {}) {
  return {make_run(scene, choice), scene};
}

std::uint64_t hash(const Player& player) { return state_hash(player.shown().states); }

TEST(Player, SteppingBackAndAheadShowsTheSameBits) {
  const Scene scene = scenes::make("pile", {.spheres = 40});
  Player player = player_of(scene), straight = player_of(scene);
  for (int i = 0; i < 30; ++i) player.step();
  const std::uint64_t end = hash(player);
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(player.step_back());
  EXPECT_EQ(player.shown().step, 18u);
  EXPECT_NE(hash(player), end);
  for (int i = 0; i < 12; ++i) player.step();
  EXPECT_EQ(hash(player), end);
  for (int i = 0; i < 10; ++i) player.step();
  for (int i = 0; i < 40; ++i) straight.step();
  EXPECT_EQ(hash(player), hash(straight));
  while (player.step_back()) {
  }
  EXPECT_EQ(player.shown().step, 0u);
  EXPECT_FALSE(player.step_back());
}

TEST(Player, SwitchingTheBackendKeepsTheBits) {
  const Scene scene = scenes::make("pile", {.spheres = 60});
  Player straight = player_of(scene), switched = player_of(scene, {.threads = 3});
  const auto backends = available_backends();
  const bool has_gpu = std::ranges::any_of(backends, [](const BackendStatus& row) {
    return row.backend == Backend::cuda && row.usable;
  });
  for (int i = 0; i < 60; ++i) {
    if (i == 10) {
      EXPECT_TRUE(switched.switch_to({.backend = Backend::cpu, .threads = 3}));
    }
    if (i == 25 && has_gpu) {
      EXPECT_TRUE(switched.switch_to({.backend = Backend::cuda, .threads = 3}));
    }
    if (i == 40) {
      EXPECT_TRUE(switched.switch_to({.threads = 3}));
    }
    straight.step();
    switched.step();
    ASSERT_EQ(hash(straight), hash(switched)) << i;
    ASSERT_EQ(straight.shown().contacts, switched.shown().contacts) << i;
    ASSERT_EQ(switched.shown().step, static_cast<std::uint64_t>(i) + 1);
  }
}

TEST(Player, AnotherNumberOfThreadsContinuesInANewWorld) {
  Player player = player_of(scenes::make("pile", {.spheres = 60}));
  for (int i = 0; i < 20; ++i) player.step();
  const std::uint64_t before = hash(player);
  EXPECT_FALSE(player.switch_to({.threads = 3}));
  EXPECT_EQ(player.choice().threads, 3u);
  EXPECT_EQ(hash(player), before);
  player.step();
  EXPECT_EQ(player.shown().step, 21u);
}

TEST(Player, AnotherResolverContinuesFromTheSameState) {
  const Scene scene = scenes::make("pile", {.spheres = 60});
  Player player = player_of(scene), straight = player_of(scene);
  for (int i = 0; i < 30; ++i) player.step(), straight.step();
  EXPECT_EQ(player.shown().substeps, scene.soft_step.substeps);
  RunSettings settings = player.settings();
  settings.solver = Solver::worst_first;
  player.set_settings(settings);
  EXPECT_EQ(player.scene().solver, Solver::worst_first);
  EXPECT_EQ(hash(player), hash(straight));
  player.step(), straight.step();
  EXPECT_EQ(player.shown().step, 31u);
  EXPECT_EQ(player.shown().substeps, 0u);
  EXPECT_NE(hash(player), hash(straight));
}

TEST(Player, SwitchingBulletsPartsAndBackendsAtRandomKeepsTheBits) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  const test::Seed seed;
  std::mt19937 random(seed);
  const Scene scene = scenes::make("mixed", {.spheres = 30, .boxes = 30, .seed = seed});
  std::vector<Backend> backends = {Backend::automatic};
  for (const BackendStatus& row : available_backends()) {
    if (row.usable) backends.push_back(row.backend);
  }
  Player stock = player_of(scene, {.engine = EngineKind::bullet_stock});
  Player switched = player_of(scene, {.engine = EngineKind::bullet});
  for (int i = 0; i < 120; ++i) {
    if (random() % 3 == 0) {
      const EngineChoice choice{
          .engine = random() % 4 == 0 ? EngineKind::bullet_stock : EngineKind::bullet,
          .backend = backends[random() % backends.size()],
          .jfpx_solver = random() % 2 == 0,
          .jfpx_world = random() % 2 == 0,
          .minimum_batch = random() % 3 == 0 ? random() % 40 : 0};
      EXPECT_TRUE(switched.switch_to(choice));
    }
    stock.step();
    switched.step();
    ASSERT_EQ(hash(stock), hash(switched)) << i;
  }
}

TEST(Player, ReportsTheBackendOfBulletsSolver) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  for (const BackendStatus& row : available_backends()) {
    if (!row.usable) continue;
    Player player = player_of(scenes::make("pile", {.spheres = 60}),
                              {.engine = EngineKind::bullet, .backend = row.backend});
    for (int i = 0; i < 50; ++i) player.step();
    EXPECT_EQ(player.shown().solved_by, to_string(row.backend));
  }
}

TEST(Player, UsesTheCostsThatWereMeasuredOnThisMachine) {
  const test::TemporaryFolder folder;
  const test::EnvironmentVariable cache(test::kCacheVariable, folder.file(""));
  EXPECT_EQ(collider_options({}).costs, CostModel());  // not measured yet
  CostModel costs;
  costs.cpu_all_pairs.call_us = 123;
  store_costs(costs);
  EXPECT_EQ(collider_options({}).costs, costs);
}

TEST(Player, AnUnusableBackendLeavesTheRunUnchanged) {
  for (const BackendStatus& row : available_backends()) {
    if (row.usable) continue;
    for (const EngineKind engine : {EngineKind::native, EngineKind::bullet}) {
      if (!has_engine(engine)) continue;
      const EngineChoice choice{.engine = engine};
      Player player = player_of(scenes::make("pile", {.spheres = 10}), choice);
      player.step();
      EXPECT_THROW(player.switch_to({.engine = engine, .backend = row.backend}),
                   BackendUnavailable);
      EXPECT_EQ(player.choice(), choice);
      player.step();
      EXPECT_EQ(player.shown().step, 2u);
    }
    // A recording made on another machine.
    const test::TemporaryFolder folder;
    const Scene scene = scenes::make("gas", {.spheres = 2});
    const std::string backend(to_string(row.backend));
    RecordingWriter(folder.file("a.rec"), {.engine = "native", .backend = backend, .scene = scene})
        .finish();
    Recorded recorded = open_recording(folder.file("a.rec"));
    Player player(std::move(recorded.run), recorded.scene);
    RunSettings settings = player.settings();
    settings.dt *= 2;
    EXPECT_THROW(player.set_settings(settings), BackendUnavailable);
    EXPECT_EQ(player.scene(), scene);
    player.save_recording(folder.file("b.rec"));
  }
}

TEST(RecordedRun, WithCallsIsLeftToReplay) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  RecordedWorld world(path, scenes::make("gas", {.spheres = 2}));
  world.add_force(Gravity{});
  world.step();
  world.finish();
  EXPECT_THROW(open_recording(path), InvalidArgument);
}

TEST(RecordedRun, IsPlayedAndContinuesWithASimulation) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  const Scene scene = scenes::make("gas", {.spheres = 20});
  Player live = player_of(scene);
  for (int i = 0; i < 15; ++i) live.step();
  live.save_recording(path);
  Recorded recorded = open_recording(path);
  EXPECT_EQ(recorded.scene, scene);
  Player played(std::move(recorded.run), recorded.scene);
  for (const RunState& run_state : live.history()) {
    EXPECT_EQ(hash(played), state_hash(run_state.states)) << run_state.step;
    played.step();
  }
  EXPECT_EQ(played.shown().step, 15u);  // the end
  EXPECT_TRUE(played.at_end());
  EXPECT_EQ(played.history().size(), 16u);
  EXPECT_TRUE(played.step_back());
  EXPECT_EQ(played.shown().step, 14u);
  EXPECT_FALSE(played.at_end());
  EXPECT_FALSE(played.switch_to({.backend = Backend::cpu}));
  played.step();
  EXPECT_EQ(played.shown().step, 16u);
  EXPECT_EQ(played.shown().computed_by, "cpu");
}

TEST(RecordedRun, HasAllStepsAlthoughTheHistoryIsBounded) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.rec");
  Player player = player_of(scenes::make("gas", {.spheres = 1}));
  player.record_to(path);
  player.step();
  player.restart();
  std::vector<std::uint64_t> hashes;
  for (std::size_t i = 0; i < Player::kHistoryLength + 1; ++i) {
    player.step();
    hashes.push_back(hash(player));
    if (i == 5) player.step_back(), player.step();
  }
  EXPECT_EQ(player.history().size(), Player::kHistoryLength);
  EXPECT_THROW(player.save_recording(folder.file("b.rec")), InvalidArgument);
  player.finish_recording();
  EXPECT_EQ(folder.entries(), 1u);
  RecordingReader recording(path);
  ASSERT_EQ(recording.steps(), hashes.size());
  for (std::size_t i = 0; i < hashes.size(); ++i) {
    ASSERT_EQ(state_hash(recording.states(i + 1)), hashes[i]) << i;
  }
}

TEST(RecordedRun, IsNotWrittenForARunWhoseSettingsChanged) {
  const test::TemporaryFolder folder;
  Player player = player_of(scenes::make("gas", {.spheres = 1}));
  player.record_to(folder.file("a.rec"));
  player.step();
  RunSettings settings = player.settings();
  settings.resolver.max_iterations = 5;
  player.set_settings(settings);
  player.step();
  EXPECT_THROW(player.finish_recording(), InvalidArgument);
  EXPECT_THROW(player.save_recording(folder.file("b.rec")), InvalidArgument);
  EXPECT_EQ(folder.entries(), 0u);
  EXPECT_THROW(player.record_to(folder.file("missing/a.rec")), FileError);
}

TEST(BodyForces, OfAFallingBallAreZeroAlsoAfterAChangeOfTheTimeStep) {
  Scene scene;
  BodyDef ball;
  ball.mass = 3;
  ball.acceleration = {0, -10, 0};
  scene.bodies = {ball};
  scene.dt = Real(1.0 / 64);
  Player player = player_of(scene);
  const auto force = [&] {
    return length(forces_between(scene, player.before(), player.shown())[0]);
  };
  for (int i = 0; i < 2; ++i) player.step();
  RunSettings settings = player.settings();
  settings.dt = scene.dt / 4;
  player.set_settings(settings);
  EXPECT_EQ(player.shown().time, 2.0 / 64);
  EXPECT_NEAR(force(), 0, 0.01);
  player.step();
  EXPECT_EQ(player.shown().time, 2.25 / 64);
  EXPECT_NEAR(force(), 0, 0.01);
}

}  // namespace
}  // namespace jfpx
