/// Contact lists between two sets, of many systems, in both orders and as compressed rows, against
/// loops over all pairs.
#include <jfpx/contact_list.hpp>
#include <jfpx/error.hpp>

#include "src/collide/sphere_pair.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

std::vector<SphereInstance> random_gas(std::size_t n, Random& random) {
  return make_gas(n, Real(0.5), 6, random);
}

std::vector<SpherePair> pairs_of(ContactSpan contacts) {
  std::vector<SpherePair> pairs;
  for (const SphereContact& c : contacts) pairs.push_back({c.a, c.b});
  return pairs;
}

TEST(ContactList, BetweenTwoSetsEqualsALoopOverAllPairsOfBoth) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  for (const auto& [first_size, second_size] : {std::pair{0, 5}, {5, 0}, {1, 300}, {400, 250}}) {
    const auto all = random_gas(static_cast<std::size_t>(first_size + second_size), random);
    const std::span<const SphereInstance> spheres = all;
    const auto first = spheres.first(static_cast<std::size_t>(first_size));
    const auto second = spheres.subspan(first.size());
    std::vector<SphereContact> expected;
    for (SphereContact c : brute_force(all)) {
      if (c.a >= first.size() || c.b < first.size()) continue;
      c.b -= static_cast<SphereIndex>(first.size());
      expected.push_back(c);
    }
    EXPECT_TRUE(same_bits(find_contacts_between(*collider, first, second), expected))
        << seed_note();
  }
}

TEST(ContactList, OfSystemsHasNoContactBetweenSystems) {
  Random random(base_seed());
  const auto collider = make_sphere_collider();
  const auto spheres = random_gas(900, random);
  const std::vector<std::uint64_t> offsets{0, 0, 1, 300, 300, 895, 900};
  std::vector<SphereContact> expected;
  for (const SphereContact& c : brute_force(spheres)) {
    const auto system = [&](SphereIndex i) {
      return std::upper_bound(offsets.begin(), offsets.end(), i) - offsets.begin();
    };
    if (system(c.a) == system(c.b)) expected.push_back(c);
  }
  ASSERT_FALSE(expected.empty());
  EXPECT_TRUE(same_bits(find_contacts_in_systems(*collider, spheres, offsets), expected))
      << seed_note();
}

TEST(ContactList, OfSystemsNamesABadSphereByItsNumberInAllSystems) {
  const auto collider = make_sphere_collider();
  std::vector<SphereInstance> spheres(9, {{}, 1});
  spheres[7].radius = -1;
  try {
    find_contacts_in_systems(*collider, spheres, std::vector<std::uint64_t>{0, 5, 9});
    FAIL() << "InvalidArgument was not thrown";
  } catch (const InvalidArgument& e) {
    EXPECT_STREQ(e.what(), "sphere 7: radius is -1; it must be finite and > 0");
  }
}

TEST(ContactList, OfSystemsRefusesBadOffsets) {
  const auto collider = make_sphere_collider();
  const std::vector<SphereInstance> spheres(9, {{}, 1});
  using Offsets = std::vector<std::uint64_t>;
  for (const Offsets& bad :
       {Offsets{}, Offsets{1, 9}, Offsets{0, 8}, Offsets{0, 10}, Offsets{0, 6, 5, 9}}) {
    EXPECT_THROW(find_contacts_in_systems(*collider, spheres, bad), InvalidArgument);
  }
}

TEST(ContactList, InBothOrdersIsTheSortedListOfContactsAndTheirOpposites) {
  Random random(base_seed());
  for (const std::size_t n : std::initializer_list<std::size_t>{0, 1, 2, 500}) {
    const auto spheres = random_gas(n, random);
    std::vector<SphereContact> expected = brute_force(spheres);
    const std::vector<SphereContact> half = expected;
    for (const SphereContact& c : half) {
      expected.push_back({.a = c.b, .b = c.a, .normal = -c.normal, .distance = c.distance});
    }
    std::sort(expected.begin(), expected.end(), [](const auto& p, const auto& q) {
      return std::pair(p.a, p.b) < std::pair(q.a, q.b);
    });
    EXPECT_TRUE(same_bits(in_both_orders(half, n), expected)) << seed_note();
    const std::vector<SpherePair> pairs = pairs_of(half), expected_pairs = pairs_of(expected);
    EXPECT_EQ(in_both_orders(pairs, n), expected_pairs) << seed_note();
  }
}

TEST(ContactList, RowOffsetsEncloseTheContactsOfEachSphere) {
  Random random(base_seed());
  const std::size_t n = 500;
  const std::vector<SphereContact> contacts = brute_force(random_gas(n, random));
  const std::vector<std::uint64_t> offsets = row_offsets(contacts, n);
  ASSERT_EQ(offsets.size(), n + 1);
  EXPECT_EQ(offsets.front(), 0u);
  EXPECT_EQ(offsets.back(), contacts.size());
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_LE(offsets[i], offsets[i + 1]);
    for (std::uint64_t k = offsets[i]; k < offsets[i + 1]; ++k) EXPECT_EQ(contacts[k].a, i);
  }
  EXPECT_EQ(row_offsets(pairs_of(contacts), n), offsets);
  EXPECT_EQ(row_offsets(ContactSpan{}, 3), std::vector<std::uint64_t>(4));
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
