/// Tests of worlds with triangle meshes: seams, rest, rotating meshes, queries and files.
#include "src/scene/scene_json.hpp"
#include "tests/world/sliders.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jfpx {
namespace {

using test::fixed_surface;
using test::flat_grid;
using test::grid;
using test::Slider;
using test::operator""_r;

TEST(MeshWorld, NothingIsStoppedBySeamsOfAFlatMesh) {
  const Real half_turn = square_root(0.5_r);
  const Slider sliders[] = {
      {"ball", Sphere{0.5_r}, 0.5_r},
      {"box", Box{{0.5_r, 0.4_r, 0.3_r}}, 0.4_r},
      {"capsule", Capsule{0.25_r, 0.5_r}, 0.25_r, {half_turn, 0, 0, half_turn}}};
  const TriangleMesh floor = flat_grid(60, 1);
  for (const Slider& slider : sliders) test::expect_to_slide(slider, floor, 0.001_r);
}

TEST(MeshWorld, ABallRollsOverSeamsAtConstantSpeed) {
  Scene scene;
  scene.bodies.push_back(fixed_surface(flat_grid(60, 1), 0.8_r));
  BodyDef body = test::ball({-20, 0.5_r, 0.3_r}, 0.5_r);
  body.velocity = {5, 0, 0};
  body.angular_velocity = {0, 0, -10};
  body.friction = 0.8_r;
  body.acceleration = {0, -9.81_r, 0};
  scene.bodies.push_back(body);
  World world(scene);
  for (int n = 0; n < 480; ++n) world.step();
  const BodyState state = world.state(world.bodies()[1]);
  EXPECT_NEAR(state.velocity.x, 5, 0.025_r);
  EXPECT_NEAR(state.position.x, 20, 0.2_r);
  EXPECT_NEAR(state.position.y, 0.5_r, 0.001_r);
}

/// An edge is no seam if the surface rises there.
TEST(MeshWorld, AStepOfTheMeshStopsABall) {
  Scene scene;
  scene.bodies.push_back(fixed_surface(
      grid(40, 0.5_r, [](std::uint32_t x, std::uint32_t) { return x > 20 ? 2.0_r : 0.0_r; }), 0));
  BodyDef body = test::ball({-4, 0.3_r, 0.3_r}, 0.3_r);
  body.velocity = {4, 0, 0};
  body.restitution = 0;
  body.acceleration = {0, -9.81_r, 0};
  scene.bodies.push_back(body);
  World world(scene);
  Real farthest = -10;
  for (int n = 0; n < 180; ++n) {
    world.step();
    farthest = std::max(farthest, world.state(world.bodies()[1]).position.x);
  }
  EXPECT_GT(farthest, -0.5_r);
  EXPECT_LT(farthest, 0.6_r);
}

TEST(MeshWorld, BodiesComeToRestOnARoughMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  // A bowl, so that nothing rolls over the rim.
  scene.bodies.push_back(fixed_surface(
      grid(30, 0.7_r,
           [&random](std::uint32_t x, std::uint32_t z) {
             const Real dx = static_cast<Real>(x) - 15, dz = static_cast<Real>(z) - 15;
             return random.uniform(-0.2_r, 0.2_r) + 0.03_r * (dx * dx + dz * dz);
           }),
      0.6_r));
  for (int i = 0; i < 60; ++i) {
    BodyDef body;
    if (i % 3 == 0) body.shape = Sphere{0.3_r};
    if (i % 3 == 1) body.shape = Box{{0.3_r, 0.2_r, 0.4_r}};
    if (i % 3 == 2) body.shape = Capsule{0.2_r, 0.3_r};
    body.position = random.uniform_in_box({-4, 2, -4}, {4, 12, 4});
    body.rolling_friction = 0.02_r;
    scene.bodies.push_back(body);
  }
  World world(scene);
  for (int n = 0; n < 1200; ++n) world.step();
  int asleep = 0;
  for (const BodyId id : world.bodies()) {
    if (id.index == 0) continue;
    EXPECT_GT(world.state(id).position.y, -0.3_r) << id.index;
    asleep += world.awake(id) ? 0 : 1;
  }
  EXPECT_GE(asleep, 57);
  for (const Contact& contact : world.contacts()) EXPECT_GT(contact.distance, -0.03_r);
}

/// A drum with paddles: a prism of sixteen sides, closed by two lids.
TriangleMesh drum(Real radius, Real length) {
  TriangleMeshDef def;
  def.two_sided = true;
  constexpr std::uint32_t kSides = 16;
  const Real half = length / 2;
  const auto point = [&](std::uint32_t side, Real r, Real z) {
    const double angle = 2 * test::kPiD * side / kSides;
    return Vec3{r * static_cast<Real>(std::cos(angle)), r * static_cast<Real>(std::sin(angle)), z};
  };
  const auto add_quad = [&def](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto first = static_cast<std::uint32_t>(def.vertices.size());
    def.vertices.insert(def.vertices.end(), {a, b, c, d});
    def.triangles.insert(def.triangles.end(),
                         {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  };
  for (std::uint32_t i = 0; i < kSides; ++i) {
    add_quad(point(i, radius, -half), point(i, radius, half), point(i + 1, radius, half),
             point(i + 1, radius, -half));
    for (const Real z : {-half, half}) {
      add_quad({0, 0, z}, point(i, radius, z), point(i, radius, z), point(i + 1, radius, z));
    }
    if (i % 4 == 0) {
      add_quad(point(i, radius, -half), point(i, radius, half), point(i, 0.7_r * radius, half),
               point(i, 0.7_r * radius, -half));
    }
  }
  return TriangleMesh(std::move(def));
}

TEST(MeshWorld, ARotatingDrumKeepsItsContent) {
  Scene scene;
  BodyDef shell = fixed_surface(drum(1, 0.8_r), 0.5_r);
  shell.kinematic = true;
  shell.angular_velocity = {0, 0, 2};
  scene.bodies.push_back(shell);
  for (int i = 0; i < 60; ++i) {
    BodyDef body;
    if (i % 3 == 0) body.shape = Sphere{0.08_r};
    if (i % 3 == 1) body.shape = Box{{0.07_r, 0.06_r, 0.08_r}};
    if (i % 3 == 2) body.shape = Capsule{0.06_r, 0.05_r};
    body.position = {static_cast<Real>(i % 4) * 0.2_r - 0.3_r,
                     static_cast<Real>(i / 12) * 0.2_r - 0.4_r,
                     static_cast<Real>(i / 4 % 3) * 0.2_r - 0.2_r};
    scene.bodies.push_back(body);
  }
  World world(scene);
  Real highest = -1;
  for (int n = 0; n < 600; ++n) {
    world.step();
    for (const BodyId id : world.bodies()) {
      if (id.index == 0) continue;
      const Vec3 p = world.state(id).position;
      ASSERT_LT(p.x * p.x + p.y * p.y, 1) << id.index << ", step " << n;
      ASSERT_LT(absolute(p.z), 0.4_r) << id.index << ", step " << n;
      if (n > 300) highest = std::max(highest, p.y);
    }
  }
  EXPECT_GT(highest, 0.2_r);  // the paddles lift the content
}

TEST(MeshWorld, AMovableBodyCannotBeAMesh) {
  Scene scene;
  scene.bodies.push_back(fixed_surface(flat_grid(1, 1), 0));
  scene.bodies[0].mass = 1;
  try {
    validate(scene);
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_THAT(
        error.what(),
        testing::HasSubstr("mass is 1; it must be 0 for a triangle mesh, which has no volume"));
  }
}

TEST(MeshWorld, JsonPreservesMeshesAndNamesTheirFaults) {
  Scene scene;
  BodyDef body = fixed_surface(
      grid(3, 0.1_r, [](std::uint32_t x, std::uint32_t z) { return static_cast<Real>(x * z) / 7; }),
      0.3_r);
  scene.bodies = {body, body};
  EXPECT_EQ(from_json(to_json(scene)), scene);
  const auto complaint = [](const std::string& shape) -> std::string {
    try {
      from_json(R"({"jfpx_scene": 2, "bodies": [{"mass": 0, "shape": {"type": "triangle_mesh", )" +
                shape + "}}]}");
    } catch (const InvalidScene& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(complaint(R"("vertices": [], "triangles": [])"),
              testing::HasSubstr("triangles is empty; it must have at least one triangle"));
  EXPECT_THAT(complaint(R"("vertices": [[0, 0, 0]], "triangles": [[0, 0, 1]])"),
              testing::HasSubstr("body 0.shape: triangles[0][2] is 1; it must be an index"));
  EXPECT_THAT(complaint(R"("vertices": [[0, 0, 0]], "triangles": [[0, 0]])"),
              testing::HasSubstr("body 0.shape.triangles[0]: must be an array of 3 indices"));
  EXPECT_THAT(complaint(R"("vertices": [[0, 0, 0]])"),
              testing::HasSubstr("body 0.shape: has no field \"triangles\""));
}

}  // namespace
}  // namespace jfpx
