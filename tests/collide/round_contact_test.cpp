/// Contacts of cylinders and cones against the separation of an oracle in double, their rays
/// against sphere tracing, mass and submerged volume against sums over small cells.
#include <jfpx/collide.hpp>

#include "tests/collide/random_solids.hpp"
#include "tests/collide/support_oracle.hpp"
#include "tests/world/meshes.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <string>

namespace jfpx {
namespace {

using test::contact_between;
using test::kPartners;
using test::partner;
using test::random_tilt;
using test::round_solid;
using test::operator""_r;
using test::operator-;
using test::Point;
using test::SupportSolid;
using test::to_point;

TEST(RoundContact, HasTheSeparationOfTheOracleWithEverySolid) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching[kPartners] = {}, near[kPartners] = {}, clear[kPartners] = {};
  int shallow_others = 0, others = 0, outside = 0;
  for (int n = 0; n < 10000; ++n) {
    const auto kind = static_cast<std::uint64_t>(n % kPartners);
    const SolidShape a = round_solid(&random), b = partner(kind, &random);
    const Transform pose_a = make_transform(random_tilt(&random), {100, -20, 3});
    const Vec3 offset = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    const Transform pose_b = make_transform(random_tilt(&random), pose_a.origin + offset);
    SCOPED_TRACE(std::to_string(n) + ", kind " + std::to_string(kind));
    const SupportSolid of_a(a, pose_a), of_b(b, pose_b);
    const double largest = test::largest_separation(of_a, of_b, &random);
    constexpr Real kMargin = 0.1_r;
    const detail::PairManifold found =
        contact_between(a, pose_a, b, pose_b, {{}, kMargin, kMaxReal, {}, {}});
    const double noise = 3e-4;
    if (largest > 0.1 + noise) {
      ASSERT_EQ(found.point_count, 0u) << largest;
      ++clear[kind];
      continue;
    }
    if (largest > 0.1 - 1e-3) continue;
    ASSERT_GT(found.point_count, 0u) << largest;
    ASSERT_NEAR(static_cast<double>(length(found.normal)), 1, 1e-5);
    ++(largest > 0 ? near : touching)[kind];
    // Along the normal, the solids are as far apart as the deepest point says, and this is at least
    // the separation of the oracle. A face is preferred to another axis if it is 2 % deeper. Deep
    // in each other, solids may have another axis than that of least overlap.
    const double along = test::separation_along(of_a, of_b, to_point(found.normal));
    Real deepest = found.points[0].distance;
    for (std::uint32_t k = 1; k < found.point_count; ++k) {
      deepest = std::min(deepest, found.points[k].distance);
    }
    const double difference = largest - along;
    EXPECT_GE(static_cast<double>(deepest), along - noise);
    const bool is_other = difference > 0.02 * std::abs(along) + noise;
    (largest > -0.1 ? shallow_others : others) += is_other ? 1 : 0;
    outside += static_cast<double>(deepest) > along + 0.02 + 0.05 * std::abs(along) ? 1 : 0;
  }
  EXPECT_LT(shallow_others, 16);  // 2 on average
  EXPECT_LT(others, 60);
  EXPECT_LT(outside, 30);
  for (int kind = 0; kind < kPartners; ++kind) {
    EXPECT_GT(touching[kind], 200) << kind;
    EXPECT_GT(near[kind], 50) << kind;
    EXPECT_GT(clear[kind], 50) << kind;
  }
}

/// Long solids with the same axis overlap least across it, in any direction.
TEST(RoundContact, SolidsWithTheSameAxisAreParted) {
  const Transform pose = make_transform(normalized(Quat{1, 0.4_r, -0.3_r, 0.2_r}), {1, 2, 3});
  const SolidShape solids[] = {Cylinder{0.1_r, 0.8_r}, Cone{0.1_r, 0.8_r}, Capsule{0.1_r, 0.8_r}};
  for (const SolidShape& a : solids) {
    for (const SolidShape& b : {solids[0], solids[1]}) {
      const detail::PairManifold found = contact_between(a, pose, b, pose);
      ASSERT_GT(found.point_count, 0u);
      EXPECT_LT(absolute(dot(found.normal, pose.basis.column(1))), 0.1_r);
      for (std::uint32_t k = 0; k < found.point_count; ++k) {
        EXPECT_GT(found.points[k].distance, -0.205_r);
      }
    }
  }
}

TEST(RoundContact, HasTheDepthOfAHalfSpace) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int several = 0;
  for (int n = 0; n < 5000; ++n) {
    const SolidShape solid = round_solid(&random);
    const Transform pose = make_transform(random_tilt(&random), {3, 4, 5});
    const bool is_upright = random.below(2) == 0;
    const Vec3 normal = is_upright ? Vec3{0, 1, 0} : test::random_direction(&random);
    const HalfSpace wall{normal, dot(normal, pose.origin) + random.uniform(-1.2_r, 0.5_r)};
    const double deepest =
        -SupportSolid(solid, pose).reach(to_point(-normal)) - static_cast<double>(wall.offset);
    const Manifold found = collide(solid, pose, wall);
    if (deepest > 1e-4) {
      EXPECT_EQ(found.count, 0) << n;
    } else if (deepest < -1e-4) {
      ASSERT_GT(found.count, 0) << n;
      // The corners of a cap may be less deep than its rim by a hundredth of 2 % of the radius.
      EXPECT_NEAR(static_cast<double>(found.distance), deepest, 3e-4) << n;
      EXPECT_EQ(found.normal, normal);
      several += found.count > 1 ? 1 : 0;
    }
  }
  EXPECT_GT(several, 300);
}

/// A triangle without neighbors has every normal, as a thin hull of its corners.
TEST(RoundContact, WithATriangleHasTheSeparationOfTheOracle) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching = 0, separated = 0, missed = 0, others = 0;
  for (int n = 0; n < 4000; ++n) {
    const SolidShape solid = round_solid(&random);
    const Transform pose = make_transform(random_tilt(&random), {});
    std::vector<Vec3> corners;
    const Vec3 centre = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    for (int k = 0; k < 3; ++k) {
      corners.push_back(centre + random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    }
    const Vec3 across = cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (!(length(across) > 0.1_r)) continue;
    const TriangleMesh mesh(corners, {{0, 1, 2}}, true);
    const test::SupportSolid of_solid(solid, pose);
    const test::SupportSolid of_triangle(corners);
    const double largest = test::largest_separation(of_solid, of_triangle, &random);
    constexpr Real kMargin = 0.1_r;
    detail::PairManifold found;
    const detail::MeshView view = detail::view_of(mesh);
    const auto find = [&](const auto& s) {
      detail::TriangleInstance triangle;
      ASSERT_TRUE(make_instance(view, 0, {}, pose.origin, &triangle));
      find_contact(detail::instance(s, pose), triangle, {{}, kMargin, kMaxReal, {}, {}}, &found);
    };
    std::visit(find, solid);
    const double noise = 4e-4;
    if (largest > 0.12) {
      EXPECT_EQ(found.point_count, 0u) << n << ", " << largest;
      ++separated;
      continue;
    }
    if (largest > 0.1 - 1e-3) continue;
    // A solid that is deep in a triangle is pushed to the side of its centre. An axis within a
    // degree of the normal of the triangle is left to its neighbors, which this triangle does not
    // have.
    if (found.point_count == 0) {
      (largest > 0 ? missed : others) += 1;
      continue;
    }
    ++touching;
    const double along = test::separation_along(of_solid, of_triangle, to_point(found.normal));
    const bool is_other = largest - along > 0.02 * std::abs(along) + noise;
    (largest > 0 ? missed : others) += is_other ? 1 : 0;
  }
  EXPECT_LT(missed, touching / 50);
  EXPECT_GT(touching, 400);
  EXPECT_GT(separated, 400);
  EXPECT_LT(others, touching / 5);
}

/// A gap of 0.27 m, along an axis that is far from all axes of the faces and edges.
TEST(RoundContact, AConeBesideATriangleDoesNotTouchIt) {
  const Transform pose{};
  const TriangleMesh mesh({{1.3345_r, 0.3003_r, 1.5565_r},
                           {1.4468_r, -0.9281_r, 1.8119_r},
                           {0.2481_r, 0.4379_r, 0.3074_r}},
                          {{0, 1, 2}}, true);
  const detail::MeshView view = detail::view_of(mesh);
  detail::TriangleInstance triangle;
  ASSERT_TRUE(make_instance(view, 0, {}, {}, &triangle));
  detail::PairManifold found;
  find_contact(detail::instance(Cone{0.7281_r, 0.25126_r}, pose), triangle, {}, &found);
  EXPECT_EQ(found.point_count, 0u);
}

/// [m], distance of a point from a cylinder or a cone in its axes, from the sides of its profile.
double distance_from(const SolidShape& solid, const Point& p) {
  double corners[4][2] = {};  // distance from the axis, and height
  if (const auto* cylinder = std::get_if<Cylinder>(&solid)) {
    const auto r = static_cast<double>(cylinder->radius);
    const auto h = static_cast<double>(cylinder->half_height);
    const double given[4][2] = {{-r, -h}, {r, -h}, {r, h}, {-r, h}};
    std::ranges::copy(&given[0][0], &given[0][0] + 8, &corners[0][0]);
  } else {
    const auto& cone = std::get<Cone>(solid);
    const auto r = static_cast<double>(cone.radius), h = static_cast<double>(cone.half_height);
    const double given[4][2] = {{-r, -h / 2}, {r, -h / 2}, {0, 1.5 * h}, {0, 1.5 * h}};
    std::ranges::copy(&given[0][0], &given[0][0] + 8, &corners[0][0]);
  }
  const double x = std::hypot(p[0], p[2]), y = p[1];
  double nearest = 1e300;
  bool is_inside = true;
  for (int i = 0; i < 4; ++i) {
    const double *from = corners[i], *to = corners[(i + 1) % 4];
    const double u = to[0] - from[0], v = to[1] - from[1], size = u * u + v * v;
    if (size == 0) continue;
    is_inside = is_inside && u * (y - from[1]) - v * (x - from[0]) >= 0;
    const double t = std::clamp((u * (x - from[0]) + v * (y - from[1])) / size, 0.0, 1.0);
    nearest = std::min(nearest, std::hypot(x - from[0] - t * u, y - from[1] - t * v));
  }
  return is_inside ? -nearest : nearest;
}

TEST(RoundContact, RaysEnterWhereAnOracleDoes) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int hits = 0, misses = 0;
  for (int n = 0; n < 20000; ++n) {
    const SolidShape solid = round_solid(&random);
    const Transform pose = make_transform(random_tilt(&random), {10, 5, -2});
    const Real far = random.below(4) == 0 ? 100.0_r : 2.0_r;
    const Vec3 origin = pose.origin + test::random_direction(&random) * far;
    const Vec3 target = pose.origin + random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    Vec3 direction = normalized(target - origin);
    if (random.below(4) == 0) direction = pose.basis.column(static_cast<int>(random.below(3)));
    const auto cast = [&](const auto& s) { return detail::enter(origin, direction, s, pose); };
    const detail::RayEntry entry = std::visit(
        [&](const auto& s) -> detail::RayEntry {
          if constexpr (detail::Round<std::decay_t<decltype(s)>>) return cast(s);
          return {};
        },
        solid);
    // Sphere tracing (Hart 1996): the first point at a distance of at most `margin`.
    const auto first_within = [&](double margin) {
      for (double t = 0; t < 200;) {
        Point local{};
        const Point world = test::sum(to_point(origin), test::scaled(to_point(direction), t));
        const Point from = world - to_point(pose.origin);
        for (int i = 0; i < 3; ++i)
          local[static_cast<std::size_t>(i)] = test::dot(to_point(pose.basis.column(i)), from);
        const double d = distance_from(solid, local);
        if (d <= margin) return t;
        t += d - margin + 1e-7;
      }
      return 1e9;
    };
    const double tolerance = 2e-4;
    const double earliest = first_within(tolerance), latest = first_within(-tolerance);
    if (entry.hit) {
      ++hits;
      EXPECT_GE(static_cast<double>(entry.distance), earliest - tolerance) << n;
      EXPECT_LE(static_cast<double>(entry.distance), latest + tolerance) << n;
      EXPECT_NEAR(static_cast<double>(length(entry.normal)), 1, 1e-5);
      EXPECT_LE(dot(entry.normal, direction), 1e-3_r) << n;
    } else {
      ++misses;
      EXPECT_GT(latest, 1e8) << n;
    }
  }
  EXPECT_GT(hits, 3000);
  EXPECT_GT(misses, 3000);
}

/// Volume, centre and moments from small cells.
template <class S>
void expect_sampled_mass(const S& solid) {
  constexpr int kSide = 120;
  const Mat3 basis = to_matrix(normalized(Quat{2, 0.3_r, -0.5_r, 0.7_r}));
  std::vector<Vec3> cells;
  const Vec3 half = detail::half_extents(solid, {});
  const auto at = [](int i) { return (static_cast<Real>(i) + 0.5_r) * 2 / kSide - 1; };
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    const Vec3 p =
        component_product(half, {at(n % kSide), at(n / kSide % kSide), at(n / kSide / kSide)});
    if (distance_from(solid, to_point(p)) <= 0) cells.push_back(p);
  }
  const double cell = 8.0 * half.x * half.y * half.z / (kSide * kSide * kSide);
  const double volume = cell * static_cast<double>(cells.size());
  EXPECT_NEAR(detail::volume(solid), volume, 0.003 * volume);
  double xx = 0, yy = 0;
  Vec3 centre;
  for (const Vec3& p : cells) {
    centre += p;
    xx += p.y * p.y + p.z * p.z;
    yy += p.x * p.x + p.z * p.z;
  }
  const auto count = static_cast<double>(cells.size());
  EXPECT_NEAR(static_cast<double>(length(centre)) / count, 0, 2e-3);
  const Vec3 moments = detail::moments_of_inertia(solid, 3);
  EXPECT_NEAR(moments.x, 3 * xx / count, 0.005 * moments.x);
  EXPECT_NEAR(moments.y, 3 * yy / count, 0.005 * moments.y);
  EXPECT_EQ(moments.z, moments.x);
  for (const Vec3& up : {Vec3{0, 1, 0}, Vec3{1, 0, 0}, Vec3{0.3_r, 0.8_r, -0.5_r}}) {
    const Vec3 normal = normalized(up);
    for (const Real offset : {-2.0_r, -0.6_r, -0.3_r, 0.0_r, 0.1_r, 0.5_r, 2.0_r}) {
      const detail::Submerged below = detail::submerged(solid, basis, {normal, offset});
      double cells_below = 0;
      Vec3 sum;
      for (const Vec3& p : cells) {
        const Vec3 world = basis * p;
        if (dot(normal, world) > offset) continue;
        ++cells_below;
        sum += world;
      }
      EXPECT_NEAR(below.volume, cells_below * cell, 0.01 * volume) << offset;
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(below.moment[k], sum[k] * cell, 0.01 * volume) << offset;
      }
    }
  }
}

TEST(RoundContact, MassAndSubmergedVolumeAgreeWithSampling) {
  expect_sampled_mass(Cylinder{0.4_r, 0.7_r});
  expect_sampled_mass(Cone{0.6_r, 0.7_r});
}

}  // namespace
}  // namespace jfpx
