/// Tests of worlds with hulls: mass, rest, seams, buoyancy and files.
#include "src/scene/compound.hpp"
#include "src/scene/scene_json.hpp"
#include "tests/world/meshes.hpp"
#include "tests/world/random_bodies.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

/// A right prism around the y axis, whose centre of mass is the origin.
Hull prism(std::uint32_t sides, Real radius, Real half_height) {
  std::vector<Vec3> points;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * test::kPiD * i / sides;
    for (const Real y : {-half_height, half_height}) {
      points.push_back({radius * static_cast<Real>(std::cos(angle)), y,
                        radius * static_cast<Real>(std::sin(angle))});
    }
  }
  return centred(Hull(points));
}
Hull hull_of(const Box& box) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    Vec3 corner = box.half_extents;
    for (int axis = 0; axis < 3; ++axis) {
      if ((i >> axis & 1) != 0) corner[axis] = -corner[axis];
    }
    corners.push_back(corner);
  }
  return Hull(corners);
}
BodyDef body_with(const Shape& shape, const Vec3& position) {
  BodyDef def;
  def.shape = shape;
  def.position = position;
  return def;
}

TEST(HullWorld, AHullOfABoxHasTheInertiaOfTheBox) {
  const Box box{{0.5_r, 0.7_r, 1.1_r}};
  const Mat3 hull = solid_inertia(hull_of(box), 3), expected = solid_inertia(box, 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(length(hull.row[i] - expected.row[i]), 1e-5_r * length(expected.row[i]));
  }
  // A part that is not centred: the box from the origin to (2, 2, 2).
  const Hull corner = hull_of({{1, 1, 1}}).translated({1, 1, 1});
  const MassProperties part = mass_properties(Compound{{{.shape = corner}}}, 2);
  const MassProperties moved =
      mass_properties(Compound{{{.shape = Box{{1, 1, 1}}, .position = {1, 1, 1}}}}, 2);
  EXPECT_LT(length(part.centre - moved.centre), 1e-5_r);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(length(part.inertia.row[i] - moved.inertia.row[i]), 1e-4_r);
  }
}

TEST(HullWorld, AMovableHullMustBeCentred) {
  Scene scene;
  scene.bodies.push_back(body_with(hull_of({{1, 1, 1}}).translated({0.5_r, 0, 0}), {}));
  try {
    validate(scene);
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_THAT(error.what(),
                testing::HasSubstr("centre of mass of vertices is (0.5, 0, 0); it must be the "
                                   "origin, to a thousandth of the hull's radius; centred()"));
  }
  scene.bodies[0].shape = centred(std::get<Hull>(scene.bodies[0].shape));
  EXPECT_NO_THROW(validate(scene));
  scene.bodies[0].shape = hull_of({{1, 1, 1}}).translated({0.5_r, 0, 0});
  scene.bodies[0].mass = 0;
  EXPECT_NO_THROW(validate(scene));
}

/// The hull of sixteen points near a sphere.
Hull random_stone(Random* random) {
  std::vector<Vec3> points;
  for (int i = 0; i < 16; ++i) {
    const Vec3 size = random->uniform_in_box({0.3_r, 0.3_r, 0.3_r}, {0.5_r, 0.5_r, 0.5_r});
    points.push_back(component_product(test::random_direction(random), size));
  }
  return centred(Hull(points));
}

/// Sixty stones in a pit, which fall onto each other. Without friction of rolling and spinning, a
/// hull that is wedged between two points swings about the line through them like a pendulum. Thin
/// splinters may rock for longer: see bench/results/meshes.md.
Scene heap_of_hulls(Random* random) {
  Scene scene;
  for (const auto& [normal, offset] : {std::pair(Vec3{0, 1, 0}, 0),
                                       {Vec3{1, 0, 0}, -2},
                                       {Vec3{-1, 0, 0}, -2},
                                       {Vec3{0, 0, 1}, -2},
                                       {Vec3{0, 0, -1}, -2}}) {
    scene.bodies.push_back(test::half_space(normal, static_cast<Real>(offset)));
  }
  for (int i = 0; i < 60; ++i) {
    BodyDef body = body_with(random_stone(random), {});
    body.position = {static_cast<Real>(i % 3) * 1.2_r - 1.2_r, 1 + static_cast<Real>(i / 9) * 1.2_r,
                     static_cast<Real>(i / 3 % 3) * 1.2_r - 1.2_r};
    body.orientation = test::random_rotation(random);
    body.rolling_friction = body.spinning_friction = 0.02_r;
    scene.bodies.push_back(body);
  }
  return scene;
}

/// Within 40 s; one of three heaps may take longer. The median is 4 s.
TEST(HullWorld, HullsComeToRestInAHeap) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int heaps_asleep = 0;
  for (int heap = 0; heap < 3; ++heap) {
    World world(heap_of_hulls(&random));
    for (int n = 0; n < 2400; ++n) world.step();
    int asleep = 0;
    for (const BodyId id : world.bodies()) {
      if (id.index < 5) continue;
      const Vec3 p = world.state(id).position;
      EXPECT_GT(p.y, 0) << id.index;
      EXPECT_LT(std::max(absolute(p.x), absolute(p.z)), 2) << id.index;
      asleep += world.awake(id) ? 0 : 1;
    }
    heaps_asleep += asleep >= 55 ? 1 : 0;
    for (const Contact& contact : world.contacts()) EXPECT_GT(contact.distance, -0.02_r);
  }
  EXPECT_GE(heaps_asleep, 2);
}

/// As MeshWorld.NothingIsStoppedBySeamsOfAFlatMesh, for a prism with twelve sides.
TEST(HullWorld, AHullSlidesOverTheSeamsOfAFlatMesh) {
  const TriangleMesh floor = test::flat_grid(60, 1);
  for (const Real speed : {0.3_r, 5.0_r, 20.0_r}) {
    Scene scene;
    scene.sleep.enabled = false;
    scene.bodies.push_back(test::fixed_surface(floor, 0));
    BodyDef body = body_with(prism(12, 0.5_r, 0.3_r), {-15.87_r, 0.3_r, -11.8_r});
    body.friction = 0;
    body.velocity = Vec3{0.8_r, 0, 0.6_r} * speed;
    scene.bodies.push_back(body);
    World world(scene);
    Real most = 0;
    const int steps = speed < 1 ? 900 : static_cast<int>(36 * 60 / speed);
    for (int n = 0; n < steps; ++n) {
      world.step();
      most = std::max(most, absolute(world.state(world.bodies()[1]).position.y - 0.3_r));
    }
    EXPECT_LT(most, 0.001_r) << speed;
    EXPECT_NEAR(length(world.state(world.bodies()[1]).velocity), speed, 0.005_r * speed);
  }
}

/// Half of a prism is below the surface of a liquid of twice its density.
TEST(HullWorld, AHullFloatsByItsVolume) {
  const Hull hull = prism(8, 0.5_r, 0.5_r);
  Scene scene;
  BodyDef body = body_with(hull, {0, 0.1_r, 0});
  body.mass = 100;
  body.linear_damping = body.angular_damping = 0.1_r;
  scene.bodies.push_back(body);
  World world(scene);
  world.add_force(Buoyancy{.liquid = {{0, 1, 0}, 0},
                           .density = static_cast<Real>(2 * 100 / hull.volume()),
                           .gravity = 9.81_r});
  for (int n = 0; n < 900; ++n) world.step();
  EXPECT_NEAR(world.state(world.bodies()[0]).position.y, 0, 0.01_r);
}

TEST(HullWorld, JsonPreservesHullsAndNamesTheirFaults) {
  Random random(11);
  Scene scene;
  scene.bodies.push_back(body_with(test::random_hull(&random), {}));
  scene.bodies.push_back(body_with(Compound{{{.shape = prism(5, 1, 1)}}}, {}));
  EXPECT_EQ(from_json(to_json(scene)), scene);
  const auto read = [](const std::string& fields) {
    return from_json(R"({"jfpx_scene": 2, "bodies": [{"mass": 0, "shape": {"type": "hull", )" +
                     fields + "}}]}");
  };
  const auto complaint = [&](const std::string& fields) -> std::string {
    try {
      read(fields);
    } catch (const InvalidScene& error) {
      return error.what();
    }
    return "";
  };
  // Faces may be absent.
  const Scene scene_of_points =
      read(R"("vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]])");
  EXPECT_EQ(std::get<Hull>(scene_of_points.bodies[0].shape).vertices().size(), 4u);
  EXPECT_THAT(complaint(R"("vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])"),
              testing::HasSubstr("body 0.shape: points is within"));
  EXPECT_THAT(complaint(R"("vertices": [[0, 0, 0]])"),
              testing::HasSubstr("body 0.shape: points has 1 points; it must have at least 4"));
  EXPECT_THAT(complaint(R"("faces": [])"), testing::HasSubstr("has no field \"vertices\""));
}

}  // namespace
}  // namespace jfpx
