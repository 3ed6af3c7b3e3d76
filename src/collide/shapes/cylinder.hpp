/// The cylinder: mass and inner radius. Its contacts are those of all round solids.
#pragma once

#include "src/collide/round/round_contact.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Cylinder> = "cylinder";
template <>
inline constexpr bool kHasFlatFaces<Cylinder> = true;

JFPX_HD inline Solid to_solid(const Cylinder& cylinder) {
  return {{cylinder.radius, cylinder.half_height, cylinder.radius}, 0};
}
JFPX_HD inline Cylinder from_solid(const Solid& solid, std::type_identity<Cylinder>) {
  return {solid.half_extents.x, solid.half_extents.y};
}

/// [m^3]
inline double volume(const Cylinder& cylinder) {
  const auto r = static_cast<double>(cylinder.radius);
  return 2 * 3.14159265358979323846 * r * r * static_cast<double>(cylinder.half_height);
}
/// [kg m^2], principal moments of a solid cylinder.
JFPX_HD constexpr Vec3 moments_of_inertia(const Cylinder& cylinder, Real mass) {
  const Real r2 = cylinder.radius * cylinder.radius;
  const Real across = mass * (r2 / 4 + cylinder.half_height * cylinder.half_height / 3);
  return {across, mass * (r2 / 2), across};
}

JFPX_HD inline Real least_half_width(const Cylinder& cylinder) {
  return cylinder.radius < cylinder.half_height ? cylinder.radius : cylinder.half_height;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
