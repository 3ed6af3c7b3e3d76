/// Mass properties of compounds.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Centre of mass and inertia of a compound. Not finite if a value overflows, or if the sum over
/// the parts of volume times density underflows to 0.
struct MassProperties {
  Vec3 centre;   ///< [m], body axes
  Mat3 inertia;  ///< [kg m^2], body axes, about the origin (not about `centre`)
};
/// Parts are solid and may overlap; each has its volume times density as its share of the mass.
/// @param mass [kg], total mass of the compound
JFPX_API MassProperties mass_properties(const Compound& compound, Real mass);

/// [m], radius of the smallest sphere about the origin that encloses a sphere around the part's
/// centre that encloses the part, without a margin for rounding errors.
Real outer_radius(const CompoundPart& part);

}  // namespace JFPX_ABI
}  // namespace jfpx
