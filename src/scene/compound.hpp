/// Mass, centre and inertia of compounds.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// How the mass of an compound is spread. Not finite, or with a total of 0, where the parts are out
/// of the range of numbers.
struct MassProperties {
  Vec3 centre;   ///< [m], body axes
  Mat3 inertia;  ///< [kg m^2], body axes, about their origin
};
/// @param mass [kg], of the whole
JFPX_API MassProperties mass_properties(const Compound& compound, Real mass);

/// Radius of the smallest sphere around a part's centre that holds it [m].
Real bounding_radius(const CompoundPart& part);

}  // namespace JFPX_ABI
}  // namespace jfpx
