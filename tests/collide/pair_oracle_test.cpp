/// Tests of the pair tests in random poses, against a convex distance in double and against the
/// same pair under a rigid transform.
#include <jfpx/collide.hpp>

#include "tests/collide/convex_distance.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kEps;
using test::Point;

Point to_double(const Vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

std::vector<Point> corners(const Box& box, const Transform& pose) {
  std::vector<Point> result;
  for (int n = 0; n < 8; ++n) {
    Point p = to_double(pose.origin);
    for (int k = 0; k < 3; ++k) {
      const double h = static_cast<double>(box.half_extents[k]) * ((n >> k & 1) != 0 ? 1 : -1);
      for (int i = 0; i < 3; ++i) {
        p[static_cast<std::size_t>(i)] += h * static_cast<double>(pose.basis(i, k));
      }
    }
    result.push_back(p);
  }
  return result;
}

std::vector<Point> moved(std::vector<Point> points, const Vec3& direction, double by) {
  for (Point& p : points) {
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] += static_cast<double>(direction[static_cast<int>(i)]) * by;
    }
  }
  return points;
}

Real log_uniform(Random* random, double low, double high) {
  return static_cast<Real>(low * std::pow(high / low, static_cast<double>(random->uniform())));
}

/// A cube, plate or needle.
Box random_box(Random* random) {
  const double thinnest = random->below(2) == 0 ? 0.3 : 0.003;
  return {{log_uniform(random, thinnest, 2), log_uniform(random, thinnest, 2),
           log_uniform(random, thinnest, 2)}};
}

TEST(SphereBoxOracle, ContactDepthNormalAndPointAreThoseOfTheClosestPoint) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0, clear = 0, inside = 0;
  for (int n = 0; n < 100000; ++n) {
    const Box box = random_box(&random);
    const Vec3 home = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
    const Transform pose = make_transform(test::random_rotation(&random), home);
    const Real radius = log_uniform(&random, 0.01, 1);
    const Vec3 range = box.half_extents + Vec3{1, 1, 1} * (radius * 1.3_r);
    const SphereInstance sphere{home + pose.basis * random.uniform_in_box(-range, range), radius};
    const Touch touch = collide(sphere, box, pose);

    const Point centre = to_double(sphere.centre);
    const Point away = test::separation(std::vector<Point>{centre}, corners(box, pose));
    const double gap = test::length(away), r = static_cast<double>(radius);
    const double noise = 100 * kEps * (static_cast<double>(length(box.half_extents)) + r + 10);
    if (!touch.touching) {
      ++clear;
      ASSERT_GE(gap, r - noise) << n;
      continue;
    }
    ++touches;
    ASSERT_LE(gap, r + noise) << n;
    const double depth = -static_cast<double>(touch.distance);
    ASSERT_NEAR(length(touch.normal), 1, 64 * kEps);
    if (gap > noise) {
      // The oracle's distance has an error of 1e-14, and its direction the square root of that.
      const double coarse = 2e-7;
      ASSERT_NEAR(depth, r - gap, noise) << n;
      for (std::size_t i = 0; i < 3; ++i) {
        const double normal = static_cast<double>(touch.normal[static_cast<int>(i)]);
        ASSERT_NEAR(normal, away[i] / gap, noise / gap + coarse) << n;
        // Half-way between the deepest point of the sphere and the box.
        const double middle = centre[i] - normal * (r + gap) / 2;
        ASSERT_NEAR(static_cast<double>(touch.point[static_cast<int>(i)]), middle,
                    noise * (1 + r / gap) + coarse * r)
            << n;
      }
      continue;
    }
    ++inside;
    // Translated by the contact, the sphere only touches; no axis direction has a smaller depth.
    const auto out = [&](const Vec3& d, double by) {
      const auto p = moved({centre}, d, by);
      return test::length(test::separation(p, corners(box, pose)));
    };
    ASSERT_NEAR(out(touch.normal, depth), r, 4 * noise) << n;
    for (int k = 0; k < 3; ++k) {
      for (const Real sign : {Real(1), Real(-1)}) {
        ASSERT_LE(out(pose.basis.column(k) * sign, depth - 4 * noise), r + noise) << n;
      }
    }
  }
  EXPECT_GT(touches, 10000);
  EXPECT_GT(clear, 10000);
  EXPECT_GT(inside, 1000);
}

TEST(BoxBoxOracle, ContactAndDepthAgreeWithTheConvexDistance) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0, clear = 0;
  for (int n = 0; n < 100000; ++n) {
    const Box a = random_box(&random), b = random_box(&random);
    const Vec3 home = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
    const Transform pose_a = make_transform(test::random_rotation(&random), home);
    Transform pose_b = make_transform(test::random_rotation(&random), {});
    if (random.below(4) == 0) pose_b.basis = pose_a.basis;
    const Real sum = length(a.half_extents) + length(b.half_extents);
    pose_b.origin = home + random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * (sum * 0.7_r);
    // For nearly parallel edges only the face axes are tested, which causes an error of this size.
    double sine = 1;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const auto s =
            static_cast<double>(length(cross(pose_a.basis.column(i), pose_b.basis.column(j))));
        if (s > 64 * kEps) sine = std::min(sine, s);
      }
    }
    const double blunt = sine < 2 * std::sqrt(kEps) ? 2 * std::sqrt(kEps) : kEps / sine;
    const double noise = 100 * static_cast<double>(sum) * blunt + 100 * kEps * 10;

    const Manifold m = collide(a, pose_a, b, pose_b);
    const auto corners_a = corners(a, pose_a), corners_b = corners(b, pose_b);
    const double gap = test::length(test::separation(corners_a, corners_b));
    if (m.count == 0) {
      ++clear;
      // Separated: boxes that overlap by more than the noise would still overlap when shrunk by it.
      const auto smaller = [&](const Box& box) {
        Box shrunk = box;
        for (int i = 0; i < 3; ++i) {
          shrunk.half_extents[i] =
              std::max(Real(0), box.half_extents[i] - static_cast<Real>(noise));
        }
        return shrunk;
      };
      ASSERT_GT(
          test::length(test::separation(corners(smaller(a), pose_a), corners(smaller(b), pose_b))),
          0)
          << n;
      continue;
    }
    ++touches;
    ASSERT_LE(gap, noise) << n;
    // Translated by its depth along the normal, a only touches b, up to the preference for faces
    // over pairs of edges whose depth is up to 2 % smaller.
    const double depth = -static_cast<double>(m.distance), more = 0.01;
    const double left =
        test::length(test::separation(moved(corners_a, m.normal, depth + more), corners_b));
    ASSERT_GE(left, more - noise) << n;
    ASSERT_LE(left, more + 0.03 * depth + noise) << n;
  }
  EXPECT_GT(touches, 10000);
  EXPECT_GT(clear, 10000);
}

/// Compares two contacts, of which the second belongs to the pair transformed by `world`.
void expect_transformed(const Touch& before, const Touch& after, const Transform& world,
                        double noise) {
  if (before.touching != after.touching) {  // only if the distance is within rounding errors
    ASSERT_GE(before.distance + after.distance, -noise);
    return;
  }
  ASSERT_NEAR(before.distance, after.distance, noise);
  if (!before.touching) return;
  ASSERT_LE(length(world.basis * before.normal - after.normal), noise);
  ASSERT_LE(length(transform_point(world, before.point) - after.point), noise);
}
void expect_transformed(const Manifold& before, const Manifold& after, const Transform& world,
                        double noise) {
  if (before.count != after.count) {  // only if a corner is within rounding errors of the wall
    ASSERT_NEAR(before.distance, after.distance, noise);
    return;
  }
  ASSERT_NEAR(before.distance, after.distance, noise);
  if (before.count == 0) return;
  ASSERT_LE(length(world.basis * before.normal - after.normal), noise);
  for (int k = 0; k < before.count; ++k) {
    const ManifoldPoint &p = before.points[k], &q = after.points[k];
    ASSERT_NEAR(p.distance, q.distance, noise);
    ASSERT_LE(length(transform_point(world, p.point) - q.point), noise);
  }
}

TEST(PairTests, TransformedPairsHaveTheSameContact) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int n = 0; n < 20000; ++n) {
    const Transform world = make_transform(test::random_rotation(&random),
                                           random.uniform_in_box({-3, -3, -3}, {3, 3, 3}));
    const Box box = random_box(&random);
    const Transform pose = make_transform(test::random_rotation(&random), {});
    const Real radius = log_uniform(&random, 0.05, 1);
    const SphereInstance sphere{random.uniform_in_box({-2, -2, -2}, {2, 2, 2}), radius};
    const HalfSpace solid{test::random_direction(&random), random.uniform(-1, 1)};
    const Plane plane{solid.normal, solid.offset};
    const SphereInstance moved_sphere{transform_point(world, sphere.centre), radius};
    const Vec3 normal = world.basis * solid.normal;
    const HalfSpace moved_solid{normal, solid.offset + dot(normal, world.origin)};
    const Plane moved_plane{normal, moved_solid.offset};

    const double noise = 400 * kEps;
    expect_transformed(collide(sphere, solid), collide(moved_sphere, moved_solid), world, noise);
    if (absolute(dot(plane.normal, sphere.centre) - plane.offset) > 0.001_r) {  // else the side
      expect_transformed(collide(sphere, plane), collide(moved_sphere, moved_plane), world, noise);
    }
    expect_transformed(collide(box, pose, solid), collide(box, world * pose, moved_solid), world,
                       noise);
    if (absolute(dot(plane.normal, pose.origin) - plane.offset) > 0.001_r) {
      expect_transformed(collide(box, pose, plane), collide(box, world * pose, moved_plane), world,
                         noise);
    }
    // The relative error of the direction from the closest point grows as the distance shrinks.
    const Vec3 local = inverse_transform_point(pose, sphere.centre);
    Real gap = 0;
    for (int i = 0; i < 3; ++i) gap = std::max(gap, absolute(local[i]) - box.half_extents[i]);
    if (gap > 0.01_r) {
      expect_transformed(collide(sphere, box, pose), collide(moved_sphere, box, world * pose),
                         world, noise / static_cast<double>(gap));
    }
    if (HasFatalFailure()) FAIL() << n;
  }
}

}  // namespace
}  // namespace jfpx
