/// The panel as a user has it: widgets are clicked where they are drawn, and what they promise
/// comes.
#include <jfpx/recording.hpp>

#include "src/scenes/scenes.hpp"
#include "src/viewer/demo_show.hpp"
#include "src/viewer/scene_show.hpp"
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
  options.size = {360, 760};  // hardly more than the panel
  options.quality = test::kSketch;
  return options;
}

class Panel : public test::WindowTest {
 protected:
  static const SceneShow& scene(test::User& user) {
    return dynamic_cast<const SceneShow&>(user.show());
  }
  static std::uint64_t hash(test::User& user) {
    return state_hash(scene(user).player().shown().states);
  }
};

TEST_F(Panel, PauseStopsTheRunAndRunLetsItGoOn) {
  test::User user(options_for("pile"));
  user.click("Pause");
  EXPECT_TRUE(user.show().paused);
  const std::uint64_t steps = user.show().steps();
  user.frame(10 * kStep);
  EXPECT_EQ(user.show().steps(), steps);
  EXPECT_FALSE(user.sees("Pause"));
  user.click("Run");
  EXPECT_FALSE(user.show().paused);
  user.frame(3.5 * kStep);
  EXPECT_EQ(user.show().steps(), steps + 3);
}

TEST_F(Panel, StepMakesOneStepAndBackShowsTheOneBefore) {
  test::User user(options_for("pile"));
  const std::uint64_t start = hash(user);
  user.click("Step");
  EXPECT_TRUE(user.show().paused);
  EXPECT_EQ(user.show().steps(), 1u);
  EXPECT_TRUE(user.reads("step 1, 0.02 s"));
  EXPECT_NE(hash(user), start);
  user.click("Step");
  user.click("Back");
  EXPECT_EQ(user.show().steps(), 1u);
  EXPECT_TRUE(user.reads("step 1, 0.02 s  (looking back)"));
  user.click("Back");
  EXPECT_EQ(hash(user), start);
  user.click("Back");  // there is none before
  EXPECT_EQ(hash(user), start);
}

TEST_F(Panel, RestartBeginsAnewWithTheSameBits) {
  test::User user(options_for("pile"));
  const std::uint64_t start = hash(user);
  for (int i = 0; i < 5; ++i) user.click("Step");
  const std::uint64_t later = hash(user);
  user.click("Restart");
  EXPECT_EQ(user.show().steps(), 0u);
  EXPECT_EQ(hash(user), start);
  for (int i = 0; i < 5; ++i) user.click("Step");
  EXPECT_EQ(hash(user), later);
}

TEST_F(Panel, TheSliderSetsTheSpeed) {
  test::User user(options_for("pile"));
  user.drag_in("speed", 0.5, 1);
  EXPECT_EQ(user.show().speed, 4);
  user.frame(1.1 * kStep);
  EXPECT_EQ(user.show().steps(), 4u);  // of 4.4
  user.drag_in("speed", 0.5, 0);
  EXPECT_NEAR(user.show().speed, 0.01, 1e-6);
  user.show().advance(50 * kStep);
  EXPECT_EQ(user.show().steps(), 4u);  // of 4.9
  user.show().advance(50 * kStep);
  EXPECT_EQ(user.show().steps(), 5u);
}

TEST_F(Panel, ABackendIsExchangedWithoutMovingABit) {
  test::User user(options_for("pile"));
  user.show().paused = true;
  const ViewOptions options = options_for("pile");
  Player straight(make_run(tool::load(options.run), {}), tool::load(options.run));
  for (const BackendStatus& row : available_backends()) {
    const std::uint64_t before = hash(user);
    const EngineChoice choice = scene(user).player().choice();
    user.click(std::string(to_string(row.backend)));
    EXPECT_EQ(hash(user), before);
    EXPECT_EQ(scene(user).player().choice().backend, row.usable ? row.backend : choice.backend);
    EXPECT_EQ(user.value(std::string(to_string(row.backend))), row.usable ? "on" : "off");
    EXPECT_TRUE(user.reads(row.usable ? "the bits stay the same" : row.reason)) << row.reason;
    user.click("Step");
    straight.step();
    EXPECT_EQ(hash(user), state_hash(straight.shown().states));
    if (row.usable) {
      EXPECT_TRUE(user.reads("spheres by " + std::string(to_string(row.backend))));
    }
  }
  user.click("auto");
  EXPECT_EQ(scene(user).player().choice().backend, Backend::automatic);
  EXPECT_EQ(user.value("auto"), "on");
}

TEST_F(Panel, AnotherEngineGoesOnFromTheSameState) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  test::User user(options_for("gas"));
  user.show().paused = true;
  user.click("Step");
  for (const EngineKind engine : {EngineKind::bullet_stock, EngineKind::native}) {
    const std::uint64_t before = hash(user);
    user.click(std::string(kEngineNames[static_cast<std::size_t>(engine)]));
    EXPECT_EQ(scene(user).player().choice().engine, engine);
    EXPECT_EQ(hash(user), before);
    EXPECT_TRUE(user.reads("Another engine goes on from the same state."));
    user.click("Step");
    EXPECT_NE(hash(user), before);
    EXPECT_EQ(user.reads("solved by Bullet"), engine == EngineKind::bullet_stock);
  }
  EXPECT_EQ(user.show().steps(), 3u);
}

TEST_F(Panel, BulletsPartsAreExchangedWithoutMovingABit) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  ViewOptions options = options_for("pile");
  options.choice.engine = EngineKind::bullet_stock;
  test::User user(options);
  user.show().paused = true;
  Player stock(make_run(tool::load(options.run), options.choice), tool::load(options.run));
  const auto expect_same_for_some_steps = [&] {
    for (int i = 0; i < 25; ++i) user.show().step(), stock.step();
    EXPECT_EQ(hash(user), state_hash(stock.shown().states));
    user.frame();
  };
  expect_same_for_some_steps();
  EXPECT_TRUE(user.reads("spheres by Bullet, solved by Bullet"));
  EXPECT_FALSE(user.sees("jfpx' solver"));
  user.click("bullet");
  EXPECT_TRUE(user.reads("the bits stay the same"));
  expect_same_for_some_steps();
  EXPECT_TRUE(user.reads("spheres by x86, solved by x86"));
  for (const char* part : {"jfpx' solver", "jfpx' world"}) {
    user.click(part);
    expect_same_for_some_steps();
  }
  EXPECT_FALSE(scene(user).player().choice().jfpx_solver);
  EXPECT_FALSE(scene(user).player().choice().jfpx_world);
  EXPECT_TRUE(user.reads("spheres by x86, solved by Bullet"));
}

TEST_F(Panel, WhatFailedOnceHasFailedWhateverStartsAgain) {
  Scene scene;
  BodyDef ball;
  ball.mass = 1;
  ball.velocity = {kMaxCoordinate, 0, 0};
  scene.bodies = {ball};
  scene.dt = Real(0.5);
  save_scene(scene, folder.file("fast.json"));
  ViewOptions options = options_for(folder.file("fast.json"));
  options.run.spheres.reset();
  test::User user(options);
  user.show().paused = true;
  ASSERT_EQ(user.show().status(), 0);
  for (int i = 0; i < 4; ++i) user.show().step();
  ASSERT_EQ(user.show().status(), 1);
  user.frame();
  user.click("Restart");
  EXPECT_EQ(user.show().steps(), 0u);
  EXPECT_EQ(user.show().status(), 1);
  user.choose("scene", "flight");
  EXPECT_EQ(user.show().status(), 0);
  EXPECT_EQ(user.finish(), 1);
}

TEST_F(Panel, ScenesAndDemosAreChosen) {
  test::User user(options_for("pile"));
  user.show().paused = true;
  user.choose("scene", "gas");
  EXPECT_EQ(scene(user).player().scene().name, "gas");
  EXPECT_TRUE(user.show().paused);
  user.choose("scene", "flight");
  ASSERT_NE(dynamic_cast<DemoShow*>(&user.show()), nullptr);
  for (int i = 0; i < 3; ++i) user.frame();
  EXPECT_TRUE(user.show().paused);
  user.click("Run");
  EXPECT_FALSE(user.show().paused);
  user.click("Pause");
  EXPECT_TRUE(user.show().paused);
  const std::uint64_t steps = user.show().steps();
  user.click("Step");
  EXPECT_EQ(user.show().steps(), steps + 1);
  user.click("Restart");
  EXPECT_EQ(user.show().steps(), 0u);
  user.choose("scene", "lattice");
  EXPECT_EQ(scene(user).player().scene().name, "lattice");
}

TEST_F(Panel, WhatIsChosenComesAsIfItHadBeenStarted) {
  ViewOptions options = options_for("pile");
  options.size.width = 720;
  test::User user(options);
  user.show().paused = true;
  user.show().forces = true;
  const auto eye_moves = [&user] {
    const Vec3 before = user.show().camera.eye();
    user.drag(600, 500, 640, 480);
    return user.show().camera.eye() != before;
  };
  EXPECT_TRUE(eye_moves());  // in a circle
  user.choose("scene", "boxes-and-balls");
  EXPECT_STREQ(SDL_GetWindowTitle(user.window().sdl()), "jfpx-view: boxes-and-balls");
  EXPECT_TRUE(user.show().forces);
  EXPECT_FALSE(eye_moves());  // one looks around, as in the thesis
  user.choose("scene", "gas");
  EXPECT_STREQ(SDL_GetWindowTitle(user.window().sdl()), "jfpx-view: gas");
  EXPECT_TRUE(eye_moves());
}

TEST_F(Panel, NumbersAndSeedsMakeOtherScenes) {
  const auto expected = [](std::uint32_t spheres, std::uint64_t seed) {
    return scenes::make("overlap", {.spheres = spheres, .seed = seed});
  };
  ViewOptions options = options_for("overlap");
  options.run.spheres.reset();
  ASSERT_NE(expected(12, 1), expected(12, 7));
  test::User user(options);
  user.show().paused = true;
  EXPECT_EQ(user.value("spheres"), "256");  // the scene's own number
  EXPECT_EQ(user.value("seed"), "1");
  user.click("Step");
  user.type("spheres", "12");
  EXPECT_EQ(scene(user).player().scene(), expected(12, 1));
  EXPECT_EQ(user.show().steps(), 0u);
  user.type("seed", "7");
  EXPECT_EQ(scene(user).player().scene(), expected(12, 7));
  user.type("seed", "18446744073709551615");
  EXPECT_EQ(scene(user).player().scene(), expected(12, 18446744073709551615u));
  user.type("spheres", "0");
  for (const char* text : {"-5", "what", "99999999999999999999"}) {  // no numbers of 64 bits
    user.type("spheres", text);
    EXPECT_EQ(scene(user).player().scene(), expected(0, 18446744073709551615u)) << text;
    EXPECT_EQ(user.value("spheres"), "0");
  }
}

TEST_F(Panel, WhatASceneCannotHaveIsToldAndTheFieldsShowWhatIs) {
  test::User user(test::row_of_balls(folder.file("row.json")));
  user.show().paused = true;
  user.click("Step");
  user.type("spheres", "9");
  EXPECT_TRUE(user.reads("--spheres"));
  EXPECT_EQ(user.value("spheres"), "4");
  EXPECT_EQ(user.show().steps(), 1u);
}

TEST_F(Panel, SettingsOfTheSolverAreTakenOver) {
  test::User user(options_for("pile"));
  user.show().paused = true;
  user.click("Settings");
  user.frame();
  const Scene before = scene(user).player().scene();
  const auto now = [&]() -> const Scene& { return scene(user).player().scene(); };
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
  user.drag_in("velocity eps [m/s]", 0.5, 0.25);
  EXPECT_GT(now().resolver.velocity_epsilon, 5e-5);
  EXPECT_LT(now().resolver.velocity_epsilon, 5e-4);
  user.click("Step");
  EXPECT_TRUE(user.reads("step 1, 0.00 s"));
  user.click("The scene's own");
  EXPECT_EQ(now(), before);
}

TEST_F(Panel, RestartKeepsWhatThePanelShows) {
  test::User user(options_for("pile"));
  user.show().paused = true;
  user.click("Settings");
  user.frame();
  user.drag_in("dt [s]", 0.5, 0);
  user.type("iterations, 0 = 8N", "17");
  user.click("sleep");
  user.click("x86");
  user.drag_in("speed", 0.5, 1);
  const Scene wanted = scene(user).player().scene();
  for (int i = 0; i < 3; ++i) user.click("Step");
  user.click("Restart");
  EXPECT_EQ(user.show().steps(), 0u);
  EXPECT_EQ(scene(user).player().scene(), wanted);
  EXPECT_EQ(user.value("iterations, 0 = 8N"), "17");
  EXPECT_EQ(user.value("sleep"), wanted.sleep.enabled ? "on" : "off");
  EXPECT_EQ(user.value("x86"), "on");
  EXPECT_EQ(user.show().speed, 4);
  EXPECT_TRUE(user.show().paused);
  // From the first step on it is one run with these settings, which a replay can make again.
  Player expected(make_run(wanted, scene(user).player().choice()), wanted);
  for (int i = 0; i < 3; ++i) user.click("Step"), expected.step();
  EXPECT_EQ(hash(user), state_hash(expected.shown().states));
  user.click("Save steps");
  EXPECT_EQ(open_recording("jfpx-view-1.rec").scene, wanted);
}

TEST_F(Panel, ARecordingStartsAgainAsItIsShown) {
  {
    test::User user(options_for("pile"));
    for (int i = 0; i < 3; ++i) user.click("Step");
    user.click("Save steps");
  }
  start_events();
  test::User user(options_for("jfpx-view-1.rec"));
  user.click("Step");
  const std::uint64_t recorded = hash(user);
  user.click("Restart");
  user.click("Step");
  EXPECT_TRUE(user.reads("spheres by the recording"));
  EXPECT_EQ(hash(user), recorded);
  user.click("Settings");
  user.frame();
  user.drag_in("dt [s]", 0.5, 0);  // goes on live
  user.click("Restart");
  EXPECT_EQ(user.show().steps(), 0u);
  EXPECT_NEAR(scene(user).player().scene().dt, 1e-4, 1e-7);
  user.click("Step");
  EXPECT_FALSE(user.reads("spheres by the recording"));
  EXPECT_NE(hash(user), recorded);
}

TEST_F(Panel, ARecordingPausesAtItsEndAndIsSavedAsItIs) {
  {
    test::User user(options_for("pile"));
    for (int i = 0; i < 3; ++i) user.click("Step");
    user.click("Save steps");
  }
  start_events();
  ViewOptions options = options_for("jfpx-view-1.rec");
  options.run.spheres.reset();
  test::User user(options);
  user.frame(10 * kStep);
  user.frame();
  EXPECT_EQ(user.show().steps(), 3u);
  EXPECT_TRUE(user.show().paused);
  EXPECT_TRUE(user.reads("(end of recording)"));
  user.click("Step");
  user.click("Run");
  user.click("Save steps");
  EXPECT_EQ(RecordingReader("jfpx-view-2.rec").steps(), 3u);
  user.click("Back");
  EXPECT_EQ(user.show().steps(), 2u);
}

TEST_F(Panel, PicturesFilmsAndRecordingsAreWritten) {
  test::User user(options_for("pile"));
  user.click("Picture");
  user.frame();
  EXPECT_EQ(read_png("jfpx-view-1.png").height, 760);
  user.click("Save steps");
  EXPECT_EQ(open_recording("jfpx-view-1.rec").scene.name, "pile");
  user.click("Film");
  for (int i = 0; i < 3; ++i) user.frame();
  user.click("Film");
  const auto pictures = [] {
    return std::distance(fs::directory_iterator("jfpx-view-frames-1"), fs::directory_iterator());
  };
  const auto filmed = pictures();
  EXPECT_GE(filmed, 3);
  user.frame();
  EXPECT_EQ(pictures(), filmed);
}

TEST_F(Panel, TheHelpListsWhatTheShowHas) {
  test::User user(options_for("pile"));
  const auto keys = [&user](const std::string& scene) {
    user.choose("scene", scene);
    for (const bool down : {true, false}) test::push_key(SDLK_F1, down);
    user.frame();
    const auto listed = [&user](const char* what) { return user.reads(what) ? '1' : '0'; };
    const std::string seen = {listed("pick a body"), listed("one step back"),
                              listed("what colours tell"), listed("raise both wings"),
                              listed("screenshot")};
    for (const bool down : {true, false}) test::push_key(SDLK_F1, down);
    user.frame();
    return seen;
  };
  EXPECT_EQ(keys("gas"), "11101");
  EXPECT_EQ(keys("flight"), "00011");
}

TEST_F(Panel, ColoursContactsAndForcesAreSwitched) {
  test::User user(options_for("pile"));
  user.choose("colours", "speed");
  EXPECT_EQ(user.show().colouring, Colouring::speed);
  user.click("contacts");
  user.click("forces");
  EXPECT_TRUE(user.show().contacts);
  EXPECT_TRUE(user.show().forces);
  user.click("contacts");
  EXPECT_FALSE(user.show().contacts);
}

TEST_F(Panel, ABodyThatIsClickedTellsItsContacts) {
  test::User user(test::row_of_balls(folder.file("row.json")));
  user.show().paused = true;
  user.click("Step");
  for (std::uint32_t k = 0; k < 4; ++k) {
    const Vec3 place = scene(user).player().shown().states[k].position;
    const auto at = project(scene(user).view(), place, kRowSize.width, kRowSize.height);
    user.click_at(at->x, at->y);
    ASSERT_EQ(scene(user).picked(), k);
    const auto& texts = user.texts();
    const auto state =
        std::find(texts.begin(), texts.end(),
                  fmt::format("at ({:.3f}, {:.3f}, {:.3f})", place.x, place.y, place.z));
    ASSERT_NE(state, texts.end());
    std::vector<std::string> others, pushes;  // below position and speeds
    for (auto row = state + 2; row < texts.end(); row += 3) {
      others.push_back(*row);
      pushes.push_back(*(row + 2));
    }
    // Neighbours push each other apart.
    if (k == 0) {
      EXPECT_THAT(others, ElementsAre("1"));
      EXPECT_THAT(pushes, ElementsAre(StartsWith("-1.00")));
    } else if (k == 3) {
      EXPECT_THAT(others, ElementsAre("2"));
      EXPECT_THAT(pushes, ElementsAre(StartsWith("1.00")));
    } else {
      EXPECT_THAT(others, ElementsAre(std::to_string(k - 1), std::to_string(k + 1)));
      EXPECT_THAT(pushes, ElementsAre(StartsWith("1.00"), StartsWith("-1.00")));
    }
  }
  user.click_at(kRowSize.width - 10, kRowSize.height - 10);  // the sky
  EXPECT_EQ(scene(user).picked(), std::nullopt);
  EXPECT_FALSE(user.reads("at ("));
}

}  // namespace
}  // namespace jfpx
