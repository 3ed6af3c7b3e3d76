/// The window as a user has it: keys, another size, the end; events come from SDL's queue.
#include <jfpx/recording.hpp>

#include "src/scenes/scenes.hpp"
#include "src/viewer/demo_show.hpp"
#include "src/viewer/scene_show.hpp"
#include "tests/viewer/window_fixture.hpp"

#include <fstream>
#include <initializer_list>
#include <utility>

namespace {

bool minimised = false;
bool interval_is_refused = false;
int pauses = 0;

}  // namespace

// SDL's offscreen driver minimises nothing: this is linked instead of SDL's own.
extern "C" Uint32 SDL_GetWindowFlags(SDL_Window*) {
  return minimised ? SDL_WINDOW_MINIMIZED : SDL_WINDOW_SHOWN;
}

// Likewise, for a driver that can't wait for the screen, or can.
extern "C" int SDL_GL_SetSwapInterval(int) { return interval_is_refused ? -1 : 0; }
extern "C" void SDL_Delay(Uint32) { ++pauses; }

namespace jfpx {
namespace {

using namespace view;
namespace fs = std::filesystem;

constexpr Size kSize{160, 120};

class Interactive : public test::WindowTest {
 protected:
  static ViewOptions options(std::uint64_t frames) {
    ViewOptions options;
    options.run.scene = "pile";
    options.run.spheres = 20;
    options.frames = frames;
    options.size = kSize;
    options.quality = kLowQuality;
    return options;
  }
  void TearDown() override {
    minimised = interval_is_refused = false;
    WindowTest::TearDown();
  }
  /// Keys that are down and up again before the first picture.
  static void press(std::initializer_list<SDL_Keycode> keys) {
    for (const SDL_Keycode code : keys) {
      for (const bool down : {true, false}) test::push_key(code, down);
    }
  }
};

TEST_F(Interactive, KeysTakePicturesFilmsAndRecordings) {
  press({SDLK_F1, SDLK_F2, SDLK_c, SDLK_f, SDLK_v, SDLK_o, SDLK_h, SDLK_MINUS, SDLK_PLUS, SDLK_F10,
         SDLK_F12, SDLK_F9});
  EXPECT_EQ(run_interactive(options(4)), 0);
  EXPECT_TRUE(fs::exists("jfpx-view-frames-1/frame-000001.png"));
  EXPECT_TRUE(fs::exists("jfpx-view-frames-1/frame-000004.png"));
  const Image image = read_png("jfpx-view-1.png");
  EXPECT_EQ(image.width, kSize.width);
  EXPECT_EQ(image.height, kSize.height);
  EXPECT_EQ(open_recording("jfpx-view-1.rec").scene.name, "pile");
  EXPECT_EQ(folder.entries(), 3u);
}

TEST_F(Interactive, AWindowClosesAfterAsManyStepsAsWereWanted) {
  App app(options(5));
  EXPECT_TRUE(app.frame(3.5 / 60));
  EXPECT_FALSE(app.frame(7.5 / 60));
  EXPECT_EQ(app.show().steps(), 5u);
}

TEST_F(Interactive, F1ShowsTheHelp) {
  const auto brightness_of_the_middle = [](std::initializer_list<SDL_Keycode> keys) {
    start_events();
    press(keys);
    ViewOptions wish = options(30);
    wish.screenshot = "picture.png";
    EXPECT_EQ(run_interactive(wish), 0);
    const Image image = read_png("picture.png");
    int sum = 0;
    for (int x = 40; x < 120; ++x) sum += image.at(x, 60)[1];
    return sum;
  };
  const int panel_away = brightness_of_the_middle({SDLK_F2});
  EXPECT_LT(brightness_of_the_middle({SDLK_F2, SDLK_F1}), panel_away * 2 / 3);
}

TEST_F(Interactive, AWindowThatIsClosedStillWritesItsLastPicture) {
  SDL_Event quit{};
  quit.type = SDL_QUIT;
  SDL_PushEvent(&quit);
  ViewOptions wish = options(1'000'000);
  wish.screenshot = "last.png";
  EXPECT_EQ(run_interactive(wish), 0);
  EXPECT_EQ(read_png("last.png").width, kSize.width);
}

TEST_F(Interactive, AWindowOfAnotherSizeHasPicturesOfThatSize) {
  const auto resize = [](void* done, SDL_Event* event) {
    if (event->type == SDL_WINDOWEVENT && !std::exchange(*static_cast<bool*>(done), true)) {
      SDL_SetWindowSize(SDL_GetWindowFromID(event->window.windowID), 200, 90);
    }
    return 0;
  };
  bool done = false;
  SDL_AddEventWatch(resize, &done);
  ViewOptions wish = options(3);
  wish.screenshot = "resized.png";
  EXPECT_EQ(run_interactive(wish), 0);
  ASSERT_TRUE(done);
  EXPECT_EQ(read_png("resized.png").width, 200);
  EXPECT_EQ(read_png("resized.png").height, 90);
}

TEST_F(Interactive, AWindowThatStartsPausedMakesNoStep) {
  ViewOptions wish = options(1'000'000);
  wish.paused = true;
  App app(wish);
  app.frame(1);
  EXPECT_EQ(app.show().steps(), 0u);
  press({SDLK_SPACE});
  app.frame(1);
  EXPECT_GT(app.show().steps(), 0u);
  wish.headless = true;
  EXPECT_THROW(check(wish), InvalidArgument);
}

TEST_F(Interactive, AFileThatIsDroppedOnTheWindowIsShown) {
  save_scene(scenes::make("gas", {.spheres = 3}), "three.json");
  std::ofstream("broken.json") << "{";
  const auto drop = [](const char* path) {
    SDL_Event event{};
    event.type = SDL_DROPFILE;
    event.drop.file = SDL_strdup(path);
    SDL_PushEvent(&event);
  };
  App app(options(1'000'000));
  const auto bodies = [&app] {
    return dynamic_cast<const SceneShow&>(app.show()).player().scene().bodies.size();
  };
  for (int i = 0; i < 3; ++i) app.frame(kRecordedFrame);
  press({SDLK_F9});
  app.frame(0);
  const std::size_t own = bodies();
  drop("three.json");
  app.frame(0);
  const std::size_t three = bodies();
  EXPECT_EQ(three, scenes::make("gas", {.spheres = 3}).bodies.size());
  for (const char* bad : {"broken.json", "missing.rec"}) {
    drop(bad);
    app.frame(0);
    EXPECT_EQ(bodies(), three);
  }
  drop("jfpx-view-1.rec");
  app.frame(0);
  EXPECT_EQ(bodies(), own);
  EXPECT_EQ(app.finish(), 0);
}

TEST_F(Interactive, EverythingIsShownAgainInAWindowOfAnotherShape) {
  ViewOptions wish = options(1'000'000);
  wish.size = {160, 160};
  App app(wish);
  app.show().paused = true;
  app.frame(0);
  const Real before = app.show().camera.distance();
  SDL_SetWindowSize(app.window().sdl(), 40, 160);
  app.frame(0);
  ASSERT_EQ(app.window().pixel_width(), 40);
  press({SDLK_h});
  app.frame(0);
  EXPECT_GT(app.show().camera.distance(), before * 2);
}

int buffers_made = 0;
decltype(epoxy_glRenderbufferStorageMultisample) make_storage;
void counted_storage(GLenum target, GLsizei samples, GLenum format, GLsizei width, GLsizei height) {
  ++buffers_made;
  make_storage(target, samples, format, width, height);
}

TEST_F(Interactive, PicturesSideBySideShareTheirBuffers) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  ViewOptions wish = options(1'000'000);
  wish.side_by_side = true;
  wish.size = {161, 120};  // no multiple of 3
  App app(wish);
  app.frame(0);
  make_storage = std::exchange(epoxy_glRenderbufferStorageMultisample, counted_storage);
  app.frame(0);
  EXPECT_EQ(buffers_made, 0);
  SDL_SetWindowSize(app.window().sdl(), 200, 120);
  app.frame(0);
  EXPECT_EQ(buffers_made, 2);  // colours and depths
  epoxy_glRenderbufferStorageMultisample = make_storage;
}

TEST_F(Interactive, WithoutAScreenToWaitForPicturesPause) {
  interval_is_refused = true;
  App app(options(1'000'000));
  app.frame(0);
  const int before = pauses;
  app.frame(0);
  EXPECT_GT(pauses, before);
}

TEST_F(Interactive, AWindowThatIsMinimisedStillHasPictures) {
  const auto take = [](const char* name, bool unseen) {
    start_events();
    ViewOptions wish = options(1'000'000);
    wish.screenshot = std::string(name) + ".png";
    App app(wish);
    app.show().paused = true;
    for (int i = 0; i < 2; ++i) EXPECT_TRUE(app.frame(0));  // panels learn their size
    minimised = unseen;
    press({SDLK_F10});
    EXPECT_TRUE(app.frame(0));
    press({SDLK_F10, SDLK_ESCAPE});
    EXPECT_FALSE(app.frame(0));
    EXPECT_EQ(app.finish(), 0);
    minimised = false;
  };
  take("seen", false);
  take("unseen", true);
  EXPECT_EQ(read_png("unseen.png").rgb, read_png("seen.png").rgb);
  EXPECT_EQ(read_png("jfpx-view-frames-2/frame-000001.png").width, kSize.width);
}

TEST_F(Interactive, AWindowThatIsMinimisedFromTheStartHasAPictureToo) {
  minimised = true;
  ViewOptions wish = options(2);
  wish.screenshot = "unseen.png";
  EXPECT_EQ(run_interactive(wish), 0);
  EXPECT_EQ(read_png("unseen.png").width, kSize.width);
  wish.screenshot = "missing/unseen.png";
  start_events();
  EXPECT_THROW(run_interactive(wish), FileError);
}

TEST_F(Interactive, TheCameraOfADemoFollowsWhileNobodyMovesIt) {
  ViewOptions wish = options(1'000'000);
  wish.run = {};
  wish.run.scene = "flight";
  App app(wish);
  for (int i = 0; i < 200; ++i) app.frame(kRecordedFrame);
  app.show().paused = true;
  app.frame(0);
  demos::View shown;
  dynamic_cast<const DemoShow&>(app.show()).demo().draw(&shown);
  EXPECT_GT(app.show().steps(), 100u);
  EXPECT_LT(length(app.show().camera.eye() - shown.camera.eye), 1e-3);
}

TEST_F(Interactive, FullScreenFillsTheScreen) {
  ViewOptions wish = options(2);
  wish.fullscreen = true;
  wish.screenshot = "full.png";
  EXPECT_EQ(run_interactive(wish), 0);
  EXPECT_GT(read_png("full.png").width, kSize.width);
}

TEST_F(Interactive, WhatCannotBeWrittenIsToldAndTheWindowStays) {
  fs::remove_all(fs::current_path());
  press({SDLK_F12, SDLK_F10, SDLK_F9});
  EXPECT_EQ(run_interactive(options(3)), 0);
  start_events();
  ViewOptions wish = options(3);
  wish.screenshot = "last.png";  // asked for on the command line: an error
  EXPECT_THROW(run_interactive(wish), FileError);
}

TEST_F(Interactive, WhatCannotBeWrittenAtTheEndLeavesTheRestWhole) {
  fs::create_directory("pictures");
  ViewOptions wish = options(3);
  wish.screenshot = "pictures/last.png";
  wish.recording = "run.rec";
  App app(wish);
  fs::remove("pictures");
  while (app.frame(kRecordedFrame)) {
  }
  EXPECT_THROW(app.finish(), FileError);
  EXPECT_EQ(RecordingReader("run.rec").steps(), 3u);
}

TEST_F(Interactive, AFilmOfTheCommandLineMustBeWrittenAndOneOfAKeyIsTold) {
  ViewOptions wish = options(1'000'000);
  wish.record = "film";
  {
    App app(wish);
    EXPECT_TRUE(app.frame(0));
    press({SDLK_F10, SDLK_F10});  // no more, and another one
    EXPECT_TRUE(app.frame(0));
    fs::remove_all("jfpx-view-frames-1");
    EXPECT_TRUE(app.frame(0));
    EXPECT_EQ(app.finish(), 0);
  }
  start_events();
  App app(wish);
  fs::remove_all("film");
  EXPECT_FALSE(app.frame(0));
  EXPECT_THROW(app.finish(), FileError);
}

}  // namespace
}  // namespace jfpx
