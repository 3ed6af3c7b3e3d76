/// Tests of debug_draw().
#include <jfpx/debug_draw.hpp>
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::ball;
using test::ground;

struct Line {
  Vec3 from, to;
  DebugColor color = 0;
};

/// Keeps what is drawn.
struct Sketch : DebugDraw {
  void line(const Vec3& from, const Vec3& to, DebugColor color) override {
    lines.push_back({from, to, color});
  }
  void text(const Vec3&, std::string_view label, DebugColor) override {
    labels.emplace_back(label);
  }
  std::vector<Line> lines;
  std::vector<std::string> labels;
};

Sketch drawn(const World& world, const DebugDrawOptions& options = {}) {
  Sketch sketch;
  debug_draw(world, &sketch, options);
  return sketch;
}

World world_to_draw(const std::vector<BodyDef>& bodies) {
  Scene scene;
  scene.bodies = bodies;
  return World(scene);
}

/// All ends of the lines of a body are on its surface.
TEST(DebugDraw, LinesAreOnTheSurfaces) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int round = 0; round < 60; ++round) {
    BodyDef def = test::random_body(&random, 2);
    if (round < 2) def.shape = HalfSpace{test::random_direction(&random), 0.5_r};
    if (round < 2) def.mass = 0;
    const bool is_wall =
        std::holds_alternative<HalfSpace>(def.shape) || std::holds_alternative<Plane>(def.shape);
    const World world = world_to_draw({def});
    const Sketch sketch = drawn(world);
    // All cells of a heightfield may be holes.
    if (is_wall || test::has_volume(def.shape)) {
      ASSERT_GE(sketch.lines.size(), 3u);
    }
    std::size_t on_surface = 0;
    for (const Line& line : sketch.lines) {
      for (const Vec3& end : {line.from, line.to}) {
        const std::optional<BodyDistance> found = world.closest_body({.position = end});
        // The back of a one-sided triangle, or the tip of the normal of a wall.
        if (!found) continue;
        if (absolute(found->distance) < 1e-4_r) ++on_surface;
      }
    }
    // Parts of compounds may overlap, so some of their lines are inside.
    const std::size_t ends = 2 * sketch.lines.size();
    if (std::holds_alternative<Compound>(def.shape)) {
      EXPECT_GT(on_surface, ends / 8) << round;
    } else if (test::has_volume(def.shape)) {
      EXPECT_EQ(on_surface, ends) << round;
    } else if (is_wall) {
      EXPECT_EQ(on_surface, ends - 1) << round;
    }
  }
}

TEST(DebugDraw, ABoxHasTwelveEdges) {
  BodyDef def;
  def.shape = Box{{1, 2, 3}};
  def.position = {5, 0, 0};
  const Sketch sketch = drawn(world_to_draw({def}));
  ASSERT_EQ(sketch.lines.size(), 12u);
  std::multiset<Real> lengths;
  for (const Line& line : sketch.lines) lengths.insert(length(line.to - line.from));
  EXPECT_EQ(lengths, (std::multiset<Real>{2, 2, 2, 2, 4, 4, 4, 4, 6, 6, 6, 6}));
}

TEST(DebugDraw, ColorsShowTheKindOfABody) {
  Scene scene;
  BodyDef sleeper = ball({0, 1, 0}), faller = ball({5, 50, 0}), lift = ball({-5, 9, 0}, 1, 0);
  sleeper.can_sleep = true;
  faller.acceleration = {0, -1, 0};
  lift.kinematic = true;
  BodyDef zone = ball({9, 9, 9}, 1, 0);
  zone.sensor = true;
  scene.bodies = {sleeper, faller, lift, zone, ball({0, 20, 0}, 1, 0)};
  World world(scene);
  for (int n = 0; n < 120; ++n) world.step();
  const DebugDrawOptions options;
  const DebugColor expected[] = {options.asleep, options.awake, options.kinematic, options.sensor,
                                 options.immovable};
  for (std::uint32_t k = 0; k < 5; ++k) {
    const Sketch sketch = drawn(world, {.filter = [k](BodyId id) { return id.index == k; }});
    ASSERT_FALSE(sketch.lines.empty());
    for (const Line& line : sketch.lines) ASSERT_EQ(line.color, expected[k]) << k;
  }
}

/// [m], distance of a point from a segment.
Real distance_from(const Vec3& point, const std::array<Real, 6>& ends) {
  const Vec3 from{ends[0], ends[1], ends[2]}, along = Vec3{ends[3], ends[4], ends[5]} - from;
  const Real length2 = length_squared(along);
  const Real t = length2 > 0 ? dot(point - from, along) / length2 : 0;
  return length(point - (from + along * std::clamp(t, 0.0_r, 1.0_r)));
}

/// In a region, a heightfield has the triangles of the mesh with the same triangles. The mesh may
/// also have some of which only the bounds are in the region.
TEST(DebugDraw, HeightfieldsHaveTheTrianglesOfMeshes) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const auto ends = [](const BodyDef& def, const DebugDrawOptions& options) {
    std::vector<std::array<Real, 6>> sorted;
    for (const Line& line : drawn(world_to_draw({def}), options).lines) {
      sorted.push_back({line.from.x, line.from.y, line.from.z, line.to.x, line.to.y, line.to.z});
    }
    std::ranges::sort(sorted);
    return sorted;
  };
  std::size_t count = 0;
  for (int round = 0; round < 40; ++round) {
    const Heightfield field(test::random_heightfield(&random, 12));
    BodyDef def;
    def.mass = 0;
    def.position = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
    def.orientation = test::random_rotation(&random);
    def.shape = field;
    BodyDef meshed = def;
    const TriangleMesh mesh = to_triangle_mesh(field);
    if (mesh.triangles().empty()) continue;  // all cells are holes
    meshed.shape = mesh;
    DebugDrawOptions options;
    const Vec3 at = random.uniform_in_box({-4, -4, -4}, {4, 4, 4});
    if (round > 0) options.region = {at - Vec3{1, 2, 1}, at + Vec3{1, 2, 1}};
    const auto of_field = ends(def, options), of_mesh = ends(meshed, options);
    EXPECT_TRUE(std::ranges::includes(of_mesh, of_field)) << round;
    std::vector<std::array<Real, 6>> missing;
    std::ranges::set_difference(of_mesh, of_field, std::back_inserter(missing));
    for (const auto& line : missing) {
      ASSERT_GT(round, 0);
      EXPECT_GT(distance_from(at, line), 0.999_r * length(Vec3{1, 2, 1})) << round;
    }
    count += of_field.size();
  }
  EXPECT_GT(count, 10u);
}

TEST(DebugDraw, ARegionHasItsBodiesAndTheirJointsAndContacts) {
  Scene scene;
  scene.bodies = {ball({0, 1, 0}), ball({3, 1, 0}), ball({40, 1, 0}), ball({43, 1, 0}), ground()};
  for (BodyDef& def : scene.bodies) def.acceleration = {0, -10, 0};
  World world(scene);
  world.add_joint(DistanceJoint{.a = world.bodies()[0], .b = world.bodies()[1]});
  world.add_joint(DistanceJoint{.a = world.bodies()[2], .b = world.bodies()[3]});
  for (int n = 0; n < 5; ++n) world.step();
  DebugDrawOptions options{.shapes = false, .labels = true};
  EXPECT_EQ(drawn(world, options).lines.size(), 6u);
  EXPECT_EQ(drawn(world, options).labels, (std::vector<std::string>{"0", "1", "2", "3", "4"}));
  options.region = {{-1.5_r, 0.5_r, -2}, {1.5_r, 2, 2}};
  const Sketch close = drawn(world, options);
  EXPECT_EQ(close.labels, (std::vector<std::string>{"0"}));
  ASSERT_EQ(close.lines.size(), 3u);
  EXPECT_EQ(close.lines[0].from, world.state(world.bodies()[0]).position);

  DebugDrawOptions touching{.shapes = false, .joints = false, .contacts = true};
  touching.contact_forces = true;
  ASSERT_EQ(world.contacts().size(), 4u);
  EXPECT_EQ(drawn(world, touching).lines.size(), 8u);
  touching.region = {{-1.5_r, -1, -2}, {1.5_r, 2, 2}};
  const std::vector<Line> lines = drawn(world, touching).lines;
  ASSERT_EQ(lines.size(), 2u);
  // A weight of 10 N, 1 cm per newton.
  EXPECT_NEAR(length(lines[1].to - lines[1].from), 0.1, 0.02);
}

TEST(DebugDraw, OptionsOutOfTheirRangeAreNamed) {
  const World world = world_to_draw({ball({})});
  const auto complaint = [&](const DebugDrawOptions& options) -> std::string {
    try {
      drawn(world, options);
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(complaint({}), "");
  EXPECT_NE(complaint({.axis_length = -1}).find("axis_length is -1"), std::string::npos);
  EXPECT_NE(complaint({.force_length = test::kNan}).find("force_length"), std::string::npos);
  EXPECT_NE(complaint({.wall_size = 0}).find("wall_size"), std::string::npos);
  EXPECT_NE(complaint({.circle_points = 3}).find("circle_points is 3"), std::string::npos);
  EXPECT_NE(complaint({.region = Aabb{{1, 1, 1}, {0, 2, 2}}}).find("region: "), std::string::npos);
}

}  // namespace
}  // namespace jfpx
