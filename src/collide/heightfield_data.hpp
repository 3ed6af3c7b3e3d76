/// The data that copies of a Heightfield share.
#pragma once

#include <jfpx/heightfield.hpp>

#include "src/collide/mesh_view.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Immutable once made.
struct HeightfieldData {
  HeightfieldDef def;
  Vec3 half_extents;  ///< [m], of a box about the origin that encloses the triangles
  std::vector<std::uint8_t> cells;
  std::vector<HeightRange> tiles;
  BlockTree tree;  ///< of the tiles that have triangles

  /// Valid as long as the object.
  MeshView view() const {
    MeshView view;
    view.tree = tree.view();
    view.grid = {def.heights.data(), cells.data(),  tiles.data(), def.columns,
                 def.rows,           def.spacing_x, def.spacing_z};
    view.vertex_count = view.grid.vertex_count();
    view.triangle_count = 2 * view.vertex_count;
    view.two_sided = def.two_sided ? 1u : 0u;
    return view;
  }
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
