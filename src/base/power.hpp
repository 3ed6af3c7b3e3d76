/// Powers for damping and exponential averaging, with the same bits for every compiler and C
/// library.
#pragma once

#include <jfpx/config.hpp>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Natural logarithm of x > 0, with a relative error of about 2e-16. frexp is exact; all other
/// operations are + - * /.
JFPX_HD inline double natural_logarithm(double x) {
  constexpr double kLn2 = 0x1.62e42fefa39efp-1;
  int exponent = 0;
  double mantissa = ::frexp(x, &exponent);
  if (mantissa < 0x1.6a09e667f3bcdp-1) {  // sqrt(1/2): keeps the mantissa close to 1
    mantissa *= 2;
    --exponent;
  }
  // ln(m) = 2 artanh(s), s = (m-1)/(m+1); |s| < 0.172, so the term after s^25 is below 1e-21.
  const double s = (mantissa - 1) / (mantissa + 1);
  double series = 0;
  for (int k = 25; k >= 1; k -= 2) series = series * (s * s) + 1.0 / k;
  return exponent * kLn2 + 2 * s * series;
}

/// e^x for x <= 0. ldexp is exact, so rounding occurs only in the range reduction and the series.
JFPX_HD inline double exponential(double x) {
  if (x < -745) return 0;
  constexpr double kLn2High = 0x1.62e42feep-1;  // short enough for n * kLn2High to be exact
  constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
  const double n = ::floor(x * 0x1.71547652b82fep+0 + 0.5);
  const double r = (x - n * kLn2High) - n * kLn2Low;
  double series = 1;  // Taylor; |r| < 0.35, so the term after r^16 is below 1e-22
  for (int k = 16; k >= 1; --k) series = 1 + r / k * series;
  return ::ldexp(series, static_cast<int>(n));
}

/// base^exponent for base in (0, 1] and exponent >= 0: the remaining fraction of a quantity after
/// `exponent` seconds if the fraction `base` remains after one second. Replaces std::pow, whose
/// last bit differs between C libraries, because a damping factor affects every state. The relative
/// error is below 1e-15 * (1 + |exponent * ln(base)|).
JFPX_HD inline double power(double base, double exponent) {
  return exponential(exponent * natural_logarithm(base));
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
