/// Sphere sets, oracle and comparison; see the header.
#include "tests/support/sphere_fixtures.hpp"

#include "src/collide/sphere_pair.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Spheres = std::vector<SphereInstance>;
using Limits = std::numeric_limits<Real>;

/// Returns the side of a cube in which n spheres of radius r have about c contacts each: uniformly
/// random centres at volume fraction phi have 4*phi contacts per sphere (each pair counted once).
Real side_for(std::size_t n, Real r, Real c) {
  const double volume = static_cast<double>(n) * 4.0 / 3.0 * 3.14159265358979 * std::pow(r, 3);
  return static_cast<Real>(std::cbrt(volume * 4.0 / static_cast<double>(c)));
}

Spheres uniform(std::size_t n, Random& random) {
  Spheres spheres = make_gas(n, 1, 3, random);
  for (SphereInstance& s : spheres) s.radius = random.uniform(Real(0.7), Real(1.3));
  return spheres;
}

Spheres lattice(std::size_t n, Random& random) {
  std::size_t edge = 1;
  while (edge * edge * edge < n) ++edge;
  Spheres spheres = make_lattice(edge, Real(1.99));
  shuffle(spheres, random);
  spheres.resize(n);
  return spheres;
}

/// Dense clusters that are far apart, with a few spheres between them.
Spheres clusters(std::size_t n, Random& random) {
  Spheres spheres(n);
  Vec3 middle;
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 50 == 0) middle = random.uniform_in_box({-1e4, -1e4, -1e4}, {1e4, 1e4, 1e4});
    const Real extent = i % 10 == 0 ? Real(1000) : Real(4);
    spheres[i].centre =
        middle + random.uniform_in_box({-extent, -extent, -extent}, {extent, extent, extent});
    spheres[i].radius = random.uniform(Real(0.2), Real(1));
  }
  shuffle(spheres, random);
  return spheres;
}

/// Groups of up to 40 spheres that share one centre exactly.
Spheres coincident(std::size_t n, Random& random) {
  Spheres spheres(n);
  Vec3 centre;
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 40 == 0) centre = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
    spheres[i] = {centre, random.uniform(Real(0.01), Real(0.5))};
  }
  shuffle(spheres, random);
  return spheres;
}

Spheres line(std::size_t n, Random& random) {
  Spheres spheres(n);
  const Vec3 direction{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  for (SphereInstance& s : spheres) {
    s = {direction * random.uniform(0, static_cast<Real>(n)), Real(0.5)};
  }
  return spheres;
}

Spheres plane(std::size_t n, Random& random) {
  const Real half = std::sqrt(static_cast<Real>(n));
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    s = {random.uniform_in_box({-half, 3, -half}, {half, 3, half}), Real(0.9)};
  }
  return spheres;
}

/// Radii over four decades, uniform in the logarithm.
Spheres polydisperse(std::size_t n, Random& random) {
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    s.radius = static_cast<Real>(std::pow(10.0, static_cast<double>(random.uniform(-3, 1))));
    const Real half = Real(1.5) * std::cbrt(static_cast<Real>(n));
    s.centre = random.uniform_in_box({-half, -half, -half}, {half, half, half});
  }
  return spheres;
}

Spheres one_large(std::size_t n, Random& random) {
  Spheres spheres = make_gas(n, Real(0.01), 2, random);
  if (n > 0) spheres[random.below(n)] = {{0, 0, 0}, 1000};
  return spheres;
}

/// A gas 1e6 to 1e9 m from the origin, where the spacing of representable coordinates is large.
Spheres far(std::size_t n, Random& random) {
  Spheres spheres = make_gas(n, 1, 3, random);
  const Real distance = static_cast<Real>(std::pow(10.0, 6 + static_cast<int>(random.below(4))));
  const Real radius = std::max(Real(1), distance * Limits::epsilon() * 4);
  for (SphereInstance& s : spheres) {
    s.centre = s.centre * radius + Vec3{distance, -distance, distance};
    s.radius = radius;
  }
  return spheres;
}

/// A gas with a few spheres that are extremely far away.
Spheres outliers(std::size_t n, Random& random) {
  Spheres spheres = make_gas(n, 1, 3, random);
  for (std::size_t i = 0; i < n; i += 100) {
    const Real extent = static_cast<Real>(std::pow(10.0, static_cast<int>(random.below(30))));
    spheres[random.below(n)].centre =
        random.uniform_in_box({-extent, -extent, -extent}, {extent, extent, extent});
  }
  return spheres;
}

/// Neighbours at a distance of exactly r_a + r_b, or with radii that differ by one unit in the last
/// place.
Spheres touching(std::size_t n, Random& random) {
  std::size_t edge = 1;
  while (edge * edge * edge < n) ++edge;
  Spheres spheres = make_lattice(edge, 2);
  shuffle(spheres, random);
  spheres.resize(n);
  const Real scale = random.below(2) == 0 ? Real(1) : Real(1) / 3;
  for (SphereInstance& s : spheres) {
    s.centre = s.centre * scale;
    const Real nudge[] = {0, 0, Limits::max(), -Limits::max()};
    s.radius = std::nextafter(scale, nudge[random.below(4)]);
  }
  return spheres;
}

/// Distances whose squares underflow, and radii down to the smallest positive number.
Spheres subnormal(std::size_t n, Random& random) {
  Spheres spheres(n);
  const Real scales[] = {Limits::denorm_min(), Limits::min(), std::sqrt(Limits::min()),
                         std::sqrt(Limits::denorm_min())};
  const Real scale = scales[random.below(4)];
  for (SphereInstance& s : spheres) {
    s.centre = random.uniform_in_box({-50, -50, -50}, {50, 50, 50}) * scale;
    s.radius = std::max(Limits::denorm_min(), random.uniform(0, 10) * scale);
  }
  return spheres;
}

/// Squares, differences and sums of radii that overflow.
Spheres huge(std::size_t n, Random& random) {
  Spheres spheres(n);
  const Real root = std::sqrt(Limits::max());
  for (SphereInstance& s : spheres) {
    const Real extent = random.below(2) == 0 ? root : Limits::max() / 2;
    s.centre = random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * extent * 2;
    const Real radii[] = {Limits::denorm_min(), 1, root / 8, root, Limits::max()};
    s.radius = random.below(20) == 0 ? radii[random.below(5)] : root * random.uniform(0, Real(0.2));
    s.radius = std::max(Limits::denorm_min(), s.radius);
  }
  return spheres;
}

constexpr SphereKind kKinds[] = {
    {"uniform", uniform},
    {"lattice", lattice},
    {"clusters", clusters},
    {"coincident", coincident},
    {"line", line},
    {"plane", plane},
    {"polydisperse", polydisperse},
    {"one_large", one_large},
    {"far", far},
    {"outliers", outliers},
    {"touching", touching},
    {"subnormal", subnormal},
    {"huge", huge},
};

/// Equal bits, or both NaN: IEEE 754 does not specify the sign and payload of a NaN, and x86 and
/// CUDA differ.
bool same(Real a, Real b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}
bool same(const Vec3& a, const Vec3& b) {
  return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
}
bool same(const SphereContact& a, const SphereContact& b) {
  return a.a == b.a && a.b == b.b && same(a.normal, b.normal) && same(a.distance, b.distance);
}
bool same(const PairResult& a, const PairResult& b) {
  return a.touching == b.touching && same(a.normal, b.normal) && same(a.distance, b.distance);
}
bool same(const PairContact& a, const PairContact& b) {
  return a.pair == b.pair && same(a.normal, b.normal) && same(a.distance, b.distance);
}

std::string describe(const Vec3& normal, Real distance) {
  char text[128];
  std::snprintf(text, sizeof text, "normal (%a, %a, %a), distance %a",
                static_cast<double>(normal.x), static_cast<double>(normal.y),
                static_cast<double>(normal.z), static_cast<double>(distance));
  return text;
}
std::string describe(const SphereContact& c) {
  return "spheres " + std::to_string(c.a) + " and " + std::to_string(c.b) + ", " +
         describe(c.normal, c.distance);
}
std::string describe(const PairResult& r) {
  return (r.touching != 0 ? "touching, " : "apart, ") + describe(r.normal, r.distance);
}
std::string describe(const PairContact& c) {
  return "pair " + std::to_string(c.pair) + ", " + describe(c.normal, c.distance);
}

template <class T>
testing::AssertionResult compare(std::span<const T> actual, std::span<const T> expected) {
  const std::size_t common = std::min(actual.size(), expected.size());
  for (std::size_t i = 0; i < common; ++i) {
    if (same(actual[i], expected[i])) continue;
    return testing::AssertionFailure()
           << "result " << i << " of " << actual.size() << " is\n  " << describe(actual[i])
           << ", expected\n  " << describe(expected[i]);
  }
  if (actual.size() != expected.size()) {
    return testing::AssertionFailure() << actual.size() << " results, expected " << expected.size();
  }
  return testing::AssertionSuccess();
}

}  // namespace

std::span<const SphereKind> sphere_kinds() { return kKinds; }

const SphereKind& sphere_kind(std::string_view name) {
  for (const SphereKind& kind : kKinds) {
    if (kind.name == name) return kind;
  }
  ADD_FAILURE() << "there is no sphere kind " << name;
  return kKinds[0];
}

std::vector<SphereInstance> make_gas(std::size_t n, Real radius, Real contacts, Random& random) {
  const Real half = side_for(n, radius, contacts) / 2;
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    s = {random.uniform_in_box({-half, -half, -half}, {half, half, half}), radius};
  }
  return spheres;
}

std::vector<SphereInstance> make_lattice(std::size_t n, Real spacing) {
  Spheres spheres;
  spheres.reserve(n * n * n);
  for (std::size_t z = 0; z < n; ++z) {
    for (std::size_t y = 0; y < n; ++y) {
      for (std::size_t x = 0; x < n; ++x) {
        const Vec3 step{static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z)};
        spheres.push_back({step * spacing, 1});
      }
    }
  }
  return spheres;
}

void shuffle(std::vector<SphereInstance>& spheres, Random& random) {
  for (std::size_t i = spheres.size(); i > 1; --i)
    std::swap(spheres[i - 1], spheres[random.below(i)]);
}

std::vector<SphereContact> brute_force(std::span<const SphereInstance> spheres) {
  std::vector<SphereContact> contacts;
  const auto n = static_cast<SphereIndex>(spheres.size());
  for (SphereIndex a = 0; a < n; ++a) {
    for (SphereIndex b = a + 1; b < n; ++b) {
      const PairResult r = detail::test_sphere_pair(spheres[a], spheres[b]);
      if (r.touching != 0) contacts.push_back({a, b, r.normal, r.distance});
    }
  }
  return contacts;
}

testing::AssertionResult same_bits(ContactSpan actual, ContactSpan expected) {
  return compare(actual, expected);
}
testing::AssertionResult same_bits(std::span<const PairResult> actual,
                                   std::span<const PairResult> expected) {
  return compare(actual, expected);
}
testing::AssertionResult same_bits(std::span<const PairContact> actual,
                                   std::span<const PairContact> expected) {
  return compare(actual, expected);
}

std::vector<PairContact> touching_of(std::span<const PairResult> results) {
  std::vector<PairContact> touching;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].touching == 0) continue;
    touching.push_back({results[i].normal, results[i].distance, static_cast<std::uint32_t>(i)});
  }
  return touching;
}

std::uint64_t base_seed() {
  static const std::uint64_t seed = [] {
    if (const char* text = std::getenv("JFPX_TEST_SEED")) {
      return static_cast<std::uint64_t>(std::strtoull(text, nullptr, 0));
    }
    std::random_device device;
    return (static_cast<std::uint64_t>(device()) << 32) | device();
  }();
  return seed;
}

std::size_t scaled(std::size_t n) {
  const char* const divisor = std::getenv("JFPX_TEST_DIVISOR");
  return divisor == nullptr ? n : n / std::max(1ul, std::strtoul(divisor, nullptr, 10));
}

std::string seed_note() { return "repeat with JFPX_TEST_SEED=" + std::to_string(base_seed()); }

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
