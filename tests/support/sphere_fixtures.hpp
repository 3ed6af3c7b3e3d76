/// Random sphere sets of every awkward kind, brute force as the oracle, and comparison by bits.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/random.hpp>

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// A way to place n spheres. Every kind works for every n, 0 and 1 included.
struct SphereKind {
  std::string_view name;
  std::vector<SphereInstance> (*make)(std::size_t n, Random& random);
};

/// uniform, lattice, clusters, coincident, line, plane, polydisperse, one_giant, far, outliers,
/// touching, subnormal, huge.
std::span<const SphereKind> sphere_kinds();
/// The kind of that name; the test fails if there is none.
const SphereKind& sphere_kind(std::string_view name);

/// About `contacts` contacts per sphere: uniformly random centres, radius `radius`, no walls.
std::vector<SphereInstance> make_gas(std::size_t n, Real radius, Real contacts, Random& random);
/// n^3 spheres of radius 1 on a cubic lattice of that spacing, in scan order.
std::vector<SphereInstance> make_lattice(std::size_t n, Real spacing);
void shuffle(std::vector<SphereInstance>& spheres, Random& random);

/// Every pair a < b through detail::test_sphere_pair: what find_contacts() must equal.
std::vector<SphereContact> brute_force(std::span<const SphereInstance> spheres);

/// Success if both hold the same results in the same order with the same bits (any NaN equals any
/// NaN); else says where they part, in hexadecimal.
testing::AssertionResult same_bits(ContactSpan actual, ContactSpan expected);
testing::AssertionResult same_bits(std::span<const PairResult> actual,
                                   std::span<const PairResult> expected);
testing::AssertionResult same_bits(std::span<const PairContact> actual,
                                   std::span<const PairContact> expected);

/// What find_touching() must make of these results.
std::vector<PairContact> touching_of(std::span<const PairResult> results);

/// Base of all seeds of this run: JFPX_TEST_SEED if set, else fresh from the system.
std::uint64_t base_seed();
/// n, or n / JFPX_TEST_DIVISOR if that is set: smaller tests for slow machines and checking tools.
std::size_t scaled(std::size_t n);
/// To be streamed into a failing assertion or SCOPED_TRACE: how to repeat this run.
std::string seed_note();

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
