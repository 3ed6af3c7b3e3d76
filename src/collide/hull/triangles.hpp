/// The surface of a hull as triangles.
#pragma once

#include <jfpx/hull.hpp>
#include <jfpx/triangle_mesh.hpp>

#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The faces of a hull, divided into triangles of its vertices, counterclockwise seen from outside.
inline std::vector<Triangle> triangles_of(const Hull& hull) {
  std::vector<Triangle> triangles;
  for (const HullFace& face : hull.faces()) {
    const auto corners = hull.corners(face);
    for (std::size_t k = 2; k < corners.size(); ++k) {
      triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
  }
  return triangles;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
