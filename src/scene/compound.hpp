/// Mass properties and extents of bodies.
#pragma once

#include "src/collide/shapes.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {

/// Centre of mass and inertia of a compound. Not finite if a value overflows, or if the sum of
/// volume times density over the parts underflows to 0.
struct MassProperties {
  Vec3 centre;   ///< [m], body axes
  Mat3 inertia;  ///< [kg m^2], body axes, about the origin (not about `centre`)
};
/// Parts are solid and may overlap. The mass of a part is proportional to volume times density.
/// @param mass [kg], total mass of the compound
JFPX_API MassProperties mass_properties(const Compound& compound, Real mass);

/// [m], radius of a sphere about the origin that encloses the part, without a margin for rounding
/// errors.
inline Real outer_radius(const CompoundPart& part) {
  const auto radius = [](const auto& solid) { return detail::outer_radius(solid); };
  return length(part.position) + std::visit(radius, part.shape);
}
/// Outer radius of all solids of a body, or of its mesh; 0 for half-spaces and planes.
inline Real outer_radius(const Shape& shape) {
  Real radius = 0;
  detail::for_each_part(shape, [&](const auto& s, const CompoundPart* part, std::uint32_t) {
    if constexpr (!detail::kIsWall<std::decay_t<decltype(s)>>) {
      radius = std::max(radius, part != nullptr ? outer_radius(*part) : detail::outer_radius(s));
    }
  });
  return radius;
}

/// Whether the shape is a half-space or a plane, which is infinite and ignores poses.
inline bool is_wall(const Shape& shape) {
  return std::holds_alternative<HalfSpace>(shape) || std::holds_alternative<Plane>(shape);
}

/// [kg m^2], inertia tensor of a solid body; zero for half-spaces, planes and meshes.
inline Mat3 solid_inertia(const Shape& shape, Real mass) {
  const auto tensor = [mass](const auto& s) -> Mat3 {
    using S = std::decay_t<decltype(s)>;
    if constexpr (std::is_same_v<S, Compound>) {
      return mass_properties(s, mass).inertia;
    } else if constexpr (detail::kIsSolid<S>) {
      return detail::central_inertia(s, mass);
    } else {
      return diagonal({});
    }
  };
  return std::visit(tensor, shape);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
