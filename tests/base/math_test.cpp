/// Tests of vectors, quaternions, matrices and transforms against identities and hand-computed
/// values.
#include <jfpx/error.hpp>
#include <jfpx/math.hpp>
#include <jfpx/random.hpp>

#include "src/base/hash64.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

namespace jfpx {
namespace {

constexpr Real kTolerance = 64 * kEpsilon;

void expect_near(const Vec3& actual, const Vec3& expected, Real tolerance = kTolerance) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

Vec3 random_vector(Random& random) { return random.uniform_in_box({-2, -2, -2}, {2, 2, 2}); }
Quat random_rotation(Random& random) {
  const Vec3 v = random_vector(random);
  return normalized(Quat{random.uniform(-1, 1), v.x, v.y, v.z});
}

// The root of an integer of 105 or 106 bits has 53, so that each integer r near it is a number.
// Those that are rounded to r lie between the squares of r - 1/2 and r + 1/2.
TEST(SquareRoot, IsCorrectlyRounded) {
  Random random(0x5157ull);
  for (int i = 0; i < 100'000; ++i) {
    const auto digits = static_cast<double>((1ull << 52) + (random.next() >> 12));
    const int shift = 52 + i % 2;
    using Wide = unsigned __int128;
    const Wide square = static_cast<Wide>(digits) << shift;
    const auto root = static_cast<Wide>(square_root(std::ldexp(digits, shift)));
    ASSERT_TRUE(root * root - root < square && square <= root * root + root) << digits << shift;
    const auto narrow = static_cast<float>(digits);
    ASSERT_EQ(square_root(narrow), static_cast<float>(square_root(static_cast<double>(narrow))));
  }
}

TEST(SquareRoot, OfAnIntegerIsAReal) {
  static_assert(std::is_same_v<decltype(square_root(2)), Real>);
  EXPECT_EQ(square_root(2), square_root(Real(2)));
}

TEST(Vec3, CrossProductOfTheAxesIsRightHanded) {
  EXPECT_EQ(cross({1, 0, 0}, {0, 1, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(cross({0, 1, 0}, {0, 0, 1}), (Vec3{1, 0, 0}));
  EXPECT_EQ(cross({0, 0, 1}, {1, 0, 0}), (Vec3{0, 1, 0}));
}

TEST(Vec3, NormalizedHasLengthOneAndKeepsZero) {
  EXPECT_NEAR(length(normalized(Vec3{3, -4, 12})), 1, kTolerance);
  EXPECT_EQ(normalized(Vec3{}), Vec3{});
}

TEST(Vec3, FiniteMeansNeitherNanNorInfinite) {
  const Real infinity = std::numeric_limits<Real>::infinity();
  EXPECT_TRUE(is_finite(
      Vec3{std::numeric_limits<Real>::max(), 0, std::numeric_limits<Real>::denorm_min()}));
  EXPECT_FALSE(is_finite(Vec3{0, -infinity, 0}));
  EXPECT_FALSE(is_finite(Vec3{0, 0, std::numeric_limits<Real>::quiet_NaN()}));
}

TEST(Erratum, E14_a_quarter_turn_about_z_maps_x_to_y) {
  const Real h = square_root(Real(0.5));
  expect_near(rotate(Quat{h, 0, 0, h}, {1, 0, 0}), {0, 1, 0});
  expect_near(transform_direction(make_transform(Quat{h, 0, 0, h}, {}), {1, 0, 0}), {0, 1, 0});
}

TEST(Erratum, E24_default_and_tiny_quaternions_are_the_identity) {
  EXPECT_EQ(Quat{}, (Quat{1, 0, 0, 0}));
  EXPECT_EQ(normalized(Quat{0, 0, 0, 0}), Quat{});
  EXPECT_EQ(normalized(Quat{0, Real(1e-25), 0, 0}), Quat{});
}

TEST(Erratum, E25_a_rotation_vector_rotates_by_its_length) {
  const Quat q = rotated_by(Quat{}, {0, 0, Real(0.001)});
  expect_near(rotate(q, {1, 0, 0}), {std::cos(Real(0.001)), std::sin(Real(0.001)), 0}, Real(1e-6));
}

TEST(Erratum, E26_inverting_a_singular_matrix_is_reported) {
  Mat3 out3 = diagonal({7, 7, 7});
  EXPECT_FALSE(invert(Mat3{{{1, 2, 3}, {2, 4, 6}, {0, 0, 1}}}, &out3));
  EXPECT_EQ(out3, diagonal({7, 7, 7}));
  EXPECT_EQ(inverse(Mat3{{{1, 2, 3}, {2, 4, 6}, {0, 0, 1}}}), std::nullopt);
  Mat4 singular;
  singular.m[2][2] = 0;
  Mat4 out4;
  EXPECT_FALSE(invert(singular, &out4));
  EXPECT_EQ(out4, Mat4{});
  EXPECT_EQ(inverse(singular), std::nullopt);
}

TEST(Quat, MatrixAgreesWithTheSandwichProduct) {
  Random random(11);
  for (int i = 0; i < 1000; ++i) {
    const Quat q = random_rotation(random);
    const Vec3 v = random_vector(random);
    const Quat sandwich = q * Quat{0, v.x, v.y, v.z} * conjugate(q);
    expect_near(rotate(q, v), {sandwich.x, sandwich.y, sandwich.z});
  }
}

TEST(Quat, FromAxisAndAngleRotatesCounterclockwise) {
  expect_near(rotate(from_axis_angle({0, 0, 2}, kPi / 2), {1, 0, 0}), {0, 1, 0});
  expect_near(rotate(from_axis_angle({0, -1, 0}, kPi / 2), {1, 0, 0}), {0, 0, 1});
  expect_near(rotate(from_axis_angle({1, 1, 1}, 2 * kPi / 3), {1, 2, 3}), {3, 1, 2});
  EXPECT_EQ(from_axis_angle({3, 0, 0}, 0), Quat{});
}

TEST(Quat, FromAxisAndAngleIsAccurate) {
#if defined(_WIN32)
  constexpr long double kReduction = 0x1p-66L;  // cos() of MinGW-w64 takes 66 bits of pi
#else
  constexpr long double kReduction = 0;
#endif
  Random random(17);
  Hash64 hash;
  for (int i = 0; i < 20000; ++i) {
    const Real range = i % 2 == 0 ? Real(7) : Real(1e6);
    const Real angle = random.uniform(-range, range);
    const Quat q = from_axis_angle({0, 1, 0}, angle);
    const long double half = static_cast<long double>(angle) / 2;
    const Real tolerance = kEpsilon + static_cast<Real>(std::abs(half) * kReduction);
    ASSERT_NEAR(q.w, static_cast<Real>(std::cos(half)), tolerance) << angle;
    ASSERT_NEAR(q.y, static_cast<Real>(std::sin(half)), tolerance) << angle;
    hash.add_bytes(&q, sizeof q);
  }
  // The same with all compilers, optimization levels and C libraries.
  EXPECT_EQ(hash.value(), sizeof(Real) == 4 ? 0xa8488d7d8e763694u : 0xb5e3b69be452331au);
}

TEST(Quat, FromAxisAndAngleNamesBadArguments) {
  const auto message = [](const Vec3& axis, Real angle) {
    try {
      from_axis_angle(axis, angle);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_EQ(message({0, 0, 0}, 1).find("axis is (0, 0, 0); "), 0u) << message({0, 0, 0}, 1);
  EXPECT_EQ(message({0, nan, 0}, 1).find("axis is (0, nan, 0); "), 0u);
  EXPECT_EQ(message({0, 1, 0}, nan).find("angle is nan; "), 0u) << message({0, 1, 0}, nan);
  EXPECT_EQ(message({0, 1, 0}, Real(1.5e6)).find("angle is 1.5e+06; "), 0u);
}

TEST(Quat, ProductAppliesTheRightFactorFirst) {
  Random random(12);
  for (int i = 0; i < 1000; ++i) {
    const Quat a = random_rotation(random), b = random_rotation(random);
    const Vec3 v = random_vector(random);
    expect_near(rotate(a * b, v), rotate(a, rotate(b, v)));
  }
}

TEST(Mat3, TimesItsInverseIsTheIdentity) {
  Random random(13);
  for (int i = 0; i < 1000; ++i) {
    const Mat3 m = to_matrix(random_rotation(random)) * diagonal({1, 2, Real(0.5)});
    Mat3 inverse_of_m;
    ASSERT_TRUE(invert(m, &inverse_of_m));
    ASSERT_EQ(inverse(m), inverse_of_m);
    const Mat3 product = m * inverse_of_m;
    for (int r = 0; r < 3; ++r) expect_near(product.row[r], Mat3{}.row[r]);
  }
}

TEST(Mat3, ProductMatchesHandComputedValues) {
  const Mat3 a{{{1, 2, 3}, {4, 5, 6}, {7, 8, 10}}};
  const Mat3 b{{{2, 0, 1}, {1, 3, 0}, {0, 1, 4}}};
  EXPECT_EQ(a * b, (Mat3{{{4, 9, 13}, {13, 21, 28}, {22, 34, 47}}}));
  EXPECT_EQ(determinant(a), -3);
  EXPECT_EQ(transform_transpose(a, {1, 1, 1}), transposed(a) * Vec3({1, 1, 1}));
}

TEST(Mat3, SkewSymmetricMatrixIsTheCrossProduct) {
  EXPECT_EQ(skew_symmetric({1, 2, 3}) * Vec3({4, 5, 6}), cross({1, 2, 3}, {4, 5, 6}));
}

TEST(Mat3, InterpolationHitsBothEnds) {
  const Mat3 a = diagonal({1, 2, 3}), b = diagonal({5, 6, 7});
  EXPECT_EQ(interpolate(a, b, 0), a);
  EXPECT_EQ(interpolate(a, b, 1), b);
  EXPECT_EQ(interpolate(a, b, Real(0.5)), diagonal({3, 4, 5}));
}

TEST(Transform, InverseUndoesIt) {
  Random random(14);
  for (int i = 0; i < 1000; ++i) {
    const Transform t = make_transform(random_rotation(random), random_vector(random));
    const Vec3 p = random_vector(random);
    expect_near(inverse_transform_point(t, transform_point(t, p)), p);
    expect_near(transform_point(inverse(t), transform_point(t, p)), p);
    expect_near(transform_point(inverse(t) * t, p), p);
    expect_near(inverse_transform_direction(t, transform_direction(t, p)), p);
  }
}

TEST(Erratum, E12_product_of_general_matrices_uses_row_times_column) {
  Mat4 a, b;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      a.m[i][j] = static_cast<Real>(i * 4 + j + 1);
      b.m[i][j] = static_cast<Real>((i * 7 + j * 3) % 5);
    }
  }
  // Row 0 of a is (1 2 3 4); column 1 of b is (3 0 2 4).
  EXPECT_EQ((a * b).m[0][1], 1 * 3 + 2 * 0 + 3 * 2 + 4 * 4);
}

TEST(Erratum, E13_general_inverse_times_matrix_is_the_identity) {
  Random random(15);
  for (int n = 0; n < 1000; ++n) {
    Mat4 a;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) a.m[i][j] = random.uniform(-1, 1) + (i == j ? Real(3) : Real(0));
    }
    Mat4 inverse_of_a;
    ASSERT_TRUE(invert(a, &inverse_of_a));
    ASSERT_EQ(inverse(a), inverse_of_a);
    const Mat4 product = a * inverse_of_a;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) EXPECT_NEAR(product.m[i][j], i == j ? 1 : 0, kTolerance);
    }
  }
}

TEST(Mat4, AgreesWithTheTransformItWasMadeFrom) {
  Random random(16);
  const Transform t = make_transform(random_rotation(random), random_vector(random));
  const Vec3 p = random_vector(random);
  expect_near(transform_point(to_mat4(t), p), transform_point(t, p));
  EXPECT_EQ(axis(to_mat4(t), 1), t.basis.column(1));
  EXPECT_EQ(axis(to_mat4(t), 3), t.origin);
  Real gl[16];
  fill_column_major(to_mat4(t), gl);
  EXPECT_EQ(gl[12], t.origin.x);
  EXPECT_EQ(gl[4], t.basis(0, 1));
}

TEST(Aabb, TouchingBoxesOverlapAndTheEmptyBoxDoesNot) {
  const Aabb a{{0, 0, 0}, {1, 1, 1}}, b{{1, 0, 0}, {2, 1, 1}}, c{{Real(1.5), 0, 0}, {2, 1, 1}};
  EXPECT_TRUE(overlap(a, b));
  EXPECT_FALSE(overlap(a, c));
  EXPECT_FALSE(overlap(a, Aabb{}));
  EXPECT_EQ(merged(a, Aabb{}), a);
  EXPECT_EQ(merged(a, b), (Aabb{{0, 0, 0}, {2, 1, 1}}));
}

TEST(Random, IsTheSameInEveryBuild) {
  Random random(1);
  EXPECT_EQ(random.next(), 0x910a2dec89025cc1u);
  EXPECT_EQ(random.next(), 0xbeeb8da1658eec67u);
  EXPECT_EQ(Random(42).uniform(), static_cast<Real>(0xbdd732u) / Real(16777216));
}

}  // namespace
}  // namespace jfpx
