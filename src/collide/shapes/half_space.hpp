/// The half-space: name and ray. Contacts with it are in the headers of the solids.
#pragma once

#include "src/collide/ray.hpp"
#include "src/collide/solid.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<HalfSpace> = "half_space";

JFPX_HD constexpr RayEntry enter(const Vec3& origin, const Vec3& direction,
                                 const HalfSpace& half_space) {
  const Real height = dot(half_space.normal, origin) - half_space.offset;
  if (!(height > 0)) return {true, 0, -direction};
  const Real descent = -dot(half_space.normal, direction);
  if (!(descent > 0)) return {};
  return {true, height / descent, half_space.normal};
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
