/// The interactive program: keys, sizes of the window, its end, and files that can't be written.
#include <jfpx/recording.hpp>

#include "src/scenes/scenes.hpp"
#include "src/viewer/demo_viewer.hpp"
#include "src/viewer/scene_viewer.hpp"
#include "tests/viewer/window_fixture.hpp"

#include <fstream>
#include <initializer_list>
#include <utility>

namespace {

bool minimised = false;
bool interval_is_refused = false;
int pauses = 0;

}  // namespace

// These replace functions of SDL, whose offscreen driver can't minimise a window or wait for the
// screen.
extern "C" Uint32 SDL_GetWindowFlags(SDL_Window*) {
  return minimised ? SDL_WINDOW_MINIMIZED : SDL_WINDOW_SHOWN;
}
extern "C" int SDL_GL_SetSwapInterval(int) { return interval_is_refused ? -1 : 0; }
extern "C" void SDL_Delay(Uint32) { ++pauses; }

namespace jfpx {
namespace {

using namespace view;
namespace fs = std::filesystem;

constexpr Size kSize{160, 120};
constexpr std::uint64_t kUnlimited = 1'000'000;

class Interactive : public test::WindowTest {
 protected:
  static ViewOptions options(std::uint64_t frames, const std::string& screenshot = "") {
    ViewOptions options;
    options.run.scene = "pile";
    options.run.spheres = 20;
    options.frames = frames;
    options.size = kSize;
    options.quality = kLowQuality;
    options.screenshot = screenshot;
    return options;
  }
  void TearDown() override {
    minimised = interval_is_refused = false;
    WindowTest::TearDown();
  }
  /// Presses and releases keys before the next picture.
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

TEST_F(Interactive, AWindowClosesAfterTheGivenNumberOfSteps) {
  App app(options(5));
  EXPECT_TRUE(app.frame(3.5 / 60));
  EXPECT_FALSE(app.frame(7.5 / 60));
  EXPECT_EQ(app.viewer().steps(), 5u);
}

TEST_F(Interactive, AWindowThatIsClosedStillWritesItsLastPicture) {
  SDL_Event quit{};
  quit.type = SDL_QUIT;
  SDL_PushEvent(&quit);
  EXPECT_EQ(run_interactive(options(kUnlimited, "last.png")), 0);
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
  EXPECT_EQ(run_interactive(options(3, "resized.png")), 0);
  ASSERT_TRUE(done);
  EXPECT_EQ(read_png("resized.png").width, 200);
  EXPECT_EQ(read_png("resized.png").height, 90);
  start_events();
  ViewOptions full = options(2, "full.png");
  full.fullscreen = true;
  EXPECT_EQ(run_interactive(full), 0);
  EXPECT_GT(read_png("full.png").width, kSize.width);
}

TEST_F(Interactive, HomeShowsEverythingInAWindowOfAnotherShape) {
  ViewOptions square = options(kUnlimited);
  square.size = {160, 160};
  App app(square);
  app.viewer().paused = true;
  app.frame(0);
  const Real before = app.viewer().camera.distance();
  SDL_SetWindowSize(app.window().sdl(), 40, 160);
  app.frame(0);
  ASSERT_EQ(app.window().pixel_width(), 40);
  press({SDLK_h});
  app.frame(0);
  EXPECT_GT(app.viewer().camera.distance(), before * 2);
}

TEST_F(Interactive, AWindowThatStartsPausedMakesNoStep) {
  ViewOptions paused = options(kUnlimited);
  paused.paused = true;
  App app(paused);
  app.frame(1);
  EXPECT_EQ(app.viewer().steps(), 0u);
  press({SDLK_SPACE});
  app.frame(1);
  EXPECT_GT(app.viewer().steps(), 0u);
  paused.headless = true;
  EXPECT_THROW(check(paused), InvalidArgument);
}

TEST_F(Interactive, AFileDroppedOnTheWindowIsOpened) {
  save_scene(scenes::make("gas", {.spheres = 3}), "three.json");
  std::ofstream("broken.json") << "{";
  const auto drop = [](const char* path) {
    SDL_Event event{};
    event.type = SDL_DROPFILE;
    event.drop.file = SDL_strdup(path);
    SDL_PushEvent(&event);
  };
  App app(options(kUnlimited));
  const auto bodies = [&app] {
    return dynamic_cast<const SceneViewer&>(app.viewer()).player().scene().bodies.size();
  };
  for (int i = 0; i < 3; ++i) app.frame(kRecordedFrame);
  press({SDLK_F9});
  app.frame(0);
  const std::size_t before = bodies();
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
  EXPECT_EQ(bodies(), before);
  EXPECT_EQ(app.finish(), 0);
}

int buffers_made = 0;
decltype(epoxy_glRenderbufferStorageMultisample) make_storage;
void counted_storage(GLenum target, GLsizei samples, GLenum format, GLsizei width, GLsizei height) {
  ++buffers_made;
  make_storage(target, samples, format, width, height);
}

TEST_F(Interactive, PicturesSideBySideShareTheirBuffers) {
  if (!has_engine(EngineKind::bullet)) GTEST_SKIP() << "built without Bullet";
  ViewOptions three = options(kUnlimited);
  three.side_by_side = true;
  three.size = {161, 120};  // not a multiple of 3
  App app(three);
  app.frame(0);
  make_storage = std::exchange(epoxy_glRenderbufferStorageMultisample, counted_storage);
  app.frame(0);
  EXPECT_EQ(buffers_made, 0);
  SDL_SetWindowSize(app.window().sdl(), 200, 120);
  app.frame(0);
  EXPECT_EQ(buffers_made, 2);  // colours and depths
  epoxy_glRenderbufferStorageMultisample = make_storage;
}

TEST_F(Interactive, PicturesPauseIfTheDriverCannotWaitForTheScreen) {
  interval_is_refused = true;
  App app(options(kUnlimited));
  app.frame(0);
  const int before = pauses;
  app.frame(0);
  EXPECT_GT(pauses, before);
}

TEST_F(Interactive, AMinimisedWindowStillHasPictures) {
  const auto take = [](const char* name, bool unseen) {
    start_events();
    App app(options(kUnlimited, std::string(name) + ".png"));
    app.viewer().paused = true;
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
  minimised = true;  // from the start
  start_events();
  EXPECT_EQ(run_interactive(options(2, "start.png")), 0);
  EXPECT_EQ(read_png("start.png").width, kSize.width);
}

TEST_F(Interactive, TheCameraOfADemoFollowsUntilTheUserMovesIt) {
  ViewOptions flight = options(kUnlimited);
  flight.run = {};
  flight.run.scene = "flight";
  App app(flight);
  Camera& camera = app.viewer().camera;
  const Vec3 start = camera.eye();
  for (int i = 0; i < 200; ++i) app.frame(kRecordedFrame);
  EXPECT_GT(length(camera.eye() - start), 5);
  app.viewer().paused = true;
  app.frame(0);
  demos::View shown;
  dynamic_cast<const DemoViewer&>(app.viewer()).demo().draw(&shown);
  EXPECT_LT(length(camera.eye() - shown.camera.eye), 1e-3);
  app.viewer().paused = false;
  camera.move(1, 0, 0);
  const Vec3 moved = camera.eye();
  for (int i = 0; i < 10; ++i) app.frame(kRecordedFrame);
  EXPECT_EQ(camera.eye(), moved);
}

TEST_F(Interactive, FailuresOfCommandsAreReportedAndThoseOfOptionsAreErrors) {
  fs::remove_all(fs::current_path());
  press({SDLK_F12, SDLK_F10, SDLK_F9});
  EXPECT_EQ(run_interactive(options(3)), 0);
  start_events();
  EXPECT_THROW(run_interactive(options(3, "last.png")), FileError);
}

TEST_F(Interactive, AFailedScreenshotLeavesTheRecordingComplete) {
  fs::create_directory("pictures");
  ViewOptions both = options(3, "pictures/last.png");
  both.recording = "run.rec";
  App app(both);
  fs::remove("pictures");
  while (app.frame(kRecordedFrame)) {
  }
  EXPECT_THROW(app.finish(), FileError);
  EXPECT_EQ(RecordingReader("run.rec").steps(), 3u);
}

TEST_F(Interactive, AFilmFailsTheRunOnlyIfTheCommandLineRequestedIt) {
  ViewOptions film = options(kUnlimited);
  film.pictures = "film";
  {
    App app(film);
    EXPECT_TRUE(app.frame(0));
    press({SDLK_F10, SDLK_F10});  // ends it and starts another one
    EXPECT_TRUE(app.frame(0));
    fs::remove_all("jfpx-view-frames-1");
    EXPECT_TRUE(app.frame(0));
    EXPECT_EQ(app.finish(), 0);
  }
  start_events();
  App app(film);
  fs::remove_all("film");
  EXPECT_FALSE(app.frame(0));
  EXPECT_THROW(app.finish(), FileError);
}

}  // namespace
}  // namespace jfpx
