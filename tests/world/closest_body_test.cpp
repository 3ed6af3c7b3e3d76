/// Tests of distance queries in a World: known cases, meshes against an oracle in double, and bad
/// input. tests/collide/closest_points_test.cpp has the oracle of two solids.
#include <jfpx/error.hpp>
#include <jfpx/world.hpp>

#include "tests/collide/convex_distance.hpp"
#include "tests/collide/support_oracle.hpp"
#include "tests/world/meshes.hpp"
#include "tests/world/random_bodies.hpp"
#include "tests/world/solid_queries.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using ::testing::ElementsAre;

/// A point, and all_solids().
std::vector<SolidShape> point_and_solids() {
  std::vector<SolidShape> solids = all_solids();
  solids.insert(solids.begin(), Sphere{0});
  return solids;
}

TriangleMeshDef square_sheet(Real half) {
  TriangleMeshDef sheet;
  sheet.vertices = {{-half, 0, -half}, {-half, 0, half}, {half, 0, half}, {half, 0, -half}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  return sheet;
}

TEST(ClosestBody, IsAsFarAsEachSolidIsAboveEachFloor) {
  HeightfieldDef grid;
  grid.columns = grid.rows = 9;
  grid.heights.assign(81, 0);
  Compound tiles;
  for (const Real x : {Real(-2), Real(2)})
    tiles.parts.push_back({Box{{2, 1, 4}}, {x, 0, 0}, {}, 1});
  const std::vector<std::pair<Shape, Vec3>> floors = {{HalfSpace{{0, 1, 0}, 0}, {}},
                                                      {Plane{{0, 1, 0}, 0}, {}},
                                                      {Plane{{0, -1, 0}, 0}, {}},
                                                      {Box{{4, 1, 4}}, {0, -1, 0}},
                                                      {TriangleMesh(square_sheet(4)), {}},
                                                      {Heightfield(grid), {}},
                                                      {tiles, {0, -1, 0}},
                                                      {Cylinder{3, 1}, {0, -1, 0}}};
  for (std::size_t i = 0; i < floors.size(); ++i) {
    const World world = query_world({fixed_body(floors[i].first, floors[i].second)});
    for (const SolidShape& solid : point_and_solids()) {
      SCOPED_TRACE(testing::Message() << "floor " << i << ", solid " << solid.index());
      const Vec3 from{0.3_r, 2 + depth_below(solid), -0.2_r};
      const auto found = world.closest_body({from, solid});
      ASSERT_TRUE(found);
      EXPECT_EQ(found->body, world.bodies()[0]);
      EXPECT_NEAR(found->distance, 2, kQueryTolerance);
      expect_near_vector(found->normal, {0, 1, 0});
      EXPECT_NEAR(found->point.y, 0, kQueryTolerance);
      EXPECT_NEAR(found->query_point.y, 2, kQueryTolerance);
      // Below the solid.
      EXPECT_LE(absolute(found->point.x - from.x), 0.5_r + kQueryTolerance);
      EXPECT_LE(absolute(found->point.z - from.z), 0.5_r + kQueryTolerance);
      EXPECT_TRUE(world.closest_body({from, solid, {}, 2.001_r}));
      EXPECT_FALSE(world.closest_body({from, solid, {}, 1.999_r}));
      if (depth_below(solid) == 0) continue;
      const Vec3 inside{0.3_r, depth_below(solid) - 0.05_r, -0.2_r};
      const auto overlap = world.closest_body({inside, solid, {}, 0});
      ASSERT_TRUE(overlap);
      EXPECT_NEAR(overlap->distance, -0.05_r, kQueryTolerance);
      expect_near_vector(overlap->normal, {0, 1, 0}, 1e-3_r);
      EXPECT_NEAR(overlap->point.y, 0, 1e-4);
      EXPECT_NEAR(overlap->query_point.y, -0.05_r, 1e-4);
    }
  }
}

TEST(ClosestBody, OfAPointInsideABodyHasTheDepthOfThePoint) {
  const World world = query_world({fixed_body(Box{{1, 2, 3}}), fixed_body(Sphere{4}, {0, 0, 1})});
  const auto found = world.bodies_within({{0.75_r, 0, 0}, Sphere{0}, {}, 0});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].body, world.bodies()[1]);
  EXPECT_NEAR(found[0].distance, 1.25_r - 4, kQueryTolerance);
  EXPECT_NEAR(found[1].distance, -0.25_r, kQueryTolerance);
  expect_near_vector(found[1].normal, {1, 0, 0});
  expect_near_vector(found[1].point, {1, 0, 0});
  expect_near_vector(found[1].query_point, {0.75_r, 0, 0});
  EXPECT_EQ(world.closest_body({{0.75_r, 0, 0}})->body, world.bodies()[1]);
}

TEST(ClosestBody, OneSidedTrianglesCountFromTheFrontOnly) {
  TriangleMeshDef sheet = square_sheet(4);
  for (const bool two_sided : {false, true}) {
    sheet.two_sided = two_sided;
    const World world = query_world({fixed_body(TriangleMesh(sheet))});
    ASSERT_TRUE(world.closest_body({{0, 3, 0}, Capsule{}}));
    const auto below = world.closest_body({{0, -3, 0}, Capsule{}});
    ASSERT_EQ(below.has_value(), two_sided);
    if (two_sided) expect_near_vector(below->normal, {0, -1, 0});
  }
}

TEST(ClosestBody, WithinADistanceAreSortedByDistanceAndThenByIndex) {
  std::vector<BodyDef> bodies;
  for (const Real x : {Real(6), Real(3), Real(9), Real(-3)})
    bodies.push_back(fixed_body(Box{}, {x, 0, 0}));
  const World world = query_world(bodies);
  const auto ids = world.bodies();
  std::vector<BodyId> found;
  // A body exactly at the distance counts.
  for (const BodyDistance& one : world.bodies_within({{}, Sphere{0.5_r}, {}, 5}))
    found.push_back(one.body);
  EXPECT_THAT(found, ElementsAre(ids[1], ids[3], ids[0]));
  EXPECT_EQ(world.closest_body({{}, Box{}})->body, ids[1]);
  const auto not_first = [&](BodyId id) { return id != ids[1]; };
  EXPECT_EQ(world.closest_body({}, not_first)->body, ids[3]);
  EXPECT_EQ(world.bodies_within({}, not_first).size(), 3u);
  EXPECT_FALSE(World{Scene{}}.closest_body({}));
}

std::vector<Point> corners_of(const Box& box, const Transform& pose) {
  std::vector<Point> corners;
  for (int i = 0; i < 8; ++i) {
    const Vec3& h = box.half_extents;
    corners.push_back(to_point(transform_point(
        pose, {(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z})));
  }
  return corners;
}

/// The distance of points from all triangles, in double.
double distance_from(const TriangleMeshDef& mesh, const Transform& pose,
                     const std::vector<Point>& points) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& triangle : mesh.triangles) {
    std::vector<Point> corners;
    for (const std::uint32_t v : triangle) {
      corners.push_back(to_point(transform_point(pose, mesh.vertices[v])));
    }
    least = std::min(least, length(separation(points, corners)));
  }
  return least;
}

TEST(ClosestBody, OfAMeshIsTheClosestTriangle) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int apart = 0;
  for (int run = 0; run < 60; ++run) {
    TriangleMeshDef mesh;
    for (int i = 0; i < 60; ++i) {
      mesh.vertices.push_back(random.uniform_in_box({-3, -3, -3}, {3, 3, 3}));
    }
    for (std::uint32_t i = 0; i < 20; ++i) mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.two_sided = true;
    BodyDef body = fixed_body(TriangleMesh(mesh), random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    body.orientation = random_rotation(&random);
    const World world = query_world({body});
    const Transform pose = make_transform(body.orientation, body.position);
    for (int i = 0; i < 20; ++i) {
      DistanceQuery query{random.uniform_in_box({-5, -5, -5}, {5, 5, 5})};
      std::vector<Point> points{to_point(query.position)};
      if (i % 2 == 0) {
        const Box box{random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {1, 1, 1})};
        query.shape = box;
        query.orientation = random_rotation(&random);
        points = corners_of(box, make_transform(query.orientation, query.position));
      }
      const double expected = distance_from(mesh, pose, points);
      const auto found = world.closest_body(query);
      ASSERT_TRUE(found);
      if (expected > 1e-6) ++apart;
      EXPECT_NEAR(static_cast<double>(std::max(found->distance, Real(0))), expected, 1e-5);
    }
  }
  EXPECT_GT(apart, 600);
}

std::string distance_complaint(const DistanceQuery& query) {
  const World world{Scene{}};
  try {
    world.closest_body(query);
  } catch (const InvalidArgument& error) {
    EXPECT_THROW(world.bodies_within(query), InvalidArgument);
    return error.what();
  }
  return "";
}

TEST(ClosestBody, RefusesInvalidArguments) {
  EXPECT_EQ(distance_complaint({{}, Capsule{0, 1}}),
            "capsule radius is 0; it must be > 0 and at most 1e9");
  EXPECT_EQ(distance_complaint({{}, Sphere{0}, {2, 0, 0, 0}}),
            "sphere orientation is (2, 0, 0, 0); it must be a unit quaternion, to a thousandth");
  EXPECT_EQ(distance_complaint({{}, Sphere{}, {}, -1}),
            "max_distance is -1; it must be >= 0; infinity is allowed");
  EXPECT_NE(distance_complaint({{}, Sphere{-1}}), "");
  for (const Real bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_NE(distance_complaint({{}, Sphere{bad}}), "");
    EXPECT_NE(distance_complaint({{0, bad, 0}}), "");
    EXPECT_NE(distance_complaint({{}, Sphere{}, {bad, 0, 0, 0}}), "");
  }
  EXPECT_NE(distance_complaint({{}, Sphere{}, {}, kNan}), "");
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
