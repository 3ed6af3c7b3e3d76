/// Tests of the table of functions that a World takes from the library jfpx_thesis.
#include <jfpx/thesis/worst_first.hpp>

#include "src/scenes/scenes.hpp"
#include "src/world/thesis_table.hpp"
#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace jfpx {
namespace {

using ::testing::HasSubstr;

Scene scene_of(Solver solver) {
  Scene scene = scenes::make("pile", {.spheres = 20, .seed = 1});
  scene.solver = solver;
  return scene;
}

/// The message of an InvalidArgument.
std::string refusal(const std::function<void()>& function) {
  try {
    function();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "no InvalidArgument";
}

class WithoutThesis : public testing::Test {
 protected:
  void disable() { set_thesis_table(nullptr); }
  void TearDown() override { thesis::enable(); }
};

TEST_F(WithoutThesis, AWorldOfWorstFirstNamesTheRemedy) {
  disable();
  const std::string message = refusal([] { World(scene_of(Solver::worst_first)); });
  EXPECT_THAT(message, HasSubstr("scene.solver is worst_first"));
  EXPECT_THAT(message, HasSubstr("jfpx::thesis::enable()"));
}

TEST_F(WithoutThesis, TheBroadPhasesOfTheThesisNameTheRemedy) {
  disable();
  for (const BroadPhase way : {BroadPhase::hierarchy, BroadPhase::brute_force}) {
    const std::string message = refusal(
        [way] { World(scene_of(Solver::soft_step), {.collider = {}, .broad_phase = way}); });
    EXPECT_THAT(message, HasSubstr("broad_phase"));
    EXPECT_THAT(message, HasSubstr("jfpx::thesis::enable()"));
  }
}

TEST_F(WithoutThesis, ARefusedSnapshotLeavesTheWorldUnchanged) {
  const Snapshot snapshot = World(scene_of(Solver::worst_first)).snapshot();
  disable();
  World world(scene_of(Solver::soft_step));
  world.step();
  const std::vector<std::byte> before = world.snapshot().bytes;
  EXPECT_THAT(refusal([&] { world.restore(snapshot); }), HasSubstr("jfpx::thesis::enable()"));
  EXPECT_EQ(world.snapshot().bytes, before);
  thesis::enable();
  world.restore(snapshot);
  EXPECT_EQ(world.settings().solver, Solver::worst_first);
  world.step();
}

TEST_F(WithoutThesis, WorldsOfSoftStepRun) {
  disable();
  World world(scene_of(Solver::soft_step));
  EXPECT_EQ(world.step().step, 1u);
}

TEST_F(WithoutThesis, AnyNumberOfThreadsMayEnableIt) {
  disable();
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([] {
      thesis::enable();
      EXPECT_EQ(World(scene_of(Solver::worst_first)).step().step, 1u);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace jfpx
