/// Randomised search for contacts that the early-out tests rule out.
#include <jfpx/thesis/intersect.hpp>

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

/// Generates pairs with sizes over decades, including needles and plates, near the origin and far
/// away.
class Generator {
 public:
  explicit Generator(std::uint64_t seed) : random(seed) {}

  Real size() { return scale_ * static_cast<Real>(std::pow(10.0, random.uniform(-1.5_r, 0.5_r))); }
  Box box() { return {{size(), size(), size()}}; }
  Vec3 direction() { return test::random_direction(&random); }
  Transform pose(const Vec3& origin) {
    const std::uint64_t kind = random.below(4);
    if (kind == 0) return {{}, origin};
    if (kind == 1) return make_transform(normalized(Quat{1, 0, random.uniform(-1, 1), 0}), origin);
    return make_transform(test::random_rotation(&random), origin);
  }
  /// Draws a new scale, and a position of the pair.
  Vec3 home() {
    scale_ = static_cast<Real>(std::pow(10.0, random.uniform(-3, 3)));
    const Vec3 p = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    return random.below(3) == 0 ? p * 1e6_r : p * scale_;
  }
  /// A factor close to 1, mostly within some rounding errors, where the tests are tight.
  Real near_one() {
    if (random.below(4) == 0) return random.uniform(0.2_r, 1.5_r);
    return 1 + random.uniform(-100, 100) * kEpsilon;
  }

  Random random;

 private:
  Real scale_ = 1;
};

/// The rotation that maps one unit vector to another.
Quat rotation_between(const Vec3& from, const Vec3& to) {
  const Vec3 axis = cross(from, to);
  return normalized(Quat{1 + dot(from, to), axis.x, axis.y, axis.z});
}

/// Numbers of pairs that were ruled out, and that touch.
struct Counts {
  int clear = 0, touches = 0;
  void expect_both() const {
    EXPECT_GT(clear, 1000);
    EXPECT_GT(touches, 1000);
  }
};

TEST(MayTouch, NeverRulesOutAContactOfSphereAndWall) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Generator generator(seed);
  Counts counts;
  for (int n = 0; n < 100000; ++n) {
    const Vec3 home = generator.home(), normal = generator.direction();
    const Real radius = generator.size();
    const HalfSpace solid{normal, dot(normal, home)};
    const SphereInstance sphere{home + normal * (radius * generator.near_one()), radius};
    const bool may = may_touch(sphere, solid);
    ASSERT_EQ(may, collide(sphere, solid).touching) << n;
    const Plane plane{generator.random.below(2) == 0 ? normal : -normal, solid.offset};
    ASSERT_EQ(may_touch(sphere, plane), collide(sphere, plane).touching) << n;
    (may ? counts.touches : counts.clear)++;
  }
  counts.expect_both();
}

TEST(MayTouch, NeverRulesOutAContactOfSphereAndBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Generator generator(seed);
  Counts counts;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 home = generator.home();
    const Box box = generator.box();
    const Transform pose = generator.pose(home);
    const Real radius = generator.size(), distance = radius + length(box.half_extents);
    // Along the diagonal, where the bounding sphere of the box is tight, or in any direction.
    const Vec3 way = generator.random.below(2) == 0
                         ? pose.basis * (box.half_extents * (Real(1) / length(box.half_extents)))
                         : generator.direction();
    const SphereInstance sphere{home + way * (distance * generator.near_one()), radius};
    const bool touches = collide(sphere, box, pose).touching;
    if (!may_touch(sphere, box, pose)) {
      ++counts.clear;
      ASSERT_FALSE(touches) << n;
    }
    counts.touches += touches;
  }
  counts.expect_both();
}

TEST(MayTouch, NeverRulesOutAContactOfBoxAndWall) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Generator generator(seed);
  Counts counts;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 home = generator.home(), normal = generator.direction();
    const Box box = generator.box();
    Transform pose = generator.pose(home);
    const Vec3 across = transform_transpose(pose.basis, normal);
    const Real half_length =
        dot({absolute(across.x), absolute(across.y), absolute(across.z)}, box.half_extents);
    pose.origin += normal * (half_length * generator.near_one());
    const HalfSpace solid{normal, dot(normal, home)};
    const Plane plane{-normal, -solid.offset};
    const bool touches = collide(box, pose, solid).count > 0;
    if (!may_touch(box, pose, solid)) {
      ++counts.clear;
      ASSERT_FALSE(touches) << n;
    }
    ASSERT_LE(collide(box, pose, plane).count, may_touch(box, pose, plane) ? 8 : 0) << n;
    counts.touches += touches;
  }
  counts.expect_both();
}

TEST(MayTouch, NeverRulesOutAContactOfBoxAndBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Generator generator(seed);
  Counts counts;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 home = generator.home();
    const Box a = generator.box(), b = generator.box();
    const Transform pose_a = generator.pose(home);
    Transform pose_b = generator.pose({});
    if (generator.random.below(3) == 0) pose_b.basis = pose_a.basis;
    // A corner on a face, where the test is tight, or any position.
    const int face = static_cast<int>(generator.random.below(3));
    const bool tight = generator.random.below(2) == 0;
    const Vec3 way = tight ? pose_a.basis.column(face) : generator.direction();
    if (tight) {
      pose_b.basis =
          to_matrix(rotation_between(b.half_extents * (Real(1) / length(b.half_extents)), -way));
    }
    const Real distance =
        (tight ? a.half_extents[face] : length(a.half_extents)) + length(b.half_extents);
    pose_b.origin = home + way * (distance * generator.near_one());
    const bool touches = collide(a, pose_a, b, pose_b).count > 0;
    if (!may_touch(a, pose_a, b, pose_b)) {
      ++counts.clear;
      ASSERT_FALSE(touches) << n;
    }
    counts.touches += touches;
  }
  counts.expect_both();
}

TEST(MayTouch, RulesOutManySeparatedBoxesWithOverlappingSpheres) {
  Random random(1);
  int separated = 0, ruled_out = 0;
  for (int n = 0; n < 20000; ++n) {
    const Box a{random.uniform_in_box({0.1_r, 0.5_r, 0.5_r}, {0.5_r, 1, 1})};
    const Box b{random.uniform_in_box({0.1_r, 0.5_r, 0.5_r}, {0.5_r, 1, 1})};
    const Transform pose_a = make_transform(test::random_rotation(&random), {});
    const Transform pose_b = make_transform(test::random_rotation(&random),
                                            random.uniform_in_box({-2, -2, -2}, {2, 2, 2}));
    if (length(pose_b.origin) > length(a.half_extents) + length(b.half_extents)) continue;
    if (collide(a, pose_a, b, pose_b).count > 0) continue;
    ++separated;
    ruled_out += may_touch(a, pose_a, b, pose_b) ? 0 : 1;
  }
  EXPECT_GT(separated, 1000);
  EXPECT_GT(ruled_out * 10, separated * 3);
  RecordProperty("percent_ruled_out", std::to_string(ruled_out * 100 / separated));
}

TEST(MayTouch, IsTrueForNan) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_TRUE(may_touch(SphereInstance{{nan, 0, 0}, 1}, Box{}, Transform{}));
  EXPECT_TRUE(may_touch(Box{}, {{}, {nan, 0, 0}}, Box{}, Transform{}));
  EXPECT_TRUE(may_touch(Box{}, {{}, {nan, 0, 0}}, HalfSpace{}));
}

TEST(Erratum, E15b_a_sphere_touches_a_half_space_by_its_distance) {
  // The original subtracted the radius from each coordinate of the centre.
  const Vec3 n{0.6_r, 0.8_r, 0};
  EXPECT_FALSE(may_touch(SphereInstance{n * 1.2_r, 1}, HalfSpace{n, 0}));
  EXPECT_TRUE(may_touch(SphereInstance{{0, -0.5_r, 0}, 1}, HalfSpace{{0, -1, 0}, 0}));
}

TEST(Erratum, E57_the_intersection_tester_agrees_with_the_full_test_at_any_position) {
  // Overlapping boxes; the original used the positions as axes.
  const Box cube{{1, 1, 1}};
  for (const Vec3& position : {Vec3{0, 0, 0}, Vec3{5, 0, 0}, Vec3{3, 4, 5}}) {
    EXPECT_TRUE(may_touch(cube, {{}, position}, cube, {{}, position + Vec3{1, 0, 0}}));
  }
  EXPECT_FALSE(may_touch(cube, Transform{}, cube, {{}, {2.8_r, 0, 0}}));
}

}  // namespace
}  // namespace jfpx
