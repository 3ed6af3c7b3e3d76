/// The panel, operated by clicks at the positions of its widgets.
#include <jfpx/recording.hpp>

#include "src/scenes/scenes.hpp"
#include "src/viewer/demo_viewer.hpp"
#include "src/viewer/scene_viewer.hpp"
#include "tests/viewer/row_of_balls.hpp"
#include "tests/viewer/user.hpp"
#include "tests/viewer/window_fixture.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace jfpx {
namespace {

using namespace view;
using test::kRowSize;
using ::testing::ElementsAre;
using ::testing::StartsWith;
namespace fs = std::filesystem;

constexpr double kStep = 1.0 / 60;  // [s], the dt of all scenes here

ViewOptions options_for(const std::string& scene) {
  ViewOptions options;
  options.run.scene = scene;
  options.run.spheres = 30;
  options.size = {360, 760};  // little more than the panel
  options.quality = test::kSketch;
  return options;
}
ViewOptions worst_first(ViewOptions options) {
  options.run.resolver = Solver::worst_first;
  return options;
}
ViewOptions paused(ViewOptions options) {
  options.paused = true;
  return options;
}

class Panel : public test::WindowTest {
 protected:
  static const SceneViewer& scene(test::User& user) {
    return dynamic_cast<const SceneViewer&>(user.viewer());
  }
  static const Player& player(test::User& user) { return scene(user).player(); }
  static std::uint64_t hash(test::User& user) { return state_hash(player(user).shown().states); }
};

TEST_F(Panel, ControlsRunPauseStepRestartAndSetTheSpeed) {
  test::User user(options_for("pile"));
  user.click("Pause");
  EXPECT_TRUE(user.viewer().paused);
  EXPECT_FALSE(user.sees("Pause"));
  user.click("Restart");
  const std::uint64_t start = hash(user);
  user.frame(10 * kStep);
  EXPECT_EQ(user.viewer().steps(), 0u);
  user.click("Step");
  EXPECT_EQ(user.viewer().steps(), 1u);
  EXPECT_TRUE(user.reads("step 1, 0.02 s"));
  EXPECT_NE(hash(user), start);
  user.click("Step");
  const std::uint64_t later = hash(user);
  user.click("Back");
  EXPECT_TRUE(user.reads("step 1, 0.02 s  (history)"));
  user.click("Back");
  EXPECT_EQ(hash(user), start);
  user.click("Back");  // there is no earlier step
  EXPECT_EQ(hash(user), start);
  for (int i = 0; i < 4; ++i) user.click("Step");
  user.click("Restart");
  EXPECT_EQ(user.viewer().steps(), 0u);
  EXPECT_EQ(hash(user), start);
  for (int i = 0; i < 2; ++i) user.click("Step");
  EXPECT_EQ(hash(user), later);
  user.click("Run");
  EXPECT_FALSE(user.viewer().paused);
  user.frame(3.5 * kStep);
  EXPECT_EQ(user.viewer().steps(), 5u);
  user.drag_in("speed", 0.5, 1);
  EXPECT_EQ(user.viewer().speed, 4);
  user.frame(1.1 * kStep);
  EXPECT_EQ(user.viewer().steps(), 9u);  // 4.9 more steps are due
}

TEST_F(Panel, ABackendIsExchangedWithoutChangingABit) {
  const ViewOptions options = options_for("pile");
  test::User user(paused(options));
  Player straight(make_run(tool::load(options.run), {}), tool::load(options.run));
  for (const BackendStatus& row : available_backends()) {
    const std::uint64_t before = hash(user);
    const EngineChoice choice = player(user).choice();
    const std::string backend(to_string(row.backend));
    user.click(backend);
    EXPECT_EQ(hash(user), before);
    EXPECT_EQ(player(user).choice().backend, row.usable ? row.backend : choice.backend);
    EXPECT_EQ(user.value(backend), row.usable ? "on" : "off");
    EXPECT_TRUE(user.reads(row.usable ? "the bits are unchanged" : row.reason)) << row.reason;
    user.click("Step");
    straight.step();
    EXPECT_EQ(hash(user), state_hash(straight.shown().states));
    EXPECT_TRUE(!row.usable || user.reads("spheres by " + backend));
  }
  user.click("auto");
  EXPECT_EQ(player(user).choice().backend, Backend::automatic);
  EXPECT_EQ(user.value("auto"), "on");
}

TEST_F(Panel, AnotherEngineContinuesFromTheSameState) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  test::User user(paused(options_for("gas")));
  user.click("Step");
  for (const EngineKind engine : {EngineKind::bullet_stock, EngineKind::native}) {
    const std::uint64_t before = hash(user);
    user.click(std::string(to_string(engine)));
    EXPECT_EQ(player(user).choice().engine, engine);
    EXPECT_EQ(hash(user), before);
    EXPECT_TRUE(user.reads("Another engine continues from the same state."));
    user.click("Step");
    EXPECT_NE(hash(user), before);
    EXPECT_EQ(user.reads("solved by Bullet"), engine == EngineKind::bullet_stock);
  }
  EXPECT_EQ(user.viewer().steps(), 3u);
}

TEST_F(Panel, BulletsPartsAreExchangedWithoutChangingABit) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  ViewOptions options = options_for("pile");
  options.choice.engine = EngineKind::bullet_stock;
  test::User user(paused(options));
  Player stock(make_run(tool::load(options.run), options.choice), tool::load(options.run));
  const auto expect_same_for_some_steps = [&] {
    for (int i = 0; i < 25; ++i) user.viewer().step(), stock.step();
    EXPECT_EQ(hash(user), state_hash(stock.shown().states));
    user.frame();
  };
  expect_same_for_some_steps();
  EXPECT_TRUE(user.reads("spheres by Bullet, solved by Bullet"));
  EXPECT_FALSE(user.sees("jfpx solver"));
  user.click("bullet");
  EXPECT_TRUE(user.reads("the bits are unchanged"));
  expect_same_for_some_steps();
  EXPECT_TRUE(user.reads("spheres by cpu, solved by cpu"));
  for (const char* part : {"jfpx solver", "jfpx world"}) {
    user.click(part);
    expect_same_for_some_steps();
  }
  EXPECT_FALSE(player(user).choice().jfpx_solver);
  EXPECT_FALSE(player(user).choice().jfpx_world);
  EXPECT_TRUE(user.reads("spheres by cpu, solved by Bullet"));
}

TEST_F(Panel, AFailureDeterminesTheExitStatusAlsoAfterARestart) {
  Scene scene;
  BodyDef ball;
  ball.mass = 1;
  ball.velocity = {kMaxCoordinate, 0, 0};
  scene.bodies = {ball};
  scene.dt = Real(0.5);
  save_scene(scene, folder.file("fast.json"));
  ViewOptions options = options_for(folder.file("fast.json"));
  options.run.spheres.reset();
  test::User user(paused(options));
  ASSERT_EQ(user.viewer().status(), 0);
  for (int i = 0; i < 4; ++i) user.viewer().step();
  ASSERT_EQ(user.viewer().status(), 1);
  user.frame();
  user.click("Restart");
  EXPECT_EQ(user.viewer().steps(), 0u);
  EXPECT_EQ(user.viewer().status(), 1);
  user.choose("scene", "flight");
  EXPECT_EQ(user.viewer().status(), 0);
  EXPECT_EQ(user.finish(), 1);
}

TEST_F(Panel, ChoosesScenesAndDemosAndKeepsTheDisplaySettings) {
  ViewOptions options = options_for("pile");
  options.size.width = 720;
  test::User user(paused(options));
  user.viewer().forces = true;
  const auto drag_moves_the_eye = [&user] {
    const Vec3 before = user.viewer().camera.eye();
    user.drag(600, 500, 640, 480);
    return user.viewer().camera.eye() != before;
  };
  EXPECT_TRUE(drag_moves_the_eye());  // orbits
  user.choose("scene", "boxes-and-balls");
  EXPECT_STREQ(SDL_GetWindowTitle(user.window().sdl()), "jfpx-view: boxes-and-balls");
  EXPECT_FALSE(drag_moves_the_eye());  // turns, as in the thesis
  user.choose("scene", "gas");
  EXPECT_EQ(player(user).scene().name, "gas");
  EXPECT_TRUE(drag_moves_the_eye());
  EXPECT_TRUE(user.viewer().paused);
  EXPECT_TRUE(user.viewer().forces);
  user.choose("scene", "flight");
  ASSERT_NE(dynamic_cast<DemoViewer*>(&user.viewer()), nullptr);
  for (int i = 0; i < 3; ++i) user.frame();
  EXPECT_TRUE(user.viewer().paused);
  user.click("Step");
  EXPECT_EQ(user.viewer().steps(), 1u);
  user.click("Restart");
  EXPECT_EQ(user.viewer().steps(), 0u);
  user.choose("scene", "lattice");
  EXPECT_EQ(player(user).scene().name, "lattice");
}

TEST_F(Panel, NumbersAndSeedsMakeOtherScenes) {
  const auto expected = [](std::uint32_t spheres, std::uint64_t seed) {
    return scenes::make("overlap", {.spheres = spheres, .seed = seed});
  };
  constexpr std::uint64_t kLargest = 18446744073709551615u;
  ViewOptions options = options_for("overlap");
  options.run.spheres.reset();
  test::User user(paused(options));
  EXPECT_EQ(user.value("spheres"), "256");  // the default of the scene
  EXPECT_EQ(user.value("seed"), "1");
  user.click("Step");
  user.type("spheres", "12");
  EXPECT_EQ(player(user).scene(), expected(12, 1));
  EXPECT_EQ(user.viewer().steps(), 0u);
  user.type("seed", std::to_string(kLargest));
  EXPECT_EQ(player(user).scene(), expected(12, kLargest));
  user.type("spheres", "0");
  for (const char* text : {"-5", "what", "99999999999999999999"}) {  // not 64-bit numbers
    user.type("spheres", text);
    EXPECT_EQ(player(user).scene(), expected(0, kLargest)) << text;
    EXPECT_EQ(user.value("spheres"), "0");
  }
}

TEST_F(Panel, AnInvalidRequestIsReportedAndTheFieldsKeepTheirValues) {
  test::User user(paused(test::row_of_balls(folder.file("row.json"))));
  user.click("Step");
  user.type("spheres", "9");
  EXPECT_TRUE(user.reads("--spheres"));
  EXPECT_EQ(user.value("spheres"), "4");
  EXPECT_EQ(user.viewer().steps(), 1u);
}

TEST_F(Panel, SettingsOfSoftStepTakeEffect) {
  test::User user(paused(options_for("pile")));
  user.click("Settings");
  user.frame();
  const Scene before = player(user).scene();
  const auto now = [&]() -> const Scene& { return player(user).scene(); };
  user.type("substeps", "7");
  EXPECT_EQ(now().soft_step.substeps, 7u);
  user.drag_in("contact [Hz], 0 = auto", 0.5, 1);
  EXPECT_EQ(now().soft_step.contact_hertz, 1000);
  user.drag_in("contact [Hz], 0 = auto", 0.5, 0);
  EXPECT_EQ(now().soft_step.contact_hertz, 0);
  user.drag_in("damping ratio", 0.5, 1);
  EXPECT_EQ(now().soft_step.damping_ratio, 1000);
  user.drag_in("push-out [m/s]", 0.5, 1);
  EXPECT_EQ(now().soft_step.push_out_speed, 100);
  user.drag_in("restitution from [m/s]", 0.5, 1);
  EXPECT_EQ(now().soft_step.restitution_threshold, 5);
  user.drag_in("margin [m]", 0.5, 1);
  EXPECT_EQ(now().soft_step.speculative_margin, 1);
  user.drag_in("sleep speed [m/s]", 0.5, 1);
  EXPECT_EQ(now().sleep.speed, 5);
  user.drag_in("sleep time [s]", 0.5, 1);
  EXPECT_EQ(now().sleep.time, 10);
  EXPECT_EQ(now().resolver, before.resolver);
  user.click("Step");
  EXPECT_TRUE(user.reads("7 substeps"));
  user.type("substeps", "65");
  EXPECT_TRUE(user.reads("soft_step.substeps is 65"));
  EXPECT_EQ(user.value("substeps"), "7");
  user.click("Scene defaults");
  EXPECT_EQ(now(), before);
}

TEST_F(Panel, TheResolverIsExchangedAndOnlyItsSettingsAreShown) {
  test::User user(paused(options_for("pile")));
  user.click("Settings");
  user.frame();
  EXPECT_EQ(user.value("soft-step"), "on");
  EXPECT_FALSE(user.sees("velocity eps [m/s]"));
  for (int i = 0; i < 3; ++i) user.click("Step");
  const std::uint64_t before = hash(user);
  user.click("worst-first");
  EXPECT_EQ(player(user).scene().solver, Solver::worst_first);
  EXPECT_EQ(hash(user), before);
  EXPECT_TRUE(user.sees("velocity eps [m/s]"));
  EXPECT_FALSE(user.sees("substeps"));
  EXPECT_FALSE(user.sees("sleep speed [m/s]"));
  user.click("Step");
  EXPECT_TRUE(user.reads(" corrections"));
  user.click("soft-step");
  EXPECT_TRUE(user.sees("sleep speed [m/s]"));
  user.click("Step");
  EXPECT_TRUE(user.reads(" substeps"));
  EXPECT_EQ(user.viewer().steps(), 5u);
  if (!has_engine(EngineKind::bullet)) return;
  user.click("bullet-stock");  // has its own solver
  EXPECT_FALSE(user.sees("soft-step"));
  EXPECT_FALSE(user.sees("sleep speed [m/s]"));
  EXPECT_TRUE(user.sees("dt [s]"));
}

TEST_F(Panel, SettingsOfWorstFirstTakeEffect) {
  test::User user(paused(worst_first(options_for("pile"))));
  user.click("Settings");
  user.frame();
  const Scene before = player(user).scene();
  const auto now = [&]() -> const Scene& { return player(user).scene(); };
  user.drag_in("dt [s]", 0.5, 0);
  EXPECT_NEAR(now().dt, 1e-4, 1e-7);
  user.drag_in("velocity eps [m/s]", 0.5, 1);
  EXPECT_EQ(now().resolver.velocity_epsilon, 1);
  user.drag_in("position eps [m]", 0.5, 1);
  EXPECT_EQ(now().resolver.position_epsilon, 1);
  user.drag_in("restitution from [m/s]", 0.5, 1);
  EXPECT_EQ(now().resolver.restitution_velocity, 5);
  user.drag_in("sleep eps [m2/s2]", 0.5, 1);
  EXPECT_EQ(now().sleep.epsilon, 5);
  user.type("iterations, 0 = 8N", "17");
  EXPECT_EQ(now().resolver.max_iterations, 17u);
  user.click("sleep");
  EXPECT_EQ(now().sleep.enabled, !before.sleep.enabled);
  EXPECT_EQ(user.value("sleep"), before.sleep.enabled ? "off" : "on");
  EXPECT_EQ(user.value("velocity eps [m/s]"), "1");
  user.click("Step");
  EXPECT_TRUE(user.reads("step 1, 0.00 s"));
  user.click("Scene defaults");
  EXPECT_EQ(now(), before);
}

TEST_F(Panel, RestartKeepsTheSettings) {
  test::User user(paused(worst_first(options_for("pile"))));
  user.click("Settings");
  user.frame();
  user.drag_in("dt [s]", 0.5, 0);
  user.type("iterations, 0 = 8N", "17");
  user.click("sleep");
  user.click("cpu");
  user.drag_in("speed", 0.5, 1);
  const Scene changed = player(user).scene();
  for (int i = 0; i < 3; ++i) user.click("Step");
  user.click("Restart");
  EXPECT_EQ(user.viewer().steps(), 0u);
  EXPECT_EQ(player(user).scene(), changed);
  EXPECT_EQ(user.value("iterations, 0 = 8N"), "17");
  EXPECT_EQ(user.value("cpu"), "on");
  EXPECT_EQ(user.viewer().speed, 4);
  EXPECT_TRUE(user.viewer().paused);
  // A new run with these settings, which can be recorded and replayed.
  Player expected(make_run(changed, player(user).choice()), changed);
  for (int i = 0; i < 3; ++i) user.click("Step"), expected.step();
  EXPECT_EQ(hash(user), state_hash(expected.shown().states));
  user.click("Save steps");
  EXPECT_EQ(open_recording("jfpx-view-1.rec").scene, changed);
}

TEST_F(Panel, ARecordingPausesAtItsEndRestartsAndContinuesWithASimulation) {
  {
    test::User user(options_for("pile"));
    for (int i = 0; i < 3; ++i) user.click("Step");
    user.click("Save steps");
  }
  start_events();
  test::User user(options_for("jfpx-view-1.rec"));
  user.frame(10 * kStep);
  user.frame();
  EXPECT_EQ(user.viewer().steps(), 3u);
  EXPECT_TRUE(user.viewer().paused);
  EXPECT_TRUE(user.reads("(end of recording)"));
  user.click("Step");
  user.click("Run");
  user.click("Save steps");
  EXPECT_EQ(RecordingReader("jfpx-view-2.rec").steps(), 3u);
  const std::uint64_t recorded = hash(user);
  user.click("Restart");
  for (int i = 0; i < 3; ++i) user.click("Step");
  EXPECT_TRUE(user.reads("spheres by the recording"));
  EXPECT_EQ(hash(user), recorded);
  user.click("Settings");
  user.frame();
  user.drag_in("dt [s]", 0.5, 0);
  user.click("Restart");
  EXPECT_EQ(user.viewer().steps(), 0u);
  EXPECT_NEAR(player(user).scene().dt, 1e-4, 1e-7);
  for (int i = 0; i < 3; ++i) user.click("Step");
  EXPECT_FALSE(user.reads("spheres by the recording"));
  EXPECT_NE(hash(user), recorded);
}

TEST_F(Panel, ButtonsWritePicturesAndSwitchesChangeThem) {
  test::User user(options_for("pile"), 1);
  user.click("Picture");
  user.frame();
  EXPECT_EQ(read_png("jfpx-view-1.png").height, 760);
  user.click("Film");
  for (int i = 0; i < 3; ++i) user.frame();
  user.click("Film");
  const auto pictures = [] {
    return std::distance(fs::directory_iterator("jfpx-view-frames-1"), fs::directory_iterator());
  };
  const auto written = pictures();
  EXPECT_GE(written, 3);
  user.frame();
  EXPECT_EQ(pictures(), written);
  user.choose("colours", "speed");
  EXPECT_EQ(user.viewer().colouring, Colouring::speed);
  user.click("contacts");
  user.click("forces");
  EXPECT_TRUE(user.viewer().contacts);
  EXPECT_TRUE(user.viewer().forces);
  user.click("contacts");
  EXPECT_FALSE(user.viewer().contacts);
}

TEST_F(Panel, TheHelpListsTheFeaturesOfTheViewer) {
  test::User user(options_for("pile"));
  const auto keys = [&user](const std::string& scene) {
    user.choose("scene", scene);
    for (const bool down : {true, false}) test::push_key(SDLK_F1, down);
    user.frame();
    const auto listed = [&user](const char* text) { return user.reads(text) ? '1' : '0'; };
    const std::string seen = {listed("pick a body"), listed("one step back"),
                              listed("property shown"), listed("raise both wings"),
                              listed("screenshot")};
    for (const bool down : {true, false}) test::push_key(SDLK_F1, down);
    user.frame();
    return seen;
  };
  EXPECT_EQ(keys("gas"), "11101");
  EXPECT_EQ(keys("flight"), "00011");
}

TEST_F(Panel, AClickedBodyListsItsContacts) {
  test::User user(paused(test::row_of_balls(folder.file("row.json"))));
  user.click("Step");
  for (std::uint32_t k = 0; k < 4; ++k) {
    const Vec3 position = player(user).shown().states[k].position;
    const auto at = project(scene(user).view(), position, kRowSize.width, kRowSize.height);
    user.click_at(at->x, at->y);
    ASSERT_EQ(scene(user).picked(), k);
    const auto& texts = user.texts();
    const auto state =
        std::find(texts.begin(), texts.end(),
                  fmt::format("at ({:.3f}, {:.3f}, {:.3f})", position.x, position.y, position.z));
    ASSERT_NE(state, texts.end());
    std::vector<std::string> others, normals;  // below position and speeds
    for (auto row = state + 2; row < texts.end(); row += 3) {
      others.push_back(*row);
      normals.push_back(*(row + 2));
    }
    // The normals point away from the neighbours.
    if (k == 0) {
      EXPECT_THAT(others, ElementsAre("1"));
      EXPECT_THAT(normals, ElementsAre(StartsWith("-1.00")));
    } else if (k == 3) {
      EXPECT_THAT(others, ElementsAre("2"));
      EXPECT_THAT(normals, ElementsAre(StartsWith("1.00")));
    } else {
      EXPECT_THAT(others, ElementsAre(std::to_string(k - 1), std::to_string(k + 1)));
      EXPECT_THAT(normals, ElementsAre(StartsWith("1.00"), StartsWith("-1.00")));
    }
  }
  user.click_at(kRowSize.width - 10, kRowSize.height - 10);  // the sky
  EXPECT_EQ(scene(user).picked(), std::nullopt);
  EXPECT_FALSE(user.reads("at ("));
}

}  // namespace
}  // namespace jfpx
