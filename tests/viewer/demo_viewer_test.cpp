/// Demos in the viewer: scripts and keys control them, and pictures show them.
#include "src/viewer/demo_viewer.hpp"

#include <jfpx/error.hpp>

#include "tests/viewer/gl_fixture.hpp"

#include <cstdlib>

namespace jfpx {
namespace {

using namespace view;
using DemoPictures = test::GlTest;

constexpr int kWidth = 320, kHeight = 200;

ViewOptions options_for(const std::string& demo, const std::string& script = "") {
  ViewOptions options;
  options.run.scene = demo;
  if (!script.empty()) options.input = std::string(JFPX_INPUT_FOLDER "/") + script;
  return options;
}

Real altitude(const DemoViewer& viewer) { return viewer.demo().states()[0].position.y; }

/// Difference of two pictures at a projected point.
int difference_at(const Image& a, const Image& b, const View& view, const Vec3& point) {
  const auto pixel = project(view, point, kWidth, kHeight);
  const int x = static_cast<int>(pixel->x), y = static_cast<int>(pixel->y);
  int sum = 0;
  for (int i = 0; i < 3; ++i) sum += std::abs(int{a.at(x, y)[i]} - int{b.at(x, y)[i]});
  return sum;
}

TEST_F(DemoPictures, AScriptFliesTheAircraftAndThePictureShowsIt) {
  DemoViewer flown(options_for("flight", "flight.input")), idle(options_for("flight"));
  for (int i = 0; i < 480; ++i) flown.step(), idle.step();
  ASSERT_GT(altitude(flown), 15);
  ASSERT_GT(altitude(flown), altitude(idle) + Real(0.3));  // the script pulls up from 4 s to 7 s

  const Vec3 position = flown.demo().states()[0].position;
  Camera camera;
  camera.look_at(position + Vec3{4, 2, 14}, position);
  const View view = camera.view(position, 8);
  demos::View shown;
  flown.demo().draw(&shown);
  demos::View empty = shown;
  empty.items.clear();
  const auto take = [&](const demos::View& content) {
    Drawing drawing(view.eye);
    drawing.set_bounds(position, 8);
    draw_demo(content, content, 1, &drawing);
    return picture(drawing, view, kWidth, kHeight);
  };
  const Image with = take(shown), without = take(empty);
  EXPECT_GT(difference_at(with, without, view, position), 60);
  // Two lengths behind the aircraft there is only ground.
  EXPECT_LT(difference_at(with, without, view, position + Vec3{5, Real(2.5), 0}), 12);
}

TEST(DemoViewer, ShowsTheItemsOfAllDemos) {
  for (const demos::Entry& entry : demos::all()) {
    if (!is_playable(entry.name)) continue;
    DemoViewer viewer(options_for(std::string(entry.name), std::string(entry.name) + ".input"));
    for (int i = 0; i < 140; ++i) viewer.step();
    demos::View shown;
    viewer.demo().draw(&shown);
    Drawing drawing(shown.camera.eye);
    draw_demo(shown, shown, 1, &drawing);
    EXPECT_GT(drawing.spheres().size() + drawing.boxes().size(), 1u) << entry.name;
    for (const BoxItem& item : drawing.boxes()) EXPECT_GT(item.half_extents[1], 0);
    EXPECT_EQ(viewer.status(), 0) << entry.name;
  }
}

TEST(DemoViewer, KeysControlTheDemoInsteadOfTheCamera) {
  DemoViewer controlled(options_for("flight")), idle(options_for("flight"));
  Controls controls;
  controls.set_demo_keys(controlled.demo_keys());
  SDL_Event event{};
  event.type = SDL_KEYDOWN;
  event.key.keysym.scancode = SDL_SCANCODE_S;  // raises both wings; without a demo, walks back
  controls.handle(event);
  for (const DemoKey& key : controls.take_demo_keys()) controlled.demo_key(key);
  for (int i = 0; i < 390; ++i) controlled.step(), idle.step();
  EXPECT_NE(controlled.demo().state_hash(), idle.demo().state_hash());
  Camera camera;
  controls.move(&camera, 1, 1);
  EXPECT_EQ(camera, Camera());
}

TEST(DemoViewer, AClickWithinOneStepFiresOnceAndDuringAPauseNotAtAll) {
  DemoViewer viewer(options_for("ballistic"));
  const auto bodies_after_step = [&viewer] {
    viewer.step();
    return viewer.demo().states().size();
  };
  viewer.demo_key({"mouse", true});
  viewer.demo_key({"mouse", false});
  viewer.demo_key({"no such key", true});
  EXPECT_EQ(bodies_after_step(), 1u);
  EXPECT_EQ(bodies_after_step(), 1u);
  viewer.restart();
  viewer.paused = true;
  for (int i = 0; i < 3; ++i) {
    viewer.demo_key({"mouse", true});
    viewer.demo_key({"mouse", false});
  }
  EXPECT_EQ(bodies_after_step(), 0u);
  viewer.demo_key({"mouse", true});  // and held
  EXPECT_EQ(bodies_after_step(), 1u);
}

TEST(DemoViewer, RejectsInvalidOptions) {
  ViewOptions options = options_for("flight");
  options.choice.engine = EngineKind::bullet;
  EXPECT_THROW(DemoViewer{options}, InvalidArgument);
  EXPECT_THROW(DemoViewer{options_for("flight", "missing.input")}, FileError);
  EXPECT_THROW(DemoViewer{options_for("flight", "ballistic.input")}, InvalidArgument);
  options = options_for("flight");
  options.recording = "flight.rec";
  EXPECT_THROW(check(options), InvalidArgument);
  EXPECT_THROW(check(options_for("pile", "flight.input")), InvalidArgument);
}

}  // namespace
}  // namespace jfpx
