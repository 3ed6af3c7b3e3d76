/// Directions in which a character can move between planes.
#pragma once

#include <jfpx/math.hpp>

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The vector closest to `wanted` that points into none of the planes, so its product with `wanted`
/// is not negative. In three dimensions, the closest point of a cone is on no plane, on one, on the
/// crease of two, or at the apex; the closest of these points that is in the cone is the solution.
/// Quake's PM_StepSlideMove (1999) tests similar candidates.
/// @param normals unit
inline Vec3 slide_along(const Vec3& wanted, std::span<const Vec3> normals) {
  const Real tolerance = length(wanted) * Real(1e-5);
  const auto enters_none = [&](const Vec3& v) {
    for (const Vec3& n : normals) {
      if (dot(v, n) < -tolerance) return false;
    }
    return true;
  };
  if (enters_none(wanted)) return wanted;
  Vec3 best;
  Real least = length_squared(wanted);
  const auto consider = [&](const Vec3& v) {
    const Real error = length_squared(wanted - v);
    if (error < least && enters_none(v)) {
      least = error;
      best = v;
    }
  };
  for (const Vec3& n : normals) consider(add_scaled(wanted, n, -dot(wanted, n)));
  for (std::size_t i = 0; i < normals.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3 crease = cross(normals[i], normals[j]);
      const Real squared = length_squared(crease);
      if (squared > Real(1e-6)) consider(crease * (dot(wanted, crease) / squared));
    }
  }
  return best;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
