/// Drawing and picking of scenes, colours by island, forces as arrows, comparison of contacts, and
/// the order of drawing.
#include "src/viewer/scene_painter.hpp"

#include "src/scenes/scenes.hpp"
#include "src/viewer/comparison.hpp"
#include "src/viewer/draw_order.hpp"
#include "src/viewer/forces.hpp"
#include "src/viewer/run.hpp"
#include "tests/support/seed.hpp"
#include "tests/viewer/painted_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>

namespace jfpx {
namespace {

using namespace view;
using test::add;
using test::draw;
using test::run_state_of;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

/// Balls of 2 kg at the origin, the last one immovable.
Scene balls(std::size_t count) {
  Scene scene;
  BodyDef ball;
  ball.mass = 2;
  ball.acceleration = {0, -10, 0};
  scene.bodies.assign(count, ball);
  scene.bodies.back().mass = 0;
  scene.dt = Real(0.125);
  return scene;
}

TEST(Islands, AreConnectedByMovableBodiesOnly) {
  const Scene scene = balls(8);
  const auto touch = [](std::uint32_t a, std::uint32_t b) {
    return Contact{{a, 0}, {b, 0}, {}, {}};
  };
  // 5-6-3 and 1-2; 0, 1 and 4 touch the immovable 7, which connects nothing.
  const std::vector<Contact> contacts = {touch(5, 6), touch(1, 2), touch(3, 6),
                                         touch(0, 7), touch(4, 7), touch(1, 7)};
  EXPECT_THAT(islands_of(scene, contacts), ElementsAre(0, 1, 1, 3, 4, 3, 3, 7));
  EXPECT_THAT(islands_of({}, {}), IsEmpty());
  const auto paints = island_paints(scene, contacts);
  EXPECT_EQ(paints[3], paints[5]);
  EXPECT_EQ(paints[0], paints[4]);  // alone: grey
  EXPECT_EQ(paints[0].r + 10, paints[0].b);
  EXPECT_NE(paints[1], paints[3]);
  EXPECT_NE(paints[1], paints[0]);
}

TEST(BodyForces, ExcludeWeightAndAreDrawnAsArrowsOfBoundedLength) {
  const Scene scene = balls(4);
  RunState before, now;
  before.states.resize(4);
  now.states = before.states;
  now.step = 1;
  now.dt = scene.dt;
  now.states[1].velocity = {0, Real(-1.25), 0};  // falls freely: 10 / 8
  now.states[2].velocity = {3, 0, 0};            // struck while at rest
  EXPECT_THAT(forces_between(scene, before, now),
              ElementsAre(Vec3{0, 20, 0}, Vec3{}, Vec3{48, 20, 0}, Vec3{}));
  now.states[2].velocity = {1e6, 0, 0};
  Drawing drawing({0, 0, 10});
  draw_forces(scene, before, now, 2, &drawing);
  ASSERT_EQ(drawing.lines().size(), 6u);          // two arrows of a shaft and two lines of a head
  EXPECT_FLOAT_EQ(drawing.lines()[0].to[1], 2);   // one unit for one weight
  EXPECT_FLOAT_EQ(drawing.lines()[3].to[0], 10);  // at most five units
  now.step = 0;
  EXPECT_THAT(forces_between(scene, before, now), ::testing::Each(Vec3{}));
}

TEST(Comparison, FindsEveryPlantedDifference) {
  std::vector<Contact> contacts;
  for (std::uint32_t i = 0; i < 20; ++i) {
    contacts.push_back({{i, 0}, {i + 1, 0}, {1, 0, 0}, {Real(i), 0, 0}, Real(-0.01)});
  }
  contacts.push_back(contacts.back());  // a duplicate counts
  EXPECT_THAT(different_contacts(contacts, contacts), IsEmpty());
  const std::vector<Contact> reversed(contacts.rbegin(), contacts.rend());
  EXPECT_THAT(different_contacts(contacts, reversed), IsEmpty());
  std::vector<Contact> planted = contacts;
  planted[7].distance = std::nextafter(planted[7].distance, Real(0));
  EXPECT_EQ(different_contacts(contacts, planted).size(), 2u);  // one removed, one added
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
  add(&scene, Sphere{2}, {}, 3);
  scene.bodies[0].acceleration = {0, -10, 0};
  const BodyState state{{0, 7, 0}, {}, {4, 0, 0}, {0, 0, 5}};
  // 3 16/2 + (0.4 3 4) 25/2 + 3 10 7
  EXPECT_NEAR(energy(scene, std::vector{state}), 24 + 60 + 210, 1e-3);
  scene.bodies[0].shape = Box{{1, 2, 3}};
  // A half turn about x does not affect a spin about z: 3/3 (1 + 4) 25/2
  const BodyState turned{{0, 7, 0}, {0, 1, 0, 0}, {4, 0, 0}, {0, 0, 5}};
  EXPECT_NEAR(energy(scene, std::vector{turned}), 24 + 62.5 + 210, 1e-3);
  scene.bodies[0].shape = Compound{
      {{.shape = Sphere{1}, .position = {-3, 0, 0}}, {.shape = Sphere{1}, .position = {3, 0, 0}}}};
  const BodyState spinning{{}, {}, {}, {0, 0, 1}};
  EXPECT_NEAR(energy(scene, std::vector{spinning}), 14.1, 1e-4);  // 2 * 1.5 (0.4 + 9) / 2
  scene.bodies[0].inertia = diagonal({1, 1, 7});
  EXPECT_NEAR(energy(scene, std::vector{spinning}), 3.5, 1e-4);
}

TEST(ScenePainter, DrawsAndPicksThePartsOfACompound) {
  Scene scene;
  add(&scene,
      Compound{{{.shape = Sphere{1}, .position = {-3, 0, 0}},
                {.shape = Box{{1, 1, 1}}, .position = {3, 0, 0}}}},
      {0, 5, 0}, 1);
  scene.bodies[0].orientation = {Real(0.70710678), 0, 0, Real(0.70710678)};  // x points up
  add(&scene, Plane{{1, 0, 0}, -8}, {}, 0);
  const RunState run_state = run_state_of(scene);
  const ScenePainter painter(scene);
  const auto pick = [&](const Vec3& eye) {
    return painter.pick(run_state, run_state, 1, eye, {0, 0, -1});
  };
  EXPECT_EQ(pick({0, 8, 20}), 0u);  // the box
  EXPECT_EQ(pick({0, 2, 20}), 0u);  // the ball
  EXPECT_EQ(pick({0, 5, 20}), std::nullopt);
  EXPECT_EQ(pick({3, 5, 20}), std::nullopt);
  const Drawing drawing = draw(scene, run_state);
  ASSERT_EQ(drawing.spheres().size(), 1u);
  ASSERT_EQ(drawing.boxes().size(), 1u);
  EXPECT_NEAR(drawing.spheres()[0].centre[1], 2, 1e-4);
  EXPECT_NEAR(drawing.boxes()[0].centre[1], 8, 1e-4);
  ASSERT_GE(drawing.grounds().size(), 1u);
  EXPECT_NEAR(drawing.grounds()[0].height, 8, 1e-4);
}

TEST(ScenePainter, PicksTheNearestMovableBodyAtItsDrawnPosition) {
  Scene scene;
  add(&scene, Sphere{1}, {0, 0, 4}, 0);  // immovable, in front
  add(&scene, Sphere{1}, {0, 0, -3}, 1);
  add(&scene, Box{{1, 1, 1}}, {0, 0, 0}, 1);
  add(&scene, Sphere{1}, {4, 0, 0}, 1);
  const RunState from = run_state_of(scene);
  RunState to = from;
  to.states[3].position = {8, 0, 0};
  const ScenePainter painter(scene);
  const auto pick = [&](const Vec3& eye, Real z) {
    return painter.pick(from, to, Real(0.25), eye, {0, 0, z});
  };
  EXPECT_EQ(pick({0, 0, 10}, -1), 2u);
  EXPECT_EQ(pick({0, 0, -10}, 1), 1u);
  EXPECT_EQ(pick({5, Real(0.99), 10}, -1), 3u);
  EXPECT_EQ(pick({5, Real(1.01), 10}, -1), std::nullopt);
  EXPECT_EQ(pick({0, 0, 10}, 1), std::nullopt);  // all are behind
  Drawing drawing({});
  painter.draw_mark(from, to, Real(0.25), 3, &drawing);
  ASSERT_EQ(drawing.lines().size(), 12u);
  for (const LineItem& line : drawing.lines()) EXPECT_NEAR(line.from[0], 5, 1.1);
}

TEST(ScenePainter, DrawsBodiesBetweenTwoStepsAndSleepersDarker) {
  const Scene scene = balls(3);
  RunState from, to;
  from.states.resize(3);
  from.awake.assign(3, 1);
  to = from;
  from.states[0].position = {1, 2, 3};
  to.states[0].position = {2, 4, 3};
  to.states[0].orientation = {0, 0, 1, 0};  // half a turn about y
  to.awake[1] = 0;
  Drawing drawing({});
  ScenePainter(scene).draw(from, to, Real(0.25), Colouring::bodies, &drawing);
  ASSERT_EQ(drawing.spheres().size(), 3u);
  const SphereItem& moving = drawing.spheres()[0];
  EXPECT_THAT(moving.centre, ElementsAre(1.25f, 2.5f, 3.0f));
  // (3/4, 0, 1/4, 0), normalized
  EXPECT_NEAR(moving.turn[1], 1 / std::sqrt(10.0), 1e-6);
  EXPECT_NEAR(moving.turn[3], 3 / std::sqrt(10.0), 1e-6);
  const Drawing awake = draw(scene, from);
  EXPECT_LT(drawing.spheres()[1].paint.r, awake.spheres()[1].paint.r);
  EXPECT_EQ(drawing.spheres()[0].paint, awake.spheres()[0].paint);
}

TEST(ScenePainter, DifferentContactsAreRedAndWiderThanOthers) {
  const Scene scene = balls(3);
  const std::vector<Contact> contacts = {{{0, 0}, {1, 0}, {1, 0, 0}, {1, 2, 3}, Real(-0.1)},
                                         {{0, 0}, {2, 0}, {1, 0, 0}, {4, 5, 6}, Real(-0.1)}};
  Drawing usual({}), errors({});
  ScenePainter(scene).draw_contacts(contacts, false, &usual);
  ScenePainter(scene).draw_contacts(contacts, true, &errors);
  ASSERT_EQ(usual.lines().size(), 4u);  // the normal and the point of each contact
  ASSERT_EQ(errors.lines().size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(errors.lines()[i].width, usual.lines()[i].width);
    EXPECT_GT(errors.lines()[i].rgba[0], 4 * errors.lines()[i].rgba[1]);
    EXPECT_GT(usual.lines()[i].rgba[1], 100);  // green, or orange with an immovable body
  }
}

TEST(ScenePainter, DrawsFiniteBodiesAmongNonFiniteOnes) {
  const Scene scene = scenes::make("lattice", {.spheres = 64});
  RunState run_state = make_run(scene, {})->run_state();
  const ScenePainter painter(scene);
  const Bounds before = painter.bounds(run_state.states);
  const auto set = [&run_state](std::size_t i, Real value) {
    run_state.states[i].position = run_state.states[i].velocity = {value, value, value};
  };
  DrawOrder order;
  const auto visible = [&](Colouring colouring) {
    const Bounds bounds = painter.bounds(run_state.states);
    EXPECT_TRUE(std::isfinite(bounds.radius));
    Camera camera;
    camera.look_at(before.centre + Vec3{0, 0, before.radius * 4}, before.centre);
    const View view = camera.view(bounds.centre, bounds.radius);
    Drawing drawing(view.eye);
    painter.draw(run_state, run_state, 1, colouring, &drawing);
    EXPECT_EQ(order.sort(drawing.spheres(), view, 1).size(), 64u);
    return order.visible();
  };
  std::size_t body = 0;
  while (!(scene.bodies[body].mass > 0)) ++body;
  set(body, 1e6);
  EXPECT_LT(painter.bounds(run_state.states).radius, before.radius * Real(1.1));  // an outlier
  set(body, std::numeric_limits<Real>::quiet_NaN());
  set(body + 1, std::numeric_limits<Real>::infinity());
  set(body + 2, -std::numeric_limits<Real>::infinity());
  EXPECT_EQ(visible(Colouring::speed), 61u);
  EXPECT_EQ(visible(Colouring::islands), 61u);
  for (std::size_t i = 0; i < run_state.states.size(); ++i) {
    set(i, std::numeric_limits<Real>::quiet_NaN());
  }
  EXPECT_EQ(visible(Colouring::speed), 0u);
}

/// The upper ends of boxes.
std::vector<float> tops(const std::vector<BoxItem>& boxes) {
  std::vector<float> tops;
  for (const BoxItem& box : boxes) tops.push_back(box.centre[1] + box.half_extents[1]);
  return tops;
}

TEST(ScenePainter, DrawsTheWallsOfARoomAsGlassAndOtherBoxesUnchanged) {
  const Scene room = scenes::make("gas", {.spheres = 30000});
  const Drawing drawing = draw(room, run_state_of(room));
  EXPECT_EQ(drawing.glass().size(), 5u);
  EXPECT_EQ(drawing.boxes().size(), 1u);  // the floor

  Scene stairs;
  add(&stairs, Sphere{Real(0.5)}, {0, 1, 0}, 1);
  for (const Real i : {Real(0), Real(1), Real(2)}) {
    add(&stairs, Box{{1, Real(0.25), 1}}, {2 * i, i * Real(-0.5), 0}, 0);
  }
  const Drawing steps = draw(stairs, run_state_of(stairs));
  EXPECT_THAT(tops(steps.boxes()), UnorderedElementsAre(0.25f, -0.25f, -0.75f));
  EXPECT_THAT(steps.glass(), IsEmpty());
  ASSERT_EQ(steps.grounds().size(), 1u);
  EXPECT_LE(-steps.grounds()[0].height, -1.25f);  // below the lowest step

  Scene floors;  // the larger one is the floor of the room
  add(&floors, Sphere{Real(0.5)}, {0, 5, 0}, 1);
  add(&floors, Box{{1, Real(0.25), 1}}, {0, 3, 0}, 0);
  add(&floors, Box{{9, Real(0.5), 9}}, {0, 0, 0}, 0);
  EXPECT_THAT(tops(draw(floors, run_state_of(floors)).boxes()), UnorderedElementsAre(3.25f, 0.5f));
}

TEST(DrawOrder, PutsVisibleSpheresFirstFrontToBackAndLosesNone) {
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
  for (const std::size_t count : {0u, 1u, 700u}) {
    Drawing drawing(view.eye);
    for (std::size_t i = 0; i < count; ++i) drawing.add_sphere(point(), size(random), {}, {});
    std::vector<SphereItem> given = drawing.spheres();
    std::vector<SphereItem> ordered = order.sort(given, view, Real(kWidth) / kHeight);
    float last = 0;
    for (std::size_t i = 0; i < order.visible(); ++i) {
      const auto distance = static_cast<float>(length(vec(ordered[i].centre)));
      const float front = std::max(distance - ordered[i].radius, 0.0f);  // the eye may be inside
      EXPECT_GE(front, last - 70.0f / 2000) << i;  // 2048 shells in the diagonal of 40 m cubed
      last = std::max(last, front);
    }
    // No point of the remaining spheres is in the picture.
    for (std::size_t i = order.visible(); i < count; ++i) {
      for (int k = 0; k < 50; ++k) {
        const Vec3 on_it = normalized(point()) * Real(ordered[i].radius) + vec(ordered[i].centre);
        const auto pixel = project(view, view.eye + on_it, kWidth, kHeight);
        EXPECT_FALSE(pixel && pixel->x > 0 && pixel->x < kWidth && pixel->y > 0 &&
                     pixel->y < kHeight)
            << i;
      }
    }
    const auto key = [](const SphereItem& s) { return std::tuple(s.centre[0], s.radius); };
    const auto by_key = [&](const auto& a, const auto& b) { return key(a) < key(b); };
    const auto same = [&](const auto& a, const auto& b) { return key(a) == key(b); };
    std::sort(given.begin(), given.end(), by_key);
    std::sort(ordered.begin(), ordered.end(), by_key);
    EXPECT_TRUE(std::equal(given.begin(), given.end(), ordered.begin(), ordered.end(), same));
    // A field of view of 41 by 23 degrees contains a small part of the surroundings.
    EXPECT_LE(order.visible(), std::max<std::size_t>(count * 3 / 4, 1));
  }
}

TEST(ScenePainter, DrawsALineBetweenTheAnchorsOfAJoint) {
  Scene scene = balls(3);
  scene.bodies[1].position = {3, 0, 0};
  DistanceJoint joint{.a = {0, 0}, .b = BodyId{1, 0}};
  joint.anchor_a = {0, 1, 0};
  scene.joints = {joint, DistanceJoint{.a = {1, 0}, .anchor_b = {0, 0, 9}}};
  const Drawing drawing = draw(scene, run_state_of(scene));
  ASSERT_EQ(drawing.lines().size(), 2u);
  EXPECT_THAT(drawing.lines()[0].from, ElementsAre(0, 1, 0));
  EXPECT_THAT(drawing.lines()[0].to, ElementsAre(3, 0, 0));
  EXPECT_THAT(drawing.lines()[1].from, ElementsAre(3, 0, 0));
  EXPECT_THAT(drawing.lines()[1].to, ElementsAre(0, 0, 9));
}

}  // namespace
}  // namespace jfpx
