/// Contacts in a periodic cell against a loop over all pairs and their 27 images.
#include <jfpx/error.hpp>
#include <jfpx/periodic.hpp>

#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/periodic_cell.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Spheres = std::vector<SphereInstance>;

/// The nearest images in long double.
struct Expected {
  std::pair<SphereIndex, SphereIndex> pair;
  long double gap;  ///< distance of the surfaces
  std::array<long double, 3> to_a;
  ImageShift shift;
};

std::vector<Expected> nearest_images(const Spheres& spheres, const PeriodicCell& cell) {
  std::vector<Expected> all;
  for (SphereIndex a = 0; a < spheres.size(); ++a) {
    for (SphereIndex b = a + 1; b < spheres.size(); ++b) {
      Expected e{{a, b}, 0, {}, {}};
      long double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const int axis = static_cast<int>(k);
        const long double length = cell.lengths[axis];
        long double d = static_cast<long double>(spheres[a].centre[axis]) -
                        static_cast<long double>(spheres[b].centre[axis]);
        if (cell.repeats[k]) {
          const long double cells = std::round(d / length);
          e.shift[k] = static_cast<std::int32_t>(cells);
          d -= cells * length;
        }
        e.to_a[k] = d;
        square += d * d;
      }
      e.gap = std::sqrt(square) - spheres[a].radius - spheres[b].radius;
      all.push_back(e);
    }
  }
  return all;
}

/// Spheres in a cell of about `side`, which some of them have left by up to three lengths.
Spheres gas_in(const PeriodicCell& cell, std::size_t n, Real largest_radius, Random& random) {
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    for (int k = 0; k < 3; ++k) {
      const Real cells = random.below(4) == 0 ? static_cast<Real>(random.below(7)) - 3 : 0;
      s.centre[k] = (random.uniform(0, 1) + cells) * cell.lengths[k];
    }
    s.radius = random.uniform(largest_radius / 3, largest_radius);
  }
  return spheres;
}

TEST(Periodic, ContactsAreThoseOfTheNearestImages) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  for (const std::array<bool, 3> repeats :
       {std::array{true, true, true}, {true, false, true}, {false, false, true}}) {
    const PeriodicCell cell{{5, 7, Real(4.5)}, repeats};
    const Spheres spheres = gas_in(cell, 300, Real(1.1), random);
    const auto found = find_periodic_contacts(*collider, spheres, cell);
    std::map<std::pair<SphereIndex, SphereIndex>, PeriodicContact> by_pair;
    for (const PeriodicContact& c : found) by_pair[{c.contact.a, c.contact.b}] = c;
    ASSERT_EQ(by_pair.size(), found.size()) << seed_note();
    ASSERT_TRUE(std::is_sorted(found.begin(), found.end(), [](const auto& p, const auto& q) {
      return std::pair(p.contact.a, p.contact.b) < std::pair(q.contact.a, q.contact.b);
    }));
    // Of the difference of the centres, of its length and of the gap.
    const long double error = 4 * static_cast<long double>(kEpsilon) * Real(2.2);
    std::size_t shifted = 0;
    for (const Expected& e : nearest_images(spheres, cell)) {
      if (std::abs(e.gap) <= error) continue;  // rounding decides
      const auto at = by_pair.find(e.pair);
      ASSERT_EQ(at != by_pair.end(), e.gap < 0)
          << e.pair.first << ", " << e.pair.second << ", " << seed_note();
      if (at == by_pair.end()) continue;
      const PeriodicContact& c = at->second;
      EXPECT_EQ(c.shift, e.shift) << seed_note();
      EXPECT_NEAR(static_cast<double>(c.contact.distance), static_cast<double>(e.gap),
                  static_cast<double>(error));
      shifted += c.shift != ImageShift{} ? 1 : 0;
    }
    EXPECT_GT(shifted, 100u);
  }
}

/// The contacts of spheres that no image touches are those of an open search, in cells of any size.
TEST(Periodic, WithoutImagesTheBitsAreThoseOfAnOpenSearch) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  Spheres spheres(400);
  for (SphereInstance& s : spheres) {
    s = {random.uniform_in_box({-10, -10, -10}, {10, 10, 10}), random.uniform(Real(0.5), 1)};
  }
  const std::span open = collider->find_contacts(spheres);
  const std::vector<SphereContact> expected(open.begin(), open.end());
  ASSERT_GT(expected.size(), 100u);
  for (const Real length : {Real(30), Real(1e3), Real(1e5), Real(1e7), Real(3e9), Real(1e12)}) {
    const PeriodicCell cell{{length, length, length}};
    std::vector<SphereContact> found;
    for (const PeriodicContact& c : find_periodic_contacts(*collider, spheres, cell)) {
      EXPECT_EQ(c.shift, ImageShift{});
      found.push_back(c.contact);
    }
    EXPECT_EQ(found, expected) << length << ", " << seed_note();
  }
}

/// Spheres at the boundaries of large cells, some of them many cells away: the distances are those
/// of the given centres, which are far less precise than the radii are.
TEST(Periodic, DistancesInLargeCellsAreThoseOfTheGivenCentres) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  std::size_t touching = 0;
  for (int k = 0; k < 60; ++k) {
    const Real length = std::exp2(random.uniform(3, 40));
    const PeriodicCell cell{{length, length * Real(1.3), length * Real(0.7)}};
    Spheres spheres(60);
    for (SphereInstance& s : spheres) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto cells = static_cast<Real>(random.below(5)) - 2;
        const Real half = cell.lengths[axis] / 2;
        s.centre[axis] = (random.below(3) == 0 ? Real(0) : cells * half) + random.uniform(-1, 1);
      }
      s.radius = random.uniform(Real(0.1), Real(0.6));
    }
    std::map<std::pair<SphereIndex, SphereIndex>, PeriodicContact> by_pair;
    for (const PeriodicContact& c : find_periodic_contacts(*collider, spheres, cell)) {
      by_pair[{c.contact.a, c.contact.b}] = c;
    }
    for (const Expected& e : nearest_images(spheres, cell)) {
      const long double error = 8 * static_cast<long double>(kEpsilon);
      if (std::abs(e.gap) <= error) continue;  // rounding decides
      const auto at = by_pair.find(e.pair);
      ASSERT_EQ(at != by_pair.end(), e.gap < 0) << length << ", " << seed_note();
      if (at == by_pair.end()) continue;
      ++touching;
      EXPECT_NEAR(static_cast<double>(at->second.contact.distance), static_cast<double>(e.gap),
                  static_cast<double>(error))
          << length << ", " << seed_note();
    }
  }
  EXPECT_GT(touching, 500u);
}

TEST(Periodic, BetweenTwoSetsAreTheContactsOfBothAmongThoseOfAll) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  const PeriodicCell cell{{9, 9, 9}, {true, false, true}};
  const Spheres all = gas_in(cell, 600, 1, random);
  constexpr SphereIndex kFirst = 250;
  const std::span first = std::span(all).first(kFirst), second = std::span(all).subspan(kFirst);
  std::vector<PeriodicContact> expected;
  for (PeriodicContact c : find_periodic_contacts(*collider, all, cell)) {
    if (c.contact.a >= kFirst || c.contact.b < kFirst) continue;
    c.contact.b -= kFirst;
    expected.push_back(c);
  }
  EXPECT_GT(expected.size(), 100u);
  EXPECT_EQ(find_periodic_contacts_between(*collider, first, second, cell), expected)
      << seed_note();
}

TEST(Periodic, SystemsHaveTheContactsOfTheirCells) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  const std::vector<PeriodicCell> cells{
      {{5, 6, 7}}, {{4, 4, 4}}, {{9, 9, 9}, {true, false, true}}, {{}, {false, false, false}}};
  const std::vector<std::uint64_t> offsets{0, 150, 150, 400, 500};
  Spheres all;
  std::vector<PeriodicContact> expected;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Spheres system =
        gas_in(i == 3 ? cells[1] : cells[i], offsets[i + 1] - offsets[i], 1, random);
    for (PeriodicContact c : find_periodic_contacts(*collider, system, cells[i])) {
      c.contact.a += static_cast<SphereIndex>(offsets[i]);
      c.contact.b += static_cast<SphereIndex>(offsets[i]);
      expected.push_back(c);
    }
    all.insert(all.end(), system.begin(), system.end());
  }
  EXPECT_GT(expected.size(), 500u);
  EXPECT_EQ(find_periodic_contacts_in_systems(*collider, all, offsets, cells), expected)
      << seed_note();
}

TEST(Periodic, BadSystemsAreNamed) {
  const auto collider = make_sphere_collider();
  Spheres spheres(5, {{}, 1});
  const auto message = [&](const std::vector<std::uint64_t>& offsets,
                           const std::vector<PeriodicCell>& cells) -> std::string {
    try {
      find_periodic_contacts_in_systems(*collider, spheres, offsets, cells);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "nothing was thrown";
  };
  const PeriodicCell good{{9, 9, 9}};
  EXPECT_EQ(message({0, 4}, {good}), "the last offset is 4; it must be the number of spheres, 5");
  EXPECT_EQ(message({0, 2, 5}, {good}),
            "there are 1 periodic cells; there must be one for each of 2 systems");
  EXPECT_EQ(message({0, 2, 5}, {good, {{9, 3, 9}}}),
            "system 1: periodic length y is 3; it must be at least twice the cutoff, which is 2");
  spheres[3].centre.z = Real(1e8);
  EXPECT_EQ(message({0, 2, 5}, {good, good}),
            "sphere 3: centre.z is 100000000; it must be within 2^20 periodic lengths");
}

TEST(Periodic, ACellThatDoesNotRepeatHasTheContactsOfTheCollider) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  const Spheres spheres = make_gas(500, Real(0.5), 6, random);
  const auto found = find_periodic_contacts(*collider, spheres, {{}, {false, false, false}});
  std::vector<SphereContact> plain;
  for (const PeriodicContact& c : found) {
    EXPECT_EQ(c.shift, ImageShift{});
    plain.push_back(c.contact);
  }
  EXPECT_TRUE(same_bits(plain, brute_force(spheres))) << seed_note();
}

TEST(Periodic, AlgorithmsAndThreadsHaveTheSameBits) {
  Random random(base_seed());
  const PeriodicCell cell{{9, 9, 9}};
  const Spheres spheres = gas_in(cell, 2000, Real(0.4), random);
  const auto expected = find_periodic_contacts(*make_sphere_collider(), spheres, cell);
  for (const SphereAlgorithm algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
    const auto collider =
        make_sphere_collider({.backend = Backend::cpu, .algorithm = algorithm, .threads = 3});
    EXPECT_EQ(find_periodic_contacts(*collider, spheres, cell), expected) << seed_note();
  }
  for (const BackendStatus& status : available_backends()) {
    if (!status.usable) continue;
    const auto collider = make_sphere_collider({.backend = status.backend});
    EXPECT_EQ(find_periodic_contacts(*collider, spheres, cell), expected) << seed_note();
  }
}

TEST(Periodic, APairHalfALengthApartIsListedOnceWithTheLowerShift) {
  const Spheres spheres{{{0, 0, 0}, 1}, {{2, 0, 0}, 1}};
  const auto found = find_periodic_contacts(*make_sphere_collider(), spheres, {{4, 100, 100}});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].shift, (ImageShift{-1, 0, 0}));
  EXPECT_EQ(found[0].contact.distance, 0);
  EXPECT_EQ(found[0].contact.normal, (Vec3{1, 0, 0}));
}

/// The tests of pairs by which searches on the GPU decide, against the search on the CPU: pairs on
/// a lattice of half lengths touch through two images, and large cells are inexact.
TEST(Periodic, TestsOfPairsFindTheImagesOfTheSearch) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  for (const Real length : {Real(1), Real(8), Real(1e4), Real(1e7)}) {
    const PeriodicCell cell{{length, length * Real(1.25), length * Real(0.9)},
                            {true, random.below(2) == 0, true}};
    Spheres spheres = gas_in(cell, 120, cell.lengths.z / 4, random);
    for (std::size_t i = 0; i < 60; ++i) {
      for (int k = 0; k < 3; ++k) {
        const auto halves = static_cast<Real>(random.below(9)) - 4;
        spheres[i].centre[k] = halves / 2 * cell.lengths[k];
      }
      if (i < 30) spheres[i].radius = cell.lengths.z / 4;
    }
    std::map<std::pair<SphereIndex, SphereIndex>, PeriodicContact> expected;
    for (const PeriodicContact& c : find_periodic_contacts(*collider, spheres, cell)) {
      expected[{c.contact.a, c.contact.b}] = c;
    }
    for (SphereIndex a = 0; a < spheres.size(); ++a) {
      for (SphereIndex b = a + 1; b < spheres.size(); ++b) {
        const detail::ImageTouch touch = detail::touch_in_cell(spheres[a], spheres[b], cell);
        const auto found = expected.find({a, b});
        ASSERT_EQ(touch.pair.touching != 0, found != expected.end())
            << a << ", " << b << ", " << length << ", " << seed_note();
        if (found == expected.end()) continue;
        const SphereContact& contact = found->second.contact;
        EXPECT_EQ(touch.pair, (PairResult{contact.normal, contact.distance, 1}));
        EXPECT_EQ(touch.shift, found->second.shift) << a << ", " << b << ", " << length;
        EXPECT_EQ(detail::shift_of_touching(spheres[a], spheres[b], cell), touch.shift)
            << a << ", " << b << ", " << length;
      }
    }
  }
}

TEST(Periodic, InBothOrdersHasTheOppositeShifts) {
  Random random(base_seed());
  const PeriodicCell cell{{5, 5, 5}};
  const Spheres spheres = gas_in(cell, 200, 1, random);
  const auto half = find_periodic_contacts(*make_sphere_collider(), spheres, cell);
  const auto both = in_both_orders(half, spheres.size());
  ASSERT_EQ(both.size(), 2 * half.size());
  std::map<std::pair<SphereIndex, SphereIndex>, PeriodicContact> by_pair;
  for (const PeriodicContact& c : both) by_pair[{c.contact.a, c.contact.b}] = c;
  ASSERT_EQ(by_pair.size(), both.size());
  for (const PeriodicContact& c : half) {
    EXPECT_EQ((by_pair[{c.contact.a, c.contact.b}]), c);
    const PeriodicContact& other = by_pair[{c.contact.b, c.contact.a}];
    EXPECT_EQ(other.contact.normal, -c.contact.normal);
    EXPECT_EQ(other.contact.distance, c.contact.distance);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(other.shift[k], -c.shift[k]);
  }
}

TEST(Periodic, BadCellsAndCentresAreNamed) {
  const auto collider = make_sphere_collider();
  const auto message = [&](const PeriodicCell& cell, const SphereInstance& sphere) {
    try {
      find_periodic_contacts(*collider, std::vector{sphere}, cell);
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string("nothing was thrown");
  };
  using testing::HasSubstr;
  const Real inf = std::numeric_limits<Real>::infinity();
  EXPECT_THAT(message({{0, 9, 9}}, {{}, 1}), HasSubstr("periodic length x is 0"));
  EXPECT_THAT(message({{9, -1, 9}}, {{}, 1}), HasSubstr("periodic length y is -1"));
  EXPECT_THAT(message({{9, 9, inf}}, {{}, 1}), HasSubstr("periodic length z is inf"));
  const Real long_cell = sizeof(Real) == 4 ? Real(1e19) : std::exp2(Real(509));
  EXPECT_THAT(message({{9, 9, long_cell}}, {{}, 1}), HasSubstr("it must be > 0 and at most"));
  EXPECT_THAT(
      message({{9, Real(3.5), 9}}, {{}, 1}),
      HasSubstr("periodic length y is 3.5; it must be at least twice the cutoff, which is 2"));
  EXPECT_THAT(message({{9, 9, 9}}, {{Real(1e8), 0, 0}, 1}), HasSubstr("within 2^20"));
  EXPECT_THAT(message({{9, 9, 9}}, {{inf, 0, 0}, 1}), HasSubstr("centre.x is inf"));
  EXPECT_THAT(message({{9, 9, 9}}, {{0, 0, 0}, 0}), HasSubstr("radius is 0"));
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
