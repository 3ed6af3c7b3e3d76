/// Transformations of inertia tensors between axes (thesis 4.1.5, 4.4.2).
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

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
