/// Mass properties of compounds.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Centre of mass and inertia of a compound. Not finite if the mass of a part, or the total, is
/// outside the range of the numbers.
struct MassProperties {
  Vec3 centre;   ///< [m], body axes
  Mat3 inertia;  ///< [kg m^2], body axes, about the origin
};
/// @param mass [kg], total mass of the compound
JFPX_API MassProperties mass_properties(const Compound& compound, Real mass);

/// [m], radius of the smallest sphere around the part's centre that encloses the part.
Real bounding_radius(const CompoundPart& part);

}  // namespace JFPX_ABI
}  // namespace jfpx
