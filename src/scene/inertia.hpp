/// Inertia tensors of solid shapes, and their transformation between axes (thesis 4.1.5, 4.4.2).
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// [kg m^2], principal moments of a solid sphere.
JFPX_HD constexpr Vec3 moments_of_inertia(const Sphere& sphere, Real mass) {
  const Real i = Real(0.4) * mass * sphere.radius * sphere.radius;
  return {i, i, i};
}

/// [kg m^2], principal moments of a solid box: m/3 (b^2 + c^2) for half extents b and c (erratum
/// E23).
JFPX_HD constexpr Vec3 moments_of_inertia(const Box& box, Real mass) {
  const Vec3 h2 = component_product(box.half_extents, box.half_extents);
  return Vec3{h2.y + h2.z, h2.z + h2.x, h2.x + h2.y} * (mass / 3);
}

/// Contribution of a point mass at `position` to the tensor about the origin (parallel axis
/// theorem).
JFPX_HD constexpr Mat3 parallel_axis(const Vec3& position, Real mass) {
  const Mat3 cross_twice = skew_symmetric(position) * skew_symmetric(position);
  return cross_twice * -mass;
}

/// R * tensor * R^T: transforms a tensor from body axes to world axes, or from the axes of a part
/// to those of its compound.
JFPX_HD constexpr Mat3 in_world_axes(const Mat3& tensor, const Mat3& rotation) {
  return rotation * tensor * transposed(rotation);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
