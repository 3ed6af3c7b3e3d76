/// Rays and their hits, for the queries of a World.
#pragma once

#include <jfpx/body.hpp>

#include <functional>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {

/// A half-line or a segment.
struct Ray {
  Vec3 origin;              ///< [m], within kMaxCoordinate
  Vec3 direction{0, 0, 1};  ///< finite and not zero; of any length
  Real max_distance = std::numeric_limits<Real>::infinity();  ///< [m], >= 0
};

/// Point where a ray enters a body. If the ray starts in a body or on its surface, the distance is
/// 0 and the normal is opposite to the ray. All numbers are finite: an intersection with a wall at
/// a distance beyond the range of Real is not a hit.
struct RayHit {
  BodyId body;
  Real distance = 0;  ///< [m], from the origin
  Vec3 point;         ///< [m], world
  Vec3 normal;        ///< [-], unit, outwards
  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// Predicate that selects bodies; empty selects all. A query calls it for bodies that the ray hits,
/// at most once for each, in unspecified order.
using BodyFilter = std::function<bool(BodyId)>;

}  // namespace JFPX_ABI
}  // namespace jfpx
