/// Searches in periodic cells on arrays in device memory against the functions on the host.
#include <jfpx/error.hpp>
#include <jfpx/periodic.hpp>

#include "tests/sphere_collider/cuda/device_arrays.hpp"

#include <cmath>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// The result of the last search in a periodic cell, of `n` contacts.
std::vector<PeriodicContact> periodic_of(ArrayCollider& collider, std::size_t n, Stream stream) {
  const auto contacts = contacts_of<std::int32_t>(collider, n, stream);
  const DeviceArray<std::int32_t> shifts(3 * n);
  collider.write_shifts(shifts.data(), n, stream);
  const auto host = shifts.download();
  std::vector<PeriodicContact> result;
  for (std::size_t i = 0; i < n; ++i) {
    result.push_back({contacts[i], {host[3 * i], host[3 * i + 1], host[3 * i + 2]}});
  }
  return result;
}

/// The same of a search for pairs.
std::vector<std::pair<SpherePair, ImageShift>> periodic_pairs_of(ArrayCollider& collider,
                                                                 std::size_t n, Stream stream) {
  const auto pairs = pairs_of(collider, n, stream);
  const DeviceArray<std::int32_t> shifts(3 * n);
  collider.write_shifts(shifts.data(), n, stream);
  const auto host = shifts.download();
  std::vector<std::pair<SpherePair, ImageShift>> result;
  for (std::size_t i = 0; i < n; ++i) {
    result.push_back({pairs[i], {host[3 * i], host[3 * i + 1], host[3 * i + 2]}});
  }
  return result;
}
std::vector<std::pair<SpherePair, ImageShift>> pairs_of(
    const std::vector<PeriodicContact>& contacts) {
  std::vector<std::pair<SpherePair, ImageShift>> result;
  for (const PeriodicContact& c : contacts) {
    result.push_back({{c.contact.a, c.contact.b}, c.shift});
  }
  return result;
}

/// Spheres of a cell, some of which have left it by up to three lengths; a quarter is on a lattice
/// of half lengths, where pairs touch through two images.
Spheres gas_in(const PeriodicCell& cell, std::size_t n, Real largest_radius, Random& random) {
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    const bool on_lattice = random.below(4) == 0;
    for (int k = 0; k < 3; ++k) {
      const Real cells = static_cast<Real>(random.below(7)) - 3;
      const Real x = on_lattice ? static_cast<Real>(random.below(2)) / 2 : random.uniform(0, 1);
      s.centre[k] = (x + cells) * cell.lengths[k];
    }
    s.radius = on_lattice ? largest_radius : random.uniform(largest_radius / 3, largest_radius);
  }
  return spheres;
}

TEST_F(Cuda, FewArraysInAPeriodicCellHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  for (unsigned axes = 0; axes < 8; ++axes) {
    const PeriodicCell cell{{8, 9, Real(7.5)}, {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0}};
    for (const auto& [n, radius] : {std::pair<std::size_t, Real>{0, 1},
                                    {1, 1},
                                    {2, 1},
                                    {200, Real(7.5) / 4},
                                    {1500, Real(0.5)}}) {
      const Spheres spheres = gas_in(cell, n, radius, random);
      const DeviceSpheres arrays(spheres);
      const auto half = find_periodic_contacts(*cpu, spheres, cell);
      for (const bool both : {false, true}) {
        const auto expected = both ? in_both_orders(half, n) : half;
        ASSERT_EQ(collider.find_periodic(arrays.arrays(), cell, ArrayResult::contacts, both,
                                         stream.get()),
                  expected.size())
            << "axes " << axes << ", N = " << n << ", " << seed_note();
        EXPECT_EQ(periodic_of(collider, expected.size(), stream.get()), expected) << seed_note();
        ASSERT_EQ(
            collider.find_periodic(arrays.arrays(), cell, ArrayResult::pairs, both, stream.get()),
            expected.size());
        EXPECT_EQ(periodic_pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
      }
    }
  }
}

/// @param fewest contacts that the test expects
void expect_contacts_of_host(ArrayCollider& collider, const Spheres& spheres,
                             const PeriodicCell& cell, std::size_t fewest) {
  const OwnedStream stream(0);
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto expected = find_periodic_contacts(*cpu, spheres, cell);
  ASSERT_GT(expected.size(), fewest);
  const DeviceSpheres arrays(spheres);
  ASSERT_EQ(
      collider.find_periodic(arrays.arrays(), cell, ArrayResult::contacts, false, stream.get()),
      expected.size())
      << seed_note();
  EXPECT_TRUE(periodic_of(collider, expected.size(), stream.get()) == expected) << seed_note();
}

/// Cells that are so large that the reduction to the cell and the images are inexact.
TEST_F(Cuda, FewArraysInALargePeriodicCellHaveTheContactsOfTheHost) {
  Random random(base_seed());
  ArrayCollider collider;
  for (const Real length : {Real(100), Real(1e4), Real(1e6), Real(1e8), Real(1e11)}) {
    const PeriodicCell cell{{length, length * Real(1.3), length * Real(0.7)}};
    Spheres spheres(500);
    for (SphereInstance& s : spheres) {
      for (int k = 0; k < 3; ++k) {
        const auto halves = static_cast<Real>(random.below(5)) - 2;
        const Real start = random.below(3) == 0 ? 0 : halves * cell.lengths[k] / 2;
        s.centre[k] = start + random.uniform(-1, 1);
      }
      s.radius = random.uniform(Real(0.1), Real(0.6));
    }
    SCOPED_TRACE(length);
    expect_contacts_of_host(collider, spheres, cell, 100);
  }
}

/// Random spheres of a cell, with up to `ratio` between radii, some of which have left it, and
/// about that number of neighbors of each.
Spheres gas_with(const PeriodicCell& cell, std::size_t n, double neighbors, Real ratio,
                 Random& random) {
  const double volume = static_cast<double>(cell.lengths.x) * static_cast<double>(cell.lengths.y) *
                        static_cast<double>(cell.lengths.z);
  const double cutoff = std::cbrt(neighbors * volume / static_cast<double>(n) / 4.19);
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    for (int k = 0; k < 3; ++k) {
      const auto cells = static_cast<Real>(random.below(4)) - 2;
      s.centre[k] = (random.uniform(0, 1) + cells) * cell.lengths[k];
    }
    s.radius = static_cast<Real>(cutoff) / 2 * (ratio > 1 ? random.uniform(1 / ratio, 1) : 1);
  }
  return spheres;
}

struct PeriodicGas {
  std::size_t n;
  double neighbors;
  Real ratio;
};

/// All variants of the grid search: direct, in one launch and in several, crowded or not, on one
/// level or several, with rows that are too long to be staged.
TEST_F(Cuda, ArraysInAPeriodicCellUseTheGridWithTheSameBits) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const PeriodicCell cell{{60, 70, Real(50.5)}, {true, true, random.below(2) == 0}};
  for (const auto& [n, neighbors, ratio] : {PeriodicGas{5'000, 3, 1},
                                            {20'000, 25, Real(1.5)},
                                            {60'000, 3, 1},
                                            {60'000, 30, 1},
                                            {60'000, 90, Real(1.4)},
                                            {60'000, 120, 1},
                                            {60'000, 200, 1},
                                            {60'000, 30, 30},
                                            {270'000, 3, 1},
                                            {270'000, 30, 1},
                                            {270'000, 8, Real(1.9)},
                                            {270'000, 20, 12},
                                            {265'000, 75, 1}}) {
    const Spheres spheres = gas_with(cell, n, neighbors, ratio, random);
    SCOPED_TRACE(std::to_string(n) + " spheres, " + std::to_string(neighbors) + " neighbors");
    expect_contacts_of_host(collider, spheres, cell, n / 20);
    // Searches with and without a cell share memory.
    const auto open = cpu->find_contacts(spheres);
    const DeviceSpheres arrays(spheres);
    ASSERT_EQ(collider.find(arrays.arrays(), ArrayResult::contacts, false, stream.get()),
              open.size());
    EXPECT_TRUE(
        std::ranges::equal(contacts_of<std::int32_t>(collider, open.size(), stream.get()), open))
        << seed_note();
  }
}

/// Distances that equal the sum of the radii, which reduced spheres and images cannot decide.
TEST_F(Cuda, ArraysOfALatticeInAPeriodicCellTouchExactly) {
  ArrayCollider collider;
  for (const int side : {12, 24, 66}) {
    for (const Real radius : {Real(0.5), Real(1)}) {
      const auto length = static_cast<Real>(side);
      Spheres spheres;
      for (int i = 0; i < side * side * side; ++i) {
        const Vec3 at{static_cast<Real>(i % side), static_cast<Real>(i / side % side),
                      static_cast<Real>(i / side / side)};
        spheres.push_back({at - Vec3{length, 3, 2 * length}, radius});
      }
      SCOPED_TRACE(std::to_string(side) + "^3 spheres of radius " + std::to_string(radius));
      expect_contacts_of_host(collider, spheres, {{length, length, length}}, spheres.size());
    }
  }
}

/// Cells that are much larger than what is in them, and one that does not repeat, where radii may
/// be so large that their squares overflow.
TEST_F(Cuda, ArraysInAnEmptyOrOpenCellHaveTheContactsOfTheHost) {
  Random random(base_seed());
  ArrayCollider collider;
  for (int k = 0; k < 3; ++k) {
    const PeriodicCell box{{30, 30, 30}};
    const Spheres few = gas_with(box, 20'000, 4, 1, random);
    Spheres slab = few;
    for (SphereInstance& s : slab) s.centre.z += s.centre.z < 0 ? 900 : 0;
    expect_contacts_of_host(collider, slab, {{1000, 30, 1000}}, 1000);
  }
  Spheres huge(25'001);
  for (std::size_t i = 0; i < huge.size(); ++i) {
    const auto group = static_cast<Real>(i / 4);
    huge[i] = {{group * Real(2e20), 0, 0}, Real(1e20)};
  }
  expect_contacts_of_host(collider, huge, {{1, 1, 1}, {false, false, false}}, 10'000);
}

template <class Index>
void expect_pairs_in_arrays(ArrayCollider& collider, const Spheres& spheres,
                            const PeriodicCell& cell,
                            const std::vector<PeriodicContact>& expected) {
  const OwnedStream stream(0);
  const DeviceSpheres arrays(spheres);
  const std::size_t e = expected.size();
  const DeviceArray<Index> indices(2 * e);
  const DeviceArray<std::int32_t> shifts(3 * e);
  for (const std::size_t capacity : {e / 2, e}) {
    ASSERT_EQ(collider.find_periodic_pairs(arrays.arrays(), cell, indices.data(), shifts.data(),
                                           capacity, stream.get()),
              e);
  }
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream.get()));
  const auto found = indices.download();
  const auto found_shifts = shifts.download();
  std::vector<std::pair<SpherePair, ImageShift>> pairs;
  for (std::size_t i = 0; i < e; ++i) {
    pairs.push_back({{static_cast<SphereIndex>(found[i]), static_cast<SphereIndex>(found[e + i])},
                     {found_shifts[3 * i], found_shifts[3 * i + 1], found_shifts[3 * i + 2]}});
  }
  EXPECT_TRUE(pairs == pairs_of(expected)) << seed_note();
}

TEST_F(Cuda, PairsInAPeriodicCellAreWrittenToArraysOfTheCaller) {
  Random random(base_seed());
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const PeriodicCell cell{{8, 9, Real(7.5)}};
  for (const std::size_t n : {std::size_t{300}, std::size_t{9000}}) {
    const Spheres spheres = gas_in(cell, n, n < 1000 ? Real(7.5) / 4 : Real(0.4), random);
    const auto expected = find_periodic_contacts(*cpu, spheres, cell);
    expect_pairs_in_arrays<std::int32_t>(collider, spheres, cell, expected);
    expect_pairs_in_arrays<std::int64_t>(collider, spheres, cell, expected);
  }
}

/// `n` spheres in the cell or, along some axes, in the next one.
Spheres gas_near(const PeriodicCell& cell, std::size_t n, Real radius, Random& random) {
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    for (int k = 0; k < 3; ++k) {
      s.centre[k] = random.uniform(Real(-0.5), Real(1.5)) * cell.lengths[k];
    }
    s.radius = radius;
  }
  return spheres;
}

/// The search itself writes the shifts of staged and of long rows, if no sphere is far from the
/// cell.
TEST_F(Cuda, PairsNearAPeriodicCellAreWrittenToArraysOfTheCaller) {
  Random random(base_seed());
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const PeriodicCell cell{{8, 9, Real(7.5)}, {true, random.below(2) == 0, true}};
  struct Case {
    std::size_t spheres;
    double neighbors;  // of a sphere, on average
  };
  for (const Case& c : {Case{30'000, 3},
                        {30'000, 30},
                        {30'000, 100},
                        {12'000, 300},
                        {5'000, 1200},
                        {300'000, 12},
                        {300'000, 40}}) {
    SCOPED_TRACE(std::to_string(c.spheres) + " spheres, " + std::to_string(c.neighbors) +
                 " neighbors, " + seed_note());
    const double volume = 8 * 9 * 7.5 / static_cast<double>(c.spheres);
    const auto radius = static_cast<Real>(std::cbrt(c.neighbors * volume / (4.19 * 8)));
    Spheres spheres = gas_near(cell, c.spheres, radius, random);
    const auto expected = find_periodic_contacts(*cpu, spheres, cell);
    expect_pairs_in_arrays<std::int32_t>(collider, spheres, cell, expected);
    if (c.spheres > 30'000) continue;
    expect_pairs_in_arrays<std::int64_t>(collider, spheres, cell, expected);
    spheres[random.below(spheres.size())].centre.x -= 2 * cell.lengths.x;
    expect_pairs_in_arrays<std::int32_t>(collider, spheres, cell,
                                         find_periodic_contacts(*cpu, spheres, cell));
  }
}

/// A search in several launches whose rows are short, long and very long.
TEST_F(Cuda, PairsOfClumpsInAPeriodicCellAreWrittenToArraysOfTheCaller) {
  Random random(base_seed());
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const PeriodicCell cell{{8, 9, Real(7.5)}};
  Spheres spheres = gas_near(cell, 300'000, Real(0.056), random);
  for (const std::size_t n : {std::size_t{500}, std::size_t{1500}}) {
    const SphereInstance place = spheres[random.below(spheres.size())];
    for (std::size_t i = 0; i < n; ++i) spheres[random.below(spheres.size())] = place;
  }
  expect_pairs_in_arrays<std::int32_t>(collider, spheres, cell,
                                       find_periodic_contacts(*cpu, spheres, cell));
}

TEST_F(Cuda, FewArraysOfTwoSetsInAPeriodicCellHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const PeriodicCell cell{{8, 9, 7}, {true, true, false}};
  for (const auto& [queries, points] : {std::pair{0, 7}, {7, 0}, {1, 900}, {700, 800}}) {
    const Spheres first = gas_in(cell, static_cast<std::size_t>(queries), 1, random);
    const Spheres second = gas_in(cell, static_cast<std::size_t>(points), Real(0.5), random);
    const auto expected = find_periodic_contacts_between(*cpu, first, second, cell);
    const DeviceSpheres d_first(first), d_second(second);
    ASSERT_EQ(collider.find_periodic_between(d_first.arrays(), d_second.arrays(), cell,
                                             ArrayResult::contacts, stream.get()),
              expected.size())
        << seed_note();
    EXPECT_EQ(periodic_of(collider, expected.size(), stream.get()), expected) << seed_note();
    ASSERT_EQ(collider.find_periodic_between(d_first.arrays(), d_second.arrays(), cell,
                                             ArrayResult::pairs, stream.get()),
              expected.size());
    EXPECT_EQ(periodic_pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
  }
}

TEST_F(Cuda, FewArraysOfSystemsInPeriodicCellsHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const std::vector<PeriodicCell> cells{{{8, 9, Real(7.5)}},
                                        {{6, 6, 6}, {false, true, true}},
                                        {{30, 30, 30}},
                                        {{4, 4, 4}, {false, false, false}},
                                        {{5, 5, 5}}};
  const std::vector<std::uint64_t> offsets{0, 300, 301, 301, 500, 1200};
  Spheres spheres;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Spheres system =
        gas_in(cells[i], offsets[i + 1] - offsets[i], i == 0 ? Real(7.5) / 4 : Real(0.5), random);
    spheres.insert(spheres.end(), system.begin(), system.end());
  }
  const DeviceSpheres arrays(spheres);
  const auto half = find_periodic_contacts_in_systems(*cpu, spheres, offsets, cells);
  for (const bool both : {false, true}) {
    const auto expected = both ? in_both_orders(half, spheres.size()) : half;
    ASSERT_EQ(collider.find_periodic_in_systems(arrays.arrays(), offsets, cells,
                                                ArrayResult::contacts, both, stream.get()),
              expected.size())
        << seed_note();
    EXPECT_EQ(periodic_of(collider, expected.size(), stream.get()), expected) << seed_note();
    ASSERT_EQ(collider.find_periodic_in_systems(arrays.arrays(), offsets, cells, ArrayResult::pairs,
                                                both, stream.get()),
              expected.size());
    EXPECT_EQ(periodic_pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
  }
  const DeviceSpheres none((Spheres()));
  EXPECT_EQ(collider.find_periodic_in_systems(none.arrays(), std::vector<std::uint64_t>{0}, {},
                                              ArrayResult::pairs, false, stream.get()),
            0u);
}

TEST_F(Cuda, ArraysInAPeriodicCellAreCheckedAsOnTheHost) {
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto message_of = [](const auto& search) -> std::string {
    try {
      search();
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "no exception";
  };
  const auto check = [&](const PeriodicCell& cell, const Spheres& spheres) {
    const std::string expected = message_of([&] { find_periodic_contacts(*cpu, spheres, cell); });
    EXPECT_NE(expected, "no exception");
    const DeviceSpheres arrays(spheres);
    EXPECT_EQ(message_of([&] {
                collider.find_periodic(arrays.arrays(), cell, ArrayResult::pairs, false,
                                       stream.get());
              }),
              expected);
  };
  const Real inf = std::numeric_limits<Real>::infinity();
  const Spheres good(40, {{}, 1});
  Spheres invalid = good, far = good, both = good, large = good;
  invalid[31].radius = -2;
  far[17].centre.y = Real(1e8);
  both[12].centre.x = Real(-1e8);
  both[20].centre.z = inf;
  large[39].radius = 3;
  check({{9, 0, 9}}, good);
  check({{9, 9, inf}}, good);
  check({{9, 9, 9}}, invalid);
  check({{9, 9, 9}}, far);
  check({{9, 9, 9}}, both);
  check({{9, Real(3.9), 9}}, good);
  check({{9, 9, 9}}, large);
  const Real max = std::numeric_limits<Real>::max();
  check({{max, 9, 9}}, good);  // images would not be finite
  const auto check_systems = [&](const std::vector<std::uint64_t>& offsets,
                                 const std::vector<PeriodicCell>& cells, const Spheres& spheres) {
    const std::string expected =
        message_of([&] { find_periodic_contacts_in_systems(*cpu, spheres, offsets, cells); });
    EXPECT_NE(expected, "no exception");
    const DeviceSpheres arrays(spheres);
    EXPECT_EQ(message_of([&] {
                collider.find_periodic_in_systems(arrays.arrays(), offsets, cells,
                                                  ArrayResult::pairs, false, stream.get());
              }),
              expected);
  };
  const PeriodicCell cell{{9, 9, 9}};
  check_systems({0, 41}, {cell}, good);
  check_systems({0, 20, 40}, {cell}, good);
  check_systems({0, 20, 40}, {cell, cell}, invalid);
  check_systems({0, 20, 40}, {cell, cell}, large);
  check_systems({0, 20, 40}, {cell, {{9, 9, -9}}}, far);
  check_systems({0, 20, 20, 40}, {cell, {{9, 9, -9}}, cell}, good);  // of an empty system
  const DeviceSpheres arrays(far);
  EXPECT_EQ(collider.find_periodic(arrays.arrays(), {{9, 9, 9}, {true, false, true}},
                                   ArrayResult::pairs, false, stream.get()),
            39u * 38 / 2);
  collider.find(arrays.arrays(), ArrayResult::pairs, false, stream.get());
  EXPECT_THROW(collider.write_shifts(nullptr, 0, stream.get()), InvalidArgument);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
