/// Tests of the buoyancy of boxes and compounds; force_test.cpp tests spheres.
#include "src/collide/shapes.hpp"
#include "tests/world/force_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::BuoyancyForce;
using test::expect_near;
using test::world_of;

/// Volume of the box [0, size] with n . p <= d, for n > 0, by inclusion and exclusion: a corner
/// tetrahedron minus the tetrahedra outside the box, plus their intersections.
double cut_volume(const std::array<double, 3>& size, const std::array<double, 3>& n, double d) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double left = d, sign = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      if ((corner >> i & 1) == 0) continue;
      left -= n[i] * size[i];
      sign = -sign;
    }
    if (left > 0) sum += sign * left * left * left;
  }
  return sum / (6 * n[0] * n[1] * n[2]);
}

TEST(Submerged, PartsOfBoxesHaveTheVolumeOfTheFormula) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int i = 0; i < 3000; ++i) {
    const Box box{random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {2, 2, 2})};
    const Vec3 direction = random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {1, 1, 1});
    const Vec3 normal = normalized(direction);
    const Real half_extent = dot(normal, box.half_extents);
    const Real offset = random.uniform(-1.2_r, 1.2_r) * half_extent;
    const detail::Submerged below = detail::submerged(box, {}, {normal, offset});
    const Vec3 extents = 2 * box.half_extents;  // exact
    const std::array<double, 3> size{extents.x, extents.y, extents.z};
    const std::array<double, 3> n{normal.x, normal.y, normal.z};
    const double total = size[0] * size[1] * size[2];
    const double expected = cut_volume(size, n, static_cast<double>(offset + half_extent));
    // The formula divides small differences by the product of the normal's components.
    const double noise = 50 * static_cast<double>(kEpsilon) + 1e-11;
    ASSERT_NEAR(below.volume, expected, noise * total);
  }
}

TEST(Submerged, TheVolumesBelowAndAboveAddUpToTheBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int i = 0; i < 3000; ++i) {
    const Box box{random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {2, 2, 2})};
    const Vec3 axis = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    const Mat3 basis = to_matrix(normalized(Quat{random.uniform(-1, 1), axis.x, axis.y, axis.z}));
    const Vec3 normal = normalized(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    if (length_squared(normal) < 0.5_r) continue;
    const Real offset = random.uniform(-2, 2);
    const detail::Submerged below = detail::submerged(box, basis, {normal, offset}),
                            above = detail::submerged(box, basis, {-normal, -offset});
    const Vec3& h = box.half_extents;
    const Real volume = 8 * h.x * h.y * h.z;
    ASSERT_NEAR(below.volume + above.volume, volume, 100 * kEpsilon * volume);
    expect_near((below.moment + above.moment) * (1 / volume), {}, 500 * kEpsilon);
  }
}

TEST(Submerged, TheCentroidAgreesWithSampling) {
  const Box box{{1, 0.5_r, 2}};
  const Transform pose = make_transform(normalized(Quat{2, 0.3_r, -0.5_r, 0.7_r}), {1, 2, 3});
  const HalfSpace liquid{normalized(Vec3{0.2_r, 1, 0.1_r}), 2.3_r};
  const detail::Submerged below = detail::submerged(
      box, pose.basis, {liquid.normal, liquid.offset - dot(liquid.normal, pose.origin)});
  constexpr int kSide = 100;
  double sum[3] = {}, count = 0;
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    const auto at = [](int i) { return (static_cast<Real>(i) + 0.5_r) * 2 / kSide - 1; };
    const Vec3 point = transform_point(
        pose, component_product(box.half_extents,
                                {at(n % kSide), at(n / kSide % kSide), at(n / kSide / kSide)}));
    if (dot(liquid.normal, point) > liquid.offset) continue;
    ++count;
    for (int k = 0; k < 3; ++k) sum[k] += point[k];
  }
  EXPECT_NEAR(below.volume, count * 8 / (kSide * kSide * kSide), 0.01);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(pose.origin[k] + below.moment[k] / below.volume, sum[k] / count, 0.003);
  }
}

BodyDef plank(const Vec3& half_extents, Real density) {
  BodyDef def = test::ball({});
  def.shape = Box{half_extents};
  def.mass = 8 * half_extents.x * half_extents.y * half_extents.z * density;
  return def;
}

TEST_P(BuoyancyForce, ABoxIsLiftedByTheLiquidItDisplaces) {
  // 2 x 2 x 2 m, 800 kg; a depth of h displaces 4 h m^3.
  for (const Real depth : {-0.5_r, 0.0_r, 0.5_r, 1.0_r, 1.75_r, 2.0_r, 5.0_r}) {
    BodyDef def = plank({1, 1, 1}, 100);
    def.position = {1000, 1 - depth, -1000};
    World world = world_of({def});
    const BodyId id = world.bodies()[0];
    world.add_force(Buoyancy{.density = 1000, .gravity = 10});
    world.step();
    const Real displaced = 4 * std::clamp(depth, 0.0_r, 2.0_r);
    expect_near(world.last_acceleration(id), {0, displaced * 1000 * 10 / 800, 0}, 2e-3);
    expect_near(world.state(id).angular_velocity, {}, 1e-3);
  }
}

TEST_P(BuoyancyForce, ACompoundOfTwoHalvesFloatsAsTheWhole) {
  BodyDef whole = plank({1, 0.25_r, 0.5_r}, 400), halves = whole;
  Compound compound;
  for (const Real side : {-0.5_r, 0.5_r}) {
    compound.parts.push_back({.shape = Box{{0.5_r, 0.25_r, 0.5_r}}, .position = {side, 0, 0}});
  }
  compound.parts.push_back({.shape = Sphere{0.1_r}, .density = 1e-6_r});
  halves.shape = compound;
  whole.orientation = halves.orientation = normalized(Quat{1, 0.1_r, 0, 0.2_r});
  World one = world_of({whole}), two = world_of({halves});
  for (World* world : {&one, &two}) world->add_force(Buoyancy{.density = 1000, .gravity = 10});
  one.step();
  two.step();
  // More than half of the ball is below the surface, and it counts in addition to the halves.
  const Real difference =
      two.last_acceleration(two.bodies()[0]).y - one.last_acceleration(one.bodies()[0]).y;
  EXPECT_NEAR(difference, 4.0 / 3 * 3.14159265 * 0.001 / 2 * 1e4 / 400, 1e-4);
  expect_near(two.states()[0].angular_velocity, one.states()[0].angular_velocity, 2e-3);
}

TEST_P(BuoyancyForce, ATiltedPlankRightsItselfAndATallOneFallsOver) {
  // Half the density of water. Flat: the metacentre is width^2 / (12 draught) above the centre of
  // buoyancy: 16 / (12 * 0.2) - 0.1 > 0. On end, 0.16 / (12 * 2) - 1 < 0.
  for (const bool flat : {true, false}) {
    BodyDef def = flat ? plank({2, 0.2_r, 1}, 500) : plank({0.2_r, 2, 1}, 500);
    def.orientation = normalized(Quat{1, 0, 0, 0.1_r});  // by 11 degrees
    def.linear_damping = def.angular_damping = 0.2_r;
    World world = world_of({def});
    world.add_force(Gravity{});
    world.add_force(Buoyancy{});
    for (int n = 0; n < 3000; ++n) world.step();
    const Vec3 up = rotate(world.states()[0].orientation, {0, 1, 0});
    EXPECT_NEAR(absolute(up.y), flat ? 1 : 0, 0.01);
    EXPECT_NEAR(world.states()[0].position.y, 0, 0.01);
  }
}

}  // namespace
}  // namespace jfpx
