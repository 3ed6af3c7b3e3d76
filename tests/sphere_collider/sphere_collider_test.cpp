/// The contract of SphereCollider, for any backend and options.
#include "src/collide/sphere_pair.hpp"
#include "tests/support/sphere_collider_contract.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Limits = std::numeric_limits<Real>;
constexpr Real kNan = Limits::quiet_NaN();
constexpr Real kInf = Limits::infinity();

/// Returns the message of the InvalidArgument that `call` throws; the test fails if it throws none.
template <class Call>
std::string message_of(Call&& call) {
  try {
    call();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  ADD_FAILURE() << "InvalidArgument was not thrown";
  return {};
}

TEST_P(SphereColliderContract, EqualsBruteForceForAllSmallNumbersOfSpheres) {
  for (const SphereKind& kind : sphere_kinds()) {
    Random random(base_seed() + static_cast<std::uint64_t>(&kind - sphere_kinds().data()));
    for (std::size_t n = 0; n <= scaled(300); n += n < scaled(70) ? 1 : 23) {
      const auto spheres = kind.make(n, random);
      ASSERT_TRUE(same_bits(collider().find_contacts(spheres), brute_force(spheres)))
          << kind.name << ", N = " << n << ", " << seed_note();
    }
  }
}

TEST_P(SphereColliderContract, EqualsBruteForceForThousandsOfSpheres) {
  for (const SphereKind& kind : sphere_kinds()) {
    Random random(base_seed() ^ static_cast<std::uint64_t>(&kind - sphere_kinds().data()));
    const std::size_t n = scaled(1000 + random.below(1500));
    const auto spheres = kind.make(n, random);
    ASSERT_TRUE(same_bits(collider().find_contacts(spheres), brute_force(spheres)))
        << kind.name << ", N = " << n << ", " << seed_note();
  }
}

TEST_P(SphereColliderContract, CoincidentSpheresAllTouch) {
  const std::size_t n = scaled(1500);
  const std::vector<SphereInstance> spheres(n, {{3, -4, 5}, Real(0.25)});
  const ContactSpan contacts = collider().find_contacts(spheres);
  ASSERT_EQ(contacts.size(), n * (n - 1) / 2);
  EXPECT_TRUE(same_bits(contacts, brute_force(spheres)));
}

TEST_P(SphereColliderContract, PairsAreThoseOfTheContacts) {
  for (const SphereKind& kind : sphere_kinds()) {
    Random random(base_seed() + static_cast<std::uint64_t>(&kind - sphere_kinds().data()));
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{40},
                                scaled(1000 + random.below(1500))}) {
      const auto spheres = kind.make(n, random);
      std::vector<SpherePair> expected;
      for (const SphereContact& c : brute_force(spheres)) expected.push_back({c.a, c.b});
      ASSERT_TRUE(std::ranges::equal(collider().find_pairs(spheres), expected))
          << kind.name << ", N = " << n << ", " << seed_note();
    }
  }
}

// Rows of any length, and cells with few and with many spheres.
TEST_P(SphereColliderContract, AnyNumberOfNeighboursIsFound) {
  Random random(base_seed());
  const std::size_t n = scaled(1500);
  for (const Real radius : {Real(0.04), Real(0.08), Real(0.2)}) {
    std::vector<SphereInstance> spheres(n);
    for (SphereInstance& s : spheres) {
      s = {{random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)}, radius};
    }
    ASSERT_TRUE(same_bits(collider().find_contacts(spheres), brute_force(spheres)))
        << "radius " << radius << ", " << seed_note();
  }
}

// Each of the three directions has n^2 rows with n-1 touching neighbours; diagonals are
// 1.99*sqrt(2) > 2 apart.
TEST_P(SphereColliderContract, LatticeHasThreeNSquaredTimesNMinusOneContacts) {
  for (const std::size_t n : std::initializer_list<std::size_t>{1, 2, 3, 10, 31}) {
    const auto spheres = make_lattice(n, Real(1.99));
    EXPECT_EQ(collider().find_contacts(spheres).size(), 3 * n * n * (n - 1)) << "n = " << n;
  }
}

TEST_P(SphereColliderContract, PermutedInputGivesTheSameContacts) {
  Random random(base_seed());
  const auto spheres = sphere_kind("polydisperse").make(scaled(2000), random);
  std::vector<SphereIndex> order(spheres.size());
  for (SphereIndex i = 0; i < order.size(); ++i) order[i] = i;
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  std::vector<SphereInstance> permuted;
  for (const SphereIndex i : order) permuted.push_back(spheres[i]);

  std::map<std::pair<SphereIndex, SphereIndex>, Real> expected;
  for (const SphereContact& c : collider().find_contacts(spheres))
    expected[{c.a, c.b}] = c.distance;
  const ContactSpan contacts = collider().find_contacts(permuted);
  ASSERT_EQ(contacts.size(), expected.size()) << seed_note();
  for (const SphereContact& c : contacts) {
    const auto [low, high] = std::minmax(order[c.a], order[c.b]);
    const auto found = expected.find({low, high});
    ASSERT_NE(found, expected.end()) << low << " and " << high << ", " << seed_note();
    EXPECT_EQ(found->second, c.distance) << low << " and " << high << ", " << seed_note();
  }
}

// Oracle in long double (64 bits of mantissa against 24 or 53). With u = epsilon/2, the computed
// difference of two coordinates has a relative error of u, len one of at most 4u (three roundings
// inside the root, which halves them, one of the root, one of the difference), and the sum of radii
// one of u. So the error of depth is at most 5u*(len + sum) + u*|depth|; the normal adds a
// reciprocal and a product.
TEST_P(SphereColliderContract, AgreesWithALongDoubleOracle) {
  using Wide = long double;
  const Wide u = static_cast<Wide>(Limits::epsilon()) / 2;
  Random random(base_seed());
  for (const std::string_view name : {"uniform", "clusters", "polydisperse", "far", "touching"}) {
    const auto spheres = sphere_kind(name).make(700, random);
    const ContactSpan contacts = collider().find_contacts(spheres);
    auto next = contacts.begin();
    for (SphereIndex a = 0; a < spheres.size(); ++a) {
      for (SphereIndex b = a + 1; b < spheres.size(); ++b) {
        Wide d[3];
        Wide square = 0;
        for (int i = 0; i < 3; ++i) {
          d[i] = static_cast<Wide>(spheres[a].centre[i]) - static_cast<Wide>(spheres[b].centre[i]);
          square += d[i] * d[i];
        }
        const Wide len = std::sqrt(square);
        const Wide sum =
            static_cast<Wide>(spheres[a].radius) + static_cast<Wide>(spheres[b].radius);
        const Wide bound = 6 * u * (len + sum);
        const bool reported = next != contacts.end() && next->a == a && next->b == b;
        if (std::abs(len - sum) > bound) {
          ASSERT_EQ(reported, len < sum)
              << name << ", " << a << " and " << b << ", " << seed_note();
        }
        if (!reported) continue;
        ASSERT_LE(std::abs(static_cast<Wide>(next->distance) - (len - sum)), bound) << seed_note();
        if (len > 2 * static_cast<Wide>(kEpsilon)) {
          for (int i = 0; i < 3; ++i) {
            ASSERT_LE(std::abs(static_cast<Wide>(next->normal[i]) - d[i] / len), 8 * u)
                << name << ", " << a << " and " << b << ", " << seed_note();
          }
        }
        ++next;
      }
    }
    EXPECT_TRUE(next == contacts.end()) << name << ", " << seed_note();
  }
}

TEST_P(SphereColliderContract, ExchangedSpheresTouchAsDeeplyWithTheOppositeNormal) {
  for (const SphereKind& kind : sphere_kinds()) {
    if (kind.name == "huge") continue;  // distances are NaN, which compares unequal
    Random random(base_seed());
    const auto spheres = kind.make(300, random);
    std::vector<SpherePair> pairs, exchanged;
    for (const SphereContact& c : collider().find_contacts(spheres)) {
      pairs.push_back({c.a, c.b});
      exchanged.push_back({c.b, c.a});
    }
    const auto to_vector = [](std::span<const PairContact> touching) {
      return std::vector(touching.begin(), touching.end());
    };
    const auto there = to_vector(collider().find_touching(spheres, pairs));
    const auto back = to_vector(collider().find_touching(spheres, exchanged));
    ASSERT_EQ(there.size(), pairs.size()) << kind.name << ", " << seed_note();
    ASSERT_EQ(back.size(), pairs.size()) << kind.name << ", " << seed_note();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto [a, b] = pairs[i];
      ASSERT_EQ(there[i].distance, back[i].distance) << kind.name << ", " << seed_note();
      // The normal of nearly coincident centres is (1,0,0), whichever sphere is first.
      const bool along_x = there[i].normal == Vec3{1, 0, 0} && back[i].normal == Vec3{1, 0, 0};
      ASSERT_TRUE(there[i].normal == -back[i].normal ||
                  (along_x && length(spheres[a].centre - spheres[b].centre) <= 2 * kEpsilon))
          << kind.name << ", " << a << " and " << b << ", " << seed_note();
    }
  }
}

TEST_P(SphereColliderContract, FindTouchingFollowsTheSharedArithmeticInTheGivenOrder) {
  for (const SphereKind& kind : sphere_kinds()) {
    Random random(base_seed());
    for (const std::size_t n : std::initializer_list<std::size_t>{1, 2, 37, 400}) {
      const auto spheres = kind.make(n, random);
      std::vector<SpherePair> pairs(n * 7 % 1009);
      for (SpherePair& p : pairs) {
        p = {static_cast<SphereIndex>(random.below(n)), static_cast<SphereIndex>(random.below(n))};
      }
      std::vector<PairResult> expected;
      for (const SpherePair& p : pairs) {
        expected.push_back(detail::test_sphere_pair(spheres[p.a], spheres[p.b]));
      }
      ASSERT_TRUE(same_bits(collider().find_touching(spheres, pairs), touching_of(expected)))
          << kind.name << ", N = " << n << ", " << seed_note();
    }
  }
}

// Bullet rejects a pair only if len > sum: a NaN on either side results in a contact, an infinite
// length does not, and a length whose square underflows is 0 (in Bullet: normal (1,0,0)).
TEST_P(SphereColliderContract, FindTouchingTreatsOddValuesAsBulletDoes) {
  const Real tiny = Limits::denorm_min();
  const std::vector<SphereInstance> spheres = {{{0, 0, 0}, 1},       {{kNan, 0, 0}, 1},
                                               {{kInf, 0, 0}, 1},    {{0, 0, 0}, kNan},
                                               {{0, 0, 0}, kInf},    {{Limits::max(), 0, 0}, 1},
                                               {{tiny, 0, 0}, tiny}, {{0, 0, 0}, -1},
                                               {{100, 0, 0}, 0},     {{0, 0, 0}, 0}};
  std::vector<SpherePair> pairs;
  std::vector<PairResult> expected;
  for (SphereIndex a = 0; a < spheres.size(); ++a) {
    for (SphereIndex b = 0; b < spheres.size(); ++b) {
      pairs.push_back({a, b});
      expected.push_back(detail::test_sphere_pair(spheres[a], spheres[b]));
    }
  }
  const auto found = collider().find_touching(spheres, pairs);
  ASSERT_TRUE(same_bits(found, touching_of(expected)));
  const auto touching = [&](std::size_t a, std::size_t b) {
    return std::count_if(found.begin(), found.end(),
                         [&](const PairContact& c) { return c.pair == a * spheres.size() + b; });
  };
  EXPECT_EQ(touching(0, 1), 1) << "NaN in a centre";
  EXPECT_EQ(touching(0, 2), 0) << "infinitely far";
  EXPECT_EQ(touching(2, 2), 1) << "inf - inf is NaN";
  EXPECT_EQ(touching(0, 3), 1) << "NaN in a radius";
  EXPECT_EQ(touching(2, 4), 1) << "inf > inf is false";
  EXPECT_EQ(touching(0, 5), 0) << "the square overflows";
  EXPECT_EQ(touching(6, 9), 1) << "the square underflows";
  EXPECT_EQ(touching(8, 9), 0);
  EXPECT_EQ(touching(9, 9), 1) << "two coincident points: 0 > 0 is false";
}

TEST_P(SphereColliderContract, NoSpheresAndNoPairsAreFine) {
  EXPECT_TRUE(collider().find_contacts({}).empty());
  EXPECT_TRUE(collider().find_touching({}, {}).empty());
  const std::vector<SphereInstance> one = {{{1, 2, 3}, 4}};
  EXPECT_TRUE(collider().find_contacts(one).empty());
  EXPECT_TRUE(collider().find_touching(one, {}).empty());
}

TEST_P(SphereColliderContract, FindContactsNamesTheFirstBadSphereFieldAndValue) {
  const auto good = make_lattice(6, Real(1.9));
  const struct {
    const char* field;
    Real Vec3::*coordinate;
  } coordinates[] = {{"centre.x", &Vec3::x}, {"centre.y", &Vec3::y}, {"centre.z", &Vec3::z}};
  for (const std::size_t index : {std::size_t{0}, std::size_t{7}, good.size() - 1}) {
    const std::string name = "sphere " + std::to_string(index) + ": ";
    for (const Real bad : {kNan, kInf, -kInf}) {
      for (const auto& c : coordinates) {
        auto spheres = good;
        spheres[index].centre.*c.coordinate = bad;
        const std::string message = message_of([&] { collider().find_contacts(spheres); });
        EXPECT_EQ(message.find(name + c.field + " is "), 0u) << message;
        EXPECT_NE(message.find("it must be finite"), std::string::npos) << message;
      }
    }
    for (const Real bad : {kNan, kInf, -kInf, Real(-1), Real(0)}) {
      auto spheres = good;
      spheres[index].radius = bad;
      spheres.back().radius = -7;  // a later sphere, which the message must not name
      if (index == good.size() - 1) spheres[index].radius = bad;
      const std::string message = message_of([&] { collider().find_contacts(spheres); });
      EXPECT_EQ(message.find(name + "radius is "), 0u) << message;
      EXPECT_NE(message.find("; it must be finite and > 0"), std::string::npos) << message;
    }
  }
  auto spheres = good;
  spheres[7].radius = -1;
  EXPECT_EQ(message_of([&] { collider().find_contacts(spheres); }),
            "sphere 7: radius is -1; it must be finite and > 0");
}

TEST_P(SphereColliderContract, MoreSpheresThanAnIndexCountsAreRejected) {
  const SphereInstance one{{0, 0, 0}, 1};
  const std::span<const SphereInstance> spheres(&one, std::size_t{1} << 32);  // never read
  EXPECT_EQ(message_of([&] { collider().find_contacts(spheres); }),
            "number of spheres is 4294967296; it must be at most 4294967295");
}

TEST_P(SphereColliderContract, MorePairsThanAContactCanNumberAreRejected) {
  const SphereInstance one{{0, 0, 0}, 1};
  const SpherePair pair{0, 0};
  const std::span<const SpherePair> pairs(&pair, std::size_t{1} << 32);  // never read
  EXPECT_EQ(message_of([&] {
              collider().find_touching({&one, 1}, pairs);
            }),
            "number of pairs is 4294967296; it must be at most 4294967295");
}

TEST_P(SphereColliderContract, FindsNoneSomeAndAllOfManyPairsTouching) {
  Random random(base_seed());
  for (const Real radius : {Real(0), Real(1), Real(1e3)}) {
    std::vector<SphereInstance> spheres(3000);
    for (SphereInstance& s : spheres) s = {random.uniform_in_box({1, 1, 1}, {9, 9, 9}), radius};
    std::vector<SpherePair> pairs(20000);  // several chunks, the last one incomplete
    for (SpherePair& p : pairs) {
      p.a = static_cast<SphereIndex>(random.below(spheres.size()));
      p.b = (p.a + 1) % static_cast<SphereIndex>(spheres.size());
    }
    std::vector<PairResult> results;
    for (const SpherePair& p : pairs) {
      results.push_back(detail::test_sphere_pair(spheres[p.a], spheres[p.b]));
    }
    const auto expected = touching_of(results);
    ASSERT_TRUE(same_bits(collider().find_touching(spheres, pairs), expected)) << seed_note();
    const std::size_t most = pairs.size();
    EXPECT_EQ(expected.size() == 0, radius == 0);
    EXPECT_EQ(expected.size() == most, radius == 1e3);
  }
}

TEST_P(SphereColliderContract, FindTouchingNamesThePairWithAnIndexOutOfRange) {
  const auto spheres = make_lattice(2, 2);
  std::vector<SpherePair> pairs(50, {1, 2});
  pairs[31] = {3, 8};
  pairs[40] = {9, 0};
  EXPECT_EQ(message_of([&] { collider().find_touching(spheres, pairs); }),
            "pair 31: b is 8; it must be less than the number of spheres, 8");
  pairs[31] = {4294967295u, 8};
  EXPECT_EQ(message_of([&] { collider().find_touching(spheres, pairs); }),
            "pair 31: a is 4294967295; it must be less than the number of spheres, 8");
  EXPECT_EQ(message_of([&] { collider().find_touching({}, pairs); }),
            "pair 0: a is 1; it must be less than the number of spheres, 0");
}

TEST_P(SphereColliderContract, StaysUsableAfterAnError) {
  Random random(base_seed());
  auto spheres = sphere_kind("uniform").make(900, random);
  const auto expected = brute_force(spheres);
  auto bad = spheres;
  bad[5].centre.y = kNan;
  EXPECT_THROW(collider().find_contacts(bad), InvalidArgument);
  EXPECT_TRUE(same_bits(collider().find_contacts(spheres), expected)) << seed_note();
  const std::vector<SpherePair> pairs = {{0, 900}};
  EXPECT_THROW(collider().find_touching(spheres, pairs), InvalidArgument);
  EXPECT_TRUE(same_bits(collider().find_contacts(spheres), expected)) << seed_note();
}

TEST_P(SphereColliderContract, AcceptsSetsOfAnySizeInAnyOrder) {
  Random random(base_seed());
  for (const std::size_t n : std::initializer_list<std::size_t>{2000, 3, 0, 700, 1, 2500, 64}) {
    const auto spheres = sphere_kind("uniform").make(n, random);
    ASSERT_TRUE(same_bits(collider().find_contacts(spheres), brute_force(spheres)))
        << "N = " << n << ", " << seed_note();
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
