/// Cylinders and cones in worlds: they roll, stand, stack and slide as rigid bodies do.
#include <jfpx/error.hpp>

#include "tests/world/sliders.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

BodyDef cylinder_at(const Vec3& position, const Quat& orientation, Real radius, Real half_height) {
  BodyDef def;
  def.shape = Cylinder{radius, half_height};
  def.position = position;
  def.orientation = orientation;
  return def;
}
/// The axis is the z axis of the world.
const Quat kAlongZ = normalized(Quat{1, 1, 0, 0});

/// Floors with their surface on the plane y = 0.
struct Floor {
  const char* name;
  Shape shape;
  Real y;
};
std::vector<Floor> floors() {
  HeightfieldDef field;
  field.columns = field.rows = 33;
  field.spacing_x = field.spacing_z = 0.4_r;
  field.heights.assign(33 * 33, 0);
  return {{"half-space", HalfSpace{}, 0},
          {"box", Box{{30, 0.5_r, 30}}, -0.5_r},
          {"mesh", test::flat_grid(40, 0.5_r), 0},
          {"heightfield", Heightfield(field), 0}};
}
BodyDef floor_body(const Floor& floor) {
  BodyDef def = test::fixed_surface(floor.shape, 0.6_r);
  def.position.y = floor.y;
  return def;
}
World after_seconds(const Scene& scene, double seconds) {
  World world(scene);
  for (int n = 0; n < static_cast<int>(seconds * 60); ++n) world.step();
  return world;
}

/// 2/3 g sin(a).
TEST(CylinderWorld, RollsDownASlopeAsItsInertiaSays) {
  for (const Real slope : {0.05_r, 0.2_r}) {
    for (const Floor& floor : floors()) {
      SCOPED_TRACE(floor.name + std::to_string(slope));
      Scene scene;
      const Real angle = std::atan(slope);
      BodyDef plane = floor_body(floor);
      plane.friction = 1;
      BodyDef log = cylinder_at({-3, 0.2_r, 0}, kAlongZ, 0.2_r, 0.5_r);
      log.friction = 1;
      log.can_sleep = false;
      log.acceleration = Vec3{std::sin(angle), -std::cos(angle), 0} * 9.81_r;
      scene.bodies = {plane, log};
      World world(scene);
      for (int n = 0; n < 120; ++n) world.step();
      const BodyState state = world.state(world.bodies()[1]);
      const double acceleration = 2.0 / 3 * 9.81 * static_cast<double>(std::sin(angle));
      const auto speed = static_cast<double>(state.velocity.x);
      EXPECT_NEAR(speed, 2 * acceleration, 0.01 * speed);
      EXPECT_NEAR(static_cast<double>(state.angular_velocity.z), -speed / 0.2, 0.01 * speed / 0.2);
      EXPECT_NEAR(state.position.y, 0.2, 2e-3);
      EXPECT_NEAR(state.position.z, 0, 2e-3);
    }
  }
}

TEST(CylinderWorld, StandsAndLiesAtRestOnEveryFloor) {
  for (const Floor& floor : floors()) {
    SCOPED_TRACE(floor.name);
    Scene scene;
    scene.bodies = {
        floor_body(floor), cylinder_at({0.1_r, 0.53_r, 0.2_r}, {}, 0.3_r, 0.5_r),
        cylinder_at({2.1_r, 0.23_r, 0.2_r}, kAlongZ, 0.2_r, 0.5_r),
        cylinder_at({-2.1_r, 0.53_r, 0.2_r}, normalized(Quat{1, 0.03_r, 0, 0.02_r}), 0.3_r, 0.5_r)};
    const World world = after_seconds(scene, 4);
    const Real heights[] = {0.5_r, 0.2_r, 0.5_r};
    for (std::size_t i = 1; i < 4; ++i) {
      const BodyId body = world.bodies()[i];
      const BodyState state = world.state(body);
      EXPECT_FALSE(world.awake(body)) << i;
      EXPECT_NEAR(state.position.y, heights[i - 1], 2e-3) << i;
      EXPECT_NEAR(state.position.x, scene.bodies[i].position.x, 0.05) << i;
      EXPECT_NEAR(state.position.z, scene.bodies[i].position.z, 0.05) << i;
    }
  }
}

TEST(CylinderWorld, StacksOfDrumsStandAndSleep) {
  Scene scene;
  scene.bodies = {floor_body(floors()[1])};
  constexpr int kDrums = 8;
  for (int i = 0; i < kDrums; ++i) {
    scene.bodies.push_back(cylinder_at({0, 0.3_r + 0.6_r * static_cast<Real>(i), 0},
                                       normalized(Quat{1, 0, 0.3_r * static_cast<Real>(i), 0}),
                                       0.4_r, 0.3_r));
  }
  const World world = after_seconds(scene, 6);
  for (std::size_t i = 1; i <= kDrums; ++i) {
    const BodyId body = world.bodies()[i];
    EXPECT_FALSE(world.awake(body)) << i;
    EXPECT_LT(length(world.state(body).position - scene.bodies[i].position), 0.01_r) << i;
  }
}

/// A pile of logs: cylinders on two others, in three layers, and a layer of parallel ones.
TEST(CylinderWorld, LogsStackAndSleep) {
  Scene scene;
  scene.bodies = {floor_body(floors()[1])};
  const Real r = 0.2_r;
  for (int layer = 0; layer < 3; ++layer) {
    const Quat q = layer % 2 == 0 ? normalized(Quat{1, 0, 0, 1}) : kAlongZ;
    for (const Real side : {-0.5_r, 0.5_r}) {
      const Vec3 across = layer % 2 == 0 ? Vec3{0, 0, side} : Vec3{side, 0, 0};
      BodyDef log = cylinder_at(Vec3{0, r * static_cast<Real>(2 * layer + 1), 0} + across, q, r, 1);
      log.rolling_friction = 0.01_r;
      scene.bodies.push_back(log);
    }
  }
  const World world = after_seconds(scene, 6);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const BodyId body = world.bodies()[i];
    EXPECT_FALSE(world.awake(body)) << i;
    EXPECT_LT(length(world.state(body).position - scene.bodies[i].position), 0.02_r) << i;
  }
}

/// Three parallel cylinders: one in the groove between two, which walls hold.
TEST(CylinderWorld, RestsInTheGrooveOfTwoOthers) {
  Scene scene;
  scene.bodies = {floor_body(floors()[1])};
  const Real r = 0.2_r;
  for (const Real side : {-1.0_r, 1.0_r}) {
    BodyDef wall;
    wall.shape = Box{{0.5_r, 1, 2}};
    wall.position = {side * (2 * r + 0.5_r), 1, 0};
    wall.mass = 0;
    scene.bodies.push_back(wall);
    scene.bodies.push_back(cylinder_at({side * r, r, 0}, kAlongZ, r, 1));
  }
  scene.bodies.push_back(cylinder_at({0, r * (1 + std::sqrt(3.0_r)), 0}, kAlongZ, r, 1));
  const World world = after_seconds(scene, 5);
  const BodyId top = world.bodies()[5];
  EXPECT_FALSE(world.awake(top));
  EXPECT_NEAR(world.state(top).position.y, r * (1 + std::sqrt(3.0_r)), 5e-3);
}

TEST(CylinderWorld, SlidesOverTheSeamsOfFlatFloors) {
  HeightfieldDef field;
  field.columns = field.rows = 101;
  field.spacing_x = field.spacing_z = 0.5_r;
  field.heights.assign(101 * 101, 0);
  const Shape surfaces[] = {test::flat_grid(100, 0.5_r), Heightfield(field)};
  const Real half_turn = std::sqrt(0.5_r);
  for (const Shape& floor : surfaces) {
    test::expect_to_slide({"standing", Cylinder{0.3_r, 0.25_r}, 0.25_r}, floor, 1e-3_r);
    test::expect_to_slide({"lying", Cylinder{0.25_r, 0.4_r}, 0.25_r, {half_turn, 0, 0, half_turn}},
                          floor, 1e-3_r);
  }
}

/// A coin that rolls on its rim, tilted, follows a circle and keeps its energy.
TEST(CylinderWorld, ACoinRollsOnItsRim) {
  Scene scene;
  BodyDef plane = test::half_space({0, 1, 0}, 0);
  plane.friction = 1;
  BodyDef coin = cylinder_at({0, 0.5_r, 0}, kAlongZ, 0.5_r, 0.05_r);
  coin.friction = 1;
  coin.velocity = {2, 0, 0};
  coin.angular_velocity = {0, 0, -4};
  coin.can_sleep = false;
  scene.bodies = {plane, coin};
  World world(scene);
  for (int n = 0; n < 120; ++n) world.step();
  const BodyState state = world.state(world.bodies()[1]);
  EXPECT_NEAR(state.velocity.x, 2, 0.02);
  EXPECT_NEAR(state.position.y, 0.5, 2e-3);
}

BodyDef cone_at(const Vec3& position, const Quat& orientation, Real radius, Real half_height) {
  BodyDef def = cylinder_at(position, orientation, 1, 1);
  def.shape = Cone{radius, half_height};
  return def;
}

TEST(ConeWorld, StandsAndLiesAtRestOnEveryFloor) {
  // Half the angle at the apex has the tangent 0.3 / 0.8. The side lies on the floor.
  const Real radius = 0.3_r, half_height = 0.4_r;
  const Real half_angle = std::atan(radius / (2 * half_height));
  const Real right = std::acos(-1.0_r) / 2;
  const Quat lying = from_axis_angle({0, 0, 1}, right + half_angle);
  const Real height = 1.5_r * half_height * std::sin(half_angle);
  for (const Floor& floor : floors()) {
    SCOPED_TRACE(floor.name);
    Scene scene;
    scene.bodies = {floor_body(floor), cone_at({0.1_r, 0.22_r, 0.2_r}, {}, radius, half_height),
                    cone_at({2.1_r, 0.3_r, 0.2_r}, lying, radius, half_height),
                    cone_at({-2.1_r, 0.25_r, 0.2_r}, normalized(Quat{1, 0.03_r, 0, 0.02_r}), radius,
                            half_height)};
    scene.bodies[2].rolling_friction = 0.005_r;
    const World world = after_seconds(scene, 5);
    for (std::size_t i = 1; i < 4; ++i) {
      const BodyId body = world.bodies()[i];
      const BodyState state = world.state(body);
      const Real up = to_matrix(state.orientation).column(1).y;
      EXPECT_FALSE(world.awake(body)) << i;
      if (i == 2) {
        EXPECT_NEAR(up, -std::sin(half_angle), 0.01);
        EXPECT_NEAR(state.position.y, height, 2e-3);
      } else {
        EXPECT_NEAR(state.position.y, half_height / 2, 2e-3) << i;
        EXPECT_NEAR(up, 1, 1e-3) << i;
      }
    }
  }
}

/// A lying cone rolls about its apex, which stays where it is.
TEST(ConeWorld, RollsInACircleAboutItsApex) {
  const Real radius = 0.3_r, half_height = 0.4_r;
  const Real half_angle = std::atan(radius / (2 * half_height));
  const Real right = std::acos(-1.0_r) / 2;
  const Quat lying = from_axis_angle({0, 0, 1}, right + half_angle);
  Scene scene;
  BodyDef plane = test::half_space({0, 1, 0}, 0);
  plane.friction = 1;
  const Real height = 1.5_r * half_height * std::sin(half_angle);
  BodyDef cone = cone_at({0, height, 0}, lying, radius, half_height);
  cone.friction = 1;
  cone.can_sleep = false;
  // The line of contact is the momentary axis.
  const Vec3 apex = Vec3{0, height, 0} + rotate(lying, {0, 1.5_r * half_height, 0});
  const Vec3 spin{-1.5_r, 0, 0};
  cone.angular_velocity = spin;
  cone.velocity = cross(spin, Vec3{0, height, 0} - apex);
  scene.bodies = {plane, cone};
  World world(scene);
  Real farthest = 0, turned = 0;
  for (int n = 0; n < 300; ++n) {
    world.step();
    const BodyState state = world.state(world.bodies()[1]);
    const Vec3 now = state.position + rotate(state.orientation, {0, 1.5_r * half_height, 0});
    farthest = std::max(farthest, length(now - apex));
    turned = std::max(turned, absolute(state.position.z));
  }
  EXPECT_LT(farthest, 0.03_r);
  EXPECT_GT(turned, 0.3_r);
}

TEST(CylinderWorld, JsonPreservesCylindersAndNamesTheirFaults) {
  Scene scene;
  scene.bodies = {cylinder_at({1, 2, 3}, kAlongZ, 0.25_r, 0.75_r)};
  CompoundPart part;
  part.shape = Cylinder{0.1_r, 0.2_r};
  CompoundPart other = part;
  other.shape = Cone{0.1_r, 0.2_r};
  BodyDef compound;
  compound.shape = Compound{{part, other}};
  scene.bodies.push_back(compound);
  EXPECT_EQ(from_json(to_json(scene)), scene);
  for (const bool is_radius : {true, false}) {
    for (const Real size : {0.0_r, -1.0_r, test::kNan}) {
      Scene bad;
      bad.bodies = {cylinder_at({}, {}, is_radius ? size : 1, is_radius ? 1 : size)};
      try {
        validate(bad);
        ADD_FAILURE() << size;
      } catch (const InvalidScene& error) {
        EXPECT_NE(std::string(error.what()).find(is_radius ? "radius" : "half_height"),
                  std::string::npos)
            << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace jfpx
