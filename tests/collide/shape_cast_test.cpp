/// Casts of convex shapes: the gap at a hit and without one against an oracle in double, known
/// cases, and precision far away, of tiny and of huge shapes.
#include "src/collide/shape_cast.hpp"

#include "tests/collide/random_solids.hpp"
#include "tests/collide/support_oracle.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// A target, and a solid that moves.
struct CastScene {
  detail::ConvexCore target;
  SolidShape target_shape;  ///< unless the target is a triangle; the core refers to hulls
  SupportSolid target_oracle;
  Transform target_pose;
  SolidShape moving;
  Transform pose;
  Vec3 translation;

  /// @param scale power of two with which squares of lengths do not underflow
  detail::CastEntry cast(Real scale = 1) const {
    const Real size = length(translation * scale);
    const Vec3 direction = translation * scale * (1 / size);
    const detail::LinearMotion local{inverse_transform_direction(target_pose, direction),
                                     size * (1 / scale), 1};
    const auto make = [](const auto& solid) { return detail::make_core(solid); };
    detail::CastEntry entry =
        detail::cast(target, std::visit(make, moving), transposed(target_pose.basis) * pose.basis,
                     inverse_transform_point(target_pose, pose.origin), local);
    entry.normal = target_pose.basis * entry.normal;
    entry.point = transform_point(target_pose, entry.point);
    return entry;
  }
  SupportSolid moved(double fraction) const {
    SupportSolid solid(moving, pose);
    solid.translate(scaled(to_point(translation), fraction));
    return solid;
  }
  /// The oracle may miss the axis that separates thin shapes, so an overlap is confirmed.
  double separation(double fraction, Random* random) const {
    double most = -1;
    for (int i = 0; i < 16 && most < 0; ++i) {
      most = std::max(most, largest_separation(moved(fraction), target_oracle, random));
    }
    return most;
  }
};

double size_of(const SolidShape& shape) {
  return std::visit([](const auto& s) { return static_cast<double>(detail::bounding_radius(s)); },
                    shape);
}

/// A solid as partner(), or one that is a thousand times as long as it is thick.
SolidShape random_shape(Random* random, bool thin) {
  const SolidShape usual = partner(random->below(kPartners), random);
  if (!thin) return usual;
  const Real small = 0.001_r * random->uniform(0.5_r, 2), large = random->uniform(0.5_r, 1);
  const Vec3 size = random->below(2) == 0 ? Vec3{small, large, large} : Vec3{small, large, small};
  switch (random->below(5)) {
    case 0:
      return Box{size};
    case 1:
      return Capsule{small, large};
    case 2:
      return random->below(2) == 0 ? Cylinder{small, large} : Cylinder{large, small};
    case 3:
      return random->below(2) == 0 ? Cone{small, large} : Cone{large, small};
    default:
      return random_hull(random).scaled(size);
  }
}

CastScene random_scene(Random* random, bool thin) {
  const Transform target_pose =
      make_transform(random_tilt(random), random->uniform_in_box({-1, -1, -1}, {1, 1, 1}));
  const Real spread = thin ? Real(0.5) : Real(1);
  const Vec3 aim = random->uniform_in_box({-1, -1, -1}, {1, 1, 1}) * spread;
  const Real distance = random->uniform(0, 1) * (random->below(2) == 0 ? Real(3) : Real(30));
  const Vec3 direction = random->below(3) == 0 ? Vec3{0, -1, 0} : random_direction(random);
  const SolidShape moving = random_shape(random, thin);
  const Transform pose = make_transform(random_tilt(random),
                                        add_scaled(target_pose.origin + aim, direction, -distance));
  const Vec3 translation = direction * (distance * random->uniform(0.1_r, 2) + 0.01_r);
  if (random->below(4) == 0) {
    Vec3 corner[3];
    const Real least = thin ? 0.001_r : 0.05_r;
    do {
      for (Vec3& p : corner) p = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
      if (thin) corner[2] = add_scaled(corner[1], corner[2] - corner[1], 0.002_r);
    } while (!(length(cross(corner[1] - corner[0], corner[2] - corner[0])) > least));
    const Vec3 normal = normalized(cross(corner[1] - corner[0], corner[2] - corner[0]));
    std::vector<Vec3> points;
    for (const Vec3& p : corner) points.push_back(transform_point(target_pose, p));
    return {detail::make_core(corner, normal),
            Sphere{},
            SupportSolid(points),
            target_pose,
            moving,
            pose,
            translation};
  }
  const SolidShape target = random_shape(random, thin);
  const auto make = [](const auto& solid) { return detail::make_core(solid); };
  return {std::visit(make, target),
          target,
          SupportSolid(target, target_pose),
          target_pose,
          moving,
          pose,
          translation};
}

constexpr double kTolerance = sizeof(Real) == 4 ? 1e-6 : 1e-13;
/// Of shapes a thousand times as long as thin, whose closest points are less accurate by that
/// factor: 1e-11 in one of a million casts.
constexpr double kThinTolerance = sizeof(Real) == 4 ? 1e-6 : 1e-10;
/// Of the closest points of curved shapes, across the normal.
constexpr double kPointTolerance = sizeof(Real) == 4 ? 2e-5 : 1e-7;

/// The hit separates the shapes: both are on their sides of the plane through the point.
void expect_touch(const CastScene& scene, const detail::CastEntry& entry, bool thin,
                  Random* random) {
  const double size = size_of(scene.moving) + 2 + static_cast<double>(length(scene.translation));
  const double tolerance = (thin ? kThinTolerance : kTolerance) * size;
  const double point_tolerance = kPointTolerance * size;
  const SupportSolid moved = scene.moved(static_cast<double>(entry.fraction));
  const Point n = to_point(entry.normal), p = to_point(entry.point);
  EXPECT_NEAR(length(n), 1, 1e-5);
  EXPECT_LT(dot(n, to_point(scene.translation)), 0);
  EXPECT_NEAR(separation_along(moved, scene.target_oracle, n), 0, tolerance);
  EXPECT_NEAR(scene.target_oracle.reach(n), dot(n, p), point_tolerance);
  // The point is in both shapes.
  for (int i = 0; i < 50; ++i) {
    const Point d = to_point(random_direction(random));
    EXPECT_LE(dot(d, p), scene.target_oracle.reach(d) + point_tolerance);
    EXPECT_LE(dot(d, p), moved.reach(d) + point_tolerance);
  }
  EXPECT_LT(largest_separation(moved, scene.target_oracle, random), tolerance);
}

/// Without a hit, the least separation, which is a convex function of the fraction, is no overlap.
void expect_miss(const CastScene& scene, Random* random) {
  double first = 0, last = 1;
  for (int i = 0; i < 12; ++i) {
    const double p = first + (last - first) / 3, q = last - (last - first) / 3;
    const double at_p = scene.separation(p, random), at_q = scene.separation(q, random);
    EXPECT_GT(std::min(at_p, at_q), -1e-4) << "at " << p;
    (at_p < at_q ? last : first) = at_p < at_q ? q : p;
  }
}

void expect_touches_and_misses(bool thin) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int hits = 0, misses = 0;
  for (int run = 0; run < 3000 && !testing::Test::HasFailure(); ++run) {
    SCOPED_TRACE(run);
    const CastScene scene = random_scene(&random, thin);
    const detail::CastEntry entry = scene.cast();
    if (entry.hit && entry.is_inside) {
      EXPECT_EQ(entry.fraction, 0);
      EXPECT_LT(scene.separation(0, &random), 1e-4);
    } else if (entry.hit) {
      ++hits;
      expect_touch(scene, entry, thin, &random);
    } else if (run % 8 == 0 && scene.separation(0, &random) > 0) {
      ++misses;
      expect_miss(scene, &random);
    }
  }
  EXPECT_GT(hits, thin ? 100 : 500);
  EXPECT_GT(misses, 50);
}
TEST(ShapeCast, HitsWhereTheShapesTouchAndMissesWhereTheyDoNot) {
  expect_touches_and_misses(false);
}
TEST(ShapeCast, OfThinShapesHitWhereTheyTouchAndMissWhereTheyDoNot) {
  expect_touches_and_misses(true);
}

SolidShape scaled_by(const SolidShape& shape, Real factor) {
  const auto scale = [factor](const auto& s) -> SolidShape {
    using S = std::decay_t<decltype(s)>;
    if constexpr (std::is_same_v<S, Sphere>) return Sphere{s.radius * factor};
    if constexpr (std::is_same_v<S, Box>) return Box{s.half_extents * factor};
    if constexpr (std::is_same_v<S, Hull>) return s.scaled({factor, factor, factor});
    if constexpr (requires { s.half_height; }) return S{s.radius * factor, s.half_height * factor};
  };
  return std::visit(scale, shape);
}

TEST(ShapeCast, OfTinyAndHugeShapesAreThoseOfUsualOnes) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int hits = 0;
  for (int run = 0; run < 2000; ++run) {
    CastScene scene = random_scene(&random, false);
    if (std::holds_alternative<detail::TriangleFace>(scene.target.core)) continue;
    if (scene.separation(0, &random) < 0.01) continue;
    const bool has_hull = std::holds_alternative<Hull>(scene.target_shape) ||
                          std::holds_alternative<Hull>(scene.moving);
    // The volume of a hull must not underflow.
    const int most = has_hull ? 20 : sizeof(Real) == 4 ? 50 : 90;
    const detail::CastEntry usual = scene.cast();
    const auto power = static_cast<int>(random.below(static_cast<std::uint64_t>(most) + 26)) - most;
    const Real factor = std::ldexp(Real(1), power);
    scene.target_shape = scaled_by(scene.target_shape, factor);
    scene.target =
        std::visit([](const auto& s) { return detail::make_core(s); }, scene.target_shape);
    scene.moving = scaled_by(scene.moving, factor);
    scene.pose.origin *= factor;
    scene.target_pose.origin *= factor;
    scene.translation *= factor;
    const detail::CastEntry entry = scene.cast(1 / factor);
    ASSERT_EQ(entry.hit, usual.hit) << run << ", 2^" << power;
    if (!entry.hit) continue;
    ++hits;
    EXPECT_NEAR(entry.fraction, usual.fraction, 1e-4) << run << ", 2^" << power;
  }
  EXPECT_GT(hits, 300);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
