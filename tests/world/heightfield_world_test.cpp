/// Tests of worlds with heightfields: seams, equality with meshes, files.
#include "src/scene/scene_json.hpp"
#include "tests/world/random_bodies.hpp"
#include "tests/world/sliders.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <variant>

namespace jfpx {
namespace {

using test::fixed_surface;
using test::Slider;
using test::operator""_r;

Heightfield flat_heightfield(std::uint32_t vertices, Real spacing) {
  return Heightfield({vertices,
                      vertices,
                      spacing,
                      spacing,
                      std::vector<Real>(std::size_t{vertices} * vertices, 0),
                      {},
                      false});
}

TEST(HeightfieldWorld, NothingIsStoppedBySeamsOfAFlatHeightfield) {
  const Real half_turn = square_root(0.5_r);
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    const Real sign = i % 2 == 0 ? 1.0_r : -1.0_r;
    const auto angle = static_cast<double>(i / 2) * test::kPiD / 2;
    corners.push_back({0.4_r * static_cast<Real>(std::cos(angle)), 0.3_r * sign,
                       0.4_r * static_cast<Real>(std::sin(angle))});
  }
  const Slider sliders[] = {
      {"ball", Sphere{0.5_r}, 0.5_r},
      {"box", Box{{0.5_r, 0.4_r, 0.3_r}}, 0.4_r},
      {"capsule", Capsule{0.25_r, 0.5_r}, 0.25_r, {half_turn, 0, 0, half_turn}},
      {"hull", centred(Hull(corners)), 0.3_r}};
  const Heightfield floor = flat_heightfield(61, 1);
  for (const Slider& slider : sliders) {
    const bool is_round = std::holds_alternative<Sphere>(slider.shape) ||
                          std::holds_alternative<Capsule>(slider.shape);
    test::expect_to_slide(slider, floor, is_round ? 0.001_r : 0.005_r);
  }
}

/// Bodies on a heightfield and on a mesh of the same triangles, immovable or kinematic.
TEST(HeightfieldWorld, BodiesMoveAsOnTheMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t contacts = 0;
  for (int run = 0; run < 16; ++run) {
    const Heightfield ground(test::random_heightfield(&random, 30));
    const TriangleMesh mesh = to_triangle_mesh(ground);
    if (mesh.triangles().empty()) continue;  // all cells are holes
    Scene scene;
    scene.bodies.push_back(fixed_surface(ground, 0.5_r));
    if (run % 2 == 1) {
      scene.bodies[0].kinematic = true;
      scene.bodies[0].angular_velocity = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
      scene.bodies[0].velocity = {0, random.uniform(0, 1), 0};
    }
    const Vec3 reach = ground.data()->half_extents;
    for (int n = 0; n < 40; ++n) {
      BodyDef body = test::random_body(&random, 1);
      if (!test::has_volume(body.shape)) continue;
      body.mass = 1;
      body.position = random.uniform_in_box(-reach, reach) + Vec3{0, random.uniform(0, 4), 0};
      body.velocity = random.uniform_in_box({-9, -20, -9}, {9, 5, 9});
      scene.bodies.push_back(body);
    }
    Scene twin = scene;
    twin.bodies[0].shape = mesh;
    World world(scene), other(twin);
    for (int n = 0; n < 60; ++n) {
      world.step();
      other.step();
      ASSERT_EQ(world.state_hash(), other.state_hash()) << run << ", step " << n;
      ASSERT_EQ(world.contacts().size(), other.contacts().size()) << run << ", step " << n;
    }
    for (std::size_t i = 0; i < world.contacts().size(); ++i) {
      EXPECT_EQ(world.contacts()[i].point, other.contacts()[i].point);
      EXPECT_EQ(world.contacts()[i].distance, other.contacts()[i].distance);
      EXPECT_EQ(world.contacts()[i].normal, other.contacts()[i].normal);
    }
    contacts += world.contacts().size();
  }
  EXPECT_GT(contacts, 100u);
}

TEST(HeightfieldWorld, ABallFallsThroughAHole) {
  Scene scene;
  HeightfieldDef def = flat_heightfield(5, 1).def();
  def.holes = {0};
  scene.bodies.push_back(fixed_surface(Heightfield(def), 0));
  for (const Real x : {-1.5_r, 1.5_r}) {
    BodyDef ball = test::ball({x, 1, x}, 0.3_r);
    ball.acceleration = {0, -9.81_r, 0};
    ball.restitution = 0;
    scene.bodies.push_back(ball);
  }
  World world(scene);
  for (int n = 0; n < 120; ++n) world.step();
  EXPECT_LT(world.state(world.bodies()[1]).position.y, -1);
  EXPECT_NEAR(world.state(world.bodies()[2]).position.y, 0.3_r, 0.01_r);
}

TEST(HeightfieldWorld, AMovableBodyCannotBeAHeightfield) {
  Scene scene;
  scene.bodies.push_back(fixed_surface(flat_heightfield(2, 1), 0));
  scene.bodies[0].mass = 1;
  try {
    validate(scene);
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_THAT(
        error.what(),
        testing::HasSubstr("mass is 1; it must be 0 for a heightfield, which has no volume"));
  }
}

TEST(HeightfieldWorld, JsonPreservesHeightfieldsAndNamesTheirFaults) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  for (int n = 0; n < 20; ++n) {
    scene.bodies.push_back(fixed_surface(Heightfield(test::random_heightfield(&random, 9)), 0.3_r));
  }
  EXPECT_EQ(from_json(to_json(scene)), scene);
  const auto complaint = [](const std::string& shape) -> std::string {
    try {
      from_json(R"({"jfpx_scene": 2, "bodies": [{"mass": 0, "shape": {"type": "heightfield", )" +
                shape + "}}]}");
    } catch (const InvalidScene& error) {
      return error.what();
    }
    return "";
  };
  const std::string grid = R"("columns": 2, "rows": 2, "spacing_x": 1, "spacing_z": 1)";
  EXPECT_EQ(complaint(grid + R"(, "heights": [0, 0, 0, 0])"), "");
  EXPECT_THAT(complaint(grid), testing::HasSubstr("body 0.shape: has no field \"heights\""));
  EXPECT_THAT(complaint(grid + R"(, "heights": [0, 0, 0])"),
              testing::HasSubstr("body 0.shape: heights has 3 items; it must have rows * columns"));
  EXPECT_THAT(complaint(grid + R"(, "heights": [])"), testing::HasSubstr("heights has 0 items"));
  EXPECT_THAT(complaint(grid + R"(, "heights": [0, "a", 0, 0])"),
              testing::HasSubstr("body 0.shape.heights[1]: is a string; it must be a number"));
  EXPECT_THAT(complaint(grid + R"(, "heights": [0, 0, 0, 0], "holes": [1])"),
              testing::HasSubstr("body 0.shape: holes[0] is 1; it must be"));
}

TEST(HeightfieldWorld, SnapshotsPreserveHeightfields) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  scene.bodies.push_back(fixed_surface(Heightfield(test::random_heightfield(&random, 30)), 0.3_r));
  for (int n = 0; n < 20; ++n) {
    scene.bodies.push_back(test::ball(random.uniform_in_box({-3, 0.2_r, -3}, {3, 2, 3}), 0.2_r));
  }
  World world(scene);
  for (int n = 0; n < 30; ++n) world.step();
  World restored(scene);
  const Snapshot snapshot = world.snapshot();
  restored.restore(snapshot);
  for (int n = 0; n < 30; ++n) {
    world.step();
    restored.step();
  }
  EXPECT_EQ(world.state_hash(), restored.state_hash());
}

}  // namespace
}  // namespace jfpx
