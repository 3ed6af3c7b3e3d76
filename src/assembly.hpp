/// Mass, centre and inertia of assemblies.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx::inline JFPX_ABI {

/// How the mass of an assembly is spread. Not finite, or with a total of 0, where the parts are out
/// of the range of numbers.
struct MassProperties {
  Vec3 centre;   ///< [m], body axes
  Mat3 inertia;  ///< [kg m^2], body axes, about their origin
};
/// @param mass [kg], of the whole
JFPX_API MassProperties mass_properties(const Assembly& assembly, Real mass);

/// Radius of the smallest sphere around a part's centre that holds it [m].
Real bounding_radius(const AssemblyPart& part);

}  // namespace jfpx::inline JFPX_ABI
