/// The gyroscopic term of a substep, compared with its equation solved in double precision.
#include "src/world/bodies/integrate.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Vector = std::array<double, 3>;

/// T c + after(w + c) = before(w) for principal moments T, by fixed-point iterations with a
/// relaxation that converges for any ratio of the moments.
Vector change_in_double(const Vector& w, const Vector& moments, double dt) {
  const auto quadratic = [&](const Vector& v, double side) {
    const Vector l{moments[0] * v[0], moments[1] * v[1], moments[2] * v[2]};
    const double energy = (v[0] * l[0] + v[1] * l[1] + v[2] * l[2]) * dt * dt / 4;
    const double half = side * dt / 2;
    return Vector{v[0] * energy + (v[1] * l[2] - v[2] * l[1]) * half,
                  v[1] * energy + (v[2] * l[0] - v[0] * l[2]) * half,
                  v[2] * energy + (v[0] * l[1] - v[1] * l[0]) * half};
  };
  const Vector before = quadratic(w, -1);
  const double most = std::max({moments[0], moments[1], moments[2]});
  const double turned2 = (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) * dt * dt;
  Vector c{};
  double largest = 1;
  for (int i = 0; i < 100000 && largest > 1e-12 * std::sqrt(turned2) / dt; ++i) {
    const Vector after = quadratic({w[0] + c[0], w[1] + c[1], w[2] + c[2]}, 1);
    largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double error = (before[k] - after[k] - moments[k] * c[k]) / moments[k];
      c[k] += error * moments[k] / (moments[k] + most * turned2);
      largest = std::max(largest, std::abs(error));
    }
  }
  return c;
}

TEST(GyroscopicTerm, SolvesItsEquation) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  constexpr Real kStep = Real(1) / 240;
  for (int run = 0; run < 5000; ++run) {
    // Of a box whose sides have ratios of up to 100.
    const auto side2 = [&] { return std::pow(10._r, random.uniform(-4, 0)); };
    const Real x = side2(), y = side2(), z = side2(), unit = std::pow(10._r, random.uniform(-8, 8));
    const Vec3 moments{y + z, z + x, x + y};
    const Real largest = std::max({moments.x, moments.y, moments.z});
    const Real turn = std::pow(10._r, random.uniform(-6, -0.6_r));  // [rad], in a substep
    const Vec3 w = random_direction(&random) * (turn / kStep);
    const Mat3 axes = to_matrix(random_rotation(&random));  // of the body in principal axes
    const auto in_body_axes = [&](const Vec3& diagonal_entries) {
      return transposed(axes) * (diagonal(diagonal_entries) * axes);
    };
    const Vec3 inverse{unit / moments.x, unit / moments.y, unit / moments.z};
    Vec3 change;
    ASSERT_TRUE(detail::momentum_keeping_change(transform_transpose(axes, w),
                                                in_body_axes(moments * (1 / largest)),
                                                in_body_axes(inverse), kStep, &change));
    change = axes * change;
    const auto to_vector = [](const Vec3& v) {
      return Vector{static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
    };
    const Vector expected = change_in_double(to_vector(w), to_vector(moments * (1 / largest)),
                                             static_cast<double>(kStep));
    // The error of the iterations, and the rounding of the inertia in the body's axes, which is
    // that of its largest entry.
    const Real least = std::min({moments.x, moments.y, moments.z});
    const Real error = 4 * std::min(turn * turn * turn, 1e-7_r);
    const Real rounding = 64 * kEpsilon * turn * (largest / least);
    const auto tolerance = static_cast<double>((error + rounding) * (turn / kStep));
    const Vector found = to_vector(change);
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_NEAR(found[k], expected[k], tolerance)
          << "run " << run << ", turn " << turn << ", moments " << moments.x << " " << moments.y
          << " " << moments.z;
    }
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
