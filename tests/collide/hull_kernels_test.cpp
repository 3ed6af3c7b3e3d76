/// Tests that the kernels of polyhedra have the bits of the scalar tests.
#include "src/base/cpu.hpp"
#include "src/collide/polyhedron_pair.hpp"
#include "tests/collide/random_solids.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>

namespace jfpx {
namespace {

using detail::BoxPolyhedron;
using detail::HullPolyhedron;
using detail::PolyhedronAxis;
using detail::PolyhedronPair;
using detail::TestedAxes;
using test::operator""_r;

#if defined(__x86_64__)

using RealBits = std::array<unsigned char, sizeof(Real)>;

auto bits_of(const PolyhedronAxis& axis) {
  const detail::LeastOverlap& o = axis.overlap;
  const auto bits = [](Real x) { return std::bit_cast<RealBits>(x); };
  const bool is_found = axis.kind != PolyhedronAxis::none;
  return std::tuple(static_cast<int>(axis.kind), axis.first, axis.second,
                    is_found ? std::array{bits(o.distance), bits(o.error), bits(o.normal.x),
                                          bits(o.normal.y), bits(o.normal.z)}
                             : std::array<RealBits, 5>{});
}

Vec3 point_on_sphere(Random* random) { return test::random_direction(random); }

/// Hulls with few and many vertices, parallel faces, faces of many corners, sharp edges, and the
/// origin on a face.
Hull test_hull(Random* random) {
  std::vector<Vec3> points;
  const std::uint64_t kind = random->below(6);
  if (kind == 0) return test::random_hull(random);
  if (kind == 1) return Hull().translated({0, random->below(2) == 0 ? 0.5_r : 0, 0});
  if (kind == 2) {
    const auto count = 4 + random->below(Hull::kMaxVertices - 3);
    for (std::uint64_t i = 0; i < count; ++i) points.push_back(point_on_sphere(random) * 0.7_r);
  } else if (kind == 3) {  // a prism
    const auto corners = 3 + random->below(60);
    for (std::uint64_t i = 0; i < corners; ++i) {
      const Quat turn = from_axis_angle({0, 1, 0}, 2 * kPi * Real(i) / Real(corners));
      const Vec3 corner = rotate(turn, {0.6_r, 0, 0});
      points.push_back(corner + Vec3{0, 0.3_r, 0});
      points.push_back(corner - Vec3{0, 0.3_r, 0});
    }
  } else if (kind == 4) {  // an octahedron
    for (int i = 0; i < 3; ++i) {
      points.push_back(detail::unit_axis(i) * 0.8_r);
      points.push_back(detail::unit_axis(i) * -0.8_r);
    }
  } else {  // a splinter
    for (int i = 0; i < 12; ++i) {
      points.push_back(random->uniform_in_box({-1, -0.01_r, -0.1_r}, {1, 0.01_r, 0.1_r}));
    }
  }
  return Hull(points);
}

/// @param found counts of the kinds of the widest axes; the first is that of separated pairs
template <class A, class B>
void compare(const A& a, const B& b, Random* random, std::array<int, 4>* found) {
  const Real size = a.size() + b.size();
  const Transform pose = make_transform(test::random_tilt(random), {});
  PolyhedronPair<A, B> pair{a, b, pose.basis, {}, size};
  const Vec3 direction = random->below(3) == 0 ? detail::unit_axis(int(random->below(3)))
                                               : test::random_direction(random);
  const Real distances[] = {0, 0.5_r, 1, random->uniform(0, size)};
  pair.offset = direction * distances[random->below(4)];
  const Real error = 8 * kEpsilon * size;
  for (const Real limit : {kMaxReal, size * 0.02_r, Real(0)}) {
    TestedAxes scalar, vector;
    const bool expected = detail::test_axes(pair, error, limit, &scalar);
    const bool meets = detail::test_axes(pair, error, limit, cpu::kAvx2HullKernels, &vector);
    ASSERT_EQ(meets, expected);
    ++(*found)[!meets ? 0u : scalar.edges.kind != 0 ? 3u : unsigned(scalar.widest.kind)];
    if (!meets) continue;
    ASSERT_EQ(bits_of(vector.of_a), bits_of(scalar.of_a));
    ASSERT_EQ(bits_of(vector.widest), bits_of(scalar.widest));
    ASSERT_EQ(bits_of(vector.edges), bits_of(scalar.edges));
  }
}

TEST(HullKernels, HaveTheBitsOfTheScalarTests) {
  if (usable_simd_level(SimdLevel::automatic) < SimdLevel::avx2) GTEST_SKIP() << "needs AVX2";
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::array<int, 4> found{};
  for (int n = 0; n < 400; ++n) {
    const Hull a = test_hull(&random), b = test_hull(&random);
    const HullPolyhedron of_a{&a.data().view}, of_b{&b.data().view};
    const BoxPolyhedron box{random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {0.9_r, 0.9_r, 0.9_r})};
    for (int k = 0; k < 8; ++k) {
      SCOPED_TRACE(n);
      compare(of_a, of_b, &random, &found);
      compare(of_a, box, &random, &found);
      if (HasFatalFailure()) return;
    }
  }
  for (const int count : found) EXPECT_GT(count, 100);
}

/// The first of several supporting vertices decides the sign of a support of 0.
TEST(HullKernels, HaveTheSignOfAZeroSupport) {
  if (usable_simd_level(SimdLevel::automatic) < SimdLevel::avx2) GTEST_SKIP() << "needs AVX2";
  const Hull below = Hull().translated({0, -0.5_r, 0}), above = Hull().translated({0, 0.5_r, 0});
  for (const Vec3& offset : {Vec3{}, Vec3{-0.0_r, -0.0_r, -0.0_r}, Vec3{0, -0.0_r, 0}}) {
    const PolyhedronPair<HullPolyhedron, HullPolyhedron> pair{
        {&below.data().view}, {&above.data().view}, {}, offset, 2};
    TestedAxes scalar, vector;
    ASSERT_TRUE(detail::test_axes(pair, kEpsilon, kMaxReal, &scalar));
    ASSERT_TRUE(detail::test_axes(pair, kEpsilon, kMaxReal, cpu::kAvx2HullKernels, &vector));
    EXPECT_EQ(bits_of(vector.of_a), bits_of(scalar.of_a));
    EXPECT_EQ(bits_of(vector.widest), bits_of(scalar.widest));
  }
}

#endif

}  // namespace
}  // namespace jfpx
