/// Tests of the CPU collider only: large inputs, the automatic choice of the algorithm, options.
#include "tests/support/sphere_collider_contract.hpp"

#include <cmath>
#include <limits>
#include <set>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

std::unique_ptr<SphereCollider> make(SphereAlgorithm algorithm, unsigned threads = 1) {
  return make_sphere_collider(
      {.backend = Backend::cpu, .algorithm = algorithm, .threads = threads});
}

TEST(SphereColliderCpu, AMillionSpheresOnALatticeHaveThreeNSquaredTimesNMinusOneContacts) {
  const auto collider = make(SphereAlgorithm::grid, 2);
  for (const std::size_t n : std::initializer_list<std::size_t>{55, 100}) {
    const auto spheres = make_lattice(n, Real(1.99));
    EXPECT_EQ(collider->find_contacts(spheres).size(), 3 * n * n * (n - 1)) << "n = " << n;
  }
}

TEST(SphereColliderCpu, TwentyThousandSpheresEqualBruteForce) {
  Random random(base_seed());
  for (const char* name : {"polydisperse", "clusters"}) {
    const auto spheres = sphere_kind(name).make(20000, random);
    EXPECT_TRUE(
        same_bits(make(SphereAlgorithm::grid)->find_contacts(spheres), brute_force(spheres)))
        << name << ", " << seed_note();
  }
}

// The search takes roots only for spheres that nearly touch. At the ends of the exponents, squares
// underflow or overflow, or only the squares of the filter overflow.
TEST(SphereColliderCpu, SpheresThatNearlyTouchEqualBruteForce) {
  constexpr int kLow = std::numeric_limits<Real>::min_exponent / 2;
  constexpr int kHigh = std::numeric_limits<Real>::max_exponent / 2;
  Random random(base_seed());
  for (const int exponent : {kLow - 4, kLow, kLow + 8, kLow / 2, 0, kHigh - 2, kHigh - 1, kHigh}) {
    const Real scale = std::ldexp(Real(1), exponent);
    auto spheres = make_lattice(8, 2 - 4 * kEpsilon);
    for (SphereInstance& s : spheres) {
      s.radius += (random.uniform() - Real(0.5)) * 100 * kEpsilon;
      s = {s.centre * scale, s.radius * scale};
    }
    const auto expected = brute_force(spheres);
    for (const SimdLevel level :
         {SimdLevel::scalar, SimdLevel::sse2, SimdLevel::avx2, SimdLevel::avx512}) {
      const auto collider = make_sphere_collider({.backend = Backend::cpu,
                                                  .algorithm = SphereAlgorithm::grid,
                                                  .threads = 1,
                                                  .simd = level});
      EXPECT_TRUE(same_bits(collider->find_contacts(spheres), expected))
          << "2^" << exponent << ", " << seed_note();
    }
  }
}

// Too large for brute force. The two algorithms have only the vector filter in common.
TEST(SphereColliderCpu, AlgorithmsAgreeOnAllKindsOfTensOfThousands) {
  const auto sorted = make(SphereAlgorithm::grid, 2);
  const auto all = make(SphereAlgorithm::all_pairs, 2);
  for (const SphereKind& kind : sphere_kinds()) {
    if (kind.name == "subnormal") continue;  // all touch: hundreds of millions of contacts
    Random random(base_seed());
    const auto spheres = kind.make(15000 + random.below(5000), random);
    EXPECT_TRUE(same_bits(sorted->find_contacts(spheres), all->find_contacts(spheres)))
        << kind.name << ", N = " << spheres.size() << ", " << seed_note();
  }
}

// One row is too long for a comparison sort, and one sphere overlaps all cells.
TEST(SphereColliderCpu, ALargeSphereTouchesEverySmallOne) {
  Random random(base_seed());
  auto spheres = sphere_kind("one_large").make(100000, random);
  const auto collider = make(SphereAlgorithm::grid, 2);
  const ContactSpan contacts = collider->find_contacts(spheres);
  std::set<SphereIndex> touched;
  SphereIndex large = 0;
  while (spheres[large].radius < 1) ++large;
  for (const SphereContact& c : contacts) {
    if (c.a == large || c.b == large) touched.insert(c.a == large ? c.b : c.a);
  }
  EXPECT_EQ(touched.size(), spheres.size() - 1) << seed_note();
  EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(), [](const auto& p, const auto& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  }));
}

// The number of cells overflows 64 bits, so empty cells are skipped.
TEST(SphereColliderCpu, ClustersAtTheCornersOfAnEnormousWorldAreFound) {
  Random random(base_seed());
  std::vector<SphereInstance> spheres;
  const Real far = Real(1e12);
  const Real radius = std::max(Real(0.01), far * kEpsilon * 2);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 middle{(corner & 1) != 0 ? far : -far, (corner & 2) != 0 ? far : -far,
                      (corner & 4) != 0 ? far : -far};
    for (int i = 0; i < 300; ++i) {
      const Vec3 offset = random.uniform_in_box({-9, -9, -9}, {9, 9, 9}) * radius;
      spheres.push_back({middle + offset, radius});
      spheres.push_back(
          {offset * Real(0.001), radius * Real(0.001)});  // small spheres in the middle
    }
  }
  shuffle(spheres, random);
  EXPECT_TRUE(same_bits(make(SphereAlgorithm::grid)->find_contacts(spheres), brute_force(spheres)))
      << seed_note();
}

// Even without empty cells the number of cells exceeds 64 bits: about two per sphere on each axis,
// (2 * 10^6)^3 > 2^62. Therefore cells are merged. The contacts are known: spheres with the same
// centre.
TEST(SphereColliderCpu, AMillionSpheresAcrossAnEnormousWorldAreFound) {
  Random random(base_seed());
  constexpr std::size_t kCount = 1'000'000, kTouching = 1000;
  constexpr Real kFar = Real(1e9);
  std::vector<SphereInstance> spheres;
  for (std::size_t i = 0; i < kCount; ++i) {
    spheres.push_back(
        {random.uniform_in_box({-kFar, -kFar, -kFar}, {kFar, kFar, kFar}), Real(0.5)});
  }
  std::vector<std::pair<SphereIndex, SphereIndex>> expected, found;
  for (std::size_t i = 0; i < kTouching; ++i) {
    expected.emplace_back(static_cast<SphereIndex>(i * (kCount / kTouching)),
                          static_cast<SphereIndex>(kCount + i));
    spheres.push_back(spheres[expected.back().first]);
  }
  const auto collider = make(SphereAlgorithm::grid);
  for (const SphereContact& c : collider->find_contacts(spheres)) found.emplace_back(c.a, c.b);
  EXPECT_EQ(found, expected) << seed_note();
}

// A body that fell out of the world must not increase the cell size of the others. Otherwise this
// test takes minutes instead of a fraction of a second.
TEST(SphereColliderCpu, DistantSpheresDoNotCoarsenTheCellsOfTheOthers) {
  Random random(base_seed());
  auto spheres = make_gas(200000, 1, 3, random);
  const auto collider = make(SphereAlgorithm::grid, 2);
  const ContactSpan before = collider->find_contacts(spheres);
  const std::vector<SphereContact> expected(before.begin(), before.end());
  spheres.push_back({{Real(-1e30), Real(1e25), Real(1e12)}, 1});
  spheres.push_back({{Real(1e20), Real(-1e30), 3}, 1});
  EXPECT_TRUE(same_bits(collider->find_contacts(spheres), expected)) << seed_note();
}

TEST(SphereColliderCpu, AutomaticChoosesBySizeAndReportsTheAlgorithm) {
  Random random(base_seed());
  const auto collider = make(SphereAlgorithm::automatic);
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::automatic);
  EXPECT_EQ(collider->backend(), Backend::cpu);
  collider->find_contacts(sphere_kind("uniform").make(100, random));
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::all_pairs);
  collider->find_contacts(sphere_kind("uniform").make(20000, random));
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::grid);
}

TEST(SphereColliderCpu, TheBackendTableNamesTheProcessor) {
  const BackendStatus status = available_backends().front();
  EXPECT_EQ(status.backend, Backend::cpu);
  EXPECT_TRUE(status.usable);
  EXPECT_NE(status.device.find(", "), std::string::npos) << status.device;
}

TEST(SphereColliderCpu, InvalidOptionsAreRejected) {
  for (const Backend backend : {Backend::automatic, Backend::cpu}) {
    EXPECT_THROW(
        make_sphere_collider({.backend = backend, .algorithm = static_cast<SphereAlgorithm>(3)}),
        InvalidArgument);
    EXPECT_THROW(make_sphere_collider({.backend = backend, .simd = static_cast<SimdLevel>(5)}),
                 InvalidArgument);
  }
}

TEST(SphereColliderCpu, TooManyThreadsAreRejected) {
  EXPECT_THROW(make(SphereAlgorithm::automatic, 257), InvalidArgument);
  EXPECT_NO_THROW(make(SphereAlgorithm::automatic, 0));
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
