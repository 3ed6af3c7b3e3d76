/// Keyboard and mouse controls, camera, and step clock.
#include "src/viewer/controls.hpp"

#include "src/viewer/step_clock.hpp"
#include "tests/viewer/us_keyboard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace jfpx {
namespace {

using namespace view;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A key of a US keyboard.
SDL_Event key(SDL_Keycode code, bool down = true) {
  SDL_Event event{};
  event.type = down ? SDL_KEYDOWN : SDL_KEYUP;
  event.key.keysym.sym = code;
  event.key.keysym.scancode = test::us_scancode(code);
  return event;
}
SDL_Event mouse_button(Uint32 type) {
  SDL_Event event{};
  event.type = type;
  event.button.button = SDL_BUTTON_LEFT;
  event.button.x = 40;
  event.button.y = 30;
  return event;
}
SDL_Event mouse_move(int x, int y) {
  SDL_Event event{};
  event.type = SDL_MOUSEMOTION;
  event.motion.xrel = x;
  event.motion.yrel = y;
  return event;
}
SDL_Event mouse_wheel(int y) {
  SDL_Event event{};
  event.type = SDL_MOUSEWHEEL;
  event.wheel.y = y;
  return event;
}

/// Controls of a walking camera.
Controls walking() {
  Controls controls;
  controls.orbit = false;
  return controls;
}

TEST(Controls, CommandsComeInTheOrderOfTheirKeys) {  // erratum E42: last in, first out
  Controls controls;
  for (const SDL_Keycode code : {SDLK_SPACE, SDLK_c, SDLK_F1, SDLK_PERIOD}) {
    controls.handle(key(code));
    controls.handle(key(code, false));
  }
  EXPECT_THAT(controls.take_commands(),
              ElementsAre(Command::pause, Command::contacts, Command::help, Command::step));
  EXPECT_THAT(controls.take_commands(), IsEmpty());
}

TEST(Controls, AKeyPressedAndReleasedWithinAFrameMovesOnceAndDoesNotStick) {  // erratum E42
  Controls controls = walking();
  Camera camera;
  const Vec3 start = camera.eye();
  controls.handle(key(SDLK_w));
  controls.handle(key(SDLK_w, false));
  controls.move(&camera, 0.1, 1);
  const Vec3 moved = camera.eye();
  EXPECT_LT(moved.z, start.z);
  controls.move(&camera, 0.1, 1);
  EXPECT_EQ(camera.eye(), moved);
}

TEST(Controls, EveryPossibleKeyCodeIsHarmless) {  // erratum E42: wrote past an array
  Controls controls;
  Camera camera;
  for (const SDL_Keycode code :
       {SDL_Keycode{SDLK_UNKNOWN}, -1, 0x7fffffff, -2147483647, SDL_Keycode{SDLK_SLEEP}}) {
    controls.handle(key(code));
    controls.handle(key(code, false));
  }
  controls.move(&camera, 0.1, 1);
  EXPECT_EQ(camera.eye(), Camera().eye());
  EXPECT_THAT(controls.take_commands(), IsEmpty());
}

TEST(Controls, LosingTheFocusReleasesAllKeys) {
  Controls controls;
  Camera camera;
  controls.handle(key(SDLK_d));
  controls.move(&camera, 0.01, 1);
  SDL_Event lost{};
  lost.type = SDL_WINDOWEVENT;
  lost.window.event = SDL_WINDOWEVENT_FOCUS_LOST;
  controls.handle(lost);
  const Vec3 eye = camera.eye();
  controls.move(&camera, 1, 1);
  EXPECT_EQ(camera.eye(), eye);
}

TEST(Controls, TheWalkingSpeedDependsOnWheelAndShiftButNotOnTheFrameRate) {
  const auto distance = [](int wheel, bool shift, int frames) {
    Controls controls = walking();
    Camera camera;
    controls.handle(mouse_wheel(wheel));
    controls.move(&camera, 0.1, 1);
    if (shift) controls.handle(key(SDLK_LSHIFT));
    controls.handle(key(SDLK_w));
    for (int i = 0; i < frames; ++i) controls.move(&camera, 1.0 / frames, 1);
    return length(camera.eye() - Camera().eye());
  };
  const Real usual = distance(0, false, 10);
  EXPECT_GT(usual, 1);
  EXPECT_NEAR(usual, distance(0, false, 1000), 1e-3);
  EXPECT_GT(distance(3, false, 10), usual * Real(1.9));  // 1.25^3
  EXPECT_LT(distance(-3, false, 10), usual * Real(0.6));
  EXPECT_NEAR(distance(0, true, 10) / usual, 5, 1e-3);
}

TEST(Controls, TheMouseTurnsBothAnglesAndAClickWithoutADragPicks) {  // erratum E41: pitch was lost
  Controls controls = walking();
  Camera camera;
  controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
  for (int i = 0; i < 20; ++i) {  // a slow drag is not a click
    controls.handle(mouse_move(-5, -3));
    controls.move(&camera, 0.1, 1);
  }
  controls.handle(mouse_button(SDL_MOUSEBUTTONUP));
  EXPECT_GT(camera.yaw(), 0.1);
  EXPECT_GT(camera.pitch(), 0.1);
  EXPECT_THAT(controls.take_clicks(), IsEmpty());
  controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
  controls.handle(mouse_move(1, 0));
  controls.handle(mouse_button(SDL_MOUSEBUTTONUP));
  controls.move(&camera, 0.1, 1);
  const auto clicks = controls.take_clicks();
  ASSERT_EQ(clicks.size(), 1u);
  EXPECT_EQ(clicks[0].x, 40);
  const Real yaw = camera.yaw();
  controls.handle(mouse_move(50, 50));  // without a button
  controls.move(&camera, 0.01, 1);
  EXPECT_EQ(camera.yaw(), yaw);
}

TEST(Controls, DragAndWheelOrbitTheFocus) {
  Controls controls;
  Camera camera;
  camera.look_at({0, 1, 10}, {0, 1, 0});
  controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
  controls.handle(mouse_move(80, 30));
  controls.move(&camera, 0.1, 1);
  EXPECT_GT(length(camera.eye() - Vec3{0, 1, 10}), 1);
  EXPECT_NEAR(length(camera.focus() - Vec3{0, 1, 0}), 0, 1e-4);
  const Vec3 forward = camera.forward();
  controls.handle(mouse_wheel(4));
  controls.move(&camera, 0.1, 1);
  EXPECT_LT(length(camera.eye()), 7);  // 10 * 0.88^4
  EXPECT_NEAR(length(camera.focus() - Vec3{0, 1, 0}), 0, 1e-4);
  EXPECT_NEAR(dot(camera.forward(), forward), 1, 1e-5);
  camera.zoom(0);  // does not reach the focus
  EXPECT_GT(camera.distance(), 0);
}

TEST(Controls, WalkingAndDemoKeysAreIdentifiedByTheirPosition) {
  SDL_Event event = key(SDLK_z);  // the label of W's position on a French keyboard
  event.key.keysym.scancode = SDL_SCANCODE_W;
  Controls controls = walking();
  Camera camera;
  controls.handle(event);
  controls.move(&camera, 0.1, 1);
  const Vec3 moved = camera.eye();
  EXPECT_LT(moved.z, Camera().eye().z);
  controls.set_demo_keys({"w"});  // while the key is down
  controls.move(&camera, 0.1, 1);
  EXPECT_EQ(camera.eye(), moved);
  controls.handle(event);
  const auto keys = controls.take_demo_keys();
  ASSERT_EQ(keys.size(), 1u);
  EXPECT_EQ(keys[0].name, "w");
  controls.move(&camera, 0.1, 1);
  EXPECT_EQ(camera.eye(), moved);
}

TEST(Controls, TheHelpNamesEveryKeyThatDoesSomething) {
  std::string help = " ";
  for (const KeyHelp& line : key_help()) {
    help += std::string(line.keys) + " " + std::string(line.action) + " ";
  }
  std::replace_if(
      help.begin(), help.end(), [](char c) { return c == ':' || c == ';'; }, ' ');
  std::vector<SDL_Keycode> codes;
  for (SDL_Keycode code = 1; code < 128; ++code) codes.push_back(code);
  for (int code = 0; code < SDL_NUM_SCANCODES; ++code) {
    codes.push_back(SDL_SCANCODE_TO_KEYCODE(code));
  }
  int effective = 0;
  for (const SDL_Keycode code : codes) {
    if (code == SDLK_EQUALS) continue;  // the same key as +
    Controls controls = walking();
    Camera camera;
    controls.handle(key(code));
    controls.move(&camera, 1, 1);
    if (controls.take_commands().empty() && camera == Camera()) continue;
    ++effective;
    std::string name = SDL_GetKeyName(code);
    if (name == "Escape") name = "Esc";
    if (name.starts_with("Keypad ")) name = name.back();
    EXPECT_NE(help.find(" " + name + " "), std::string::npos) << name;
  }
  EXPECT_GE(effective, 29);
}

TEST(Camera, PitchStopsBeforeTheZenith) {
  Camera camera;
  camera.turn(0, 10);
  EXPECT_EQ(camera.pitch(), Camera::kMaxPitch);
  camera.turn(0, -20);
  EXPECT_EQ(camera.pitch(), -Camera::kMaxPitch);
  camera.look_at({0, 5, 0}, {0, 0, 0});  // straight down
  const View view = camera.view({}, 1);
  EXPECT_NEAR(length(view.up), 1, 1e-5);
  EXPECT_NEAR(dot(view.up, view.forward), 0, 1e-5);
}

TEST(Camera, ClipPlanesFitScenesOfAnySize) {  // erratum E43: 1000 to 5000 m, then 1 to 100 m
  for (const Real radius : {Real(0.01), Real(1), Real(1342)}) {  // the tower is 1342 m tall
    Camera camera;
    camera.look_at({0, 0, 3 * radius}, {});
    const View view = camera.view({}, radius);
    EXPECT_LT(view.near_plane, 2 * radius);
    EXPECT_GT(view.near_plane, 0);
    EXPECT_GT(view.far_plane, 4 * radius);
    camera.look_at({0, 0, radius / 2}, {});  // inside
    EXPECT_LT(camera.view({}, radius).near_plane, radius / 100 + Real(1e-3));
  }
}

std::uint64_t steps_after(StepClock* clock, double seconds, double dt,
                          std::uint64_t max_steps = std::numeric_limits<std::uint64_t>::max()) {
  std::uint64_t steps = 0;
  clock->advance(seconds, dt, max_steps, [&steps] { ++steps; });
  return steps;
}

TEST(StepClock, StepsAreFixedWhateverTheFrameRate) {
  for (const int frames : {10, 60, 144, 1000}) {
    StepClock clock;
    std::uint64_t steps = 0;
    for (int i = 0; i < frames; ++i) steps += steps_after(&clock, 0.5 / frames, 1.0 / 64);
    EXPECT_NEAR(static_cast<double>(steps), 32, 1) << frames;
    EXPECT_GE(clock.share(), 0);
    EXPECT_LT(clock.share(), 1.0001);
  }
  StepClock clock;
  for (const double bad : {-1.0, 0.0, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(steps_after(&clock, bad, 0.01), 0u);
  }
}

TEST(StepClock, DropsStepsBeyondItsBudgetOnly) {
  StepClock clock;
  clock.budget = HUGE_VAL;
  EXPECT_EQ(steps_after(&clock, 0.25, 1.0 / 4096), 1024u);
  EXPECT_EQ(clock.kept(), 1);
  clock.budget = -1;
  EXPECT_EQ(steps_after(&clock, 1, 1.0 / 64), StepClock::kSureSteps);
  EXPECT_LT(clock.kept(), 0.5);
  EXPECT_EQ(steps_after(&clock, 1.0 / 64, 1.0 / 64), 1u);  // does not catch up
  for (int i = 0; i < 1000; ++i) steps_after(&clock, 1.0 / 64, 1.0 / 64);
  EXPECT_GT(clock.kept(), 0.999);
  EXPECT_EQ(steps_after(&clock, 0.1, 1.0 / 64, 3), 3u);
  EXPECT_EQ(steps_after(&clock, 0.1, 1.0 / 64, 0), 0u);
  EXPECT_EQ(clock.share(), 1);
}

}  // namespace
}  // namespace jfpx
