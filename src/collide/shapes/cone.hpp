/// The cone: mass and inner radius. Its contacts are those of all round solids.
#pragma once

#include "src/collide/round/round_contact.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Cone> = "cone";
template <>
inline constexpr bool kHasFlatFaces<Cone> = true;

/// The core is higher than the cone, so that its height is exact.
JFPX_HD inline Solid to_solid(const Cone& cone) {
  return {{cone.radius, 2 * cone.half_height, cone.radius}, 0};
}
JFPX_HD inline Cone from_solid(const Solid& solid, std::type_identity<Cone>) {
  return {solid.half_extents.x, solid.half_extents.y / 2};
}

/// [m^3]
inline double volume(const Cone& cone) {
  const auto r = static_cast<double>(cone.radius);
  return 2.0 / 3.0 * 3.14159265358979323846 * r * r * static_cast<double>(cone.half_height);
}
/// [kg m^2], principal moments of a solid cone about its centre of mass.
JFPX_HD constexpr Vec3 moments_of_inertia(const Cone& cone, Real mass) {
  const Real r2 = cone.radius * cone.radius;
  const Real across = mass * Real(0.15) * (r2 + cone.half_height * cone.half_height);
  return {across, mass * Real(0.3) * r2, across};
}

/// [m], radius of the largest ball around the centre of mass: to the base or to the side.
JFPX_HD inline Real least_half_width(const Cone& cone) {
  const Frustum frustum = to_frustum(cone);
  const Real to_base = -frustum.lower;
  const Real to_side = frustum.side_cosine * cone.radius - frustum.side_sine * to_base;
  return to_base < to_side ? to_base : to_side;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
