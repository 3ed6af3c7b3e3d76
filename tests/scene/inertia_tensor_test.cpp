/// Tests of the validation and inversion of inertia tensors, against sums over points.
#include "src/scene/inertia_tensor.hpp"

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

/// The inertia of `count` random point masses: sum of m (x.x 1 - x x^T).
Mat3 of_points(Random* random, int count) {
  Mat3 tensor = diagonal({0, 0, 0});
  for (int i = 0; i < count; ++i) {
    const Vec3 x = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    const Real mass = random->uniform(0.1_r, 2);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        tensor(r, c) += mass * ((r == c ? length_squared(x) : Real(0)) - x[r] * x[c]);
      }
    }
  }
  return tensor;
}

TEST(InertiaTensor, OfAnyPointsIsValidAndInverted) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int i = 0; i < 10000; ++i) {
    const Mat3 tensor = of_points(&random, 3 + i % 5);
    ASSERT_EQ(inertia_must_be(tensor), nullptr) << i;
    const Mat3 inverse = inverse_inertia(tensor);
    Real size = 0;
    for (const Vec3& row : inverse.row) size = std::max(size, length(row));
    const Mat3 product = tensor * inverse;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(product(r, c), r == c ? 1 : 0, 200 * kEpsilon * (1 + size)) << i;
        ASSERT_EQ(inverse(r, c), inverse(c, r));
      }
    }
  }
}

TEST(InertiaTensor, StaysValidUnderRotation) {
  // Moments (1, 2, z) in rotated axes are valid for 1 <= z <= 3, with a tolerance of a thousandth.
  const Mat3 rotation = to_matrix(normalized(Quat{1, 2, 3, 4}));
  const auto rotated = [&rotation](Real z) {
    return rotation * diagonal({1, 2, z}) * transposed(rotation);
  };
  for (const Real good : {1.001_r, 2.5_r, Real(3)}) {
    EXPECT_EQ(inertia_must_be(rotated(good)), nullptr) << good;
  }
  for (const Real bad : {0.97_r, 3.03_r}) {
    EXPECT_STREQ(inertia_must_be(rotated(bad)),
                 "such that no principal moment exceeds the sum of the others");
  }
  EXPECT_STREQ(inertia_must_be(rotated(-0.1_r)), "positive definite");
}

TEST(InertiaTensor, ValidityDoesNotDependOnTheScale) {
  for (const Real scale : {1e-30_r, 1e30_r}) {
    EXPECT_EQ(inertia_must_be(diagonal({2, 3, 4}) * scale), nullptr) << scale;
    EXPECT_NE(inertia_must_be(diagonal({2, 3, 6}) * scale), nullptr) << scale;
    const Mat3 full{{{2, 0.5_r, 0}, {0.5_r, 3, 0}, {0, 0, 4}}};
    EXPECT_EQ(inertia_must_be(full * scale), nullptr);
    EXPECT_NEAR(inverse_inertia(full * scale)(1, 1) * scale, 2 / 5.75, 1e-6);
  }
}

TEST(InertiaTensor, MustHaveAFiniteInverse) {
  const Real tiny = std::numeric_limits<Real>::denorm_min();
  EXPECT_STREQ(inertia_must_be(diagonal({tiny, tiny, tiny})), "such that its inverse is finite");
}

TEST(InertiaTensor, LastDigitsMayBeAsymmetric) {
  const Mat3 tensor{{{2, 0.1_r, 0}, {0.1_r * (1 + 2 * kEpsilon), 3, 0}, {0, 0, 4}}};
  EXPECT_EQ(inertia_must_be(tensor), nullptr);
  const Mat3 mean = symmetric_part(tensor);
  EXPECT_EQ(mean(0, 1), mean(1, 0));
}

}  // namespace
}  // namespace jfpx
