/// Tests of the contact resolver on small sets of contacts with known solutions.
#include "src/thesis/contact_resolver.hpp"

#include "tests/thesis/linear_scan.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

constexpr Real kTolerance = 64 * kEpsilon;

/// Bodies, and contacts that the test adds.
struct Scenario {
  explicit Scenario(std::span<const BodyDef> defs) : bodies(0.01_r, SleepSettings{}) {
    for (const BodyDef& def : defs) bodies.add(def);
  }
  /// Adds the contact of two spheres, as the collider would find it.
  void touch(std::uint32_t a, std::uint32_t b) {
    const Vec3 d = bodies.moving.position[a] - bodies.moving.position[b];
    const Real len = length(d);
    const Vec3 normal = len > kEpsilon ? d * (1 / len) : Vec3{1, 0, 0};
    const Real distance = len - (bodies.radius(a) + bodies.radius(b));
    const SphereInstance sphere_b{bodies.moving.position[b], bodies.radius(b)};
    contacts.push_back(
        {bodies.id(a), bodies.id(b), normal, middle_point(normal, distance, sphere_b), distance,
         combined(CombineRule::geometric_mean, bodies.friction(a), bodies.friction(b)),
         combined(CombineRule::geometric_mean, bodies.restitution(a), bodies.restitution(b))});
  }
  ResolverReport resolve(const ResolverSettings& settings = {}) {
    return resolver.resolve(bodies, contacts, settings);
  }
  Vec3 velocity(std::uint32_t body) const { return bodies.moving.velocity[body]; }
  Vec3 spin(std::uint32_t body) const { return bodies.moving.angular_velocity[body]; }

  BodyStore bodies;
  std::vector<Contact> contacts;
  ContactResolver resolver;
};

BodyDef moving(BodyDef def, const Vec3& velocity, Real friction = 0, Real restitution = 0) {
  def.velocity = velocity;
  def.friction = friction;
  def.restitution = restitution;
  return def;
}

/// Ball a at the origin passes ball b on its right and hits it with closing speed 1.
/// The arms are +-0.95 x. Along x, a unit impulse changes the closing speed by 1 + 1 = 2, along y
/// by 2 (1 + 0.95^2 / 0.4) = 6.5125. So e = 0 needs 0.5 along x, and 1/6.5125 stops the sliding.
Scenario glancing(Real friction) {
  const BodyDef defs[] = {moving(test::ball({0, 0, 0}), {1, 1, 0}, friction),
                          moving(test::ball({1.9_r, 0, 0}), {}, friction)};
  Scenario s(defs);
  s.touch(0, 1);
  return s;
}

TEST(Erratum, E01_friction_spins_both_balls_the_same_way) {
  Scenario s = glancing(1);
  EXPECT_NEAR(s.contacts[0].point.x, 0.95_r, kTolerance);
  s.resolve();
  const double stop = 1 / 6.5125;
  EXPECT_NEAR(s.velocity(0).x, 0.5, kTolerance);
  EXPECT_NEAR(s.velocity(0).y, 1 - stop, kTolerance);
  EXPECT_NEAR(s.velocity(1).x, 0.5, kTolerance);
  EXPECT_NEAR(s.velocity(1).y, stop, kTolerance);
  EXPECT_NEAR(s.spin(0).z, -0.95 / 0.4 * stop, kTolerance);
  EXPECT_NEAR(s.spin(1).z, -0.95 / 0.4 * stop, kTolerance);
}

TEST(ContactResolver, SlidingFrictionIsTheShareOfTheNormalImpulse) {
  Scenario s = glancing(0.1_r);
  s.resolve();
  EXPECT_NEAR(s.velocity(0).y, 1 - 0.1 * 0.5, kTolerance);
  EXPECT_NEAR(s.velocity(1).y, 0.1 * 0.5, kTolerance);
  EXPECT_NEAR(s.spin(0).z, -0.95 / 0.4 * 0.05, kTolerance);
}

TEST(ContactResolver, WithoutFrictionNothingSpins) {
  Scenario s = glancing(0);
  s.resolve();
  EXPECT_EQ(s.velocity(0).y, 1);
  EXPECT_EQ(s.spin(0), Vec3{});
  EXPECT_EQ(s.spin(1), Vec3{});
}

TEST(ContactResolver, FrictionIsAConeAndNotABox) {
  // Sliding along the diagonal of the tangent plane: the friction impulse is mu * normal impulse
  // in that direction, not in each axis.
  const BodyDef defs[] = {moving(test::ball({0, 0, 0}), {1, 3, 3}, 0.1_r),
                          moving(test::ball({1.9_r, 0, 0}), {}, 0.1_r)};
  Scenario s(defs);
  s.touch(0, 1);
  s.resolve();
  EXPECT_NEAR(s.velocity(1).y, 0.05 * std::sqrt(0.5), kTolerance);
  EXPECT_NEAR(s.velocity(1).z, 0.05 * std::sqrt(0.5), kTolerance);
}

TEST(Erratum, E02_E03_arms_are_each_bodys_own_and_angular_momentum_stays) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int i = 0; i < 300; ++i) {
    std::vector<BodyDef> defs;
    for (int k = 0; k < 2; ++k) {
      BodyDef def = test::ball(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}), random.uniform(1, 2),
                               random.uniform(1, 10));
      def.velocity = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      def.angular_velocity = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      def.friction = random.uniform();
      def.restitution = random.uniform();
      defs.push_back(def);
    }
    Scenario s(defs);
    s.touch(0, 1);
    const auto now = [&] {
      const BodyState states[] = {s.bodies.state(0), s.bodies.state(1)};
      return test::sums(defs, states);
    };
    const test::Sums before = now();
    s.resolve({.position_epsilon = 100});  // resolves velocities only
    const test::Sums after = now();
    const double tolerance = 40 * static_cast<double>(kEpsilon) * (before.scale + 100);
    for (int k = 0; k < 3; ++k) {
      ASSERT_NEAR(after.momentum[k], before.momentum[k], tolerance);
      ASSERT_NEAR(after.angular_momentum[k], before.angular_momentum[k], tolerance);
    }
    ASSERT_LE(after.energy, before.energy * (1 + 100 * static_cast<double>(kEpsilon)));
  }
}

TEST(Erratum, E04_contact_axes_are_orthonormal_for_every_normal) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int i = 0; i < 10000; ++i) {
    Vec3 normal = normalized(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    if (i == 0) normal = {0.8_r, 0.6_r, 0};
    if (i < 7 && i > 0) normal = Vec3{}, normal[(i - 1) % 3] = i <= 3 ? 1 : -1;
    if (length_squared(normal) < 0.5_r) continue;
    const detail::ContactBasis b = detail::contact_basis(normal);
    ASSERT_NEAR(length(b.tangent), 1, kTolerance);
    ASSERT_NEAR(length(b.bitangent), 1, kTolerance);
    ASSERT_NEAR(dot(b.tangent, normal), 0, kTolerance);
    ASSERT_NEAR(dot(b.bitangent, normal), 0, kTolerance);
    ASSERT_NEAR(dot(cross(normal, b.tangent), b.bitangent), 1, kTolerance);
  }
}

TEST(Erratum, E05_both_bodies_share_an_elastic_hit) {
  // Head-on at speed 1 against a ball of equal mass at rest: they exchange velocities.
  const BodyDef defs[] = {moving(test::ball({0, 0, 0}), {1, 0, 0}, 0, 1),
                          moving(test::ball({1.9_r, 0, 0}), {}, 0, 1)};
  Scenario s(defs);
  s.touch(0, 1);
  s.resolve();
  EXPECT_NEAR(s.velocity(0).x, 0, kTolerance);
  EXPECT_NEAR(s.velocity(1).x, 1, kTolerance);
}

TEST(ContactResolver, ElasticHitOfUnequalMassesFollowsTheTextbook) {
  // v1 = (m1 - m2)/(m1 + m2) u, v2 = 2 m1/(m1 + m2) u with m1 = 3, m2 = 1, u = 2.
  const BodyDef defs[] = {moving(test::ball({0, 0, 0}, 1, 3), {2, 0, 0}, 0, 1),
                          moving(test::ball({1.9_r, 0, 0}, 1, 1), {}, 0, 1)};
  Scenario s(defs);
  s.touch(0, 1);
  s.resolve();
  EXPECT_NEAR(s.velocity(0).x, 1, 4 * kTolerance);
  EXPECT_NEAR(s.velocity(1).x, 3, 4 * kTolerance);
}

TEST(Erratum, E06_penetration_is_resolved_and_shared_by_mass) {
  const BodyDef defs[] = {test::ball({0, 0, 0}, 1, 3), test::ball({1.6_r, 0, 0}, 1, 1)};
  Scenario s(defs);
  s.touch(0, 1);
  const ResolverReport report = s.resolve();
  EXPECT_EQ(report.position_iterations, 1u);
  // Resolved to 15/16 of epsilon: moved apart by 0.4 - 0.009375, the light ball three times as far.
  const double apart = 0.4 - 0.01 * 15 / 16;
  EXPECT_NEAR(s.bodies.moving.position[0].x, -apart / 4, kTolerance);
  EXPECT_NEAR(s.bodies.moving.position[1].x, 1.6 + apart * 3 / 4, kTolerance);
  EXPECT_EQ(s.velocity(0), Vec3{});
  EXPECT_EQ(s.velocity(1), Vec3{});
}

TEST(Erratum, E06_immovable_bodies_are_not_moved_and_make_no_numbers_of_zero_mass) {
  const BodyDef defs[] = {test::ball({0, 0, 0}, 1, 0), test::ball({1.5_r, 0, 0}, 1, 1),
                          test::ball({1.5_r, 0.1_r, 0}, 1, 0)};
  Scenario s(defs);
  s.touch(0, 1);
  s.contacts.push_back({s.bodies.id(0), s.bodies.id(2), {1, 0, 0}, {}, -1});
  s.resolve();
  EXPECT_EQ(s.bodies.state(0), (BodyState{{0, 0, 0}, {}, {}, {}}));
  EXPECT_EQ(s.bodies.state(2), (BodyState{{1.5_r, 0.1_r, 0}, {}, {}, {}}));
  EXPECT_NEAR(s.bodies.moving.position[1].x, 2 - 0.01 * 15 / 16, kTolerance);
}

TEST(Erratum, E10_moving_one_body_deepens_and_lightens_its_other_contacts) {
  // A row of five balls that overlap by 0.3 each. Afterwards, the depths that the resolver has
  // estimated must agree with the distances.
  std::vector<BodyDef> defs;
  for (int i = 0; i < 5; ++i) defs.push_back(test::ball({static_cast<Real>(i) * 1.7_r, 0, 0}));
  Scenario s(defs);
  for (std::uint32_t i = 0; i + 1 < 5; ++i) {
    if (i % 2 == 0) {
      s.touch(i, i + 1);
    } else {
      s.touch(i + 1, i);
    }
  }
  const ResolverReport report = s.resolve({.max_iterations = 1000});
  EXPECT_FALSE(report.exhausted);
  for (std::uint32_t i = 0; i + 1 < 5; ++i) {
    const Real gap = length(s.bodies.moving.position[i] - s.bodies.moving.position[i + 1]);
    EXPECT_GE(gap, 2 - 0.0101_r);
  }
}

TEST(Erratum, E11_contacts_in_which_the_moved_body_is_second_are_refreshed) {
  // a falls on b, which lies on the ground; in the contact of both, b is the second body.
  const BodyDef defs[] = {moving(test::ball({0, 3, 0}), {0, -1, 0}), test::ball({0, 1, 0}),
                          test::ground()};
  Scenario s(defs);
  s.touch(0, 1);
  s.contacts.push_back({s.bodies.id(1), s.bodies.id(2), {0, 1, 0}, {0, 0, 0}, 0});
  const ResolverReport report = s.resolve({.max_iterations = 100});
  EXPECT_FALSE(report.exhausted);
  // No contact approaches faster than the epsilon.
  EXPECT_GE(s.velocity(0).y - s.velocity(1).y, -0.01_r);
  EXPECT_GE(s.velocity(1).y, -0.01_r);
  EXPECT_LE(s.velocity(0).y, kTolerance);
}

TEST(Erratum, E34_the_limit_of_iterations_is_kept_and_reported) {
  std::vector<BodyDef> defs;
  for (int i = 0; i < 20; ++i) defs.push_back(test::ball({static_cast<Real>(i), 0, 0}));
  Scenario s(defs);
  for (std::uint32_t i = 0; i + 1 < 20; ++i) s.touch(i, i + 1);
  const ResolverReport report = s.resolve({.max_iterations = 7});
  EXPECT_EQ(report.position_iterations, 7u);
  EXPECT_TRUE(report.exhausted);
}

TEST(ContactResolver, OneIterationIsEnoughForOneContactAndIsNotExhausted) {
  const BodyDef defs[] = {test::ball({0, 0, 0}), test::ball({1, 0, 0})};
  Scenario s(defs);
  s.touch(0, 1);
  const ResolverReport report = s.resolve({.max_iterations = 1});
  EXPECT_EQ(report.position_iterations, 1u);
  EXPECT_FALSE(report.exhausted);
}

TEST(ContactResolver, ProjectionTurnsABodyThatIsHitOffCentreButNotTooFar) {
  // A cube of half size 1 stands on the ground 0.1 deep with the edge x = 1 only.
  BodyDef cube = test::ball({0, 0.9_r, 0});
  cube.shape = Box{{1, 1, 1}};
  const BodyDef defs[] = {cube, test::ground()};
  Scenario s(defs);
  s.contacts.push_back({s.bodies.id(0), s.bodies.id(1), {0, 1, 0}, {1, -0.05_r, 0}, -0.1_r});
  s.resolve();
  // Inverse effective mass: 1 by translation; r x n = (0,0,1), I = 2/3, so 1.5 by rotation about
  // +z.
  const double depth = 0.1 - 0.01 * 15 / 16;
  EXPECT_NEAR(s.bodies.moving.position[0].y, 0.9 + depth / 2.5, kTolerance);
  EXPECT_NEAR(2 * s.bodies.moving.orientation[0].z, 1.5 * depth / 2.5, 1e-4);

  Scenario deep(defs);
  deep.contacts.push_back({deep.bodies.id(0), deep.bodies.id(1), {0, 1, 0}, {1, -0.5_r, 0}, -1});
  deep.resolve({.angular_limit = 0.2_r});
  // Rotation would resolve 0.6 of the depth; the limit allows 0.2 at the arm's length of 1.
  EXPECT_NEAR(deep.bodies.moving.position[0].y, 0.9 + (1 - 0.01 * 15 / 16) - 0.2, kTolerance);
  EXPECT_NEAR(2 * deep.bodies.moving.orientation[0].z, 0.2, 2e-3);
}

TEST(ContactResolver, ProjectionTurnsAThinRodNoFurtherEither) {
  // A contact near the axis of the rod: the rod rotates easily about that axis, but hardly about
  // the axis about which the same contact would rotate an isotropic body.
  BodyDef rod = test::ball({0, 0, 0});
  rod.shape = Box{{1, 0.01_r, 0.01_r}};
  const BodyDef defs[] = {rod, test::ground()};
  Scenario s(defs);
  s.contacts.push_back({s.bodies.id(0), s.bodies.id(1), {0, 1, 0}, {1, 0, 0.01_r}, -1});
  s.resolve({.max_iterations = 1, .angular_limit = 0.2_r});
  const Quat& q = s.bodies.moving.orientation[0];
  EXPECT_NEAR(2 * std::acos(std::min(1.0, std::fabs(double(q.w)))), 0.2, 2e-3);
  // The contact point has still moved by the whole depth.
  const Vec3 point =
      s.bodies.moving.position[0] + cross(Vec3{2 * q.x, 2 * q.y, 2 * q.z}, Vec3{1, 0, 0.01_r});
  EXPECT_NEAR(point.y, 1 - 0.01 * 15 / 16, 1e-2);
}

TEST(ContactResolver, SleepingBodiesAreNotMoved) {
  const BodyDef defs[] = {test::ball({0, 0, 0}), test::ball({1, 0, 0})};
  Scenario s(defs);
  s.bodies.moving.awake.assign(2, 0);
  s.touch(0, 1);
  const ResolverReport report = s.resolve();
  EXPECT_EQ(report.position_iterations, 0u);
  EXPECT_EQ(s.bodies.state(1).position, (Vec3{1, 0, 0}));
}

TEST(ContactResolver, MassesOfThirtyOrdersOfMagnitudeStayFinite) {
  for (const Real mass : {1e-15_r, 1e15_r}) {
    const BodyDef defs[] = {moving(test::ball({0, 0, 0}, 1, mass), {1, 1, 0}, 0.5_r),
                            moving(test::ball({1.9_r, 0, 0}, 1, mass), {}, 0.5_r)};
    Scenario s(defs);
    s.touch(0, 1);
    s.resolve();
    EXPECT_NEAR(s.velocity(0).x, 0.5, kTolerance);
    EXPECT_LT(s.spin(0).z, -0.1);  // friction acted
  }
}

/// Balls at random places in a small volume, most of them overlapping, with random velocities.
Scenario dense_cloud(std::uint64_t seed, std::uint32_t count) {
  Random random(seed);
  std::vector<BodyDef> defs;
  for (std::uint32_t i = 0; i < count; ++i) {
    BodyDef def = test::ball(random.uniform_in_box({0, 0, 0}, {8, 8, 8}), 1,
                             random.below(9) == 0 ? 0 : random.uniform(1, 5));
    def.velocity = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
    def.friction = random.uniform();
    def.restitution = random.uniform();
    // A regular lattice for even seeds, so that equal depths and velocities are common.
    if (seed % 2 == 0) {
      def.position = {static_cast<Real>(i % 5), static_cast<Real>(i / 5 % 5),
                      static_cast<Real>(i / 25)};
      def.velocity = {};
    }
    defs.push_back(def);
  }
  Scenario s(defs);
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = a + 1; b < count; ++b) {
      const Vec3 d = s.bodies.moving.position[a] - s.bodies.moving.position[b];
      const bool movable = s.bodies.movable(a) || s.bodies.movable(b);
      if (movable && length_squared(d) <= 4) s.touch(a, b);
    }
  }
  return s;
}

/// Expects that two states differ in the bodies of one contact only, and that they do differ.
void expect_corrected(const Contact& contact, const BodyStore& before, const BodyStore& after) {
  bool differs = false;
  for (const BodyId id : before.ids()) {
    const bool equal = before.state(id.index) == after.state(id.index);
    ASSERT_TRUE(equal || id == contact.a || id == contact.b) << id.index;
    differs = differs || !equal;
  }
  ASSERT_TRUE(differs);
}

TEST(ContactResolver, ProjectsTheContactThatALinearScanSelects) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  for (std::uint64_t k = 0; k < 10; ++k) {
    Scenario s = dense_cloud(seed + k, 100);
    const BodyStore before = s.bodies;
    std::vector<Real> depths;
    for (const Contact& c : s.contacts) depths.push_back(-c.distance);
    test::LinearScan scan;
    scan.assign(depths);
    const ResolverReport report = s.resolve({.max_iterations = 1, .velocity_epsilon = 1e9_r});
    ASSERT_EQ(report.position_iterations, 1u);
    ASSERT_EQ(report.velocity_iterations, 0u);
    ASSERT_NO_FATAL_FAILURE(expect_corrected(s.contacts[scan.top()], before, s.bodies));
  }
}

/// The key of a contact of two spheres in the velocity loop.
Real target_delta_velocity(const Contact& c, const BodyStore& bodies) {
  const auto velocity = [&](BodyId id, Real side) {
    const Vec3 arm = c.normal * (side * (bodies.radius(id.index) + c.distance * 0.5_r));
    return detail::point_velocity(bodies.moving.velocity[id.index],
                                  bodies.moving.angular_velocity[id.index], arm);
  };
  return detail::target_delta_velocity(dot(c.normal, velocity(c.a, -1) - velocity(c.b, 1)), 0,
                                       c.restitution, ResolverSettings{}.restitution_velocity);
}

TEST(ContactResolver, AppliesEachImpulseToTheContactThatALinearScanSelects) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  std::uint32_t impulses = 0;
  for (std::uint64_t k = 0; k < 4; ++k) {
    const Scenario start = dense_cloud(seed + k, 100);
    BodyStore before = start.bodies;
    for (std::uint32_t n = 1; n <= 100; ++n) {
      std::vector<Real> keys;
      for (const Contact& c : start.contacts) keys.push_back(target_delta_velocity(c, before));
      test::LinearScan scan;
      scan.assign(keys);
      const ResolverSettings settings{.max_iterations = n, .position_epsilon = 100};
      if (!(scan.key(scan.top()) > settings.velocity_epsilon)) break;
      Scenario s = start;
      ASSERT_EQ(s.resolve(settings).velocity_iterations, n);
      ASSERT_NO_FATAL_FAILURE(expect_corrected(s.contacts[scan.top()], before, s.bodies));
      before = s.bodies;
      ++impulses;
    }
  }
  EXPECT_GE(impulses, 100u);
}

TEST(TargetDeltaVelocity, BouncesOnTheImpactSpeedButNotOnTheWeight) {
  // Approach at 2, of which 0.5 is from this step's gravity: rebound at 0.5 * 1.5.
  EXPECT_EQ(detail::target_delta_velocity(-2, -0.5_r, 0.5_r, 0.25_r), 2.75_r);
  EXPECT_EQ(detail::target_delta_velocity(-0.25_r, 0, 1, 0.25_r), 0.25_r);  // too slow to bounce
  EXPECT_EQ(detail::target_delta_velocity(-2, -3, 1, 0.25_r), 2);  // weight alone: no bounce
  EXPECT_EQ(detail::target_delta_velocity(-2, 1, 1, 0.25_r), 4);   // accelerated apart: no gain
  EXPECT_EQ(detail::target_delta_velocity(3, 0, 1, 0.25_r),
            -3);  // separating: no correction needed
}

}  // namespace
}  // namespace jfpx
