/// Ray casts. `direction` is always a unit vector, and solids include their surface.
#pragma once

#include <jfpx/math.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The point where a ray enters a solid. Without a hit the other fields are 0.
struct RayEntry {
  bool hit = false;
  Real distance = 0;       ///< [m], >= 0
  Vec3 normal;             ///< unit, outwards; opposite to a ray that starts inside
  std::uint32_t part = 0;  ///< as in RayHit
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
