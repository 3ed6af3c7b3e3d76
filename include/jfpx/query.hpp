/// Questions about the bodies of a World: what a ray hits.
#pragma once

#include <jfpx/body.hpp>

#include <functional>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {

/// A half-line, or a part of one.
struct Ray {
  Vec3 origin;              ///< [m], within kMaxCoordinate
  Vec3 direction{0, 0, 1};  ///< finite and not zero; its length does not matter
  Real max_distance = std::numeric_limits<Real>::infinity();  ///< [m], >= 0
};

/// Where a ray enters a body. A ray that starts in a body, or on its surface, hits it at a distance
/// of 0 with a normal against the ray. All numbers are finite: a wall that a ray would meet farther
/// away than any Real is not hit.
struct RayHit {
  BodyId body;
  Real distance = 0;  ///< [m], from the origin
  Vec3 point;         ///< [m], world
  Vec3 normal;        ///< [-], unit, outwards
  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// Says of which bodies a query shall hear; an empty one, of all.
using BodyFilter = std::function<bool(BodyId)>;

}  // namespace JFPX_ABI
}  // namespace jfpx
