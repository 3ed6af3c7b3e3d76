/// Random sphere sets including degenerate ones, a brute-force oracle, and bitwise comparison.
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

/// A generator of n spheres. Every kind supports every n, including 0 and 1.
struct SphereKind {
  std::string_view name;
  std::vector<SphereInstance> (*make)(std::size_t n, Random& random);
};

/// uniform, lattice, clusters, coincident, line, plane, polydisperse, one_large, far, outliers,
/// touching, subnormal, huge.
std::span<const SphereKind> sphere_kinds();
/// Returns the kind with this name; the test fails if there is none.
const SphereKind& sphere_kind(std::string_view name);

/// Creates spheres of one radius with uniformly random centres and about `contacts` contacts per
/// sphere.
std::vector<SphereInstance> make_gas(std::size_t n, Real radius, Real contacts, Random& random);
/// Creates n^3 spheres of radius 1 on a cubic lattice, in scan order.
std::vector<SphereInstance> make_lattice(std::size_t n, Real spacing);
void shuffle(std::vector<SphereInstance>& spheres, Random& random);

/// Tests every pair a < b with detail::test_sphere_pair(): the expected result of find_contacts().
std::vector<SphereContact> brute_force(std::span<const SphereInstance> spheres);

/// Succeeds if both contain the same results in the same order with the same bits (any NaN equals
/// any NaN); otherwise reports the first difference in hexadecimal.
testing::AssertionResult same_bits(ContactSpan actual, ContactSpan expected);
testing::AssertionResult same_bits(std::span<const PairResult> actual,
                                   std::span<const PairResult> expected);
testing::AssertionResult same_bits(std::span<const PairContact> actual,
                                   std::span<const PairContact> expected);

/// Returns the expected result of find_touching() for these results of detail::test_sphere_pair().
std::vector<PairContact> touching_of(std::span<const PairResult> results);

/// Base of all seeds of this run: JFPX_TEST_SEED if set, else random.
std::uint64_t base_seed();
/// Returns n, or n / JFPX_TEST_DIVISOR if set: smaller tests for slow machines and for sanitizers.
std::size_t scaled(std::size_t n);
/// Text for failing assertions and SCOPED_TRACE that explains how to repeat this run.
std::string seed_note();

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
