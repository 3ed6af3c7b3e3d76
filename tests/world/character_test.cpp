/// Tests of characters: speeds on all kinds of ground, walls, slopes, steps, jumps, moving bodies,
/// and random terrain, on which closest_body() is the oracle.
#include <jfpx/character.hpp>
#include <jfpx/error.hpp>

#include "tests/world/solid_queries.hpp"
#include "tests/world/tiles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

namespace jfpx {
namespace {

using test::operator""_r;
using test::expect_near_vector;
using test::fixed_body;
using test::query_world;

constexpr Real kDt = Real(1) / 60;
constexpr Real kGravity = 9.81_r;

/// A character with the steps of a game.
struct Player {
  CharacterSettings settings;
  CharacterState state;
  std::vector<CharacterHit> hits;

  explicit Player(const Vec3& feet) { state.position = feet + Vec3{0, height(), 0}; }
  /// [m], of the middle above the ground.
  Real height() const { return settings.half_height + settings.radius + settings.skin; }
  Vec3 feet() const { return state.position - Vec3{0, height(), 0}; }
  bool stands() const { return state.ground_state == GroundState::ground; }

  void move(const World& world, const Vec3& velocity) {
    state.velocity = velocity;
    CharacterMove move = move_character(world, settings, state, kDt);
    state = move.state;
    hits = std::move(move.hits);
  }
  /// Falls, and keeps its horizontal velocity.
  void fall(const World& world) { move(world, state.velocity - Vec3{0, kGravity * kDt, 0}); }
  /// Falls, and walks with a horizontal velocity.
  void walk(const World& world, Real x, Real z) {
    move(world, {x, state.velocity.y - kGravity * kDt, z});
  }
  DistanceQuery query() const {
    return {.position = state.position, .shape = Capsule{settings.radius, settings.half_height}};
  }
};

BodyDef kinematic_box(const Vec3& half_extents, const Vec3& position, const Vec3& velocity) {
  BodyDef def = fixed_body(Box{half_extents}, position);
  def.kinematic = true;
  def.velocity = velocity;
  return def;
}
BodyDef turned(BodyDef def, const Vec3& axis, Real degrees) {
  def.orientation = from_axis_angle(axis, degrees * kPi / 180);
  return def;
}
Heightfield field(std::uint32_t size, Real spacing,
                  const std::function<Real(std::uint32_t, std::uint32_t)>& height) {
  HeightfieldDef def;
  def.rows = def.columns = size;
  def.spacing_x = def.spacing_z = spacing;
  for (std::uint32_t z = 0; z < size; ++z) {
    for (std::uint32_t x = 0; x < size; ++x) def.heights.push_back(height(x, z));
  }
  return Heightfield(std::move(def));
}
/// Floors at the height 0, at least from -12 to 12 m.
std::vector<std::pair<std::string, std::vector<BodyDef>>> floors() {
  const auto level = [](std::uint32_t, std::uint32_t) { return 0.0_r; };
  return {{"half-space", {fixed_body(HalfSpace{{0, 1, 0}, 0})}},
          {"box", {fixed_body(Box{{12, 1, 12}}, {0, -1, 0})}},
          {"boxes", test::tiled_floor(test::Tiles::boxes, 24, 0)},
          {"parts", test::tiled_floor(test::Tiles::parts, 24, 0)},
          {"mesh", {fixed_body(test::flat_grid(48, 0.5_r))}},
          {"heightfield", {fixed_body(field(49, 0.5_r, level))}}};
}

TEST(Character, WalksOnEachFloorWithItsSpeed) {
  for (const auto& [name, bodies] : floors()) {
    SCOPED_TRACE(name);
    const World world = query_world(bodies);
    for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{0.6_r, 0, 0.8_r}}) {
      const Vec3 start = direction * -5;
      Player player(start);
      for (int n = 0; n < 120; ++n) {
        player.walk(world, 5 * direction.x, 5 * direction.z);
        ASSERT_TRUE(player.stands()) << n;
        ASSERT_NEAR(player.feet().y, 0, 1e-4) << n;
        const Vec3 expected = start + direction * (5 * kDt * static_cast<Real>(n + 1));
        ASSERT_LT(length(player.feet() - expected), 1e-3_r) << n;
      }
      expect_near_vector(player.state.velocity, direction * 5);
      expect_near_vector(player.state.ground_normal, {0, 1, 0});
      EXPECT_EQ(player.hits.size(), 0u);
    }
  }
}

TEST(Character, FallsOntoEachFloor) {
  for (const auto& [name, bodies] : floors()) {
    SCOPED_TRACE(name);
    const World world = query_world(bodies);
    Player player({0.3_r, 2, 0.2_r});
    int landed = 0;
    for (int n = 1; n <= 60; ++n) {
      player.fall(world);
      if (player.stands() && landed == 0) {
        landed = n;
        ASSERT_EQ(player.hits.size(), 1u);
        EXPECT_NEAR(player.hits[0].approach_speed, std::sqrt(2 * 9.81 * 2), 0.2);
      }
    }
    EXPECT_NEAR(landed * static_cast<double>(kDt), std::sqrt(2 * 2 / 9.81), 1.01 / 60);
    EXPECT_NEAR(player.feet().y, 0, 1e-4);
  }
}

TEST(Character, HasTheTriangleOfTheGroundAndOfAHit) {
  const TriangleMesh mesh({{-9, 0, -9}, {-9, 0, 9}, {2, 0, -9}, {2, 0, 9}, {2, 9, -9}, {2, 9, 9}},
                          {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 5}});
  const World world = query_world({fixed_body(mesh)});
  Player player({-4, 0, 2});
  std::uint32_t walls = 0;
  for (int n = 0; n < 240; ++n) {
    player.walk(world, 3, 0);
    if (!player.stands()) continue;
    const auto ground = world.cast_ray({.origin = player.state.position, .direction = {0, -1, 0}});
    ASSERT_TRUE(ground.has_value());
    EXPECT_EQ(player.state.ground_part, ground->part) << n;
    for (const CharacterHit& hit : player.hits) {
      if (hit.normal.y > 0.5_r) continue;  // it lands
      EXPECT_LT(hit.normal.x, -0.9_r);
      EXPECT_EQ(hit.part, 2u);
      ++walls;
    }
  }
  EXPECT_GT(walls, 20u);
}

TEST(Character, SlidesAlongAWall) {
  const World world = query_world({test::ground(), fixed_body(Box{{1, 5, 50}}, {3, 5, 0})});
  Player player({0, 0, 0});
  for (int n = 0; n < 120; ++n) {
    player.walk(world, 3, 4);
    ASSERT_NEAR(player.state.position.z, 4 * kDt * static_cast<Real>(n + 1), 1e-3) << n;
  }
  EXPECT_NEAR(player.state.position.x, 2 - player.settings.radius - player.settings.skin, 1e-4);
  expect_near_vector(player.state.velocity, {0, 0, 4});
  ASSERT_EQ(player.hits.size(), 1u);
  EXPECT_EQ(player.hits[0].body, world.bodies()[1]);
  expect_near_vector(player.hits[0].normal, {-1, 0, 0});
  EXPECT_NEAR(player.hits[0].approach_speed, 3, 1e-4);
  EXPECT_NEAR(player.hits[0].point.x, 2, 1e-4);
}

TEST(Character, StopsInCornersAndDoesNotVibrate) {
  for (const Real angle : {20.0_r, 45.0_r, 80.0_r, 90.0_r, 120.0_r, 170.0_r}) {
    SCOPED_TRACE(angle);
    // Two walls that meet at x = 4, symmetric to the x axis.
    std::vector<BodyDef> bodies{test::ground()};
    for (const Real side : {-1.0_r, 1.0_r}) {
      BodyDef wall = turned(fixed_body(Box{{40, 5, 1}}), {0, 1, 0}, side * (angle / 2));
      const Mat3 axes = to_matrix(wall.orientation);
      wall.position = Vec3{4, 5, 0} + axes.column(0) * -40 + axes.column(2) * side;
      bodies.push_back(wall);
    }
    const World world = query_world(bodies);
    for (const Real z : {0.0_r, 0.4_r, -0.1_r}) {
      Player player({-6, 0, z});
      Vec3 before;
      for (int n = 0; n < 600; ++n) {
        before = player.state.position;
        player.walk(world, 5, 0.5_r * z);
        // Never backwards. Recovery of the skin may be as long as rounding errors.
        ASSERT_GT(player.state.position.x, before.x - 1e-4_r) << n;
      }
      EXPECT_LT(length(player.state.position - before), 1e-5_r);
      EXPECT_LT(length(player.state.velocity), 0.3_r);
      const auto closest = world.closest_body(player.query());
      ASSERT_TRUE(closest);
      EXPECT_GT(closest->distance, player.settings.skin * 0.9_r);
    }
  }
}

/// Ramps of 45 degrees that begin at x = 0 and rise along x.
std::vector<std::pair<std::string, BodyDef>> ramps() {
  const auto slope = [](std::uint32_t x, std::uint32_t) {
    return std::max(0.5_r * (static_cast<Real>(x) - 20), 0.0_r);
  };
  const Real thickness = std::sqrt(0.5_r);
  return {{"box", turned(fixed_body(Box{{20, 1, 5}}, {thickness, -thickness, 0}), {0, 0, 1}, 45)},
          {"mesh", fixed_body(test::grid(40, 0.5_r, slope))},
          {"heightfield", fixed_body(field(41, 0.5_r, slope))}};
}

TEST(Character, WalksUpSlopesThatAreNotTooSteep) {
  for (const auto& [name, ramp] : ramps()) {
    SCOPED_TRACE(name);
    const World world = query_world({test::ground(), ramp});
    for (const bool walkable : {true, false}) {
      SCOPED_TRACE(walkable);
      Player player({-2, 0, 0});
      player.settings.max_slope = (walkable ? 50 : 40) * kPi / 180;
      for (int n = 0; n < 120; ++n) {
        player.walk(world, 3, 0);
        ASSERT_TRUE(player.stands()) << n;
      }
      if (walkable) {
        // About 2 m to the ramp, then 4 m with the same speed.
        EXPECT_NEAR(player.feet().y, 4 * std::sqrt(0.5), 0.2);
      } else {
        EXPECT_NEAR(player.feet().y, 0, 1e-4);
        EXPECT_LT(player.feet().x, 0);
        EXPECT_LT(length(player.state.velocity), 1e-4_r);
      }
      // Down again, on the ground.
      if (!walkable) continue;
      for (int n = 0; n < 120; ++n) {
        player.walk(world, -3, 0);
        ASSERT_TRUE(player.stands()) << n;
      }
      EXPECT_NEAR(player.feet().y, 0, 1e-3);
    }
  }
}

TEST(Character, StopsBelowCeilingsThatMeetTheGround) {
  const Vec3 low = normalized(Vec3{-0.3_r, -1, 0});
  const BodyDef flat = fixed_body(Box{{30, 1, 30}}, {0, 3.9_r, 0});
  std::vector<std::vector<BodyDef>> scenes{
      {test::ground(), fixed_body(HalfSpace{low, dot(low, {4, 1.9_r, 0})})}};
  for (const auto& [name, ramp] : ramps()) scenes.push_back({test::ground(), ramp, flat});
  for (const std::vector<BodyDef>& bodies : scenes) {
    const World world = query_world(bodies);
    Player player({-4, 0, 0});
    player.settings.max_slope = 50 * kPi / 180;
    Vec3 before;
    for (int n = 0; n < 240; ++n) {
      before = player.state.position;
      player.walk(world, 4, 0);
      ASSERT_TRUE(player.stands()) << n;
      ASSERT_GT(player.state.position.x, before.x - 1e-3_r) << n;
    }
    EXPECT_GT(player.state.position.x, 0);
    EXPECT_LT(length(player.state.position - before), 1e-4_r);
    const auto closest = world.closest_body(player.query());
    ASSERT_TRUE(closest);
    EXPECT_GT(closest->distance, 0.4_r * player.settings.skin);
  }
}

TEST(Character, SlidesDownSteepSlopesAsWithoutFriction) {
  for (const auto& [name, ramp] : ramps()) {
    for (const Real push : {0.0_r, 3.0_r}) {  // against the slope
      SCOPED_TRACE(name);
      SCOPED_TRACE(push);
      const World world = query_world({test::ground(), ramp});
      Player player({6, 6.15_r, 0});
      player.settings.max_slope = 40 * kPi / 180;
      for (int n = 0; n < 6; ++n) player.fall(world);
      ASSERT_EQ(player.state.ground_state, GroundState::steep);
      const Vec3 start = player.state.position;
      const Real speed = length(player.state.velocity);
      for (int n = 0; n < 48; ++n) {
        const Real height = player.state.position.y;
        player.fall(world);
        if (push > 0) player.state.velocity.x = push;
        ASSERT_LT(player.state.position.y, height) << n;
        ASSERT_EQ(player.state.ground_state, GroundState::steep) << n;
      }
      if (push > 0) continue;
      const Real t = 48 * kDt;
      EXPECT_NEAR(length(player.state.position - start),
                  speed * t + kGravity * std::sqrt(0.125_r) * t * t, 0.1);
      for (int n = 0; n < 60; ++n) player.fall(world);
      EXPECT_TRUE(player.stands());
      EXPECT_NEAR(player.feet().y, 0, 1e-3);
    }
  }
}

std::vector<BodyDef> stairs(Real height, Real tread) {
  std::vector<BodyDef> bodies{test::ground()};
  for (int n = 0; n < 5; ++n) {
    const Real left = static_cast<Real>(n) * tread;
    const Real middle = static_cast<Real>(n) * height + height / 2;
    bodies.push_back(
        fixed_body(Box{{(20 - left) / 2, height / 2, 5}}, {(20 + left) / 2, middle, 0}));
  }
  return bodies;
}
/// The same as one mesh, with vertices of a profile.
BodyDef mesh_stairs(Real height, Real tread) {
  TriangleMeshDef def;
  const auto corner = [&](Real x, Real y) {
    def.vertices.push_back({x, y, -5});
    def.vertices.push_back({x, y, 5});
  };
  corner(-20, 0);
  for (int n = 0; n < 5; ++n) {
    const auto k = static_cast<Real>(n);
    corner(k * tread, k * height);
    corner(k * tread, (k + 1) * height);
  }
  corner(20, 5 * height);
  for (std::uint32_t i = 0; i + 3 < def.vertices.size(); i += 2) {
    def.triangles.push_back({i, i + 1, i + 2});
    def.triangles.push_back({i + 1, i + 3, i + 2});
  }
  return fixed_body(TriangleMesh(std::move(def)));
}

TEST(Character, ClimbsStepsUpToItsStepHeight) {
  for (const Real tread : {0.25_r, 0.5_r}) {
    for (const bool mesh : {false, true}) {
      for (const Real speed : {0.3_r, 2.0_r, 6.0_r}) {
        for (const Real height : {0.3_r, 0.5_r}) {
          SCOPED_TRACE(testing::Message() << "tread " << tread << ", mesh " << mesh << ", speed "
                                          << speed << ", height " << height);
          const World world =
              query_world(mesh ? std::vector{mesh_stairs(height, tread)} : stairs(height, tread));
          Player player({-0.5_r, 0, 0});
          const int steps = static_cast<int>(4 / (speed * kDt));
          for (int n = 0; n < steps; ++n) {
            player.walk(world, speed, 0.2_r * speed);
            ASSERT_TRUE(player.stands()) << n;
          }
          if (height > 0.4_r) {
            EXPECT_NEAR(player.feet().y, 0, 1e-4);
            EXPECT_LT(player.feet().x, 0);
            continue;
          }
          EXPECT_NEAR(player.feet().y, 5 * height, 5e-4);
          // Each step may take it two skins farther, or shorten a move.
          EXPECT_NEAR(player.feet().x, 3.5, 0.3);
          // Down again, with constant speed.
          for (int n = 0; n < steps * 5 / 4; ++n) {
            const Real x = player.feet().x;
            player.walk(world, -speed, 0);
            ASSERT_TRUE(player.stands()) << n;
            ASSERT_NEAR(player.feet().x, x - speed * kDt, player.settings.skin / 2 + 1e-3_r) << n;
          }
          EXPECT_NEAR(player.feet().y, 0, 1e-3);
        }
      }
    }
  }
}

TEST(Character, JumpsAndLandsInTime) {
  for (const auto& [name, bodies] : floors()) {
    SCOPED_TRACE(name);
    const World world = query_world(bodies);
    Player player({0, 0, 0});
    player.walk(world, 2, 0);
    ASSERT_TRUE(player.stands());
    player.move(world, {2, 5, 0});
    ASSERT_EQ(player.state.ground_state, GroundState::air);
    EXPECT_NEAR(player.feet().y, 5 * kDt, 1e-4);
    int steps = 1;
    Real highest = 0;
    for (; steps < 200 && !player.stands(); ++steps) {
      player.fall(world);
      highest = std::max(highest, player.feet().y);
    }
    EXPECT_NEAR(steps * static_cast<double>(kDt), 2 * 5 / 9.81, 1.5 / 60);
    EXPECT_NEAR(highest, 0.5 * 25 / 9.81, 0.05);
    expect_near_vector(player.state.velocity, {2, 0, 0});
  }
}

TEST(Character, JumpsOffASlopeThatItRunsUp) {
  for (const auto& [name, ramp] : ramps()) {
    SCOPED_TRACE(name);
    const World world = query_world({test::ground(), ramp});
    Player player({-1, 0, 0});
    player.settings.max_slope = 50 * kPi / 180;
    for (int n = 0; n < 40; ++n) player.walk(world, 4, 0);
    ASSERT_TRUE(player.stands());
    const Real height = player.feet().y;
    player.move(world, {4, 3, 0});
    EXPECT_EQ(player.state.ground_state, GroundState::air);
    EXPECT_GT(player.feet().y, height + 2.9_r * kDt);
  }
}

TEST(Character, HitsTheCeilingAndFalls) {
  const World world = query_world({test::ground(), fixed_body(Box{{5, 1, 5}}, {0, 3.5_r, 0})});
  Player player({0, 0, 0});
  player.walk(world, 0, 0);
  player.move(world, {1, 8, 0});
  Real highest = 0;
  bool hit = false;
  for (int n = 0; n < 60; ++n) {
    player.fall(world);
    highest = std::max(highest, player.state.position.y);
    if (!hit && player.hits.size() == 1) {
      hit = true;
      expect_near_vector(player.hits[0].normal, {0, -1, 0});
      EXPECT_NEAR(player.state.velocity.y, 0, 1e-4);
      EXPECT_NEAR(player.state.velocity.x, 1, 1e-4);
    }
  }
  EXPECT_TRUE(hit);
  EXPECT_NEAR(highest, 2.5_r - player.height(), 1e-4);
  EXPECT_TRUE(player.stands());
}

TEST(Character, RidesALift) {
  World world =
      query_world({test::ground(), kinematic_box({2, 0.1_r, 2}, {0, 0.1_r, 0}, {0.5_r, 1.5_r, 0})});
  const BodyId lift = world.bodies()[1];
  Player player({0, 0.2_r, 0});
  player.walk(world, 0, 0);
  for (int n = 0; n < 240; ++n) {
    if (n == 120) {
      BodyState state = world.state(lift);
      state.velocity = {-0.5_r, -1.5_r, 0.2_r};
      world.set_state(lift, state);
    }
    const Vec3 before = world.state(lift).position;
    const Vec3 offset = player.feet() - before;
    world.step();
    player.walk(world, 0, 0.25_r);
    ASSERT_TRUE(player.stands()) << n;
    ASSERT_EQ(player.state.ground_body, lift);
    const Vec3 moved = player.feet() - world.state(lift).position - offset;
    ASSERT_LT(length(moved - Vec3{0, 0, 0.25_r * kDt}), 1e-4_r) << n;
    ASSERT_LT(length(player.state.ground_velocity - world.state(lift).velocity), 1e-4_r);
    ASSERT_LT(length(player.state.velocity - Vec3{0, 0, 0.25_r}), 1e-4_r);
  }
  // A jump from a lift that moves has the velocity of both.
  const Vec3 velocity = world.state(lift).velocity;
  world.step();
  player.move(world, {0, 5, 0});
  EXPECT_EQ(player.state.ground_state, GroundState::air);
  expect_near_vector(player.state.velocity, velocity + Vec3{0, 5, 0}, 1e-4_r);
}

/// Walks in place for 300 steps on a surface that rotates about a point with 1 rad/s, and expects
/// the circle of radius 2 m about it.
void expect_ride(World& world, Player& player, const Vec3& centre, double tolerance) {
  player.walk(world, 0, 0);
  for (int n = 1; n <= 300; ++n) {
    world.step();
    player.walk(world, 0, 0);
    ASSERT_TRUE(player.stands());
    const double angle = n * static_cast<double>(kDt);
    ASSERT_NEAR(player.feet().x, static_cast<double>(centre.x) + 2 * std::cos(angle), tolerance)
        << n;
    ASSERT_NEAR(player.feet().z, static_cast<double>(centre.z) - 2 * std::sin(angle), tolerance)
        << n;
  }
}

TEST(Character, RidesATurntable) {
  BodyDef table = kinematic_box({4, 0.1_r, 4}, {1, -0.1_r, 0}, {});
  table.angular_velocity = {0, 1, 0};
  World world = query_world({table});
  Player player({3, 0, 0});
  expect_ride(world, player, {1, 0, 0}, 2e-3);
  EXPECT_LT(length(player.state.velocity), 1e-4_r);
  EXPECT_NEAR(length(player.state.ground_velocity), 2, 1e-3);
}

/// The surface with velocity v and angular velocity w rotates about the point at which both cancel.
TEST(Character, RidesAConveyor) {
  BodyDef belt = kinematic_box({6, 0.1_r, 6}, {1, -0.1_r, 0}, {1, 0, 0});
  belt.angular_velocity = {0, 1, 0};
  belt.motion_locks = kFixedPose;
  World world = query_world({belt});
  Player player({3, 0, -1});
  expect_ride(world, player, {1, 0, -1}, 0.06);
  EXPECT_NEAR(length(player.state.ground_velocity), 2, 0.04);
}

TEST(Character, IsPushedByDoorsThatClose) {
  for (const Vec3& normal : {Vec3{1, 0, 0}, Vec3{0, 0, -1}, Vec3{0.6_r, 0, 0.8_r}}) {
    BodyDef door = kinematic_box({0.1_r, 1, 0.1_r}, normal * -2 + Vec3{0, 1, 0}, normal * 2);
    World world = query_world({test::ground(), door});
    Player player({0.01_r, 0, 0.02_r});
    player.walk(world, 0, 0);
    bool pushed = false;
    for (int n = 0; n < 120; ++n) {
      world.step();
      player.walk(world, 0, 0);
      const auto closest = world.closest_body(player.query());
      ASSERT_TRUE(closest);
      ASSERT_GT(closest->distance, player.settings.skin * 0.48_r) << n;
      for (const CharacterHit& hit : player.hits) {
        pushed = pushed || (hit.body == world.bodies()[1] && hit.approach_speed > 1);
      }
    }
    EXPECT_TRUE(pushed);
    EXPECT_GT(length(player.feet()), 0.5_r);
  }
}

TEST(Character, IsPushedUpAndDownSlopes) {
  for (const Real degrees : {-40.0_r, -15.0_r, -4.0_r, 4.0_r, 6.0_r, 15.0_r, 30.0_r, 44.0_r}) {
    for (const Real speed : {0.6_r, 3.0_r, 6.0_r}) {
      SCOPED_TRACE(testing::Message() << degrees << " degrees, " << speed << " m/s");
      const Real angle = degrees * kPi / 180;
      const Vec3 uphill = rotate(from_axis_angle({0, 0, 1}, angle), Vec3{1, 0, 0});
      const Vec3 normal = rotate(from_axis_angle({0, 0, 1}, angle), Vec3{0, 1, 0});
      const BodyDef floor = fixed_body(HalfSpace{normal, 0});
      const BodyDef pusher = kinematic_box({0.5_r, 2, 2}, uphill * -3, uphill * speed);
      World world = query_world({floor, pusher});
      Player player({0, 0, 0});
      for (int n = 0; n < 20; ++n) player.walk(world, 0, 0);
      for (int n = 0; n < static_cast<int>(360 / speed); ++n) {
        world.step();
        player.walk(world, 0, 0);
        const auto closest = world.closest_body(player.query());
        ASSERT_TRUE(closest);
        ASSERT_GT(closest->distance, player.settings.skin * 0.45_r) << n;
      }
      EXPECT_GT(dot(player.feet(), uphill), 1.5_r);
    }
  }
}

TEST(Character, LeavesOverlapsAtTheStart) {
  const World world = query_world({test::ground(), fixed_body(Box{{1, 1, 1}}, {0, 1, 0})});
  Player player({1.1_r, -0.1_r, 0});
  player.walk(world, 0, 0);
  const auto closest = world.closest_body(player.query());
  ASSERT_TRUE(closest);
  EXPECT_GT(closest->distance, player.settings.skin * 0.48_r);
  EXPECT_TRUE(player.stands());
}

TEST(Character, PassesNoThinWall) {
  TriangleMeshDef sheet;
  sheet.two_sided = true;
  sheet.vertices = {{0, -1, -9}, {0, -1, 9}, {0, 9, 9}, {0, 9, -9}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const BodyDef& wall : {fixed_body(Box{{0.002_r, 5, 9}}, {0, 5, 0}),
                              fixed_body(Plane{{1, 0, 0}, 0}), fixed_body(TriangleMesh(sheet))}) {
    SCOPED_TRACE(wall.shape.index());
    const World world = query_world({test::ground(), wall});
    for (const Real start : {-8.3_r, -0.5_r, 0.4_r, 7.7_r}) {
      for (const Real up : {0.0_r, 20.0_r}) {
        Player player({start, 0, 0.1_r});
        player.walk(world, 0, 0);
        for (int n = 0; n < 30; ++n) {
          player.move(world, {start < 0 ? 100.0_r : -100.0_r, n < 3 ? up : 0, 0.3_r});
        }
        EXPECT_NEAR(std::abs(player.feet().x), player.settings.radius + player.settings.skin, 5e-3);
        EXPECT_EQ(player.feet().x < 0, start < 0);
      }
    }
  }
}

TEST(Character, WalksOverAnEdgeAndFalls) {
  const World world = query_world({test::ground(), fixed_body(Box{{2, 1, 2}}, {0, 1, 0})});
  Player player({0, 2, 0});
  int left = 0;
  for (int n = 0; n < 120; ++n) {
    player.walk(world, 3, 0);
    ASSERT_NEAR(player.feet().x, 3 * kDt * static_cast<Real>(n + 1), 1e-2) << n;
    if (left == 0 && !player.stands()) left = n;
  }
  EXPECT_NEAR(static_cast<double>(left) / 60, (2 + 0.3) / 3, 0.05);
  EXPECT_TRUE(player.stands());
  EXPECT_NEAR(player.feet().y, 0, 1e-4);
}

TEST(Character, PushesABodyThatItHits) {
  BodyDef crate;
  crate.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
  crate.position = {2, 0.5_r, 0};
  crate.mass = 20;
  World world = query_world({test::ground(), crate});
  const BodyId id = world.bodies()[1];
  Player player({0, 0, 0});
  for (int n = 0; n < 120; ++n) {
    world.step();
    player.walk(world, 2, 0);
    for (const CharacterHit& hit : player.hits) {
      if (hit.body != id) continue;
      world.apply_impulse_at_point(id, hit.normal * (-20 * hit.approach_speed), hit.point);
    }
  }
  EXPECT_GT(world.state(id).position.x, 2.3_r);
  EXPECT_GT(player.feet().x, 1.5_r);
}

TEST(Character, StandsInAnyDirection) {
  for (const Vec3& up : {Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0.48_r, 0.6_r, -0.64_r}}) {
    const World world = query_world({fixed_body(HalfSpace{up, 0})});
    const Vec3 ahead = normalized(cross(up, {0.3_r, 0.2_r, 0.9_r}));
    CharacterSettings settings;
    settings.up = up * 3;
    CharacterState state;
    const Real height = settings.half_height + settings.radius + settings.skin;
    state.position = up * height;
    for (int n = 0; n < 60; ++n) {
      state.velocity = ahead * 2 - up * (kGravity * kDt);
      state = move_character(world, settings, state, kDt).state;
    }
    EXPECT_EQ(state.ground_state, GroundState::ground);
    expect_near_vector(state.position, up * height + ahead * 2, 1e-3_r);
  }
}

TEST(Character, IgnoresSensorsAndFilteredBodies) {
  BodyDef zone = fixed_body(Box{{1, 1, 1}}, {1.5_r, 1, 0});
  zone.sensor = true;
  const World world =
      query_world({test::ground(), zone, fixed_body(Box{{1, 1, 1}}, {4.5_r, 1, 0})});
  Player player({0, 0, 0});
  player.settings.filter = [&](BodyId id) { return id != world.bodies()[2]; };
  for (int n = 0; n < 120; ++n) player.walk(world, 5, 0);
  EXPECT_NEAR(player.feet().x, 10, 1e-3);
}

/// Hills with ledges, and boxes, spheres, capsules and cylinders on and in them.
std::vector<BodyDef> random_terrain(std::mt19937_64& random, bool mesh) {
  const auto draw = [&](Real low, Real high) {
    return std::uniform_real_distribution<Real>(low, high)(random);
  };
  std::vector<Real> heights(51 * 51);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto x = static_cast<double>(i % 51), z = static_cast<double>(i / 51);
    heights[i] = static_cast<Real>(std::sin(x * 0.3) * std::cos(z * 0.4)) + draw(-0.3_r, 0.3_r);
    if (i % 17 == 0) heights[i] += draw(0, 2);
  }
  const auto height = [&](std::uint32_t x, std::uint32_t z) { return heights[x + 51 * z]; };
  std::vector<BodyDef> bodies{mesh ? fixed_body(test::grid(50, 0.8_r, height))
                                   : fixed_body(field(51, 0.8_r, height))};
  for (const Real side : {-1.0_r, 1.0_r}) {  // a fence
    bodies.push_back(fixed_body(HalfSpace{{-side, 0, 0}, -18}));
    bodies.push_back(fixed_body(HalfSpace{{0, 0, -side}, -18}));
  }
  for (int n = 0; n < 120; ++n) {
    const Vec3 position{draw(-18, 18), draw(-0.5_r, 1.5_r), draw(-18, 18)};
    const Box box{{draw(0.1_r, 1.5_r), draw(0.1_r, 1), draw(0.1_r, 1.5_r)}};
    const Real size = draw(0.2_r, 1);
    BodyDef def = fixed_body(n % 4 == 0   ? Shape(Sphere{size})
                             : n % 4 == 1 ? Shape(Capsule{size / 2, size})
                             : n % 8 == 2 ? Shape(Cylinder{size, size / 2})
                                          : Shape(box),
                             position);
    if (n % 3 != 0) {
      def = turned(def, {draw(-1, 1), draw(-1, 1), draw(-1, 1)}, draw(0, n % 3 == 1 ? 180 : 20));
    }
    bodies.push_back(def);
  }
  return bodies;
}

TEST(Character, WalksOnRandomTerrainWithoutEnteringAnything) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  std::mt19937_64 random(seed);
  const auto draw = [&](Real low, Real high) {
    return std::uniform_real_distribution<Real>(low, high)(random);
  };
  for (const bool mesh : {false, true}) {
    const World world = query_world(random_terrain(random, mesh));
    for (int who = 0; who < 10; ++who) {
      Player player({draw(-15, 15), 5, draw(-15, 15)});
      Vec3 velocity;
      int standing = 0;
      for (int n = 0; n < 2000; ++n) {
        if (n % 50 == 0) velocity = {draw(-6, 6), 0, draw(-6, 6)};
        const Player before = player;
        player.walk(world, velocity.x, velocity.z);
        if (player.stands()) ++standing;
        const std::optional<BodyDistance> closest = world.closest_body(player.query());
        ASSERT_TRUE(closest);
        ASSERT_GT(closest->distance, -1e-3_r)
            << n << ", body " << closest->body.index << ", mesh " << mesh;
        ASSERT_GT(player.feet().y, -3) << n;
        // No move is longer than its velocity, a step and the recovery of the skin.
        const Vec3 moved = player.state.position - before.state.position;
        ASSERT_LT(length({moved.x, 0, moved.z}), 0.3_r) << n;
        if (n % 100 == 50 && player.stands()) player.move(world, {velocity.x, 5, velocity.z});
        if (n % 10 == 0) {  // the same bits twice
          Player again = before;
          again.walk(world, velocity.x, velocity.z);
          Player same = before;
          same.walk(world, velocity.x, velocity.z);
          ASSERT_EQ(again.state, same.state);
          ASSERT_EQ(again.hits, same.hits);
        }
      }
      EXPECT_GT(standing, 200);
    }
  }
}

TEST(Character, IsNotPushedIntoFixedBodiesByThoseThatMove) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  std::mt19937_64 random(seed);
  const auto draw = [&](Real low, Real high) {
    return std::uniform_real_distribution<Real>(low, high)(random);
  };
  // A yard with walls of 10 cm, fixed, kinematic and movable boxes.
  std::vector<BodyDef> bodies{fixed_body(Box{{10, 1, 10}}, {0, -1, 0})};
  for (const Real side : {-1.0_r, 1.0_r}) {
    bodies.push_back(fixed_body(Box{{0.05_r, 50, 10}}, {8 * side, 50, 0}));
    bodies.push_back(fixed_body(Box{{10, 50, 0.05_r}}, {0, 50, 8 * side}));
  }
  for (int n = 0; n < 36; ++n) {
    BodyDef box = fixed_body(Box{{draw(0.2_r, 1), draw(0.1_r, 1), draw(0.2_r, 1)}},
                             {draw(-7, 7), draw(0, 3), draw(-7, 7)});
    box.kinematic = n % 3 == 1;
    if (n % 3 == 2) box.mass = 5;
    if (n % 6 == 0) {  // a conveyor is fixed
      box.kinematic = true;
      box.motion_locks = kFixedPose;
      box.velocity = {0.5_r, 0, 0.3_r};
    }
    bodies.push_back(box);
  }
  World world = query_world(bodies);
  const auto is_fixed = [&](BodyId id) { return id.index < 5 || (id.index - 5) % 3 == 0; };
  std::vector<Player> players;
  for (int n = 0; n < 8; ++n) players.push_back(Player({draw(-6, 6), 4, draw(-6, 6)}));
  for (int n = 0; n < 1000; ++n) {
    for (std::size_t i = 6; i < bodies.size() && n % 60 == 0; i += 3) {
      BodyState state = world.state(world.bodies()[i]);
      const Vec3& p = state.position;  // back to the middle
      state.velocity = {std::copysign(draw(-1, 2), -p.x), p.y > 3 ? -1.0_r : draw(-0.5_r, 1),
                        std::copysign(draw(-1, 2), -p.z)};
      state.angular_velocity = {draw(-0.3_r, 0.3_r), draw(-2, 2), draw(-0.3_r, 0.3_r)};
      world.set_state(world.bodies()[i], state);
    }
    world.step();
    for (Player& player : players) {
      player.walk(world, draw(-6, 6), draw(-6, 6));
      for (const CharacterHit& hit : player.hits) {
        world.apply_impulse_at_point(hit.body, hit.normal * (-5 * hit.approach_speed), hit.point);
      }
      const std::optional<BodyDistance> closest = world.closest_body(player.query(), is_fixed);
      ASSERT_TRUE(closest);
      ASSERT_GT(closest->distance, -1e-3_r) << n << ", body " << closest->body.index;
      const Vec3 feet = player.feet();
      ASSERT_TRUE(std::abs(feet.x) < 8 && std::abs(feet.z) < 8 && feet.y > -0.1_r) << n;
    }
  }
}

TEST(Character, StandsWhereSteepSurfacesHoldIt) {
  for (const Real steepness : {0.1_r, 0.3_r, 0.6_r}) {
    const Real across = std::sqrt(1 - steepness * steepness);
    const World world = query_world({fixed_body(HalfSpace{{across, steepness, 0}, -0.5_r}),
                                     fixed_body(HalfSpace{{-across, steepness, 0}, -0.6_r})});
    Player player({0, 5, 0});
    for (int n = 0; n < 240; ++n) player.fall(world);
    ASSERT_TRUE(player.stands());
    const Vec3 position = player.state.position;
    for (int n = 0; n < 20; ++n) {  // with and without gravity, which a game may leave out
      if (n % 2 == 0) player.move(world, {n % 4 == 0 ? 2.0_r : -2.0_r, 0, 0});
      if (n % 2 == 1) player.fall(world);
      ASSERT_TRUE(player.stands()) << n;
      ASSERT_LT(length(player.state.position - position), 1e-3_r);
    }
    player.move(world, {0, 5, 0});
    EXPECT_EQ(player.state.ground_state, GroundState::air);
    EXPECT_GT(player.state.position.y, position.y + 4 * kDt);
  }
}

TEST(Character, RefusesInvalidArguments) {
  const World world = query_world({test::ground()});
  const Player player({0, 0, 0});
  const auto message = [&](const auto& change, Real dt = kDt) -> std::string {
    CharacterSettings settings;
    CharacterState state = player.state;
    change(settings, state);
    try {
      move_character(world, settings, state, dt);
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return "no error";
  };
  using Settings = CharacterSettings;
  using State = CharacterState;
  EXPECT_EQ(message([](Settings& s, State&) { s.radius = 0; }),
            "radius is 0; it must be positive and finite");
  EXPECT_EQ(message([](Settings& s, State&) { s.half_height = test::kNan; }),
            "half_height is nan; it must be positive and finite");
  EXPECT_EQ(message([](Settings& s, State&) { s.up = {}; }),
            "up is (0, 0, 0); it must be finite and longer than epsilon");
  EXPECT_EQ(message([](Settings& s, State&) { s.max_slope = 2; }),
            "max_slope is 2; it must be from 0 to 1.5");
  EXPECT_EQ(message([](Settings& s, State&) { s.step_height = -1; }),
            "step_height is -1; it must be >= 0 and finite");
  EXPECT_EQ(message([](Settings& s, State&) { s.skin = 1; }),
            "skin is 1; it must be positive and less than the radius");
  EXPECT_EQ(message([](Settings&, State& s) {
              s.position = {test::kInfinity, 0, 0};
            }),
            "position is (inf, 0, 0); it must be between -1e9 and 1e9");
  EXPECT_EQ(message([](Settings&, State& s) {
              s.velocity = {test::kNan, 0, 0};
            }),
            "velocity is (nan, 0, 0); it must be finite");
  EXPECT_EQ(message([](Settings&, State&) {}, 0), "dt is 0; it must be positive and finite");
  EXPECT_NE(message([](Settings&, State& s) { s.velocity = {1e30_r, 0, 0}; }), "no error");
}

}  // namespace
}  // namespace jfpx
