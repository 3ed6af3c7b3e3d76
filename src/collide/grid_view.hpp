/// The arrays of a heightfield, in host memory or on a device, and the triangles that follow from
/// them. See HeightfieldDef for the numbers of vertices, cells and triangles.
#pragma once

#include "src/collide/triangle_normal.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Instead of a vertex.
inline constexpr std::uint32_t kNoVertex = 0xffffffffu;

/// Least and most height of the vertices of several triangles. Without triangles, least > most.
struct HeightRange {
  Real least = kMaxReal, most = -kMaxReal;
};

/// The triangles of a grid. The neighbors of a triangle and the triangles in a box are found by
/// their numbers.
struct GridView {
  /// The search first tests the heights of a tile of kTile x kTile cells.
  static constexpr std::uint32_t kTile = 16;

  /// Flags of a cell. Bit k is set if triangle k is missing: in a hole, without area, or outside of
  /// the grid. The others are set if two triangles are in one plane: those of the cell, and those
  /// at its first edge along x and along z.
  static constexpr std::uint8_t kMissing = 1 << 0 | 1 << 1;
  static constexpr std::uint8_t kFlatDiagonal = 1 << 2, kFlatX = 1 << 3, kFlatZ = 1 << 4;

  const Real* heights = nullptr;  ///< [m], by vertex
  /// Flags by padding() + cell: the cells at the last row and column, and before the first cell,
  /// have no triangles.
  const std::uint8_t* cells = nullptr;
  const HeightRange* tiles = nullptr;  ///< by row and column of tiles
  std::uint32_t columns = 0, rows = 0;
  Real spacing_x = 0, spacing_z = 0;  ///< [m]

  JFPX_HD std::uint32_t padding() const { return columns + 1; }
  JFPX_HD std::uint32_t vertex_count() const { return columns * rows; }
  JFPX_HD std::uint32_t cell_count() const { return padding() + vertex_count(); }
  JFPX_HD static std::uint32_t tiles_along(std::uint32_t vertices) {
    return (vertices - 2) / kTile + 1;
  }
  JFPX_HD std::uint32_t tile_columns() const { return tiles_along(columns); }
  JFPX_HD std::uint32_t tile_count() const { return tile_columns() * tiles_along(rows); }

  JFPX_HD static Real place(std::uint32_t i, std::uint32_t count, Real spacing) {
    return (static_cast<Real>(i) - static_cast<Real>(count - 1) * Real(0.5)) * spacing;
  }
  JFPX_HD Real place_x(std::uint32_t column) const { return place(column, columns, spacing_x); }
  JFPX_HD Real place_z(std::uint32_t row) const { return place(row, rows, spacing_z); }
  JFPX_HD Vec3 position(std::uint32_t vertex) const {
    const std::uint32_t row = vertex / columns;
    return {place_x(vertex - row * columns), heights[vertex], place_z(row)};
  }

  JFPX_HD bool has_triangle(std::uint32_t triangle) const {
    return (cells[padding() + triangle / 2] >> (triangle & 1) & 1) == 0;
  }
  JFPX_HD std::uint32_t vertex(std::uint32_t triangle, int k) const {
    const std::uint32_t first = triangle / 2;
    if (k == 1) return first + columns;
    const bool is_second = (triangle & 1) != 0;
    return first + (k == 0 ? 0 : 1) + (is_second ? (k == 0 ? 1 : columns) : 0);
  }
  /// By edge: the third vertex of the neighbor, or kNoVertex.
  JFPX_HD std::uint32_t opposite(std::uint32_t triangle, int edge) const {
    const std::uint32_t first = triangle / 2;
    if ((triangle & 1) == 0) {
      if (edge == 0) return if_present(first - 1, 1, first + columns - 1);
      if (edge == 1) return if_present(first, 1, first + columns + 1);
      return if_present(first - columns, 1, first - columns + 1);
    }
    if (edge == 0) return if_present(first, 0, first);
    if (edge == 1) return if_present(first + columns, 0, first + 2 * columns);
    return if_present(first + 1, 0, first + 2);
  }
  /// Bit i: the neighbor at edge i is in the same plane.
  JFPX_HD std::uint32_t flat_edges(std::uint32_t triangle) const {
    const std::uint32_t first = triangle / 2;
    const bool is_second = (triangle & 1) != 0;
    const auto flag = [this](std::uint32_t number, std::uint8_t bit) {
      return (cells[padding() + number] & bit) != 0 ? 1u : 0u;
    };
    const std::uint32_t diagonal = flag(first, kFlatDiagonal);
    const std::uint32_t along_x = flag(is_second ? first + columns : first, kFlatX);
    const std::uint32_t along_z = flag(is_second ? first + 1 : first, kFlatZ);
    return is_second ? diagonal | along_x << 1 | along_z << 2
                     : along_z | diagonal << 1 | along_x << 2;
  }
  /// Calls visit(neighbor) with the vertices at the other ends of the edges of a vertex until it
  /// returns false. @returns whether all calls returned true
  template <class Visit>
  JFPX_HD bool all_neighbors(std::uint32_t vertex, const Visit& visit) const {
    constexpr std::uint32_t kRing = 6;
    const auto present = [this](std::uint32_t cell, std::uint32_t k) {
      return (cells[padding() + cell] >> k & 1) == 0 ? 1u : 0u;
    };
    // Triangle i is between the neighbors i and (i + 1) % 6.
    const std::uint32_t triangles =
        present(vertex, 0) | present(vertex - 1, 1) << 1 | present(vertex - 1, 0) << 2 |
        present(vertex - columns - 1, 1) << 3 | present(vertex - columns, 0) << 4 |
        present(vertex - columns, 1) << 5;
    const std::uint32_t edges = triangles | triangles << 1 | triangles >> (kRing - 1);
    for (std::uint32_t i = 0; i < kRing; ++i) {
      if ((edges >> i & 1) == 0) continue;
      const std::uint32_t half = i % 3;
      const std::uint32_t offset = half == 0 ? 1 : half == 1 ? columns : columns - 1;
      if (!visit(i < 3 ? vertex + offset : vertex - offset)) return false;
    }
    return true;
  }
  JFPX_HD void get_corners(std::uint32_t triangle, Vec3 (&corner)[3]) const {
    const std::uint32_t first = triangle / 2, row = first / columns;
    const std::uint32_t column = first - row * columns, k = triangle & 1;
    const Real x = place_x(column), next_x = place_x(column + 1);
    const Real z = place_z(row), next_z = place_z(row + 1);
    const Real* const at = heights + first;
    corner[0] = {k == 0 ? x : next_x, at[k], z};
    corner[1] = {x, at[columns], next_z};
    corner[2] = k == 0 ? Vec3{next_x, at[1], z} : Vec3{next_x, at[columns + 1], next_z};
  }

  /// Calls visit(triangle) for the triangles whose bounds overlap a box.
  template <class Visit>
  JFPX_HD void visit_overlapping(const Aabb& box, const Visit& visit) const {
    const CellRange x = cells_between(box.lower.x, box.upper.x, columns, spacing_x);
    const CellRange z = cells_between(box.lower.z, box.upper.z, rows, spacing_z);
    if (x.begin == x.end || z.begin == z.end) return;
    const std::uint32_t last_tile_x = (x.end - 1) / kTile, last_tile_z = (z.end - 1) / kTile;
    for (std::uint32_t tile_z = z.begin / kTile; tile_z <= last_tile_z; ++tile_z) {
      for (std::uint32_t tile_x = x.begin / kTile; tile_x <= last_tile_x; ++tile_x) {
        const HeightRange& range = tiles[tile_z * tile_columns() + tile_x];
        if (range.least > box.upper.y || range.most < box.lower.y) continue;
        visit_cells(common(x, cells_of(tile_x, columns)), common(z, cells_of(tile_z, rows)), box,
                    visit);
      }
    }
  }
  /// The same for the triangles of one tile.
  template <class Visit>
  JFPX_HD void visit_overlapping_in(std::uint32_t tile, const Aabb& box, const Visit& visit) const {
    const CellRange x = cells_between(box.lower.x, box.upper.x, columns, spacing_x);
    const CellRange z = cells_between(box.lower.z, box.upper.z, rows, spacing_z);
    visit_cells(common(x, columns_of_tile(tile)), common(z, rows_of_tile(tile)), box, visit);
  }

  /// Indices of cells along an axis.
  struct CellRange {
    std::uint32_t begin = 0, end = 0;
  };
  /// The cells whose bounds overlap an interval.
  JFPX_HD static CellRange cells_between(Real lower, Real upper, std::uint32_t vertices,
                                         Real spacing) {
    const auto at = [&](std::uint32_t i) { return place(i, vertices, spacing); };
    const std::uint32_t last = vertices - 2;
    if (!(lower <= at(last + 1)) || !(upper >= at(0))) return {};
    const auto cell_of = [&](Real p, std::uint32_t otherwise) {
      const Real cell = p / spacing + static_cast<Real>(vertices - 1) * Real(0.5);
      if (!(cell > 0)) return 0u;
      return cell < static_cast<Real>(otherwise) ? static_cast<std::uint32_t>(cell) : otherwise;
    };
    // The quotient is nearly exact: these loops end after one or two rounds.
    std::uint32_t begin = cell_of(lower, last), end = cell_of(upper, last);
    while (begin > 0 && at(begin) >= lower) --begin;
    while (begin < last && at(begin + 1) < lower) ++begin;
    while (end < last && at(end + 1) <= upper) ++end;
    while (end > 0 && at(end) > upper) --end;
    return {begin, end + 1};
  }
  JFPX_HD static CellRange common(const CellRange& a, const CellRange& b) {
    return {a.begin > b.begin ? a.begin : b.begin, a.end < b.end ? a.end : b.end};
  }
  /// The cells of the tiles with an index along an axis.
  JFPX_HD static CellRange cells_of(std::uint32_t tile, std::uint32_t vertices) {
    return common({tile * kTile, (tile + 1) * kTile}, {0, vertices - 1});
  }
  JFPX_HD CellRange columns_of_tile(std::uint32_t tile) const {
    return cells_of(tile % tile_columns(), columns);
  }
  JFPX_HD CellRange rows_of_tile(std::uint32_t tile) const {
    return cells_of(tile / tile_columns(), rows);
  }
  JFPX_HD Aabb bounds_of_tile(std::uint32_t tile) const {
    const CellRange x = columns_of_tile(tile), z = rows_of_tile(tile);
    return {{place_x(x.begin), tiles[tile].least, place_z(z.begin)},
            {place_x(x.end), tiles[tile].most, place_z(z.end)}};
  }
  /// Calls visit(triangle) for the triangles of some cells whose heights overlap those of a box.
  template <class Visit>
  JFPX_HD void visit_cells(const CellRange& x, const CellRange& z, const Aabb& box,
                           const Visit& visit) const {
    for (std::uint32_t row = z.begin; row < z.end; ++row) {
      const std::uint32_t end = row * columns + x.end;
      for (std::uint32_t first = row * columns + x.begin; first < end; ++first) {
        const std::uint32_t flags = cells[padding() + first];
        if ((flags & kMissing) == kMissing) continue;
        const Real* const at = heights + first;
        const Real p = at[1], q = at[columns];
        const Real low = p < q ? p : q, high = p < q ? q : p;
        for (std::uint32_t k = 0; k < 2; ++k) {
          if ((flags >> k & 1) != 0) continue;
          const Real r = at[k == 0 ? 0 : columns + 1];
          const Real least = r < low ? r : low, most = r > high ? r : high;
          if (!(least > box.upper.y) && !(most < box.lower.y)) visit(2 * first + k);
        }
      }
    }
  }

 private:
  /// A vertex, or kNoVertex if a triangle is missing.
  JFPX_HD std::uint32_t if_present(std::uint32_t cell, std::uint32_t k,
                                   std::uint32_t vertex) const {
    return (cells[padding() + cell] >> k & 1) == 0 ? vertex : kNoVertex;
  }
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
