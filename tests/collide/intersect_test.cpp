/// Hunts for touches that the early-outs deny.
#include <jfpx/intersect.hpp>

#include "tests/world/shape_zoo.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

/// Sizes over decades, needles and plates, near the origin and far out.
class Hunt {
 public:
  explicit Hunt(std::uint64_t seed) : random(seed) {}

  Real size() { return scale_ * static_cast<Real>(std::pow(10.0, random.uniform(-1.5_r, 0.5_r))); }
  Box box() { return {{size(), size(), size()}}; }
  Vec3 direction() { return test::random_direction(&random); }
  Transform pose(const Vec3& origin) {
    const std::uint64_t kind = random.below(4);
    if (kind == 0) return {{}, origin};
    if (kind == 1) return make_transform(normalized(Quat{1, 0, random.uniform(-1, 1), 0}), origin);
    return make_transform(test::random_turn(&random), origin);
  }
  /// A new scale, and a place for the pair.
  Vec3 home() {
    scale_ = static_cast<Real>(std::pow(10.0, random.uniform(-3, 3)));
    const Vec3 p = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    return random.below(3) == 0 ? p * 1e6_r : p * scale_;
  }
  /// Near 1: mostly within some rounding errors, for hunting where it is tight.
  Real near_one() {
    if (random.below(4) == 0) return random.uniform(0.2_r, 1.5_r);
    return 1 + random.uniform(-100, 100) * kEpsilon;
  }

  Random random;

 private:
  Real scale_ = 1;
};

/// The rotation that takes one unit vector to another.
Quat turn_from(const Vec3& from, const Vec3& to) {
  const Vec3 axis = cross(from, to);
  return normalized(Quat{1 + dot(from, to), axis.x, axis.y, axis.z});
}

/// How often a test ruled out, how often there was a touch.
struct Score {
  int clear = 0, touches = 0;
  void expect_both() const {
    EXPECT_GT(clear, 1000);
    EXPECT_GT(touches, 1000);
  }
};

TEST(MayTouch, NeverDeniesATouchOfSphereAndWall) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Hunt hunt(seed);
  Score score;
  for (int n = 0; n < 100000; ++n) {
    const Vec3 home = hunt.home(), normal = hunt.direction();
    const Real radius = hunt.size();
    const HalfSpace solid{normal, dot(normal, home)};
    const SphereInstance sphere{home + normal * (radius * hunt.near_one()), radius};
    const bool may = may_touch(sphere, solid);
    ASSERT_EQ(may, collide(sphere, solid).touching) << n;
    const Plane plane{hunt.random.below(2) == 0 ? normal : -normal, solid.offset};
    ASSERT_EQ(may_touch(sphere, plane), collide(sphere, plane).touching) << n;
    (may ? score.touches : score.clear)++;
  }
  score.expect_both();
}

TEST(MayTouch, NeverDeniesATouchOfSphereAndBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Hunt hunt(seed);
  Score score;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 home = hunt.home();
    const Box box = hunt.box();
    const Transform pose = hunt.pose(home);
    const Real radius = hunt.size(), reach = radius + length(box.half_extents);
    // Along the diagonal, where the sphere around the box is tight, or anywhere.
    const Vec3 way = hunt.random.below(2) == 0
                         ? pose.basis * (box.half_extents * (Real(1) / length(box.half_extents)))
                         : hunt.direction();
    const SphereInstance sphere{home + way * (reach * hunt.near_one()), radius};
    const bool touches = collide(sphere, box, pose).touching;
    if (!may_touch(sphere, box, pose)) {
      ++score.clear;
      ASSERT_FALSE(touches) << n;
    }
    score.touches += touches;
  }
  score.expect_both();
}

TEST(MayTouch, NeverDeniesATouchOfBoxAndWall) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Hunt hunt(seed);
  Score score;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 home = hunt.home(), normal = hunt.direction();
    const Box box = hunt.box();
    Transform pose = hunt.pose(home);
    const Vec3 across = transform_transpose(pose.basis, normal);
    const Real reach =
        dot({absolute(across.x), absolute(across.y), absolute(across.z)}, box.half_extents);
    pose.origin += normal * (reach * hunt.near_one());
    const HalfSpace solid{normal, dot(normal, home)};
    const Plane plane{-normal, -solid.offset};
    const bool touches = collide(box, pose, solid).count > 0;
    if (!may_touch(box, pose, solid)) {
      ++score.clear;
      ASSERT_FALSE(touches) << n;
    }
    ASSERT_LE(collide(box, pose, plane).count, may_touch(box, pose, plane) ? 8 : 0) << n;
    score.touches += touches;
  }
  score.expect_both();
}

TEST(MayTouch, NeverDeniesATouchOfBoxAndBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Hunt hunt(seed);
  Score score;
  for (int n = 0; n < 200000; ++n) {
    const Vec3 home = hunt.home();
    const Box a = hunt.box(), b = hunt.box();
    const Transform pose_a = hunt.pose(home);
    Transform pose_b = hunt.pose({});
    if (hunt.random.below(3) == 0) pose_b.basis = pose_a.basis;
    // Corner to face, where the test is tight, or anywhere.
    const int face = static_cast<int>(hunt.random.below(3));
    const bool tight = hunt.random.below(2) == 0;
    const Vec3 way = tight ? pose_a.basis.column(face) : hunt.direction();
    if (tight) {
      pose_b.basis =
          to_matrix(turn_from(b.half_extents * (Real(1) / length(b.half_extents)), -way));
    }
    const Real reach =
        (tight ? a.half_extents[face] : length(a.half_extents)) + length(b.half_extents);
    pose_b.origin = home + way * (reach * hunt.near_one());
    const bool touches = collide(a, pose_a, b, pose_b).count > 0;
    if (!may_touch(a, pose_a, b, pose_b)) {
      ++score.clear;
      ASSERT_FALSE(touches) << n;
    }
    score.touches += touches;
  }
  score.expect_both();
}

TEST(MayTouch, RulesOutMostBoxesWhoseSpheresOverlapInVain) {
  Random random(1);
  int in_vain = 0, ruled_out = 0;
  for (int n = 0; n < 20000; ++n) {
    const Box a{random.uniform_in_box({0.1_r, 0.5_r, 0.5_r}, {0.5_r, 1, 1})};
    const Box b{random.uniform_in_box({0.1_r, 0.5_r, 0.5_r}, {0.5_r, 1, 1})};
    const Transform pose_a = make_transform(test::random_turn(&random), {});
    const Transform pose_b =
        make_transform(test::random_turn(&random), random.uniform_in_box({-2, -2, -2}, {2, 2, 2}));
    if (length(pose_b.origin) > length(a.half_extents) + length(b.half_extents)) continue;
    if (collide(a, pose_a, b, pose_b).count > 0) continue;
    ++in_vain;
    ruled_out += may_touch(a, pose_a, b, pose_b) ? 0 : 1;
  }
  EXPECT_GT(in_vain, 1000);
  EXPECT_GT(ruled_out * 10, in_vain * 3);
  RecordProperty("share", std::to_string(ruled_out * 100 / in_vain));
}

TEST(MayTouch, SaysYesToWhatIsNoNumber) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_TRUE(may_touch(SphereInstance{{nan, 0, 0}, 1}, Box{}, Transform{}));
  EXPECT_TRUE(may_touch(Box{}, {{}, {nan, 0, 0}}, Box{}, Transform{}));
  EXPECT_TRUE(may_touch(Box{}, {{}, {nan, 0, 0}}, HalfSpace{}));
}

TEST(Erratum, E15b_a_sphere_meets_a_half_space_by_its_distance) {
  // The original subtracted the radius from each coordinate of the centre.
  const Vec3 n{0.6_r, 0.8_r, 0};
  EXPECT_FALSE(may_touch(SphereInstance{n * 1.2_r, 1}, HalfSpace{n, 0}));
  EXPECT_TRUE(may_touch(SphereInstance{{0, -0.5_r, 0}, 1}, HalfSpace{{0, -1, 0}, 0}));
}

TEST(Erratum, E57_the_intersection_tester_agrees_with_the_full_test_wherever_boxes_are) {
  // Boxes that overlap, where the original took the places for axes.
  const Box cube{{1, 1, 1}};
  for (const Vec3& place : {Vec3{0, 0, 0}, Vec3{5, 0, 0}, Vec3{3, 4, 5}}) {
    EXPECT_TRUE(may_touch(cube, {{}, place}, cube, {{}, place + Vec3{1, 0, 0}}));
  }
  EXPECT_FALSE(may_touch(cube, Transform{}, cube, {{}, {2.8_r, 0, 0}}));
}

}  // namespace
}  // namespace jfpx
