/// Camera, keys and mouse, clock and player: all of the viewer that needs no picture.
#include "src/viewer/controls.hpp"

#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>

#include "src/scenes/scenes.hpp"
#include "src/sphere_collider/cost_cache.hpp"
#include "src/viewer/comparison.hpp"
#include "src/viewer/draw_order.hpp"
#include "src/viewer/exchangeable_collider.hpp"
#include "src/viewer/forces.hpp"
#include "src/viewer/image.hpp"
#include "src/viewer/islands.hpp"
#include "src/viewer/player.hpp"
#include "src/viewer/step_clock.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/values.hpp"
#include "tests/support/seed.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/viewer/us_keyboard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <limits>
#include <random>
#include <sys/stat.h>
#include <tuple>
#include <unistd.h>

namespace jfpx {
namespace {

using namespace view;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Of a US keyboard.
SDL_Event key(SDL_Keycode code, bool down = true) {
  SDL_Event event{};
  event.type = down ? SDL_KEYDOWN : SDL_KEYUP;
  event.key.keysym.sym = code;
  event.key.keysym.scancode = test::us_scancode(code);
  return event;
}
SDL_Event mouse_button(Uint32 type, Uint8 button = SDL_BUTTON_LEFT) {
  SDL_Event event{};
  event.type = type;
  event.button.button = button;
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
  Controls controls;
  controls.orbit = false;
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
  constexpr SDL_Keycode kStrange[] = {SDLK_UNKNOWN, -1,         0x7fffffff,
                                      -2147483647,  SDLK_SLEEP, 0x40000fff};
  for (const SDL_Keycode code : kStrange) {
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
  const Vec3 there = camera.eye();
  controls.move(&camera, 1, 1);
  EXPECT_EQ(camera.eye(), there);
}

TEST(Controls, WalkingDoesNotDependOnTheFrameRate) {
  const auto walked = [](int frames) {
    Controls controls;
    controls.orbit = false;
    Camera camera;
    controls.handle(key(SDLK_w));
    for (int i = 0; i < frames; ++i) controls.move(&camera, 1.0 / frames, 1);
    return length(camera.eye() - Camera().eye());
  };
  EXPECT_GT(walked(10), 1);
  EXPECT_NEAR(walked(10), walked(1000), 1e-3);
}

TEST(Controls, TheMouseTurnsBothAnglesAndAClickWithoutADragPicks) {  // erratum E41: pitch was lost
  Controls controls;
  controls.orbit = false;
  Camera camera;
  controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
  controls.handle(mouse_move(-100, -60));
  controls.handle(mouse_button(SDL_MOUSEBUTTONUP));
  controls.move(&camera, 0.01, 1);
  EXPECT_GT(camera.yaw(), 0.1);
  EXPECT_GT(camera.pitch(), 0.1);
  EXPECT_THAT(controls.take_clicks(), IsEmpty());
  controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
  controls.handle(mouse_button(SDL_MOUSEBUTTONUP));
  const auto clicks = controls.take_clicks();
  ASSERT_EQ(clicks.size(), 1u);
  EXPECT_EQ(clicks[0].x, 40);
  // Moves of a mouse that is not held turn nothing.
  const Real yaw = camera.yaw();
  controls.handle(mouse_move(50, 50));
  controls.move(&camera, 0.01, 1);
  EXPECT_EQ(camera.yaw(), yaw);
}

TEST(Controls, ADragIsNoClickHoweverSlowItIs) {
  for (const int units : {1, 10}) {
    Controls controls;
    Camera camera;
    controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
    for (int i = 0; i < units; ++i) {
      controls.handle(mouse_move(1, 0));
      controls.move(&camera, 0.1, 1);
    }
    controls.handle(mouse_button(SDL_MOUSEBUTTONUP));
    EXPECT_EQ(controls.take_clicks().size(), units == 1 ? 1u : 0u);
  }
}

TEST(Controls, AKeyThatBecomesADemosDoesNotWalkOn) {
  Controls controls;
  controls.orbit = false;
  Camera camera;
  controls.handle(key(SDLK_w));
  controls.move(&camera, 0.1, 1);
  const Vec3 there = camera.eye();
  controls.set_demo_keys({"w"});
  controls.handle(key(SDLK_w, false));
  controls.move(&camera, 0.1, 1);
  EXPECT_EQ(camera.eye(), there);
}

TEST(Controls, WheelAndShiftChangeTheWalkingSpeed) {
  const auto walked = [](int wheel, bool shift) {
    Controls controls;
    controls.orbit = false;
    Camera camera;
    SDL_Event event{};
    event.type = SDL_MOUSEWHEEL;
    event.wheel.y = wheel;
    controls.handle(event);
    controls.move(&camera, 0.1, 1);
    if (shift) controls.handle(key(SDLK_LSHIFT));
    controls.handle(key(SDLK_w));
    controls.move(&camera, 0.1, 1);
    return length(camera.eye() - Camera().eye());
  };
  EXPECT_GT(walked(3, false), walked(0, false) * Real(1.9));  // 1.25^3
  EXPECT_LT(walked(-3, false), walked(0, false) * Real(0.6));
  EXPECT_NEAR(walked(0, true) / walked(0, false), 5, 1e-3);
}

TEST(Controls, DragAndWheelCircleTheFocusUnlessOneWalks) {
  Controls controls;
  Camera camera;
  camera.look_at({0, 0, 10}, {});
  controls.handle(mouse_button(SDL_MOUSEBUTTONDOWN));
  controls.handle(mouse_move(80, 30));
  controls.handle(mouse_button(SDL_MOUSEBUTTONUP));
  controls.move(&camera, 0.1, 1);
  EXPECT_GT(length(camera.eye() - Vec3{0, 0, 10}), 1);
  EXPECT_NEAR(length(camera.focus()), 0, 1e-4);
  SDL_Event event{};
  event.type = SDL_MOUSEWHEEL;
  event.wheel.y = 4;
  controls.handle(event);
  controls.move(&camera, 0.1, 1);
  EXPECT_LT(length(camera.eye()), 7);  // 0.88^4
  EXPECT_NEAR(length(camera.focus()), 0, 1e-4);
}

TEST(Controls, KeysToWalkAndOfDemosCountByTheirPlace) {
  SDL_Event event = key(SDLK_z);  // on a French keyboard, where a US one has W
  event.key.keysym.scancode = SDL_SCANCODE_W;
  Controls walking, flying;
  walking.orbit = false;
  Camera camera;
  walking.handle(event);
  walking.move(&camera, 0.1, 1);
  EXPECT_LT(camera.eye().z, Camera().eye().z);
  flying.set_demo_keys({"w"});
  flying.handle(event);
  const auto keys = flying.take_demo_keys();
  ASSERT_EQ(keys.size(), 1u);
  EXPECT_EQ(keys[0].name, "w");
}

TEST(Controls, TheHelpNamesEveryKeyThatDoesSomething) {
  std::string help = " ";
  for (const KeyHelp& line : key_help()) {
    help += std::string(line.keys) + " " + std::string(line.what) + " ";
  }
  std::replace_if(
      help.begin(), help.end(), [](char c) { return c == ':' || c == ';'; }, ' ');
  std::vector<SDL_Keycode> codes;
  for (SDL_Keycode code = 1; code < 128; ++code) codes.push_back(code);
  for (int code = 0; code < SDL_NUM_SCANCODES; ++code) {
    codes.push_back(SDL_SCANCODE_TO_KEYCODE(code));
  }
  int meanings = 0;
  for (const SDL_Keycode code : codes) {
    if (code == SDLK_EQUALS) continue;  // the same key as +
    Controls controls;
    controls.orbit = false;
    Camera camera;
    controls.handle(key(code));
    controls.move(&camera, 1, 1);
    if (controls.take_commands().empty() && camera == Camera()) continue;
    ++meanings;
    std::string name = SDL_GetKeyName(code);
    if (name == "Escape") name = "Esc";
    if (name.starts_with("Keypad ")) name = name.back();
    EXPECT_NE(help.find(" " + name + " "), std::string::npos) << name;
  }
  EXPECT_GE(meanings, 29);
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

TEST(Camera, OrbitKeepsTheFocusAndZoomTheDirection) {
  Camera camera;
  camera.look_at({3, 4, 12}, {0, 1, 0});
  camera.orbit(Real(0.7), Real(0.2));
  EXPECT_NEAR(length(camera.focus() - Vec3{0, 1, 0}), 0, 1e-4);
  const Vec3 forward = camera.forward();
  camera.zoom(Real(0.5));
  EXPECT_NEAR(length(camera.focus() - Vec3{0, 1, 0}), 0, 1e-4);
  EXPECT_NEAR(dot(camera.forward(), forward), 1, 1e-5);
  camera.zoom(0);  // never reaches the focus
  EXPECT_GT(camera.distance(), 0);
}

TEST(Camera, StaysBitForBitWhereNobodyMovesIt) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(-50, 50);
  const auto point = [&] { return Vec3{anywhere(random), anywhere(random), anywhere(random)}; };
  for (const bool orbit : {true, false}) {
    for (int i = 0; i < 200; ++i) {
      Controls controls;
      controls.orbit = orbit;
      Camera camera;
      camera.look_at(point(), point());
      const Camera before = camera;
      controls.move(&camera, 0.01, 1);
      ASSERT_EQ(camera, before) << i;
    }
  }
}

TEST(Camera, ProjectionAndRayAreInverses) {
  Camera camera;
  camera.look_at({3, 4, 12}, {0, 1, 0});
  const View view = camera.view({}, 5);
  for (const Vec3 point : {Vec3{0, 1, 0}, Vec3{2, -1, 3}, Vec3{-4, 3, -6}}) {
    const auto pixel = project(view, point, 640, 480);
    ASSERT_TRUE(pixel);
    const Vec3 ray = ray_through(view, pixel->x, pixel->y, 640, 480);
    EXPECT_NEAR(dot(ray, normalized(point - view.eye)), 1, 1e-5);
  }
  EXPECT_FALSE(project(view, {6, 8, 24}, 640, 480));  // behind
}

constexpr std::uint64_t kAnyNumber = std::numeric_limits<std::uint64_t>::max();

std::uint64_t steps_after(StepClock* clock, double seconds, double dt,
                          std::uint64_t most = kAnyNumber) {
  std::uint64_t steps = 0;
  clock->advance(seconds, dt, most, [&steps] { ++steps; });
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

TEST(StepClock, AMachineThatIsFastEnoughMakesAllSteps) {
  StepClock clock;
  clock.patience = HUGE_VAL;
  EXPECT_EQ(steps_after(&clock, 0.25, 1.0 / 4096), 1024u);  // far more than are sure
  EXPECT_EQ(clock.kept(), 1);
}

TEST(StepClock, WhatPatienceDoesNotSufficeForIsGivenUpAndTold) {
  StepClock clock;
  clock.patience = -1;
  EXPECT_EQ(steps_after(&clock, 1, 1.0 / 64), StepClock::kSureSteps);
  EXPECT_EQ(clock.kept(), 1.0 / 8);
  EXPECT_EQ(steps_after(&clock, 1.0 / 64, 1.0 / 64), 1u);  // no endless catching up
  for (int i = 0; i < 1000; ++i) steps_after(&clock, 1.0 / 64, 1.0 / 64);
  EXPECT_GT(clock.kept(), 0.999);
}

TEST(StepClock, MakesNoMoreStepsThanAreWanted) {
  StepClock clock;
  EXPECT_EQ(steps_after(&clock, 0.1, 1.0 / 64, 3), 3u);
  EXPECT_EQ(steps_after(&clock, 0.1, 1.0 / 64, 0), 0u);
  EXPECT_EQ(clock.share(), 1);
}

Player player_of(const Scene& scene, const EngineChoice& choice = {}) {
  return {make_run(scene, choice), scene};
}

TEST(Player, SteppingBackAndAheadShowsTheSameBits) {
  const Scene scene = scenes::make("pile", {.spheres = 40});
  Player player = player_of(scene), straight = player_of(scene);
  for (int i = 0; i < 30; ++i) player.step();
  const std::uint64_t end = state_hash(player.shown().states);
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(player.step_back());
  EXPECT_EQ(player.shown().step, 18u);
  EXPECT_NE(state_hash(player.shown().states), end);
  for (int i = 0; i < 12; ++i) player.step();
  EXPECT_EQ(state_hash(player.shown().states), end);
  for (int i = 0; i < 10; ++i) player.step();
  for (int i = 0; i < 40; ++i) straight.step();
  EXPECT_EQ(state_hash(player.shown().states), state_hash(straight.shown().states));
  while (player.step_back()) {
  }
  EXPECT_EQ(player.shown().step, 0u);
  EXPECT_FALSE(player.step_back());
}

TEST(Player, SwitchingTheBackendKeepsTheBits) {
  const Scene scene = scenes::make("pile", {.spheres = 60});
  Player straight = player_of(scene), switched = player_of(scene);
  for (int i = 0; i < 60; ++i) {
    if (i == 10) {
      EXPECT_TRUE(switched.switch_to({.backend = Backend::cpu}));
    }
    if (i == 25) {
      EXPECT_TRUE(switched.switch_to({.backend = Backend::cpu, .threads = 3}));
    }
    if (i == 40) {
      EXPECT_TRUE(switched.switch_to({}));
    }
    straight.step();
    switched.step();
    ASSERT_EQ(state_hash(straight.shown().states), state_hash(switched.shown().states)) << i;
  }
}

TEST(Player, UsesTheCostsThatWereMeasuredOnThisMachine) {
  const test::TemporaryFolder folder;
  const char* before = std::getenv("XDG_CACHE_HOME");
  const std::string kept = before != nullptr ? before : "";
  setenv("XDG_CACHE_HOME", folder.file("").c_str(), 1);
  EXPECT_EQ(collider_options({}).costs, CostModel());  // not measured yet
  CostModel costs;
  costs.x86_all_pairs.call_us = 123;
  store_costs(costs);
  EXPECT_EQ(collider_options({}).costs, costs);
  before != nullptr ? setenv("XDG_CACHE_HOME", kept.c_str(), 1) : unsetenv("XDG_CACHE_HOME");
}

TEST(Player, ABackendThatCannotBeHadLeavesTheRunAsItWas) {
  for (const BackendStatus& row : available_backends()) {
    for (const EngineKind engine : {EngineKind::native, EngineKind::bullet}) {
      if (row.usable || !has_engine(engine)) continue;
      const EngineChoice choice{.engine = engine};
      Player player = player_of(scenes::make("pile", {.spheres = 10}), choice);
      player.step();
      EXPECT_THROW(player.switch_to({.engine = engine, .backend = row.backend}),
                   BackendUnavailable);
      EXPECT_EQ(player.choice(), choice);
      player.step();
      EXPECT_EQ(player.shown().step, 2u);
    }
  }
}

TEST(Player, SettingsThatCannotBeTakenOverLeaveAllAsItWas) {
  for (const BackendStatus& row : available_backends()) {
    if (row.usable) continue;
    const test::TemporaryFolder folder;  // of a recording that another machine made
    const Scene scene = scenes::make("gas", {.spheres = 2});
    RecordingWriter(
        folder.file("a.rec"),
        {.engine = "native", .backend = std::string(to_string(row.backend)), .scene = scene})
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

TEST(Player, TellsWhoSolvedTheStep) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  const auto solved_by = [](const EngineChoice& choice) {
    Player player = player_of(scenes::make("pile", {.spheres = 60}), choice);
    for (int i = 0; i < 50; ++i) player.step();
    EXPECT_FALSE(player.shown().contacts.empty());
    return player.shown().solved_by;
  };
  EXPECT_EQ(solved_by({}), "");
  EXPECT_EQ(solved_by({.engine = EngineKind::bullet_stock}), "Bullet");
  EXPECT_EQ(solved_by({.engine = EngineKind::bullet, .jfpx_solver = false}), "Bullet");
  EXPECT_EQ(solved_by({.engine = EngineKind::bullet, .minimum_batch = 100000}), "Bullet");
  for (const BackendStatus& row : available_backends()) {
    if (!row.usable) continue;
    EXPECT_EQ(solved_by({.engine = EngineKind::bullet, .backend = row.backend}),
              to_string(row.backend));
  }
}

TEST(Player, SwitchingBulletsDispatcherKeepsTheBits) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  const Scene scene = scenes::make("pile", {.spheres = 60});
  Player stock = player_of(scene, {.engine = EngineKind::bullet_stock});
  Player switched = player_of(scene, {.engine = EngineKind::bullet_stock});
  for (int i = 0; i < 80; ++i) {
    if (i % 20 == 10) {
      EXPECT_TRUE(switched.switch_to({.engine = EngineKind::bullet}));
    }
    if (i % 20 == 0) {
      EXPECT_TRUE(switched.switch_to({.engine = EngineKind::bullet_stock}));
    }
    stock.step();
    switched.step();
    ASSERT_EQ(state_hash(stock.shown().states), state_hash(switched.shown().states)) << i;
    EXPECT_EQ(switched.shown().computed_by, i % 20 >= 10 ? "x86" : "Bullet") << i;
  }
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
    ASSERT_EQ(state_hash(stock.shown().states), state_hash(switched.shown().states)) << i;
  }
}

TEST(Player, ARecordingIsPlayedAndGoesOnLiveAndReplays) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  const Scene scene = scenes::make("gas", {.spheres = 20});
  Player live = player_of(scene);
  for (int i = 0; i < 15; ++i) live.step();
  live.save_recording(path);
  Recorded recorded = open_recording(path);
  EXPECT_EQ(recorded.scene, scene);
  Player played(std::move(recorded.run), recorded.scene);
  for (const Moment& moment : live.history()) {
    EXPECT_EQ(state_hash(played.shown().states), state_hash(moment.states)) << moment.step;
    played.step();
  }
  EXPECT_EQ(played.shown().step, 15u);  // the end stays
  EXPECT_TRUE(played.at_end());
  EXPECT_EQ(played.history().size(), 16u);
  EXPECT_TRUE(played.step_back());
  EXPECT_EQ(played.shown().step, 14u);
  EXPECT_FALSE(played.at_end());
  EXPECT_FALSE(played.switch_to({.backend = Backend::cpu}));
  played.step();
  EXPECT_EQ(played.shown().step, 16u);
  EXPECT_EQ(played.shown().computed_by, "x86");
}

TEST(Player, OnlyAWholeRunIsRecorded) {
  const test::TemporaryFolder folder;
  Player changed = player_of(scenes::make("gas", {.spheres = 1}));
  RunSettings settings = changed.settings();
  settings.resolver.max_iterations = 5;
  changed.set_settings(settings);
  EXPECT_THROW(changed.save_recording(folder.file("a.rec")), InvalidArgument);
  Player late = player_of(scenes::make("gas", {.spheres = 1}));
  for (std::size_t i = 0; i < Player::kHistoryLength + 1; ++i) late.step();
  EXPECT_THROW(late.save_recording(folder.file("a.rec")), InvalidArgument);
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Player, EachStepIsWrittenAsItIsMadeHoweverManyAreKept) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.rec");
  Player player = player_of(scenes::make("gas", {.spheres = 1}));
  player.record_to(path);
  player.step();
  player.restart();
  std::vector<std::uint64_t> hashes;
  for (std::size_t i = 0; i < Player::kHistoryLength + 1; ++i) {
    player.step();
    hashes.push_back(state_hash(player.shown().states));
    if (i == 5) player.step_back(), player.step();
  }
  player.finish_recording();
  RecordingReader recording(path);
  ASSERT_EQ(recording.steps(), hashes.size());
  for (std::size_t i = 0; i < hashes.size(); ++i) {
    ASSERT_EQ(state_hash(recording.states(i + 1)), hashes[i]) << i;
  }
}

TEST(Player, ARunWithOtherSettingsLeavesNoRecording) {
  const test::TemporaryFolder folder;
  Player player = player_of(scenes::make("gas", {.spheres = 1}));
  player.record_to(folder.file("a.rec"));
  player.step();
  RunSettings settings = player.settings();
  settings.resolver.max_iterations = 5;
  player.set_settings(settings);
  player.step();
  EXPECT_THROW(player.finish_recording(), InvalidArgument);
  EXPECT_EQ(folder.entries(), 0u);
  EXPECT_THROW(player.record_to(folder.file("missing/a.rec")), FileError);
}

TEST(Player, AnotherEngineGoesOnFromTheSameState) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  const Scene scene = scenes::make("gas", {.spheres = 27});
  Player player = player_of(scene);
  for (int i = 0; i < 20; ++i) player.step();
  const Moment before = player.shown();
  EXPECT_FALSE(player.switch_to({.engine = EngineKind::bullet}));
  player.step();
  EXPECT_EQ(player.shown().step, 21u);
  EXPECT_LT(drift(scene, before.states, player.shown().states),
            6 * 1.8 / 60);  // speeds <= 3 sqrt 3
}

TEST(Player, HistoryIsBounded) {
  Player player = player_of(scenes::make("gas", {.spheres = 1}));
  for (std::size_t i = 0; i < Player::kHistoryLength + 100; ++i) player.step();
  EXPECT_LE(player.history().size(), Player::kHistoryLength);
}

/// Balls of 2 kg in a row, the last one immovable.
Scene row_of_balls(std::size_t count) {
  Scene scene;
  BodyDef ball;
  ball.mass = 2;
  ball.acceleration = {0, -10, 0};
  scene.bodies.assign(count, ball);
  scene.bodies.back().mass = 0;
  scene.dt = Real(0.125);
  return scene;
}

TEST(Islands, HangTogetherByMovableBodiesOnly) {
  const Scene scene = row_of_balls(8);
  const auto touch = [](std::uint32_t a, std::uint32_t b) { return Contact{a, b, {}, {}}; };
  // 5-6-3 and 1-2; 0 and 4 lie on the immovable 7, which joins nothing.
  const std::vector<Contact> contacts = {touch(5, 6), touch(1, 2), touch(3, 6),
                                         touch(0, 7), touch(4, 7), touch(1, 7)};
  EXPECT_THAT(islands_of(scene, contacts), ElementsAre(0, 1, 1, 3, 4, 3, 3, 7));
  EXPECT_THAT(islands_of(scene, {}), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT(islands_of({}, {}), IsEmpty());
  const auto paints = island_paints(scene, contacts);
  EXPECT_EQ(paints[3], paints[5]);
  EXPECT_EQ(paints[0], paints[4]);  // alone: grey
  EXPECT_EQ(paints[0].r + 10, paints[0].b);
  EXPECT_NE(paints[1], paints[3]);
  EXPECT_NE(paints[1], paints[0]);
}

TEST(Islands, AreThoseOfAFloodFill) {
  const test::Seed seed;
  std::mt19937 random(seed);
  const Scene scene = row_of_balls(60);
  std::vector<Contact> contacts(random() % 80);
  std::uniform_int_distribution<std::uint32_t> any(0, 59);
  for (Contact& contact : contacts) contact.a = any(random), contact.b = any(random);
  std::vector<std::uint32_t> expected(60);
  for (std::uint32_t i = 0; i < 60; ++i) expected[i] = i;
  for (bool changed = true; changed;) {  // labels sink to the lowest neighbour's
    changed = false;
    for (const Contact& c : contacts) {
      if (c.a == 59 || c.b == 59 || expected[c.a] == expected[c.b]) continue;
      expected[c.a] = expected[c.b] = std::min(expected[c.a], expected[c.b]);
      changed = true;
    }
  }
  EXPECT_EQ(islands_of(scene, contacts), expected);
}

TEST(Forces, AreWhatGravityDoesNotExplain) {
  const Scene scene = row_of_balls(4);
  Moment before, now;
  before.states.resize(4);
  now.states = before.states;
  now.step = 1;
  now.dt = scene.dt;
  now.states[1].velocity = {0, Real(-1.25), 0};  // falls freely: 10 / 8
  now.states[2].velocity = {3, 0, 0};            // struck while it lies
  const auto forces = forces_between(scene, before, now);
  EXPECT_THAT(forces, ElementsAre(Vec3{0, 20, 0}, Vec3{}, Vec3{48, 20, 0}, Vec3{}));
  now.step = 0;
  EXPECT_THAT(forces_between(scene, before, now), ::testing::Each(Vec3{}));
}

TEST(Forces, OfABallAtRestAreItsWeightOnEveryEngine) {
  for (const EngineKind engine : {EngineKind::native, EngineKind::bullet}) {
    if (!has_engine(engine)) continue;
    Scene scene;
    BodyDef ball, ground;
    ball.shape = Sphere{1};
    ball.position = {0, 1, 0};
    ball.mass = 3;
    ball.acceleration = {0, -10, 0};
    ground.shape = HalfSpace{{0, 1, 0}, 0};
    ground.mass = 0;
    scene.bodies = {ball, ground};
    Player player = player_of(scene, {.engine = engine});
    Vec3 sum;
    constexpr int kSteps = 60;
    for (int i = 0; i < 2 * kSteps; ++i) {
      player.step();
      if (i >= kSteps) sum += forces_between(scene, player.before(), player.shown())[0];
    }
    EXPECT_NEAR(sum.y / kSteps, 30, 0.5) << kEngineNames[static_cast<std::size_t>(engine)];
  }
}

TEST(Forces, OfABallThatFallsAreNoneWhateverTheSettingsBecome) {
  Scene scene;
  BodyDef ball;
  ball.mass = 3;
  ball.acceleration = {0, -10, 0};
  scene.bodies = {ball};
  scene.dt = Real(1.0 / 64);
  Player player = player_of(scene);
  for (int i = 0; i < 2; ++i) player.step();
  RunSettings settings = player.settings();
  settings.dt = scene.dt / 4;
  player.set_settings(settings);
  EXPECT_EQ(player.shown().time, 2.0 / 64);
  const Moment last = player.shown();
  EXPECT_NEAR(length(forces_between(scene, player.before(), last)[0]), 0, 0.01);
  player.step();
  EXPECT_EQ(player.shown().time, 2.25 / 64);
  EXPECT_NEAR(length(forces_between(scene, player.before(), player.shown())[0]), 0, 0.01);
}

TEST(Forces, AreDrawnAsArrowsOfBoundedLength) {
  const Scene scene = row_of_balls(4);
  Moment before, now;
  before.states.resize(4);
  now.states = before.states;
  now.step = 1;
  now.dt = scene.dt;
  now.states[1].velocity = {0, Real(-1.25), 0};
  now.states[2].velocity = {1e6, 0, 0};
  Drawing drawing({0, 0, 10});
  draw_forces(scene, before, now, 2, &drawing);
  ASSERT_EQ(drawing.lines().size(), 6u);         // two arrows: a shaft and a head of two lines each
  EXPECT_FLOAT_EQ(drawing.lines()[0].to[1], 2);  // one weight, one unit
  EXPECT_FLOAT_EQ(drawing.lines()[3].to[0], 10);  // five units at the most
}

TEST(Comparison, FindsEveryPlantedDifference) {
  std::vector<Contact> contacts;
  for (std::uint32_t i = 0; i < 20; ++i) {
    contacts.push_back({i, i + 1, {1, 0, 0}, {Real(i), 0, 0}, Real(-0.01)});
  }
  contacts.push_back(contacts.back());  // twice the same is not the same as once
  EXPECT_THAT(different_contacts(contacts, contacts), IsEmpty());
  std::vector<Contact> reversed(contacts.rbegin(), contacts.rend());
  EXPECT_THAT(different_contacts(contacts, reversed), IsEmpty());
  std::vector<Contact> planted = contacts;
  planted[7].distance = std::nextafter(planted[7].distance, Real(0));
  EXPECT_EQ(different_contacts(contacts, planted).size(), 2u);  // one gone, one new
  planted = contacts;
  planted.pop_back();
  EXPECT_EQ(different_contacts(contacts, planted).size(), 1u);
  planted = contacts;
  planted[3].normal.y = -Real(0);  // another bit
  EXPECT_EQ(different_contacts(contacts, planted).size(), 2u);
  EXPECT_EQ(different_contacts({}, contacts).size(), 21u);
}

TEST(Comparison, EnergyIsKineticPlusPotential) {
  Scene scene;
  BodyDef ball;
  ball.shape = Sphere{2};
  ball.mass = 3;
  ball.acceleration = {0, -10, 0};
  scene.bodies = {ball};
  const BodyState state{{0, 7, 0}, {}, {4, 0, 0}, {0, 0, 5}};
  // 3 16/2 + (0.4 3 4) 25/2 + 3 10 7
  EXPECT_NEAR(energy(scene, std::vector{state}), 24 + 60 + 210, 1e-3);
  scene.bodies[0].shape = Box{{1, 2, 3}};
  // Half a turn about x swaps nothing for a spin about z: 3/3 (1 + 4) 25/2
  const BodyState turned{{0, 7, 0}, {0, 1, 0, 0}, {4, 0, 0}, {0, 0, 5}};
  EXPECT_NEAR(energy(scene, std::vector{turned}), 24 + 62.5 + 210, 1e-3);
}

TEST(Comparison, EnergyOfAnCompoundHasItsArms) {
  Scene scene;
  BodyDef dumbbell;
  dumbbell.shape = Compound{
      {{.shape = Sphere{1}, .position = {-3, 0, 0}}, {.shape = Sphere{1}, .position = {3, 0, 0}}}};
  dumbbell.mass = 2;
  dumbbell.acceleration = {};
  scene.bodies = {dumbbell};
  const BodyState state{{}, {}, {}, {0, 0, 1}};
  // Two balls of 1 kg: (0.4 + 9) 1/2 each
  EXPECT_NEAR(energy(scene, std::vector{state}), 9.4, 1e-4);
  scene.bodies[0].inertia = diagonal({1, 1, 7});
  EXPECT_NEAR(energy(scene, std::vector{state}), 3.5, 1e-4);
}

TEST(Stage, PartsOfAnCompoundAreDrawnAndPickedWhereTheyAre) {
  Scene scene;
  BodyDef body;
  body.shape = Compound{{{.shape = Sphere{1}, .position = {-3, 0, 0}},
                         {.shape = Box{{1, 1, 1}}, .position = {3, 0, 0}}}};
  body.position = {0, 5, 0};
  body.orientation = {Real(0.70710678), 0, 0, Real(0.70710678)};  // x points up
  BodyDef wall;
  wall.shape = Plane{{1, 0, 0}, -8};
  wall.mass = 0;
  scene.bodies = {body, wall};
  Moment moment;
  for (const BodyDef& def : scene.bodies) {
    moment.states.push_back({def.position, def.orientation, {}, {}});
  }
  moment.awake = {1, 1};
  const Stage stage(scene);
  EXPECT_EQ(stage.pick(moment, moment, 1, {0, 8, 20}, {0, 0, -1}), 0u);  // the box
  EXPECT_EQ(stage.pick(moment, moment, 1, {0, 2, 20}, {0, 0, -1}), 0u);  // the ball
  EXPECT_EQ(stage.pick(moment, moment, 1, {0, 5, 20}, {0, 0, -1}), std::nullopt);
  EXPECT_EQ(stage.pick(moment, moment, 1, {3, 5, 20}, {0, 0, -1}), std::nullopt);
  Drawing drawing({0, 0, 20});
  stage.draw(moment, moment, 1, Colouring::bodies, &drawing);
  ASSERT_EQ(drawing.spheres().size(), 1u);
  ASSERT_EQ(drawing.boxes().size(), 1u);
  EXPECT_NEAR(drawing.spheres()[0].centre[1], 2, 1e-4);
  EXPECT_NEAR(drawing.boxes()[0].centre[1], 8, 1e-4);
  ASSERT_GE(drawing.grounds().size(), 1u);
  EXPECT_NEAR(drawing.grounds()[0].height, 8, 1e-4);
}

TEST(DrawOrder, HasWhatIsSeenFirstFrontToBackAndLosesNothing) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(-20, 20), size(0.05f, 3);
  const auto point = [&] { return Vec3{anywhere(random), anywhere(random), anywhere(random)}; };
  const auto vec = [](const float(&c)[3]) { return Vec3{c[0], c[1], c[2]}; };
  Camera camera;
  camera.look_at(point(), point());
  const View view = camera.view({}, 20);
  constexpr int kWidth = 320, kHeight = 180;
  DrawOrder order;
  EXPECT_TRUE(order.sort({}, view, Real(1.5)).empty());
  EXPECT_EQ(order.visible(), 0u);
  for (const std::size_t count : {1u, 2u, 700u}) {
    Drawing drawing(view.eye);
    for (std::size_t i = 0; i < count; ++i) drawing.add_sphere(point(), size(random), {}, {});
    const auto key = [](const SphereItem& s) { return std::tuple(s.centre[0], s.radius); };
    const auto by_key = [&](const auto& a, const auto& b) { return key(a) < key(b); };
    const auto same = [&](const auto& a, const auto& b) { return key(a) == key(b); };
    std::vector<SphereItem> given = drawing.spheres();
    std::vector<SphereItem> ordered = order.sort(given, view, Real(kWidth) / kHeight);
    float last = 0;
    for (std::size_t i = 0; i < order.visible(); ++i) {
      const auto distance = static_cast<float>(length(vec(ordered[i].centre)));
      const float front = std::max(distance - ordered[i].radius, 0.0f);  // the eye may be inside
      EXPECT_GE(front, last - 70.0f / 2000) << i;  // 2048 shells in the diagonal of 40 m cubed
      last = std::max(last, front);
    }
    // Of what comes after no point is in the picture.
    for (std::size_t i = order.visible(); i < count; ++i) {
      for (int k = 0; k < 50; ++k) {
        const Vec3 on_it = normalized(point()) * Real(ordered[i].radius) + vec(ordered[i].centre);
        const auto pixel = project(view, view.eye + on_it, kWidth, kHeight);
        const bool seen =
            pixel && pixel->x > 0 && pixel->x < kWidth && pixel->y > 0 && pixel->y < kHeight;
        EXPECT_FALSE(seen) << i;
      }
    }
    std::sort(given.begin(), given.end(), by_key);
    std::sort(ordered.begin(), ordered.end(), by_key);
    EXPECT_TRUE(std::equal(given.begin(), given.end(), ordered.begin(), ordered.end(), same));
    // A picture of 41 by 23 degrees shows a small part of what is all around.
    EXPECT_LE(order.visible(), std::max<std::size_t>(count * 3 / 4, 2));
  }
}

TEST(Image, WhatCannotBeWrittenIsToldWithTheReasonAndLeavesNothing) {
  const test::TemporaryFolder folder;
  const Image image{1, 1, {1, 2, 3}};
  std::filesystem::create_directory(folder.file("taken.png"));
  for (const char* name : {"taken.png", "missing/a.png"}) {
    try {
      write_png(image, folder.file(name));
      FAIL() << name;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), ::testing::MatchesRegex(".*: can't be written: .*irectory.*"));
    }
  }
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(Image, WhatIsNoFileIsWrittenToAndStays) {
  const test::TemporaryFolder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);  // so that writers need not wait
  require_writable(pipe);
  write_png({1, 1, {1, 2, 3}}, pipe);
  char magic[4] = {};
  EXPECT_EQ(read(reader, magic, sizeof magic), 4);
  EXPECT_EQ(std::string(magic + 1, 3), "PNG");
  close(reader);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(Stage, DrawsWhatLeftTheFiniteNumbersAmongTheRest) {
  const Scene scene = scenes::make("lattice", {.spheres = 64});
  Moment moment = make_run(scene, {})->moment();
  const Stage stage(scene);
  const Bounds before = stage.bounds(moment.states);
  const auto lose = [&moment](std::size_t i, Real value) {
    moment.states[i].position = moment.states[i].velocity = {value, value, value};
  };
  DrawOrder order;
  const auto visible = [&](Colouring colouring) {
    const Bounds bounds = stage.bounds(moment.states);
    EXPECT_TRUE(std::isfinite(bounds.radius));
    Camera camera;
    camera.look_at(before.centre + Vec3{0, 0, before.radius * 4}, before.centre);
    const View view = camera.view(bounds.centre, bounds.radius);
    Drawing drawing(view.eye);
    stage.draw(moment, moment, 1, colouring, &drawing);
    EXPECT_EQ(order.sort(drawing.spheres(), view, 1).size(), 64u);
    return order.visible();
  };
  ASSERT_EQ(visible(Colouring::speed), 64u);
  std::size_t body = 0;
  while (!(scene.bodies[body].mass > 0)) ++body;
  lose(body, std::numeric_limits<Real>::quiet_NaN());
  lose(body + 1, std::numeric_limits<Real>::infinity());
  lose(body + 2, -std::numeric_limits<Real>::infinity());
  EXPECT_EQ(visible(Colouring::speed), 61u);
  EXPECT_EQ(visible(Colouring::islands), 61u);
  for (std::size_t i = 0; i < moment.states.size(); ++i) {
    lose(i, std::numeric_limits<Real>::quiet_NaN());
  }
  EXPECT_EQ(visible(Colouring::speed), 0u);
}

TEST(Stage, PickFindsTheNearestMovableBody) {
  Scene scene;
  const auto add = [&scene](Shape shape, const Vec3& at, Real mass) {
    BodyDef body;
    body.shape = shape;
    body.position = at;
    body.mass = mass;
    scene.bodies.push_back(body);
  };
  add(Sphere{1}, {0, 0, 4}, 0);  // immovable, in front
  add(Sphere{1}, {0, 0, -3}, 1);
  add(Box{{1, 1, 1}}, {0, 0, 0}, 1);
  add(Sphere{1}, {5, 0, 0}, 1);
  Moment moment;
  for (const BodyDef& body : scene.bodies) moment.states.push_back({body.position, {}, {}, {}});
  moment.awake.assign(4, 1);
  const Stage stage(scene);
  EXPECT_EQ(stage.pick(moment, moment, 1, {0, 0, 10}, {0, 0, -1}), 2u);
  EXPECT_EQ(stage.pick(moment, moment, 1, {0, 0, -10}, {0, 0, 1}), 1u);
  EXPECT_EQ(stage.pick(moment, moment, 1, {5, Real(0.99), 10}, {0, 0, -1}), 3u);
  EXPECT_EQ(stage.pick(moment, moment, 1, {5, Real(1.01), 10}, {0, 0, -1}), std::nullopt);
  EXPECT_EQ(stage.pick(moment, moment, 1, {0, 0, 10}, {0, 0, 1}), std::nullopt);  // all behind
}

TEST(Stage, DrawsBodiesBetweenTwoStepsAndSleepersDarker) {
  const Scene scene = row_of_balls(3);
  Moment from, to;
  from.states.resize(3);
  from.awake.assign(3, 1);
  to = from;
  from.states[0].position = {1, 2, 3};
  to.states[0].position = {2, 4, 3};
  to.states[0].orientation = {0, 0, 1, 0};  // half a turn about y
  to.awake[1] = 0;
  Drawing drawing({});
  Stage(scene).draw(from, to, Real(0.25), Colouring::bodies, &drawing);
  ASSERT_EQ(drawing.spheres().size(), 3u);
  const SphereItem& moving = drawing.spheres()[0];
  EXPECT_THAT(moving.centre, ElementsAre(1.25f, 2.5f, 3.0f));
  // (3/4, 0, 1/4, 0), made a unit quaternion
  EXPECT_NEAR(moving.turn[1], 1 / std::sqrt(10.0), 1e-6);
  EXPECT_NEAR(moving.turn[3], 3 / std::sqrt(10.0), 1e-6);
  Drawing awake({});
  Stage(scene).draw(from, from, 1, Colouring::bodies, &awake);
  EXPECT_LT(drawing.spheres()[1].paint.r, awake.spheres()[1].paint.r);
  EXPECT_EQ(drawing.spheres()[0].paint, awake.spheres()[0].paint);
}

TEST(Stage, BodiesArePickedAndMarkedWhereTheyAreDrawn) {
  const Scene scene = row_of_balls(2);
  Moment from, to;
  from.states.resize(2);
  from.awake.assign(2, 1);
  to = from;
  to.states[0].position = {8, 0, 0};
  const Stage stage(scene);
  EXPECT_EQ(stage.pick(from, to, Real(0.25), {2, 0, 10}, {0, 0, -1}), 0u);
  EXPECT_EQ(stage.pick(from, to, Real(0.25), {8, 0, 10}, {0, 0, -1}), std::nullopt);
  Drawing drawing({});
  stage.draw_mark(from, to, Real(0.25), 0, &drawing);
  ASSERT_EQ(drawing.lines().size(), 12u);
  for (const LineItem& line : drawing.lines()) EXPECT_NEAR(line.from[0], 2, 1);
}

TEST(Stage, DifferentContactsAreRedAndWiderThanOthers) {
  const Scene scene = row_of_balls(3);
  const std::vector<Contact> contacts = {{0, 1, {1, 0, 0}, {1, 2, 3}, Real(-0.1)},
                                         {0, 2, {1, 0, 0}, {4, 5, 6}, Real(-0.1)}};
  Drawing usual({}), faults({});
  Stage(scene).draw_contacts(contacts, false, &usual);
  Stage(scene).draw_contacts(contacts, true, &faults);
  ASSERT_EQ(usual.lines().size(), 4u);  // of each contact its normal and its point
  ASSERT_EQ(faults.lines().size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(faults.lines()[i].width, usual.lines()[i].width);
    EXPECT_GT(faults.lines()[i].rgba[0], 4 * faults.lines()[i].rgba[1]);
    EXPECT_GT(usual.lines()[i].rgba[1], 100);  // green, or orange against what stands still
  }
}

TEST(Stage, BoundsLeaveOutTheOneThatFlewAway) {
  Scene scene = scenes::make("lattice", {.spheres = 1000});
  std::vector<BodyState> states;
  for (const BodyDef& body : scene.bodies) states.push_back({body.position, {}, {}, {}});
  const Real usual = bounds_of(scene, states).radius;
  states[17].position = {1e6, 0, 0};
  EXPECT_LT(bounds_of(scene, states).radius, usual * Real(1.1));
  EXPECT_GT(bounds_of(Scene{}, {}).radius, 0);
}

TEST(Stage, WallsOfLargeRoomsAreGlassAndTheRoomIsSeenWhole) {
  const Scene scene = scenes::make("gas", {.spheres = 30000});
  Moment moment;
  for (const BodyDef& body : scene.bodies) moment.states.push_back({body.position, {}, {}, {}});
  moment.awake.assign(scene.bodies.size(), 1);
  Drawing drawing({0, 0, 1000});
  Stage(scene).draw(moment, moment, 1, Colouring::bodies, &drawing);
  EXPECT_EQ(drawing.glass().size(), 5u);
  EXPECT_EQ(drawing.boxes().size(), 1u);  // the floor
}

/// A ball and immovable boxes, each where the list says and as large.
Scene ball_among(const Vec3& ball, const std::vector<std::pair<Vec3, Vec3>>& boxes) {
  Scene scene;
  BodyDef body;
  body.shape = Sphere{Real(0.5)};
  body.position = ball;
  body.mass = 1;
  scene.bodies = {body};
  for (const auto& [position, half] : boxes) {
    body.shape = Box{half};
    body.position = position;
    body.mass = 0;
    scene.bodies.push_back(body);
  }
  return scene;
}

Moment moment_of(const Scene& scene) {
  Moment moment;
  for (const BodyDef& body : scene.bodies) moment.states.push_back({body.position, {}, {}, {}});
  moment.awake.assign(scene.bodies.size(), 1);
  return moment;
}

/// Where boxes end above and below, in the order in which they are drawn.
std::vector<float> heights(const std::vector<BoxItem>& boxes, float side) {
  std::vector<float> heights;
  for (const BoxItem& box : boxes) heights.push_back(box.centre[1] + side * box.half_extents[1]);
  return heights;
}

TEST(Stage, EachStepOfAStairHasItsOwnHeight) {
  const Vec3 half{1, Real(0.25), 1};
  const Scene scene =
      ball_among({0, 1, 0}, {{{0, 0, 0}, half}, {{2, Real(-0.5), 0}, half}, {{4, -1, 0}, half}});
  const Moment moment = moment_of(scene);
  Drawing drawing({});
  Stage(scene).draw(moment, moment, 1, Colouring::bodies, &drawing);
  EXPECT_THAT(heights(drawing.boxes(), 1), ::testing::UnorderedElementsAre(0.25f, -0.25f, -0.75f));
  EXPECT_THAT(drawing.glass(), IsEmpty());
  const std::vector<float> below = heights(drawing.boxes(), -1);
  ASSERT_EQ(drawing.grounds().size(), 1u);  // seen from the origin
  EXPECT_LE(-drawing.grounds()[0].height, *std::min_element(below.begin(), below.end()));
}

TEST(Stage, OfFloorsOneAboveAnotherTheLargestIsTheRooms) {
  const Scene scene =
      ball_among({0, 5, 0}, {{{0, 3, 0}, {1, Real(0.25), 1}}, {{0, 0, 0}, {9, Real(0.5), 9}}});
  const Moment moment = moment_of(scene);
  Drawing drawing({});
  Stage(scene).draw(moment, moment, 1, Colouring::bodies, &drawing);
  EXPECT_THAT(heights(drawing.boxes(), 1), ::testing::UnorderedElementsAre(3.25f, 0.5f));
}

TEST(Stage, AWallStaysWhereItIsWhenTheCrowdHasPassedIt) {
  const Scene scene =
      ball_among({0, 2, 0}, {{{0, 0, 0}, {4, Real(0.5), 4}}, {{4, 3, 0}, {Real(0.25), 3, 4}}});
  const Stage stage(scene);
  const auto drawn = [&](const Vec3& ball) {
    Moment moment = moment_of(scene);
    moment.states[0].position = ball;
    Drawing drawing({});
    stage.draw(moment, moment, 1, Colouring::bodies, &drawing);
    EXPECT_EQ(drawing.boxes().size(), 1u);
    EXPECT_EQ(drawing.glass().size(), 1u);
    return std::pair(drawing.boxes().at(0).centre[1], drawing.glass().at(0).centre[0]);
  };
  const auto before = drawn({0, 2, 0});
  EXPECT_EQ(before.first, 0.5f - 0.0625f);  // half of a plate of an eighth of a metre
  EXPECT_EQ(before.second, 3.75f);
  EXPECT_EQ(drawn({0, -20, 0}), before);
  EXPECT_EQ(drawn({20, 2, 0}), before);
}

TEST(Timing, MedianOfNoneOddAndEven) {
  EXPECT_EQ(median({}), 0);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
}

}  // namespace
}  // namespace jfpx
