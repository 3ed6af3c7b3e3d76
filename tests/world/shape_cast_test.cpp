/// Tests of casts of solids in a World: known cases, overlaps at the start, rays against enlarged
/// shapes, and bad input. tests/collide/shape_cast_test.cpp has the oracle of the distances.
#include <jfpx/error.hpp>

#include "tests/world/meshes.hpp"
#include "tests/world/random_bodies.hpp"
#include "tests/world/solid_queries.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::all_solids;
using test::depth_below;
using test::expect_near_vector;
using test::fixed_body;
using test::kInfinity;
using test::kNan;
using test::query_world;
using ::testing::ElementsAre;

TEST(CastShape, OfEachSolidLandsOnEachFloor) {
  TriangleMeshDef sheet;
  sheet.vertices = {{-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  HeightfieldDef grid;
  grid.columns = grid.rows = 9;
  grid.heights.assign(81, 0);
  Compound tiles;
  for (const Real x : {Real(-2), Real(2)})
    tiles.parts.push_back({Box{{2, 1, 4}}, {x, 0, 0}, {}, 1});
  const std::vector<std::pair<Shape, Vec3>> floors = {
      {HalfSpace{{0, 1, 0}, 0}, {}}, {Plane{{0, 1, 0}, 0}, {}},   {Plane{{0, -1, 0}, 0}, {}},
      {Box{{4, 1, 4}}, {0, -1, 0}},  {TriangleMesh(sheet), {}},   {Heightfield(grid), {}},
      {tiles, {0, -1, 0}},           {Cylinder{3, 1}, {0, -1, 0}}};
  for (std::size_t i = 0; i < floors.size(); ++i) {
    const World world = query_world({fixed_body(floors[i].first, floors[i].second)});
    for (const SolidShape& solid : all_solids()) {
      SCOPED_TRACE(testing::Message() << "floor " << i << ", solid " << solid.index());
      const Vec3 from{0.3_r, 5 + depth_below(solid), -0.2_r};
      const auto hit = world.cast_shape({solid, from, {}, {0, -20, 0}});
      ASSERT_TRUE(hit);
      EXPECT_EQ(hit->body, world.bodies()[0]);
      EXPECT_NEAR(hit->fraction, 0.25_r, test::kQueryTolerance);
      EXPECT_EQ(hit->distance, 0);
      expect_near_vector(hit->normal, {0, 1, 0});
      EXPECT_NEAR(hit->point.y, 0, 2 * test::kQueryTolerance);
      // In the shadow of the solid.
      EXPECT_LE(absolute(hit->point.x - from.x), 0.5_r + test::kQueryTolerance);
      EXPECT_LE(absolute(hit->point.z - from.z), 0.5_r + test::kQueryTolerance);
      EXPECT_FALSE(world.cast_shape({solid, from, {}, {0, -4.99_r, 0}}));
      EXPECT_FALSE(world.cast_shape({solid, from, {}, {0, 20, 0}}));
      EXPECT_FALSE(world.cast_shape({solid, from, {}, {3, 0, 1}}));
    }
  }
}

TEST(CastShape, OfASphereIsARayToAnEnlargedShape) {
  constexpr Real kGrazing = sizeof(Real) == 4 ? 2e-3_r : 1e-7_r;
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int hits = 0;
  for (int run = 0; run < 3000; ++run) {
    const Real radius = random.uniform(0.01_r, 1);
    const Vec3 origin = random.uniform_in_box({-4, -4, -4}, {4, 4, 4});
    const Vec3 translation = test::random_direction(&random) * random.uniform(1, 20);
    BodyDef def = fixed_body(Sphere{random.uniform(0.01_r, 1)});
    BodyDef enlarged = def;
    enlarged.shape = Sphere{std::get<Sphere>(def.shape).radius + radius};
    if (run % 3 == 1) {
      const Capsule capsule{random.uniform(0.01_r, 1), random.uniform(0.1_r, 2)};
      def.shape = capsule;
      def.orientation = enlarged.orientation = test::random_rotation(&random);
      enlarged.shape = Capsule{capsule.radius + radius, capsule.half_height};
    } else if (run % 3 == 2) {
      const HalfSpace wall{test::random_direction(&random), random.uniform(-2, 2)};
      def.shape = wall;
      enlarged.shape = HalfSpace{wall.normal, wall.offset + radius};
    }
    const Real size = length(translation);
    const auto ray = query_world({enlarged}).cast_ray({origin, translation, size});
    const auto hit = query_world({def}).cast_shape({Sphere{radius}, origin, {}, translation});
    // A grazing hit may be missed by rounding.
    if (ray && dot(ray->normal, translation) > -0.01_r * size) continue;
    ASSERT_EQ(hit.has_value(), ray.has_value()) << run;
    if (!ray) continue;
    ++hits;
    EXPECT_NEAR(hit->fraction * size, ray->distance, kGrazing) << run;
    if (ray->distance > 0) expect_near_vector(hit->normal, ray->normal, kGrazing);
  }
  EXPECT_GT(hits, 300);
}

TEST(CastShape, HitsAtZeroWhatOverlapsAtTheStart) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int overlaps = 0;
  for (int run = 0; run < 200; ++run) {
    Scene scene;
    for (int i = 0; i < 12; ++i) scene.bodies.push_back(test::random_body(&random, 2));
    const World world(scene);
    for (int i = 0; i < 20; ++i) {
      const SolidShape solid = test::random_sub_shape(&random);
      const Vec3 position = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      const Quat orientation = test::random_rotation(&random);
      const Vec3 translation = i % 4 == 0 ? Vec3{} : test::random_direction(&random) * 3;
      std::vector<BodyId> at_start;
      for (const ShapeHit& hit :
           world.cast_shape_through({solid, position, orientation, translation})) {
        EXPECT_NEAR(length(hit.normal), 1, 1e-4);
        if (hit.distance < 0) {
          EXPECT_EQ(hit.fraction, 0);
          at_start.push_back(hit.body);
        }
      }
      ASSERT_EQ(at_start, world.overlapping(solid, position, orientation)) << run << ' ' << i;
      overlaps += static_cast<int>(at_start.size());
      const auto first = world.cast_shape({solid, position, orientation, translation});
      if (!at_start.empty()) {
        EXPECT_EQ(first->body, at_start[0]);
      } else if (i % 4 == 0) {
        EXPECT_FALSE(first);
      }
    }
  }
  EXPECT_GT(overlaps, 500);
}

TEST(CastShape, ThatStartsInAnOverlapHasTheNormalAndTheDistanceThatEndIt) {
  for (const SolidShape& solid : all_solids()) {
    SCOPED_TRACE(solid.index());
    const World world = query_world({fixed_body(Box{{4, 1, 4}}, {0, -1, 0})});
    const Vec3 position{0, depth_below(solid) - 0.1_r, 0};
    const auto hit = world.cast_shape({solid, position, {}, {0, 1, 0}});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->fraction, 0);
    EXPECT_NEAR(hit->distance, -0.1_r, test::kQueryTolerance);
    expect_near_vector(hit->normal, {0, 1, 0}, 1e-3_r);
    EXPECT_EQ(world.overlapping(solid, position).size(), 1u);
    EXPECT_TRUE(world.overlapping(solid, position + hit->normal * 0.1001_r).empty());
  }
}

TEST(CastShape, ThatTouchesAtTheStartHitsOnlyWhatItMovesTowards) {
  // A gap of the size of the rounding errors.
  const World world = query_world({fixed_body(Box{{4, 1, 4}}, {0, -1, 0})});
  const ShapeCast cast{Box{}, {0, 0.5_r + 4 * kEpsilon, 0}, {}, {}};
  const auto moved = [&](const Vec3& translation) {
    ShapeCast along = cast;
    along.translation = translation;
    return world.cast_shape(along);
  };
  EXPECT_FALSE(moved({}));
  EXPECT_FALSE(moved({1, 0, 0}));
  EXPECT_FALSE(moved({1, 1, 0}));
  ASSERT_TRUE(moved({1, -0.1_r, 0}));
  EXPECT_NEAR(moved({1, -0.1_r, 0})->fraction, 0, 1e-4);
}

TEST(CastShape, OneSidedTrianglesAreHitFromTheFrontOnly) {
  TriangleMeshDef sheet;
  sheet.vertices = {{-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const bool two_sided : {false, true}) {
    sheet.two_sided = two_sided;
    const World world = query_world({fixed_body(TriangleMesh(sheet))});
    const auto down = world.cast_shape({Capsule{}, {0, 3, 0}, {}, {0, -4, 0}});
    const auto up = world.cast_shape({Capsule{}, {0, -3, 0}, {}, {0, 4, 0}});
    ASSERT_TRUE(down);
    expect_near_vector(down->normal, {0, 1, 0});
    ASSERT_EQ(up.has_value(), two_sided);
    if (two_sided) expect_near_vector(up->normal, {0, -1, 0});
  }
}

/// A character on stairs: a wall that is low enough, and what is above it.
TEST(CastShape, AgainstAnEdgeHasTheNormalBetweenBothFaces) {
  const World world = query_world({fixed_body(Box{{1, 1, 4}})});
  const Real half = square_root(0.5_r);
  const auto hit = world.cast_shape({Sphere{1}, {1 + 3, 1 + 3, 0.3_r}, {}, {-6, -6, 0}});
  ASSERT_TRUE(hit);
  expect_near_vector(hit->normal, {half, half, 0});
  expect_near_vector(hit->point, {1, 1, 0.3_r});
  EXPECT_NEAR(hit->fraction, (3 - half) / 6, test::kQueryTolerance);
}

TEST(CastShape, FarFromTheOriginAndFromTheTargetIsAsAccurateAsTheCoordinates) {
  for (const Real away : {1e3_r, 1e5_r, 1e7_r}) {
    const Vec3 centre{away, -away, away};
    const World world = query_world({fixed_body(Box{{4, 1, 4}}, centre)});
    // At most the error of a coordinate.
    const Real error = 2 * away * kEpsilon;
    const auto hit = world.cast_shape({Sphere{0.5_r}, centre + Vec3{0, 16, 0}, {}, {0, -32, 0}});
    ASSERT_TRUE(hit) << away;
    EXPECT_NEAR(hit->fraction * 32, 14.5_r, error + 4 * test::kQueryTolerance) << away;
    // A long way to a small body.
    const World small = query_world({fixed_body(Sphere{1}, {})});
    const auto passes = [&](Real beside) {
      return !small.cast_shape({Sphere{1}, {-away, beside, 0}, {}, {2 * away, 0, 0}});
    };
    EXPECT_FALSE(passes(1.99_r)) << away;
    EXPECT_TRUE(passes(2.01_r)) << away;
    const auto first = small.cast_shape({Sphere{1}, {-away, 0, 0}, {}, {2 * away, 0, 0}});
    ASSERT_TRUE(first);
    EXPECT_NEAR(first->fraction, (away - 2) / (2 * away), kEpsilon) << away;
  }
}

TEST(CastShape, OntoAHugeFloorIsAsAccurateAsOntoASmallOne) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (const Real half : {100.0_r, 10000.0_r}) {
    TriangleMeshDef sheet;
    sheet.vertices = {{-half, 0, -half}, {-half, 0, half}, {half, 0, half}, {half, 0, -half}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    BodyDef floor = fixed_body(TriangleMesh(sheet));
    if (random.below(2) == 0) {
      floor.shape =
          Hull(std::vector<Vec3>{{-half, 0, -half}, {half, 0, -half}, {0, 0, half}, {0, -half, 0}});
    }
    const World world = query_world({floor});
    for (int run = 0; run < 500; ++run) {
      SCOPED_TRACE(run);
      const Vec3 from{random.uniform(-3, 3), random.uniform(1, 9), random.uniform(-3, 3)};
      const Vec3 by{random.uniform(-50, 50), random.uniform(-50, -20), random.uniform(-50, 50)};
      const SolidShape solid = all_solids()[random.below(6)];
      const auto hit = world.cast_shape({solid, from, {}, by});
      ASSERT_TRUE(hit);
      EXPECT_NEAR(from.y + hit->fraction * by.y, depth_below(solid), 10 * test::kQueryTolerance);
      expect_near_vector(hit->normal, {0, 1, 0});
    }
  }
}

TEST(CastShape, ThroughSortsByFractionAndThenByIndex) {
  std::vector<BodyDef> bodies;
  for (const Real x : {Real(6), Real(3), Real(9), Real(3)})
    bodies.push_back(fixed_body(Box{}, {x, 0, 0}));
  const World world = query_world(bodies);
  const auto ids = world.bodies();
  const ShapeCast cast{Capsule{}, {-3, 0, 0}, {}, {10, 0, 0}};
  std::vector<BodyId> found;
  for (const ShapeHit& hit : world.cast_shape_through(cast)) found.push_back(hit.body);
  EXPECT_THAT(found, ElementsAre(ids[1], ids[3], ids[0]));
  EXPECT_EQ(world.cast_shape(cast)->body, ids[1]);
  const auto not_first = [&](BodyId id) { return id != ids[1]; };
  EXPECT_EQ(world.cast_shape(cast, not_first)->body, ids[3]);
  EXPECT_EQ(world.cast_shape_through(cast, not_first).size(), 2u);
  EXPECT_FALSE(World{Scene{}}.cast_shape(cast));
}

std::string cast_complaint(const World& world, const ShapeCast& cast) {
  try {
    world.cast_shape(cast);
  } catch (const InvalidArgument& error) {
    EXPECT_THROW(world.cast_shape_through(cast), InvalidArgument);
    return error.what();
  }
  return "";
}

TEST(CastShape, RefusesInvalidArguments) {
  const World world{Scene{}};
  const auto said = [&](const SolidShape& shape, const Vec3& from, const Quat& q, const Vec3& by) {
    return cast_complaint(world, {shape, from, q, by});
  };
  EXPECT_EQ(said(Capsule{0, 1}, {}, {}, {}), "capsule radius is 0; it must be > 0 and at most 1e9");
  EXPECT_EQ(said(Cone{}, {}, {2, 0, 0, 0}, {}),
            "cone orientation is (2, 0, 0, 0); it must be a unit quaternion, to a thousandth");
  EXPECT_EQ(said(Sphere{}, {}, {}, {2e9_r, 0, 0}),
            "translation is (2e+09, 0, 0); it must be such that the end is between -1e9 and 1e9");
  for (const Real bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_NE(said(Sphere{bad}, {}, {}, {}), "");
    EXPECT_NE(said(Cylinder{1, bad}, {}, {}, {}), "");
    EXPECT_NE(said(Sphere{}, {0, bad, 0}, {}, {}), "");
    EXPECT_NE(said(Sphere{}, {}, {}, {0, 0, bad}), "");
    EXPECT_NE(said(Sphere{}, {}, {bad, 0, 0, 0}, {}), "");
  }
}

}  // namespace
}  // namespace jfpx
