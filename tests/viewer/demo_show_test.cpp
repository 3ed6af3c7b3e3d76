/// Demos in the viewer: scripts and keys steer them, and pictures show it.
#include "src/viewer/demo_show.hpp"

#include <jfpx/error.hpp>

#include "src/viewer/scene_choice.hpp"
#include "tests/viewer/gl_fixture.hpp"

#include <gmock/gmock.h>

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

Real altitude(const DemoShow& show) { return show.demo().states()[0].position.y; }

/// How much two pictures differ where a point is seen.
int difference_at(const Image& a, const Image& b, const View& view, const Vec3& point) {
  const auto pixel = project(view, point, kWidth, kHeight);
  const int x = static_cast<int>(pixel->x), y = static_cast<int>(pixel->y);
  int sum = 0;
  for (int i = 0; i < 3; ++i) sum += std::abs(int{a.at(x, y)[i]} - int{b.at(x, y)[i]});
  return sum;
}

TEST_F(DemoPictures, AScriptFliesTheAircraftAndThePictureShowsIt) {
  DemoShow flown(options_for("flight", "flight.input")), left(options_for("flight"));
  for (int i = 0; i < 480; ++i) flown.step(), left.step();
  ASSERT_GT(altitude(flown), 15);
  ASSERT_GT(altitude(flown), altitude(left) + Real(0.3));  // the script pulls up from 4 s to 7 s

  const Vec3 place = flown.demo().states()[0].position;
  Camera camera;
  camera.look_at(place + Vec3{4, 2, 14}, place);
  const View view = camera.view(place, 8);
  demos::View shown;
  flown.demo().draw(&shown);
  demos::View empty = shown;
  empty.items.clear();
  const auto take = [&](const demos::View& what) {
    Drawing drawing(view.eye);
    drawing.set_bounds(place, 8);
    draw_demo(what, what, 1, &drawing);
    return picture(drawing, view, kWidth, kHeight);
  };
  const Image with = take(shown), without = take(empty);
  EXPECT_GT(difference_at(with, without, view, place), 60);
  // Two lengths behind it there is nothing but ground.
  EXPECT_LT(difference_at(with, without, view, place + Vec3{5, Real(2.5), 0}), 12);
}

TEST(DemoShow, WhatWasPressedAndReleasedDuringAPauseDoesNotAct) {
  DemoShow show(options_for("ballistic"));
  show.paused = true;
  for (int i = 0; i < 3; ++i) {
    show.demo_key({"mouse", true});
    show.demo_key({"mouse", false});
  }
  show.step();
  EXPECT_EQ(show.demo().states().size(), 0u);
  show.demo_key({"mouse", true});  // and held
  show.step();
  EXPECT_EQ(show.demo().states().size(), 1u);
}

TEST_F(DemoPictures, OfAllDemosShowWhatTheyHave) {
  for (const demos::Entry& entry : demos::all()) {
    if (!is_playable(entry.name)) continue;
    DemoShow show(options_for(std::string(entry.name), std::string(entry.name) + ".input"));
    for (int i = 0; i < 140; ++i) show.step();
    demos::View shown;
    show.demo().draw(&shown);
    Drawing drawing(shown.camera.eye);
    draw_demo(shown, shown, 1, &drawing);
    EXPECT_GT(drawing.spheres().size() + drawing.boxes().size(), 1u) << entry.name;
    for (const BoxItem& item : drawing.boxes()) EXPECT_GT(item.half_extents[1], 0);
    EXPECT_EQ(show.status(), 0) << entry.name;
  }
}

TEST(DemoShow, KeysSteerInTheirOrder) {
  DemoShow steered(options_for("flight")), left(options_for("flight"));
  Controls controls;
  controls.set_demo_keys(steered.demo_keys());
  SDL_Event event{};
  event.type = SDL_KEYDOWN;
  event.key.keysym.scancode =
      SDL_SCANCODE_S;  // raises both wings; walks back where there is no demo
  controls.handle(event);
  for (const DemoKey& key : controls.take_demo_keys()) steered.demo_key(key);
  for (int i = 0; i < 390; ++i) steered.step(), left.step();
  EXPECT_NE(steered.demo().state_hash(), left.demo().state_hash());
  Camera camera;
  controls.move(&camera, 1, 1);
  EXPECT_EQ(camera, Camera());  // the key was the demo's
}

TEST(DemoShow, AClickFiresOnceEvenWithinOneStep) {
  DemoShow show(options_for("ballistic"));
  show.demo_key({"mouse", true});
  show.demo_key({"mouse", false});
  show.demo_key({"no such key", true});
  show.step();
  EXPECT_EQ(show.demo().states().size(), 1u);
  show.step();
  EXPECT_EQ(show.demo().states().size(), 1u);
  show.restart();
  EXPECT_EQ(show.demo().states().size(), 0u);
}

TEST(DemoShow, TheCameraFollowsUntilItIsMoved) {
  DemoShow show(options_for("flight"));
  show.home();
  const Vec3 first = show.camera.eye();
  for (int i = 0; i < 200; ++i) show.step();
  show.home();
  EXPECT_GT(length(show.camera.eye() - first), 5);
}

TEST(DemoShow, BadOptionsAreNamed) {
  ViewOptions options = options_for("flight");
  options.choice.engine = EngineKind::bullet;
  EXPECT_THROW(DemoShow{options}, InvalidArgument);
  EXPECT_THROW(DemoShow{options_for("flight", "missing.input")}, FileError);
  EXPECT_THROW(DemoShow{options_for("flight", "ballistic.input")}, InvalidArgument);
  options = options_for("flight");
  options.recording = "flight.rec";
  EXPECT_THROW(check(options), InvalidArgument);
  ViewOptions scene = options_for("pile", "flight.input");
  EXPECT_THROW(check(scene), InvalidArgument);
}

}  // namespace
}  // namespace jfpx
