/// Exact sums of doubles and of products of doubles, as nonoverlapping expansions (Shewchuk 1997,
/// Adaptive precision floating-point arithmetic and fast robust geometric predicates). Exact unless
/// a product overflows or is below 2^-968.
#pragma once

#include <jfpx/math.hpp>

#include <array>
#include <cassert>
#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The sum of a rounded value and its rounding error.
struct RoundedPair {
  double value, error;
};

/// Knuth's TWO-SUM (Shewchuk 1997, theorem 7).
inline RoundedPair two_sum(double a, double b) {
  const double sum = a + b, part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}
/// Veltkamp's split into halves of 26 bits (Shewchuk 1997, theorem 17).
inline RoundedPair split(double a) {
  const double c = 134217729.0 * a, high = c - (c - a);
  return {high, a - high};
}
/// Dekker's TWO-PRODUCT (Shewchuk 1997, theorem 18).
inline RoundedPair two_product(double a, double b) {
  const double product = a * b;
  const auto [a_high, a_low] = split(a);
  const auto [b_high, b_low] = split(b);
  const double error =
      ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
  return {product, error};
}

/// a * b - c * d to a few units in the last place, for integers below 2^53: if the rounded products
/// cancel, the difference of their errors is exact.
inline double product_difference(double a, double b, double c, double d) {
  const RoundedPair ab = two_product(a, b), cd = two_product(c, d);
  return (ab.value - cd.value) + (ab.error - cd.error);
}

/// A sum of at most 24 doubles, by GROW-EXPANSION (Shewchuk 1997, theorem 10) without zeros.
class ExactSum {
 public:
  void add(double x) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const auto [sum, error] = two_sum(x, parts_[i]);
      x = sum;
      if (error != 0) parts_[kept++] = error;
    }
    if (x != 0) parts_[kept++] = x;
    count_ = kept;
    assert(count_ <= parts_.size());
  }
  void add_product(double a, double b) {
    const auto [value, error] = two_product(a, b);
    add(error);
    add(value);
  }
  void add_product(double a, double b, double c) {
    const auto [value, error] = two_product(a, b);
    add_product(error, c);
    add_product(value, c);
  }
  /// -1, 0 or 1. The last part is larger than the sum of the others.
  int sign() const { return count_ == 0 ? 0 : parts_[count_ - 1] > 0 ? 1 : -1; }
  /// The sum with a relative error of a few rounding units.
  double value() const {
    double sum = 0;
    for (std::size_t i = 0; i < count_; ++i) sum += parts_[i];
    return sum;
  }

 private:
  std::array<double, 24> parts_ = {};  ///< in increasing order of magnitude
  std::size_t count_ = 0;
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
