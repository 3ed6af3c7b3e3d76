/// Rotations about an axis.
#include <jfpx/error.hpp>
#include <jfpx/math.hpp>

#include <cmath>
#include <sstream>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr Real kMaxAngle = Real(1e6);

struct SineCosine {
  double sine, cosine;
};

/// Taylor series for |x| <= pi/4; the terms omitted are less than 10^-18.
SineCosine sine_cosine_near_zero(double x) {
  const double square = x * x;
  double sine = 0, cosine = 0;
  for (int n = 16; n >= 2; n -= 2) {
    sine = -(sine + 1) * square / (n * (n + 1));
    cosine = -(cosine + 1) * square / (n * (n - 1));
  }
  return {x + x * sine, 1 + cosine};
}

/// Errors of a few 10^-16 for |x| <= kMaxAngle. Cody and Waite, "Software Manual for the Elementary
/// Functions": subtracts pi/2 in three parts. The first two parts have 33 bits, so that their
/// products with the number of quarters are exact.
SineCosine sine_cosine(double x) {
  constexpr double kPart1 = 0x1.921fb544p+0, kPart2 = 0x1.0b4611a6p-34,
                   kPart3 = 0x1.3198a2e037073p-69, kQuartersPerRadian = 0x1.45f306dc9c883p-1;
  const double quarters = std::floor(x * kQuartersPerRadian + 0.5);
  const double rest = ((x - quarters * kPart1) - quarters * kPart2) - quarters * kPart3;
  const SineCosine r = sine_cosine_near_zero(rest);
  switch (static_cast<int>(quarters) & 3) {
    case 0:
      return r;
    case 1:
      return {r.cosine, -r.sine};
    case 2:
      return {-r.sine, -r.cosine};
    default:
      return {-r.cosine, r.sine};
  }
}

std::string text(Real value) {
  std::ostringstream stream;
  stream << value;
  return stream.str();
}

}  // namespace

Quat from_axis_angle(const Vec3& axis, Real angle) {
  const Real size = length(axis);
  if (!(size > kEpsilon) || !is_finite(size)) {
    throw InvalidArgument("axis is (" + text(axis.x) + ", " + text(axis.y) + ", " + text(axis.z) +
                          "); it must be finite and longer than " + text(kEpsilon));
  }
  if (!(absolute(angle) <= kMaxAngle)) {
    throw InvalidArgument("angle is " + text(angle) + "; it must be from -1e6 to 1e6");
  }
  const SineCosine half = sine_cosine(static_cast<double>(angle) / 2);
  const double scale = half.sine / static_cast<double>(size);
  return {static_cast<Real>(half.cosine), static_cast<Real>(static_cast<double>(axis.x) * scale),
          static_cast<Real>(static_cast<double>(axis.y) * scale),
          static_cast<Real>(static_cast<double>(axis.z) * scale)};
}

Quat axes_along(const Vec3& axis) {
  const auto x = static_cast<double>(axis.x), y = static_cast<double>(axis.y),
             z = static_cast<double>(axis.z);
  const double size = square_root(x * x + y * y + z * z);
  if (!(size > static_cast<double>(kEpsilon)) || !std::isfinite(size)) {
    throw InvalidArgument("axis is (" + text(axis.x) + ", " + text(axis.y) + ", " + text(axis.z) +
                          "); it must be finite and longer than " + text(kEpsilon));
  }
  // 1 + x, without the cancellation near the opposite direction.
  const double across2 = y * y + z * z;
  const double w = x > 0 ? size + x : across2 / (size - x);
  const double length = square_root(w * w + across2);
  if (!(length > 0)) return {0, 0, 1, 0};  // half a turn about y
  return {static_cast<Real>(w / length), 0, static_cast<Real>(-z / length),
          static_cast<Real>(y / length)};
}

Quat axes_along(const Vec3& x, const Vec3& y) {
  const Quat along = axes_along(x);
  const Vec3 turned = rotate(conjugate(along), y);
  const Real size = square_root(turned.y * turned.y + turned.z * turned.z);
  if (!(size > kEpsilon) || !is_finite(size)) {
    throw InvalidArgument("y is (" + text(y.x) + ", " + text(y.y) + ", " + text(y.z) +
                          "); it must be finite and not parallel to x");
  }
  const Quat turn{size + turned.y, turned.z, 0, 0};
  return along * (length_squared(turn) > kEpsilon * size ? normalized(turn) : Quat{0, 1, 0, 0});
}

}  // namespace JFPX_ABI
}  // namespace jfpx
