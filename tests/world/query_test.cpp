/// Tests of rays and overlaps: known cases, distance functions in double, and bad input.
#include <jfpx/error.hpp>

#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kInfinity;
using test::kNan;
using ::testing::ElementsAre;

using Point = std::array<double, 3>;
Point to_double(const Vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point along(const Point& from, const Point& direction, double t) {
  return {from[0] + direction[0] * t, from[1] + direction[1] * t, from[2] + direction[2] * t};
}

/// A body in double, with the distance of a point from its surface: negative inside.
struct Solid {
  Shape shape;
  Point centre;
  std::array<Point, 3> axes;  ///< of the body, as unit vectors

  explicit Solid(const BodyDef& def) : shape(def.shape), centre(to_double(def.position)) {
    const Quat& q = def.orientation;
    const double w = q.w, x = q.x, y = q.y, z = q.z, n = w * w + x * x + y * y + z * z;
    axes[0] = {1 - 2 * (y * y + z * z) / n, 2 * (x * y + w * z) / n, 2 * (x * z - w * y) / n};
    axes[1] = {2 * (x * y - w * z) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z + w * x) / n};
    axes[2] = {2 * (x * z + w * y) / n, 2 * (y * z - w * x) / n, 1 - 2 * (x * x + y * y) / n};
  }
  Point to_local(const Point& p) const {
    const Point d{p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]};
    return {dot(axes[0], d), dot(axes[1], d), dot(axes[2], d)};
  }
  Point to_world(const Point& p) const {
    return along(along(along(centre, axes[0], p[0]), axes[1], p[1]), axes[2], p[2]);
  }
  double distance(const Point& p) const {
    if (const auto* sphere = std::get_if<Sphere>(&shape)) {
      const Point local = to_local(p);
      return std::sqrt(dot(local, local)) - static_cast<double>(sphere->radius);
    }
    if (const auto* plane = std::get_if<HalfSpace>(&shape)) {
      const Point n = to_double(plane->normal);
      const double len = std::sqrt(dot(n, n));
      return (dot(n, p) - static_cast<double>(plane->offset)) / len;
    }
    if (const auto* capsule = std::get_if<Capsule>(&shape)) {
      Point local = to_local(p);
      const auto half = static_cast<double>(capsule->half_height);
      local[1] -= std::clamp(local[1], -half, half);
      return std::sqrt(dot(local, local)) - static_cast<double>(capsule->radius);
    }
    const Point local = to_local(p), h = to_double(std::get<Box>(shape).half_extents);
    double outside = 0, inside = -1e300;
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = std::abs(local[i]) - h[i];
      inside = std::max(inside, d);
      outside += d > 0 ? d * d : 0;
    }
    return outside > 0 ? std::sqrt(outside) : inside;
  }
  /// Radius of a box or a capsule.
  double size() const {
    if (const auto* capsule = std::get_if<Capsule>(&shape)) {
      return static_cast<double>(capsule->radius + capsule->half_height);
    }
    return static_cast<double>(length(std::get<Box>(shape).half_extents));
  }
  /// The point of a box or a capsule nearest to p.
  Point nearest(const Point& p, double shrunk_by) const {
    Point local = to_local(p);
    if (const auto* capsule = std::get_if<Capsule>(&shape)) {
      const auto half = static_cast<double>(capsule->half_height);
      const double radius = static_cast<double>(capsule->radius) - shrunk_by;
      const Point core{0, std::clamp(local[1], -half, half), 0};
      local[1] -= core[1];
      const double reach = std::sqrt(dot(local, local));
      return to_world(along(core, local, reach > radius ? radius / reach : 1));
    }
    const Point h = to_double(std::get<Box>(shape).half_extents);
    for (std::size_t i = 0; i < 3; ++i) {
      local[i] = std::clamp(local[i], shrunk_by - h[i], h[i] - shrunk_by);
    }
    return to_world(local);
  }
};

/// Distance at which a ray is first deeper in a solid than `margin`, by sphere tracing (Hart 1996),
/// which cannot step over such a point; infinity if there is none before `end`.
double march(const Solid& solid, const Point& origin, const Point& direction, double end,
             double margin) {
  for (double t = 0; t < end;) {
    const double d = solid.distance(along(origin, direction, t));
    if (d < -margin) return t;
    t += d + 2 * margin;
  }
  return std::numeric_limits<double>::infinity();
}

/// Balls, boxes, capsules and a half-space, some of them overlapping.
Scene random_scene(Random* random, int bodies) {
  Scene scene;
  for (int i = 0; i < bodies; ++i) {
    BodyDef def = test::ball(random->uniform_in_box({-5, -5, -5}, {5, 5, 5}),
                             random->uniform(0.1_r, 1.5_r), static_cast<Real>(i % 3));
    if (i % 3 != 0) {
      def.shape = Box{random->uniform_in_box({0.05_r, 0.05_r, 0.05_r}, {2, 2, 2})};
      if (i % 3 == 1) def.shape = Capsule{random->uniform(0.05_r, 1), random->uniform(0.05_r, 2)};
      const Vec3 v = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
      def.orientation = normalized(Quat{random->uniform(-1, 1), v.x, v.y, v.z});
    }
    scene.bodies.push_back(def);
  }
  BodyDef floor = test::half_space(
      normalized(random->uniform_in_box({-0.3_r, 1, -0.3_r}, {0.3_r, 1, 0.3_r})), -4);
  scene.bodies.push_back(floor);
  return scene;
}

Vec3 random_direction(Random* random) {
  const Vec3 v = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
  Vec3 axis{};
  axis[static_cast<int>(random->below(3))] = random->below(2) != 0 ? Real(1) : Real(-1);
  return random->below(4) == 0 ? axis : v;  // parallel to faces in a quarter of the cases
}

TEST(RayCast, AgreesWithTheDistanceFunctions) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const double margin = 4e-5;  // 20 m in float: a step of 2e-6, about ten of which add up
  std::uint64_t hits = 0, inside = 0;
  for (int run = 0; run < 300; ++run) {
    const Scene scene = random_scene(&random, 12);
    const World world(scene);
    for (int i = 0; i < 100; ++i) {
      const Ray ray{random.uniform_in_box({-8, -3, -8}, {8, 8, 8}), random_direction(&random),
                    i % 3 == 0 ? random.uniform(0, 10) : 20};
      const Point origin = to_double(ray.origin);
      Point direction = to_double(ray.direction);
      const double len = std::sqrt(dot(direction, direction));
      for (double& d : direction) d /= len;
      const std::vector<RayHit> found = world.cast_ray_through(ray);
      std::set<std::uint32_t> met;
      for (const RayHit& hit : found) {
        ASSERT_TRUE(met.insert(hit.body.index).second);
        const Solid solid(scene.bodies[hit.body.index]);
        const double t = hit.distance, start = solid.distance(origin);
        ASSERT_LE(hit.distance, ray.max_distance);
        ASSERT_GE(hit.distance, 0);
        ASSERT_NEAR(length(hit.normal), 1, 1e-6);
        if (t == 0) {
          ASSERT_LE(start, margin);
          ++inside;
          continue;
        }
        // On the surface, outside the solid before it, and against the normal of this face.
        const Point there = along(origin, direction, t);
        ASSERT_NEAR(solid.distance(there), 0, margin) << "body " << hit.body.index;
        ASSERT_GE(march(solid, origin, direction, t - 1e-3, margin), t - 1e-3);
        for (int k = 0; k < 3; ++k) {
          ASSERT_NEAR(hit.point[k], there[static_cast<std::size_t>(k)], margin);
        }
        ASSERT_LE(dot(to_double(hit.normal), direction), margin);
        const Point above = along(there, to_double(hit.normal), 0.01);
        ASSERT_NEAR(solid.distance(above), 0.01, 3 * margin);
      }
      for (std::uint32_t body = 0; body < scene.bodies.size(); ++body) {
        if (met.contains(body)) continue;
        const Solid solid(scene.bodies[body]);
        ASSERT_GE(march(solid, origin, direction, ray.max_distance - margin, margin), 1e9) << body;
      }
      hits += found.size();
      // The closest hit is the first of the sorted list.
      for (std::size_t k = 1; k < found.size(); ++k) {
        ASSERT_LE(std::pair(found[k - 1].distance, found[k - 1].body.index),
                  std::pair(found[k].distance, found[k].body.index));
      }
      const std::optional<RayHit> closest = world.cast_ray(ray);
      ASSERT_EQ(closest.has_value(), !found.empty());
      if (closest) {
        ASSERT_EQ(*closest, found[0]);
      }
    }
  }
  EXPECT_GT(hits, 5000u);
  EXPECT_GT(inside, 500u);
}

/// A ball at x = 5, a box around x = 10 and a wall at x = 20.
World three_in_a_row() {
  Scene scene;
  BodyDef box = test::ball({10, 0, 0});
  box.shape = Box{{1, 2, 3}};
  scene.bodies = {test::half_space({-1, 0, 0}, -20), box, test::ball({5, 0, 0})};
  return World(scene);
}

TEST(RayCast, GivesDistancePointAndNormal) {
  const World world = three_in_a_row();
  const auto hits = world.cast_ray_through({{0, 0.5_r, 0}, {1000, 0, 0}});
  ASSERT_EQ(hits.size(), 3u);
  const Real x = square_root(0.75_r);
  EXPECT_EQ(hits[0].body, world.bodies()[2]);
  EXPECT_NEAR(hits[0].distance, 5 - x, 1e-6);
  EXPECT_NEAR(hits[0].normal.x, -x, 1e-6);
  EXPECT_NEAR(hits[0].normal.y, 0.5, 1e-6);
  EXPECT_EQ(hits[1], (RayHit{world.bodies()[1], 9, {9, 0.5_r, 0}, {-1, 0, 0}}));
  EXPECT_EQ(hits[2], (RayHit{world.bodies()[0], 20, {20, 0.5_r, 0}, {-1, 0, 0}}));
}

/// Half a radius beside the centre, the normal is (-sqrt(3)/2, 1/2, 0) for any radius, even if its
/// square underflows.
TEST(RayCast, SmallSpheresHaveUnitNormalsAndAreHitWhereTheyAre) {
  const Real least = std::numeric_limits<Real>::denorm_min();
  for (const Real radius : {kEpsilon, kEpsilon / 2, 1e-9_r, 1e-20_r, 4096 * least, 4 * least}) {
    Scene scene;
    scene.bodies = {test::ball({0, 0, 0}, radius, 0)};
    const World world(scene);
    const auto hit = world.cast_ray({{-1, radius / 2, 0}, {1, 0, 0}});
    ASSERT_TRUE(hit) << radius;
    EXPECT_NEAR(hit->normal.x, -square_root(0.75_r), 1e-6) << radius;
    EXPECT_NEAR(hit->normal.y, 0.5, 1e-6) << radius;
    EXPECT_EQ(hit->normal.z, 0) << radius;
    EXPECT_NEAR(hit->distance, 1, 1e-6) << radius;
    EXPECT_EQ(world.cast_ray({{-1, 0, 0}, {1, 0, 0}})->normal, (Vec3{-1, 0, 0})) << radius;
    EXPECT_FALSE(world.cast_ray({{-1, radius * 1.25_r, 0}, {1, 0, 0}})) << radius;
  }
}

TEST(RayCast, EndsAtItsMaximumDistanceInclusive) {
  const World world = three_in_a_row();
  EXPECT_FALSE(world.cast_ray({{0, 0, 0}, {1, 0, 0}, 3.99_r}));
  EXPECT_EQ(world.cast_ray({{0, 0, 0}, {1, 0, 0}, 4})->distance, 4);
  EXPECT_FALSE(world.cast_ray({{0, 0, 0}, {1, 0, 0}, 0}));
  EXPECT_FALSE(world.cast_ray({{0, 0, 0}, {-1, 0, 0}}));
  EXPECT_FALSE(World{Scene{}}.cast_ray({}));
}

TEST(RayCast, FromInsideHitsAtDistanceZeroAgainstTheRay) {
  const World world = three_in_a_row();
  for (const Vec3& from : {Vec3{5, 0.5_r, 0}, Vec3{10, 0, 0}, Vec3{30, 0, 0}}) {
    const auto hit = world.cast_ray({from, {0, 2, 0}});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->distance, 0);
    EXPECT_EQ(hit->point, from);
    EXPECT_EQ(hit->normal, (Vec3{0, -1, 0}));
  }
}

TEST(RayCast, FindsOnlyBodiesThatTheFilterSelects) {
  const World world = three_in_a_row();
  const BodyId ball = world.bodies()[2];
  const auto not_the_ball = [ball](BodyId id) { return id != ball; };
  EXPECT_EQ(world.cast_ray({{0, 0, 0}, {1, 0, 0}}, not_the_ball)->body, world.bodies()[1]);
  EXPECT_EQ(world.cast_ray_through({{0, 0, 0}, {1, 0, 0}}, not_the_ball).size(), 2u);
}

TEST(RayCast, TiesGoToTheLowestIndex) {
  Scene scene;
  for (int i = 0; i < 5; ++i) scene.bodies.push_back(test::ball({5, 0, 0}));
  const World world(scene);
  const auto hits = world.cast_ray_through({{0, 0, 0}, {1, 0, 0}});
  ASSERT_EQ(hits.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(hits[i].body, world.bodies()[i]);
  EXPECT_EQ(world.cast_ray({{0, 0, 0}, {1, 0, 0}})->body, world.bodies()[0]);
}

TEST(RayCast, TheLengthOfTheDirectionDoesNotMatter) {
  const World world = three_in_a_row();
  const auto expected = world.cast_ray({{0, 0, 0}, {1, 0.01_r, 0}});
  for (const int power : {-118, -60, 60, 126}) {
    const Real scale = std::ldexp(Real(1), power);
    EXPECT_EQ(world.cast_ray({{0, 0, 0}, {scale, 0.01_r * scale, 0}}), expected) << power;
  }
}

/// The ray intersects the half-space at 2 m / sinking; for the plane, the normal is tilted instead.
TEST(RayCast, WallsBeyondTheRangeOfRealAreNotHit) {
  constexpr Real kDenormal = std::numeric_limits<Real>::denorm_min();
  BodyDef plane = test::half_space({1, 0, kDenormal}, 0);
  plane.shape = Plane{{1, 0, kDenormal}, 0};
  Scene scene;
  scene.bodies = {test::half_space({0, 0, -1}, 0), test::ball({5, 0, -2}), plane};
  const World world(scene);
  const auto ids = world.bodies();
  for (const Real sinking : {kDenormal, 4 * kDenormal, std::numeric_limits<Real>::min() / 4}) {
    const Ray along_floor{{2, 0, -2}, {1, 0, sinking}};
    const auto hits = world.cast_ray_through(along_floor);
    ASSERT_EQ(hits.size(), 1u) << sinking;
    EXPECT_EQ(hits[0].body, ids[1]) << sinking;
    EXPECT_EQ(hits[0].point, (Vec3{4, 0, -2})) << sinking;
    EXPECT_EQ(world.cast_ray(along_floor), hits[0]) << sinking;
    EXPECT_FALSE(world.cast_ray({{9, 0, -2}, {1, 0, sinking}})) << sinking;
  }
  EXPECT_FALSE(world.cast_ray({{2, 3, -2}, {0, 0, -1}}));
  const Real sinking = 16 * std::numeric_limits<Real>::min();
  const auto far = world.cast_ray({{9, 0, -2}, {1, 0, sinking}});
  ASSERT_TRUE(far);
  EXPECT_EQ(*far, (RayHit{ids[0], 2 / sinking, {2 / sinking, 0, 0}, {0, 0, -1}}));
}

TEST(RayCast, FindsBodiesAtTheirCurrentPositions) {
  World world = three_in_a_row();
  world.set_state(world.bodies()[2], {{7, 0, 0}, {}, {}, {}});
  EXPECT_EQ(world.cast_ray({{0, 0, 0}, {1, 0, 0}})->distance, 6);
  world.remove(world.bodies()[2]);
  EXPECT_EQ(world.cast_ray({{0, 0, 0}, {1, 0, 0}})->distance, 9);
}

template <class Call>
std::string complaint(const Call& call) {
  try {
    call();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "";
}

TEST(RayCast, RefusesInvalidRays) {
  const World world = three_in_a_row();
  const auto said = [&world](const Ray& ray) { return complaint([&] { world.cast_ray(ray); }); };
  EXPECT_EQ(said({{0, 0, 0}, {0, 0, 0}}),
            "ray direction is (0, 0, 0); it must be finite and not zero");
  EXPECT_EQ(said({{0, 0, 0}, {1, 0, 0}, -1}),
            "ray max_distance is -1; it must be >= 0; infinity is allowed");
  EXPECT_EQ(said({{2e9_r, 0, 0}, {1, 0, 0}}),
            "ray origin is (2e+09, 0, 0); it must be between -1e9 and 1e9");
  for (const Real bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_NE(said({{0, bad, 0}, {1, 0, 0}}), "");
    EXPECT_NE(said({{0, 0, 0}, {1, 0, bad}}), "");
  }
  EXPECT_NE(said({{0, 0, 0}, {1, 0, 0}, kNan}), "");
  EXPECT_NE(complaint([&] { world.cast_ray_through({{0, 0, 0}, {0, 0, 0}}); }), "");
}

/// A compound of three balls, a mesh of a square cell and a heightfield of three cells, side by
/// side: each query is aimed at one part.
TEST(Query, HitsHaveTheNumbersOfPartsAndTriangles) {
  Scene scene;
  BodyDef body;
  body.mass = 0;
  Compound balls;
  for (int i = -1; i <= 1; ++i) balls.parts.push_back({Sphere{0.4_r}, {Real(i), 0, 0}, {}, 1});
  body.shape = balls;
  scene.bodies.push_back(body);
  body.position = {10, 0, 0};
  body.shape = TriangleMesh({{-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {1, 0, 1}},
                            {Triangle{0, 2, 1}, Triangle{1, 2, 3}});
  scene.bodies.push_back(body);
  body.position = {20, 0, 0};
  body.shape = Heightfield({.columns = 4, .rows = 2, .heights = std::vector<Real>(8), .holes = {}});
  scene.bodies.push_back(body);
  const World world(scene);
  struct Aim {
    Vec3 at;
    std::uint32_t body, part;
  };
  for (const Aim& aim : {Aim{{-1, 0, 0}, 0, 0}, Aim{{0, 0, 0}, 0, 1}, Aim{{1, 0, 0}, 0, 2},
                         Aim{{9.5_r, 0, -0.5_r}, 1, 0}, Aim{{10.5_r, 0, 0.5_r}, 1, 1},
                         Aim{{18.7_r, 0, -0.3_r}, 2, 0}, Aim{{21.3_r, 0, 0.3_r}, 2, 5}}) {
    const Vec3 above = aim.at + Vec3{0, 2, 0}, down{0, -4, 0};
    const auto ray = world.cast_ray({.origin = above, .direction = down});
    ASSERT_TRUE(ray.has_value());
    EXPECT_EQ(ray->body.index, aim.body);
    EXPECT_EQ(ray->part, aim.part);
    EXPECT_EQ(world.cast_ray_through({.origin = above, .direction = down})[0].part, aim.part);
    const Sphere small{0.1_r};
    const auto cast = world.cast_shape({.shape = small, .position = above, .translation = down});
    ASSERT_TRUE(cast.has_value());
    EXPECT_EQ(cast->part, aim.part);
    const Vec3 beside = aim.at + Vec3{0, 0.05_r, 0};
    const auto overlap = world.cast_shape({.shape = small, .position = beside});
    ASSERT_TRUE(overlap.has_value());
    EXPECT_EQ(overlap->part, aim.part);
    for (const Vec3& p : {above, beside}) {
      const auto closest = world.closest_body({.position = p, .shape = small});
      ASSERT_TRUE(closest.has_value());
      EXPECT_EQ(closest->body.index, aim.body);
      EXPECT_EQ(closest->part, aim.part);
    }
  }
}

TEST(Overlap, OfASphereAgreesWithTheDistanceFunctions) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t touching = 0;
  for (int run = 0; run < 100; ++run) {
    const Scene scene = random_scene(&random, 12);
    const World world(scene);
    for (int i = 0; i < 20; ++i) {
      const Vec3 centre = random.uniform_in_box({-6, -6, -6}, {6, 6, 6});
      const Real radius = random.uniform(0.01_r, 2);
      std::set<std::uint32_t> found;
      for (const BodyId id : world.overlapping(Sphere{radius}, centre)) found.insert(id.index);
      for (std::uint32_t body = 0; body < scene.bodies.size(); ++body) {
        const double gap =
            Solid(scene.bodies[body]).distance(to_double(centre)) - static_cast<double>(radius);
        if (std::abs(gap) > 1e-5) {
          ASSERT_EQ(found.contains(body), gap < 0) << body;
        }
      }
      touching += found.size();
    }
  }
  EXPECT_GT(touching, 500u);
}

/// Upper bound of the distance of two boxes or capsules, by alternating projections (Cheney and
/// Goldstein 1959) until it is at most `enough`. Nearly parallel edges converge slowly.
double gap(const Solid& a, const Solid& b, double shrunk_by, double enough, int most = 300000) {
  Point p = a.centre, q = b.centre;
  double distance = 1e300;
  for (int i = 0; i < most && distance > enough; ++i) {
    q = b.nearest(p, shrunk_by);
    p = a.nearest(q, shrunk_by);
    const Point d = along(p, q, -1);
    distance = std::sqrt(dot(d, d));
  }
  return distance;
}

TEST(Overlap, OfABoxAgreesWithTheDistanceFunctions) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t touching = 0;
  for (int run = 0; run < 120; ++run) {
    const Scene scene = random_scene(&random, 12);
    const World world(scene);
    for (int i = 0; i < 10; ++i) {
      BodyDef def;
      def.position = random.uniform_in_box({-6, -6, -6}, {6, 6, 6});
      def.shape = Box{random.uniform_in_box({0.05_r, 0.05_r, 0.05_r}, {1, 1, 1})};
      const Vec3 v = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
      def.orientation = normalized(Quat{random.uniform(-1, 1), v.x, v.y, v.z});
      const Solid box(def);
      std::set<std::uint32_t> found;
      for (const BodyId id :
           world.overlapping(std::get<Box>(def.shape), def.position, def.orientation)) {
        found.insert(id.index);
      }
      for (std::uint32_t body = 0; body < scene.bodies.size(); ++body) {
        const Solid solid(scene.bodies[body]);
        double distance = 0;
        if (const auto* sphere = std::get_if<Sphere>(&solid.shape)) {
          distance = box.distance(solid.centre) - static_cast<double>(sphere->radius);
        } else if (std::holds_alternative<HalfSpace>(solid.shape)) {
          distance = 1e300;
          for (int corner = 0; corner < 8; ++corner) {
            Point local = to_double(std::get<Box>(def.shape).half_extents);
            for (std::size_t k = 0; k < 3; ++k) local[k] *= (corner >> k & 1) != 0 ? 1 : -1;
            distance = std::min(distance, solid.distance(box.to_world(local)));
          }
        } else if (found.contains(body)) {
          // The tolerance of collide() for nearly parallel edges, and 1 mm for the oracle.
          const double size = box.size() + solid.size();
          const double near = 2 * std::sqrt(static_cast<double>(kEpsilon)) * size + 1e-3;
          distance = gap(box, solid, 0, near) <= near ? -1 : 1;
        } else {
          distance = gap(box, solid, 1e-3, 1e-9, 3000) <= 1e-9 ? -1 : 1;
        }
        if (std::abs(distance) > 1e-5) {
          ASSERT_EQ(found.contains(body), distance < 0) << body;
        }
      }
      touching += found.size();
    }
  }
  EXPECT_GT(touching, 200u);
}

TEST(Overlap, ComesInTheOrderOfBodiesAndCountsAnExactTouch) {
  const World world = three_in_a_row();
  const auto ids = world.bodies();
  EXPECT_THAT(world.overlapping(Sphere{3}, {7.5_r, 0, 0}), ElementsAre(ids[1], ids[2]));
  EXPECT_THAT(world.overlapping(Sphere{4}, {0, 0, 0}), ElementsAre(ids[2]));
  const auto is_other = [&](BodyId id) {
    EXPECT_THAT((std::vector{ids[1], ids[2]}), ::testing::Contains(id));  // the bodies that overlap
    return id != ids[1];
  };
  EXPECT_THAT(world.overlapping(Sphere{3}, {7.5_r, 0, 0}, {}, is_other), ElementsAre(ids[2]));
  EXPECT_THAT(world.overlapping(Sphere{3.99_r}, {0, 0, 0}), ElementsAre());
  EXPECT_THAT(world.overlapping(Box{{4, 1, 1}}, {0, 0, 0}), ElementsAre(ids[2]));
  EXPECT_THAT(world.overlapping(Box{{8, 1, 1}}, {12, 0, 0}), ElementsAre(ids[0], ids[1], ids[2]));
  EXPECT_THAT(World{Scene{}}.overlapping(Sphere{}, {}), ElementsAre());
}

TEST(Overlap, RefusesInvalidShapes) {
  const World world = three_in_a_row();
  const auto sphere = [&world](Real radius, const Vec3& centre) {
    return complaint([&] { world.overlapping(Sphere{radius}, centre); });
  };
  const auto box = [&world](const Vec3& half, const Vec3& centre, const Quat& q) {
    return complaint([&] { world.overlapping(Box{half}, centre, q); });
  };
  EXPECT_EQ(sphere(0, {}), "sphere radius is 0; it must be > 0 and at most 1e9");
  EXPECT_EQ(box({1, -1, 1}, {}, {}),
            "box half_extents is (1, -1, 1); it must be > 0 and at most 1e9 each");
  EXPECT_EQ(box({1, 1, 1}, {}, {2, 0, 0, 0}),
            "box orientation is (2, 0, 0, 0); it must be a unit quaternion, to a thousandth");
  for (const Real bad : {kNan, kInfinity}) {
    EXPECT_NE(sphere(bad, {}), "");
    EXPECT_NE(sphere(1, {0, bad, 0}), "");
    EXPECT_NE(box({bad, 1, 1}, {}, {}), "");
    EXPECT_NE(box({1, 1, 1}, {bad, 0, 0}, {}), "");
    EXPECT_NE(box({1, 1, 1}, {}, {bad, 0, 0, 0}), "");
  }
}

}  // namespace
}  // namespace jfpx
