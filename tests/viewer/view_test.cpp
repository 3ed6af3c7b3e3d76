/// The program jfpx-view: pictures, exit statuses and errors.
#include "src/viewer/image.hpp"
#include "src/viewer/window.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace jfpx {
namespace {

using ::testing::HasSubstr;

constexpr const char* kOwnPrecision = sizeof(Real) == 4 ? "float" : "double";
constexpr const char* kOtherPrecision = sizeof(Real) == 4 ? "double" : "float";

/// Runs the program; its output includes stderr.
test::ProcessResult jfpx_view(const std::string& arguments, const std::string& environment = "") {
  return test::run_process(environment + " " JFPX_VIEW_PATH " " + arguments + " 2>&1");
}

/// Expects the status and a single message.
void expect_fails(const test::ProcessResult& result, int status, const std::string& message) {
  EXPECT_EQ(result.status, status) << result.output;
  EXPECT_THAT(result.output, HasSubstr(message));
  EXPECT_THAT(result.output, ::testing::StartsWith("jfpx-view: "));
}

/// Range of the green values.
int contrast(const view::Image& image) {
  int low = 255, high = 0;
  for (std::size_t i = 1; i < image.rgb.size(); i += 3) {
    low = std::min<int>(low, image.rgb[i]);
    high = std::max<int>(high, image.rgb[i]);
  }
  return high - low;
}

class Pictures : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto probe = jfpx_view("pile --spheres 0 --headless --frames 0 --size 16x16");
    if (probe.status == 3) GTEST_SKIP() << probe.output;
    ASSERT_EQ(probe.status, 0) << probe.output;
  }
  test::TemporaryFolder folder;

  view::Image take(const std::string& arguments) {
    const std::string path = folder.file("picture.png");
    const auto result =
        jfpx_view(arguments + " --headless --size 160x120 --quality low --screenshot " + path);
    EXPECT_EQ(result.status, 0) << result.output;
    return view::read_png(path);
  }
};

TEST_F(Pictures, OfEveryNamedSceneAreNotBlank) {
  for (const char* scene :
       {"boxes-and-balls", "pile", "gas", "columns", "overlap", "lattice", "polydisperse"}) {
    const view::Image image = take(std::string(scene) + " --spheres 27 --frames 5");
    EXPECT_EQ(image.width, 160);
    EXPECT_EQ(image.height, 120);
    EXPECT_GT(contrast(image), 80) << scene;
  }
}

TEST_F(Pictures, DependOnTimeAndOptionsOnly) {
  const std::string scene = "pile --spheres 60 --frames 60";
  const auto plain = take(scene);
  EXPECT_EQ(plain.rgb, take(scene).rgb);
  EXPECT_NE(plain.rgb, take("pile --spheres 60 --frames 10").rgb);
  for (const char* option :
       {" --colours islands", " --colours speed", " --colours sleep", " --colours penetration",
        " --colours contacts", " --forces", " --contacts"}) {
    EXPECT_NE(take(scene + option).rgb, plain.rgb) << option;
  }
  EXPECT_LT(take(scene + " --panel").at(20, 60)[0], 90) << "the panel is dark";
}

TEST_F(Pictures, SideBySideFindsNoDifference) {
  if (!JFPX_HAS_BULLET) GTEST_SKIP() << "built without Bullet";
  const auto result = jfpx_view(
      "--side-by-side pile --spheres 60 --frames 60 --headless --size 300x150 --quality low "
      "--screenshot " +
      folder.file("three.png"));
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("0 different contacts"));
  EXPECT_THAT(result.output, HasSubstr("worlds identical"));
  EXPECT_THAT(result.output, HasSubstr(" 0 mismatches"));
  // Below the titles the two pictures of Bullet are equal, and the native one differs.
  const auto image = view::read_png(folder.file("three.png"));
  int same = 0, other = 0;
  for (int y = 50; y < 100; ++y) {
    for (int x = 2; x < 98; ++x) {
      same += std::equal(image.at(100 + x, y), image.at(100 + x, y) + 3, image.at(200 + x, y));
      other += std::equal(image.at(x, y), image.at(x, y) + 3, image.at(100 + x, y));
    }
  }
  EXPECT_EQ(same, 50 * 96);
  EXPECT_LT(other, 50 * 96);
}

TEST_F(Pictures, ARunEndsNormallyWhenItIsTerminated) {
  for (const auto& [kind, signal] : {std::pair<std::string, std::string>{"", "TERM"},
                                     {"--headless --frames 100000000", "TERM"},
                                     {"--headless --frames 100000000", "HUP"}}) {
    const std::string film = folder.file(kind.empty() ? "window" : "headless" + signal);
    // Sends the signal when the second picture exists; the last line is the status of the program.
    const auto result = test::run_process(
        "SDL_VIDEODRIVER=offscreen " JFPX_VIEW_PATH
        " pile --spheres 400 --size 160x120 --quality low --screenshot " +
        film + ".png --pictures " + film + " " + kind + " 2>&1 & until [ -e " + film +
        "/frame-000002.png ] || ! kill -0 $!; do sleep 0.05; done; "
        "kill -" +
        signal + " $!; wait $!; echo status $?");
    EXPECT_THAT(result.output, HasSubstr("status 0"));
    EXPECT_THAT(result.output, HasSubstr("rendering on"));
    EXPECT_THAT(result.output, HasSubstr("engine native"));
    EXPECT_GT(contrast(view::read_png(film + ".png")), 80);
  }
}

TEST_F(Pictures, ALostContextIsStatusThreeAndLeavesCompletePictures) {
  {
    const auto window = view::Window::hidden();
    if (!window.reports_resets()) GTEST_SKIP() << window.driver() << " can't report resets";
  }
  // The status is queried after drawing a picture and after reading it; in a window, where drawing
  // may be asynchronous, after reading and after presenting it.
  for (const std::string kind : {"--headless", ""}) {
    for (const int healthy : {0, 1, 2, 3, 5}) {
      const std::string folder_name = folder.file("film" + kind + std::to_string(healthy));
      const auto result =
          jfpx_view("pile --spheres 5 --size 64x48 --quality low --frames 100 --screenshot " +
                        folder.file("last.png") + " --pictures " + folder_name + " " + kind,
                    "SDL_VIDEODRIVER=offscreen JFPX_TEST_HEALTHY=" + std::to_string(healthy) +
                        " LD_PRELOAD=" JFPX_LOST_CONTEXT_PATH);
      EXPECT_EQ(result.status, 3);
      EXPECT_EQ(result.output,
                "jfpx-view: OpenGL lost its context: the graphics device was reset\n");
      const int pictures = kind.empty() ? (healthy + 1) / 2 : healthy / 2;
      for (int i = 1; i <= pictures + 1; ++i) {
        const std::string name = folder_name + "/frame-00000" + std::to_string(i) + ".png";
        ASSERT_EQ(std::filesystem::exists(name), i <= pictures) << name;
        if (i > pictures) break;
        EXPECT_GT(contrast(view::read_png(name)), 40);
      }
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("last.png")));
}

TEST_F(Pictures, AnUnsupportedOpenGlIsStatusThree) {
  // A video driver without OpenGL.
  expect_fails(jfpx_view("pile --spheres 2 --headless", "SDL_VIDEODRIVER=dummy"), 3, "OpenGL");
  {
    const view::Window window = view::Window::hidden();
    const std::string driver = reinterpret_cast<const char*>(glGetString(GL_VERSION));
    if (driver.find("Mesa") == std::string::npos) GTEST_SKIP() << driver << " has no override";
  }
  expect_fails(jfpx_view("pile --spheres 2 --headless", "MESA_GL_VERSION_OVERRIDE=3.2"), 3,
               "OpenGL 3.3");
}

TEST_F(Pictures, AFileThatCannotBeWrittenIsNamedAndNothingIsLeft) {
  expect_fails(jfpx_view("pile --spheres 2 --headless --frames 1 --size 32x32 --screenshot " +
                         folder.file("no/such/folder.png")),
               2, "no/such/folder.png");
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(View, RunsWithoutRenderingForTiming) {
  const auto result = jfpx_view("pile --spheres 20 --frames 10 --no-render", "env -u DISPLAY");
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("10 steps"));
  EXPECT_THAT(result.output, HasSubstr("rendering off"));
}

TEST(View, ARunWithoutRenderingEndsNormallyBySignals) {
  for (const char* signal : {"INT", "TERM", "HUP"}) {
    const test::TemporaryFolder folder;
    const auto result = test::run_process(
        "timeout --foreground --preserve-status -s " + std::string(signal) +
        " 0.5 " JFPX_VIEW_PATH " gas --spheres 9 --frames 1000000000 --no-render --record " +
        folder.file("a.rec") + " 2>&1");
    EXPECT_EQ(result.status, 0) << result.output;
    EXPECT_EQ(folder.entries(), 1u);
    EXPECT_EQ(test::run_process(JFPX_TOOL_PATH " replay --quiet " + folder.file("a.rec")).status,
              0);
  }
}

TEST(View, StatesAreRecordedAndPlayedBack) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("gas.rec");
  const auto recorded = jfpx_view("gas --spheres 9 --frames 7 --no-render --record " + path);
  EXPECT_EQ(recorded.status, 0) << recorded.output;
  const std::string again = folder.file("again.rec");
  const auto played = jfpx_view(path + " --frames 70 --no-render --recording " + again);
  EXPECT_EQ(played.status, 0) << played.output;
  EXPECT_THAT(played.output, HasSubstr("step 7,"));
  EXPECT_THAT(played.output, HasSubstr("7 steps,"));
  const auto replayed = test::run_process(JFPX_TOOL_PATH " replay " + again + " 2>&1");
  EXPECT_EQ(replayed.status, 0) << replayed.output;
  for (const char* change : {" --spheres 5", " --boxes 1", " --dt 0.01", " --seed 2", " --no-sleep",
                             " --resolver worst-first", " --substeps 2", " --engine bullet",
                             " --backend x86", " --threads 3", " --side-by-side"}) {
    expect_fails(jfpx_view(path + change + " --no-render"), 2, "is a recording");
  }
  std::ofstream(path, std::ios::app) << "more";
  expect_fails(jfpx_view(path + " --no-render"), 2, path);
  expect_fails(jfpx_view("flight --frames 2 --no-render --recording " + path), 2,
               "can be recorded");
}

TEST(View, ARecordingIsPlayedInThePrecisionInWhichItWasMade) {
  if (!JFPX_HAS_BOTH_PRECISIONS) GTEST_SKIP() << "built in one precision";
  const test::TemporaryFolder folder;
  const std::string path = folder.file("gas.rec");
  const auto recorded =
      jfpx_view(std::string("gas --spheres 9 --frames 7 --no-render --precision ") +
                kOtherPrecision + " --recording " + path);
  ASSERT_EQ(recorded.status, 0) << recorded.output;
  const auto played = jfpx_view(path + " --no-render");
  EXPECT_EQ(played.status, 0) << played.output;
  EXPECT_THAT(played.output, HasSubstr("step 7,"));
  expect_fails(jfpx_view(path + " --no-render --precision " + kOwnPrecision), 2, kOtherPrecision);
}

TEST(View, PrintsTheSameHashAsTheTool) {
  for (const std::string parts : {"native", "native --threads 3", "native --resolver worst-first",
                                  "bullet", "bullet --solver stock", "bullet --world stock"}) {
    if (!JFPX_HAS_BULLET && parts.starts_with("bullet")) continue;
    const std::string run = " pile --spheres 40 --engine " + parts;
    const auto ran = test::run_process(JFPX_TOOL_PATH " run" + run + " --steps 30 --hash --quiet");
    ASSERT_EQ(ran.status, 0) << ran.output;
    EXPECT_THAT(jfpx_view(run + " --frames 30 --no-render").output,
                HasSubstr("hash " + ran.output.substr(0, 16)));
  }
}

TEST(View, BadUsageIsStatusTwo) {
  expect_fails(jfpx_view("plie --headless"), 2, "there is no scene called \"plie\"");
  expect_fails(jfpx_view("missing.json --headless"), 2, "missing.json: can't be opened");
  expect_fails(jfpx_view("pile --headless --spheres 4 --eye 1,2,3"), 2, "--target");
  expect_fails(jfpx_view("pile --headless --eye 1,2,3 --target 1,2,3"), 2, "same point");
  expect_fails(jfpx_view("pile --no-render --screenshot a.png"), 2, "--no-render");
  expect_fails(jfpx_view("flight --no-render --no-sleep"), 2, "--no-sleep requires a scene");
  expect_fails(jfpx_view("flight --no-render --substeps 2"), 2, "--substeps requires a scene");
  expect_fails(jfpx_view("flight --no-render --colours speed"), 2, "--colours requires a scene");
  expect_fails(jfpx_view("--side-by-side pile --no-render --engine bullet"), 2, "all engines");
  for (const char* bad :
       {"--size 0x0", "--size 15x100", "--size 100x9000", "--size 100", "--size x",
        "--size 1e3x100", "--size -5x100", "--eye 1,2 --target 0,0,0",
        "--eye nan,2,3 --target 0,0,0", "--colours mood", "--frames -1", "--solver mine"}) {
    EXPECT_EQ(jfpx_view(std::string("pile --headless ") + bad).status, 2) << bad;
  }
  const test::TemporaryFolder folder;
  const std::string path = folder.file("broken.json");
  std::ofstream(path) << "{\"jfpx_scene\": 1, \"bodies\": [";
  expect_fails(jfpx_view(path + " --headless"), 2, path);
}

TEST(View, NoDisplayIsStatusThree) {
  const std::string none = "env -u DISPLAY -u WAYLAND_DISPLAY ";
  expect_fails(jfpx_view("pile --spheres 2", none + "SDL_VIDEODRIVER=x11"), 3, "display");
  // SDL's last resort shows nothing. Without the folder, the library of Wayland prints a line, too.
  expect_fails(jfpx_view("pile --spheres 2 --frames 1",
                         none + "-u SDL_VIDEODRIVER XDG_RUNTIME_DIR=/nowhere"),
               3, "found no display; --headless");
}

TEST(View, HelpNamesTheOptionsAndExitStatuses) {
  const auto help = jfpx_view("--help");
  EXPECT_EQ(help.status, 0);
  for (const char* word : {"recording (.rec)", "--headless", "--screenshot", "--side-by-side",
                           "--engine", "--precision", "Exit status"}) {
    EXPECT_THAT(help.output, HasSubstr(word));
  }
  EXPECT_EQ(jfpx_view("--version").output, "jfpx-view " JFPX_VERSION "\n");
}

}  // namespace
}  // namespace jfpx
