/// Rules that combine the coefficients of two bodies into the coefficient of their contact.
#pragma once

#include <jfpx/math.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

enum class CombineRule : std::uint8_t {
  geometric_mean,  ///< sqrt(a * b): preserves equal coefficients, and 0
  product,         ///< a * b, as in Bullet
  minimum,
  maximum,
  average  ///< a/2 + b/2
};

/// Name in the JSON of a scene; null for a value outside the enumeration.
constexpr const char* to_string(CombineRule rule) {
  switch (rule) {
    case CombineRule::geometric_mean:
      return "geometric_mean";
    case CombineRule::product:
      return "product";
    case CombineRule::minimum:
      return "minimum";
    case CombineRule::maximum:
      return "maximum";
    case CombineRule::average:
      return "average";
  }
  return nullptr;
}

/// Combines two coefficients. @param a,b >= 0
JFPX_HD inline Real combined(CombineRule rule, Real a, Real b) {
  switch (rule) {
    case CombineRule::geometric_mean:
      break;
    case CombineRule::product:
      return a * b;
    case CombineRule::minimum:
      return a < b ? a : b;
    case CombineRule::maximum:
      return a > b ? a : b;
    case CombineRule::average:
      return a * Real(0.5) + b * Real(0.5);
  }
  return square_root(a * b);
}

/// Rules of a scene.
struct MaterialSettings {
  CombineRule friction = CombineRule::geometric_mean;
  CombineRule restitution = CombineRule::geometric_mean;
  friend bool operator==(const MaterialSettings&, const MaterialSettings&) = default;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
