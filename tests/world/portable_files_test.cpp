/// Files are portable: x86-64 and ARM64 write the same bytes, and each reads what the other wrote.
/// The committed files are those of both.
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/snapshot.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

constexpr int kSteps = 8, kMoreSteps = 60;

std::string committed(const std::string& kind) {
  return JFPX_FILES + std::string("mixed-") + (sizeof(Real) == 4 ? "float." : "double.") + kind;
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Balls and boxes that roll and collide in a pit, all of them with odd numbers.
Scene scene() {
  Scene scene = scenes::make("mixed", {.spheres = 4, .boxes = 4, .seed = 3});
  scene.dt = 1 / 30._r;
  scene.bodies.front().user_data = 0x123456789abcdef0u;
  return scene;
}

class PortableFiles : public ::testing::Test {
 protected:
  /// Writes a scene, a recording with calls, and a snapshot after it.
  PortableFiles() {
    save_scene(scene(), path("json"));
    RecordedWorld recorded(path("rec"), scene(), {.collider = {.backend = Backend::cpu}});
    const BodyId ball = recorded.world().bodies().front();
    for (int step = 0; step < kSteps; ++step) {
      if (step == 2) recorded.add_force(Drag{.linear = 0.3_r, .wind = {1 / 3._r, 0, 0}});
      if (step == 3) recorded.apply_force(ball, {0, 700, 0.1_r});
      recorded.step();
    }
    recorded.finish();
    snapshot_ = recorded.world().snapshot();
    save_snapshot(snapshot_, path("snap"));
  }
  std::string path(const std::string& kind) const { return folder_.file("mixed." + kind); }

  TemporaryFolder folder_;
  Snapshot snapshot_;
};

TEST_F(PortableFiles, HaveTheSameBytesOnX86AndArm) {
  for (const char* kind : {"json", "rec", "snap"}) {
    // JFPX_WRITE_FILES=1 renews the files after a change of the format or of the bits of a step.
    if (std::getenv("JFPX_WRITE_FILES") != nullptr) {
      std::filesystem::copy_file(path(kind), committed(kind),
                                 std::filesystem::copy_options::overwrite_existing);
    }
    EXPECT_TRUE(content(path(kind)) == content(committed(kind))) << committed(kind);
  }
}

TEST_F(PortableFiles, AreReadOnTheOtherArchitecture) {
  EXPECT_TRUE(load_scene(committed("json")) == scene());

  RecordingReader reader(committed("rec"));
  World world(reader.header().scene);
  ASSERT_EQ(reader.steps(), std::uint64_t{kSteps});
  for (std::uint64_t step = 1; step <= reader.steps(); ++step) {
    repeat_calls(reader, step, world);
    world.step();
    EXPECT_FALSE(first_difference(reader.states(step), world.states())) << "step " << step;
  }

  World restored(scene());
  restored.restore(load_snapshot(committed("snap")));
  EXPECT_EQ(restored.snapshot(), snapshot_);
  for (int step = 0; step < kMoreSteps; ++step) {
    world.step();
    restored.step();
  }
  EXPECT_EQ(restored.state_hash(), world.state_hash());
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
