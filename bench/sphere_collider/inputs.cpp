/// Inputs of the CUDA benchmarks; the same spheres on every machine.
#include "bench/sphere_collider/inputs.hpp"

#include <jfpx/error.hpp>
#include <jfpx/random.hpp>

#include <cmath>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

using Spheres = std::vector<SphereInstance>;

/// Uniformly random centres at volume fraction phi have 4*phi contacts per sphere.
Real side_of(std::size_t n, double mean_volume, double contacts) {
  return static_cast<Real>(std::cbrt(static_cast<double>(n) * mean_volume * 4 / contacts));
}
constexpr double kUnitSphere = 4.18879020478639;

Spheres gas_with(std::size_t n, double contacts) {
  Random random(1);
  const Real side = side_of(n, kUnitSphere / 8, contacts);
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    s = {random.uniform_in_box({0, 0, 0}, {side, side, side}), Real(0.5)};
  }
  return spheres;
}

Spheres gas(std::size_t n) { return gas_with(n, 3); }
/// Each sphere touches 30 others.
Spheres crowded(std::size_t n) { return gas_with(n, 15); }

/// Log-uniform radii from 1e-3 to 10. Two spheres touch with probability 4/3 pi (r_a + r_b)^3 / V,
/// and E (r_a + r_b)^3 = 2 E r^3 + 6 E r^2 E r, with E r^k = (10^k - 1e-3^k) / (k ln 1e4).
Spheres polydisperse(std::size_t n) {
  Random random(2);
  const auto moment = [](int k) {
    return (std::pow(10.0, k) - std::pow(1e-3, k)) / (k * std::log(1e4));
  };
  const double cube = 2 * moment(3) + 6 * moment(2) * moment(1);
  const auto side = static_cast<Real>(std::cbrt(kUnitSphere * cube * static_cast<double>(n) / 6));
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    s.centre = random.uniform_in_box({0, 0, 0}, {side, side, side});
    s.radius = static_cast<Real>(std::pow(10.0, static_cast<double>(random.uniform(-3, 1))));
  }
  return spheres;
}

/// Groups of 1000 spheres, each a gas, far from each other.
Spheres clusters(std::size_t n) {
  Random random(3);
  const Real side = side_of(1000, kUnitSphere / 8, 3);
  Spheres spheres(n);
  Vec3 corner;
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 1000 == 0) corner = random.uniform_in_box({-1e5, -1e5, -1e5}, {1e5, 1e5, 1e5});
    spheres[i] = {corner + random.uniform_in_box({0, 0, 0}, {side, side, side}), Real(0.5)};
  }
  return spheres;
}

/// On a diagonal, three contacts per sphere on average.
Spheres line(std::size_t n) {
  Random random(4);
  const Real length = static_cast<Real>(n) / 3;
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    const Real t = random.uniform(0, length) + random.uniform(0, 1) / 1024;
    s = {Vec3{Real(0.48), Real(0.6), Real(0.64)} * t, Real(0.5)};
  }
  return spheres;
}

/// Centres in one plane; density so that a disc of radius 1 holds six others.
Spheres plane(std::size_t n) {
  Random random(5);
  const auto side = static_cast<Real>(std::sqrt(static_cast<double>(n) * 3.14159265358979 / 6));
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    s = {random.uniform_in_box({0, 7, 0}, {side, 7, side}), Real(0.5)};
  }
  return spheres;
}

Spheres far(std::size_t n) {
  Spheres spheres = gas(n);
  for (SphereInstance& s : spheres) s.centre += Vec3{1e6, -1e6, 1e6};
  return spheres;
}

/// A gas in which sphere 0 also touches all others.
Spheres giant(std::size_t n) {
  Spheres spheres = gas(n);
  const Real side = side_of(n, kUnitSphere / 8, 3);
  if (n > 0) spheres[0] = {{side / 2, side / 2, side / 2}, side};
  return spheres;
}

/// Groups of 7 concentric spheres, far from each other: three contacts per sphere.
Spheres coincident(std::size_t n) {
  Spheres spheres = gas(n);
  for (std::size_t i = n; i-- > 0;) spheres[i].centre = spheres[i - i % 7].centre * 16;
  return spheres;
}

/// A gas in which one sphere in a hundred is up to 1e12 m away.
Spheres outliers(std::size_t n) {
  Random random(6);
  Spheres spheres = gas(n);
  for (std::size_t i = 0; i < n; i += 100) {
    const auto reach = static_cast<Real>(std::pow(10.0, static_cast<int>(random.below(13))));
    spheres[i].centre = random.uniform_in_box({-reach, -reach, -reach}, {reach, reach, reach});
  }
  return spheres;
}

Spheres overlap(std::size_t n) {
  Random random(7);
  Spheres spheres(n);
  for (SphereInstance& s : spheres) s = {random.uniform_in_box({0, 0, 0}, {1, 1, 1}), 2};
  return spheres;
}

constexpr Input kInputs[] = {
    {"gas", gas},           {"crowded", crowded}, {"polydisperse", polydisperse},
    {"clusters", clusters}, {"line", line},       {"plane", plane},
    {"far", far},           {"giant", giant},     {"coincident", coincident},
    {"outliers", outliers}, {"overlap", overlap}};

}  // namespace

std::span<const Input> inputs() { return kInputs; }

const Input& input(std::string_view name) {
  for (const Input& i : kInputs) {
    if (i.name == name) return i;
  }
  throw InvalidArgument("unknown input: " + std::string(name));
}

}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx
