/// Conservative overlap test of spheres with quantized coordinates, which are small integers, so
/// that tensor cores compute exactly. No touching pair fails the test.
#pragma once

#include "src/sphere_collider/cuda/grid_cells.hpp"
#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Largest magnitude of a quantized coordinate. Half precision represents all integers up to this
/// magnitude, and twice these integers, exactly.
inline constexpr Real kMaxQuantized = 1023;

/// Quantized sphere. All four values are integers; the radius includes a margin for all rounding
/// errors.
struct QuantizedSphere {
  float x, y, z, radius;
};

/// Mapping of the points in a box to quantized coordinates.
struct Quantization {
  Vec3 origin;  ///< centre of the box, up to rounding
  Real scale;   ///< quantized units per metre
};

/// Quantization for spheres with centres in [low, high] and radii of at most `largest`. The edges
/// of its box are at least twice as long as `largest`, and longer than the rounding errors of the
/// coordinates.
JFPX_HD inline Quantization quantization_around(const Vec3& low, const Vec3& high, Real largest) {
  constexpr Real kRoundings = 8 * std::numeric_limits<Real>::epsilon();
  const auto longer = [](Real p, Real q) { return p > q ? p : q; };
  Quantization quantization;
  Real half = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Real position = longer(absolute(low[axis]), absolute(high[axis]));
    const Real margin = fused(largest, Real(2), fused(position, kRoundings, kShortest));
    const Real first = moved(low[axis], -margin), last = moved(high[axis], margin);
    const Real middle = first * Real(0.5) + last * Real(0.5);
    quantization.origin[axis] = middle;
    half = longer(half, longer(last - middle, middle - first));
  }
  // If a sum of radii may be infinite, all spheres may touch: a scale of 0 maps them to one point.
  const bool sums_are_finite = largest <= std::numeric_limits<Real>::max() / 2;
  quantization.scale = sums_are_finite ? kMaxQuantized / half : 0;
  return quantization;
}

/// The integer nearest to x * scale, if its magnitude is less than 2^22.
template <typename T>
JFPX_HD inline T to_whole(T x, T scale) {
  constexpr T kWhole =
      T(1.5) * static_cast<T>(std::uint64_t{1} << (std::numeric_limits<T>::digits - 1));
  return fused(x, scale, kWhole) - kWhole;
}

/// Quantizes a sphere in the box of the quantization. If detail::test_sphere_pair() reports that
/// two of them touch, then |a - b| <= ra + rb also holds for the quantized spheres.
///
/// Proof, with u, t, D and s as in sphere_filter.hpp. Spheres that touch have D <= s^2 (1+9u) + 8t,
/// and hence a distance of at most d = s (1+6u) + sqrt(8t) (1+u) <= s (1+7u) + kShortest. A
/// quantized coordinate is rounded twice: in the offset, by at most 1023u units, and to an integer,
/// by at most 1/2. Hence the distance of two quantized centres is at most scale * d + sqrt(3) (1 +
/// 2046u) < scale * d + 2 * 0.8663. The sum of the quantized radii is at least scale * ((ra + rb)
/// (1+14u) + kShortest) + 2 * (1.3666 - 2048u - 1/2), because rounding to an integer subtracts at
/// most 1/2; and s <= (ra + rb) (1+u).
JFPX_HD inline QuantizedSphere quantized(const Quantization& quantization,
                                         const SphereInstance& s) {
  constexpr Real kSlack = 1 + 8 * std::numeric_limits<Real>::epsilon();
  const Vec3 offset = s.centre - quantization.origin;
  const Real more = fused(kShortest, quantization.scale, Real(1.3666));
  const Real radius = fused(s.radius * quantization.scale, kSlack, more);
  return {static_cast<float>(to_whole(offset.x, quantization.scale)),
          static_cast<float>(to_whole(offset.y, quantization.scale)),
          static_cast<float>(to_whole(offset.z, quantization.scale)),
          static_cast<float>(to_whole(radius, Real(1)))};
}

/// The overlap test as a dot product. The squared distance of the centres, minus the squared sum of
/// the radii, minus 1, is negative iff the quantized spheres overlap. It is the dot product of
/// row_terms() of one sphere and column_terms() of the other, kTerms numbers each. All of them are
/// integers that half precision represents exactly (up to 2048), so the products are exact. No
/// partial sum, in any order, reaches 2^24 in magnitude (2 * 3 * 1023^2 + 2 * 1024^2 for the
/// products of coordinates and of radii, twice 3 * 1023^2 + 2048 for the others), so single
/// precision adds them without error.
inline constexpr unsigned kTerms = 8;
struct QuantizedTerms {
  float values[kTerms];
};
/// An integer of magnitude below 2^22, as upper * kUpperPart + lower.
inline constexpr float kUpperPart = 2048;
struct QuantizedParts {
  float upper, lower;
};
JFPX_HD inline QuantizedParts parts_of(float whole) {
  const float upper = to_whole(whole, 1 / kUpperPart);
  return {upper, fused(upper, -kUpperPart, whole)};
}
/// Power of the origin with respect to the sphere: squared distance minus squared radius.
JFPX_HD inline float power_of_origin(const QuantizedSphere& s) {
  return fused(s.x, s.x, fused(s.y, s.y, fused(s.z, s.z, -(s.radius * s.radius))));
}
/// Terms of the first sphere of a pair.
JFPX_HD inline QuantizedTerms row_terms(const QuantizedSphere& a) {
  const QuantizedParts power = parts_of(power_of_origin(a) - 1);
  return {{-2 * a.x, -2 * a.y, -2 * a.z, -2 * a.radius, kUpperPart, 1, power.upper, power.lower}};
}
/// Terms of the second sphere of a pair.
JFPX_HD inline QuantizedTerms column_terms(const QuantizedSphere& b) {
  const QuantizedParts power = parts_of(power_of_origin(b));
  return {{b.x, b.y, b.z, b.radius, power.upper, power.lower, kUpperPart, 1}};
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
