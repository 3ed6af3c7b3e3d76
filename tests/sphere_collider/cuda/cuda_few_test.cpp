/// Every kernel with the smallest input that launches it, for checking tools that slow it down a
/// thousand times: scripts/sanitize-cuda runs these tests. The reference is the CPU.
#include "src/collide/sphere_pair.hpp"
#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// Searches twice, because a search clears the state of the next one.
void expect_cpu_contacts(const Spheres& spheres, SphereAlgorithm algorithm, const char* what) {
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto collider = make_sphere_collider({.backend = Backend::cuda, .algorithm = algorithm});
  for (int repeat = 0; repeat < 2; ++repeat) {
    EXPECT_TRUE(same_bits(collider->find_contacts(spheres), cpu->find_contacts(spheres)))
        << what << ", N = " << spheres.size() << ", " << seed_note();
  }
}

TEST_F(Cuda, FewSpheresInOneCluster) {
  Random random(base_seed());
  expect_cpu_contacts(make_gas(300, Real(0.5), 3, random), SphereAlgorithm::automatic, "gas");
}

TEST_F(Cuda, FewSpheresAsAllPairs) {
  Random random(base_seed());
  expect_cpu_contacts(make_gas(1100, Real(0.5), 3, random), SphereAlgorithm::all_pairs, "gas");
}

TEST_F(Cuda, FewSpheresInCellsWithRoom) {
  Random random(base_seed());
  expect_cpu_contacts(make_gas(2000, Real(0.5), 3, random), SphereAlgorithm::grid, "gas");
}

TEST_F(Cuda, FewSpheresInOneLaunch) {
  Random random(base_seed());
  for (const char* const name : {"polydisperse", "outliers", "one_large"}) {
    expect_cpu_contacts(sphere_kind(name).make(1500, random), SphereAlgorithm::grid, name);
  }
}

TEST_F(Cuda, FewSpheresInManyLaunches) {
  constexpr std::size_t kFewest = (1 << 18) + 1;
  Random random(base_seed());
  auto gas = make_gas(kFewest, Real(0.5), 1, random);
  for (std::size_t i = 0; i < 50; ++i) gas[999 * i].centre = gas[7].centre;  // a long row
  expect_cpu_contacts(gas, SphereAlgorithm::automatic, "gas with coincident spheres");
  auto mixed =
      make_gas(kFewest, Real(0.5), 20, random);  // about ten spheres per cell of the widest level
  for (SphereInstance& s : mixed) s.radius *= random.uniform(Real(0.04), 1);
  expect_cpu_contacts(mixed, SphereAlgorithm::automatic, "radii over 1.4 decades");
  for (std::size_t i = 0; i < 100; ++i) mixed[999 * i].centre *= 1e6;
  expect_cpu_contacts(mixed, SphereAlgorithm::automatic, "the same with outliers");
}

TEST_F(Cuda, FewCrowdedSpheres) {
  Random random(base_seed());
  // Rows in one launch are longer than the staging buffer holds, and the cells have no room.
  expect_cpu_contacts(make_gas(1500, Real(0.5), 60, random), SphereAlgorithm::grid, "gas");
  auto gas = make_gas((1 << 18) + 1, Real(0.5), 14, random);
  for (std::size_t i = 0; i < 50; ++i) gas[999 * i].centre = gas[7].centre;  // a long row
  expect_cpu_contacts(gas, SphereAlgorithm::automatic, "gas with coincident spheres");
  // Rows that a few lanes keep, that are longer than a row of the staging buffer, and far longer.
  auto dense = make_gas((1 << 18) + 1, Real(0.5), 45, random);
  std::size_t from = 0;
  for (const std::size_t group : {60u, 100u, 300u}) {
    const Vec3 centre = dense[from].centre;
    for (std::size_t i = 0; i < group; ++i, ++from) dense[501 * from].centre = centre;
  }
  expect_cpu_contacts(dense, SphereAlgorithm::automatic, "dense gas with coincident spheres");
}

TEST_F(Cuda, FewCrowdedSpheresThatTouchExactly) {
  Random random(base_seed());
  // Each sphere touches 32 others, six of them in one point.
  std::vector<SphereInstance> lattice(20 * 20 * 20);
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    lattice[i] = {
        Vec3{static_cast<Real>(i % 20), static_cast<Real>(i / 20 % 20), static_cast<Real>(i / 400)},
        Real(1)};
  }
  for (std::size_t i = lattice.size(); i > 1; --i) {
    std::swap(lattice[i - 1], lattice[random.below(i)]);
  }
  expect_cpu_contacts(lattice, SphereAlgorithm::grid, "lattice");
  for (SphereInstance& s : lattice) s.centre = s.centre + Vec3{1e6, -1e6, 3e5};
  expect_cpu_contacts(lattice, SphereAlgorithm::grid, "lattice far from the origin");
  for (SphereInstance& s : lattice) s = {s.centre * Real(0x1p-40), s.radius * Real(0x1p-40)};
  expect_cpu_contacts(lattice, SphereAlgorithm::grid, "the same, tiny");
}

TEST_F(Cuda, FewCrowdedSpheresOfSeveralRadii) {
  Random random(base_seed());
  auto gas = make_gas(6000, Real(0.5), 20, random);
  for (SphereInstance& s : gas) s.radius = random.uniform(Real(0.35), Real(0.5));
  expect_cpu_contacts(gas, SphereAlgorithm::grid, "radii");
  // Consecutive spheres in the order of cells are far from each other.
  for (std::size_t i = 0; i < gas.size(); i += 2) gas[i].centre.x += 400;
  expect_cpu_contacts(gas, SphereAlgorithm::grid, "two parts");
}

TEST_F(Cuda, FewPairsOfAList) {
  Random random(base_seed());
  const auto spheres = make_gas(200, Real(0.5), 3, random);
  std::vector<SpherePair> pairs(5000);
  for (SpherePair& p : pairs) {
    p = {static_cast<SphereIndex>(random.below(200)), static_cast<SphereIndex>(random.below(200))};
  }
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto collider = make();
  EXPECT_TRUE(
      same_bits(collider->find_touching(spheres, pairs), cpu->find_touching(spheres, pairs)))
      << seed_note();
}

TEST_F(Cuda, FewPairsOnAStream) {
  Random random(base_seed());
  const auto spheres = make_gas(200, Real(0.5), 3, random);
  std::vector<SpherePair> pairs(1000);
  std::vector<PairResult> expected;
  for (SpherePair& p : pairs) {
    p = {static_cast<SphereIndex>(random.below(200)), static_cast<SphereIndex>(random.below(200))};
    expected.push_back(detail::test_sphere_pair(spheres[p.a], spheres[p.b]));
  }
  DeviceData data(spheres, 0);
  EXPECT_TRUE(same_bits(test_pairs(data, pairs), expected)) << seed_note();
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
