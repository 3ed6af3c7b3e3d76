/// Selection of the vertices of a hull from points.
#pragma once

#include "src/collide/hull/quickhull.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Points whose hull contains all given points, up to twice a tolerance.
struct VertexSelection {
  Extent extent = Extent::point;  ///< below solid: no points
  std::vector<int> vertices;      ///< indices, ascending
};

/// Omits points that are within the tolerance of the hull of the selected ones. Each selected point
/// is farther than the tolerance from the hull of the others, unless its removal would leave
/// another selected vertex of the first hull outside by more than that.
/// @param points    distinct integers in lexicographic order
/// @param most      if the hull has more than four times as many vertices, all of these are
/// returned
VertexSelection select_vertices(std::span<const GridPoint> points, double tolerance, int most);

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
