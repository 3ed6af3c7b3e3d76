/// The triangles of the cells of a height field.
#pragma once

#include <jfpx/config.hpp>

#include "src/bullet/dispatch/mesh_leaves.hpp"

#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Reproduces btHeightfieldTerrainShape::processAllTriangles of Bullet 3.24, operation by
/// operation. The shape must be exactly of that class.
class HeightCells {
 public:
  explicit HeightCells(const btHeightfieldTerrainShape& shape)
      : shape_(shape),
        scaling_(shape.*HeightFields::scaling),
        up_(shape.*HeightFields::up),
        first_axis_(up_ == 0 ? 1 : 0),
        second_axis_(up_ == 2 ? 1 : 2) {}

  /// Calls visit(vertices, part, index) for the triangles that overlap the box.
  template <class Visit>
  void for_each_triangle(const LocalBox& box, const Visit& visit) const {
    const auto [columns, rows] = find_cells(box);
    if (columns.begin >= columns.end) return;
    const bool flips_edges = shape_.*HeightFields::flips_edges;
    const bool diamonds = shape_.*HeightFields::diamonds, zigzag = shape_.*HeightFields::zigzag;
    // The winding exchanges the first and the last vertex.
    const int first = shape_.*HeightFields::flips_winding ? 2 : 0, last = 2 - first;
    for (int row = rows.begin; row < rows.end; ++row) {
      btVector3 near = vertex(columns.begin, row), far = vertex(columns.begin, row + 1);
      for (int column = columns.begin; column < columns.end; ++column) {
        const btVector3 next_near = vertex(column + 1, row);
        const btVector3 next_far = vertex(column + 1, row + 1);
        btVector3 v[3];
        const auto visit_overlapping = [&](int part) {
          if (TestTriangleAgainstAabb2(v, box.min, box.max)) visit(v, part, row);
        };
        v[first] = near;
        const bool is_flipped =
            flips_edges || (diamonds && ((row + column) & 1) == 0) || (zigzag && (row & 1) == 0);
        if (is_flipped) {
          v[1] = far;
          v[last] = next_far;
        } else {
          v[1] = far;
          v[last] = next_near;
        }
        Range range = range_of(v[0][up_], v[1][up_], v[2][up_]);
        if (range.overlaps(box, up_)) visit_overlapping(2 * column);
        if (is_flipped) {
          v[1] = next_far;
          v[last] = next_near;
        } else {
          v[first] = next_near;
          v[last] = next_far;
        }
        range.min = btMin(range.min, v[last][up_]);
        range.max = btMax(range.max, v[last][up_]);
        if (range.overlaps(box, up_)) visit_overlapping(2 * column + 1);
        near = next_near;
        far = next_far;
      }
    }
  }

 private:
  /// A half-open range of the grid.
  struct Interval {
    int begin, end;
  };
  struct Range {
    bool overlaps(const LocalBox& box, int axis) const {
      return !(min > box.max[axis] || max < box.min[axis]);
    }
    btScalar min, max;
  };
  /// With Bullet's comparisons, because a height may be a NaN.
  static Range range_of(btScalar a, btScalar b, btScalar c) {
    if (a > b) {
      if (b > c) return {c, a};
      return a > c ? Range{b, a} : Range{b, c};
    }
    if (a > c) return {c, b};
    return b > c ? Range{a, b} : Range{a, c};
  }
  static int nearest(btScalar x) {
    return x < 0 ? static_cast<int>(x - 0.5) : static_cast<int>(x + 0.5);
  }

  /// The columns and rows of the cells around the box.
  std::pair<Interval, Interval> find_cells(const LocalBox& box) const {
    const btVector3 inverse(btScalar(1) / scaling_[0], btScalar(1) / scaling_[1],
                            btScalar(1) / scaling_[2]);
    btVector3 min = box.min * inverse, max = box.max * inverse;
    for (btVector3* side : {&min, &max}) {
      *side += shape_.*HeightFields::origin;
      side->setMax(shape_.*HeightFields::local_min);
      side->setMin(shape_.*HeightFields::local_max);
    }
    const auto interval = [&](int axis, int points) {
      return Interval{std::max(nearest(min[axis]) - 1, 0),
                      std::min(nearest(max[axis]) + 1, points - 1)};
    };
    return {shrink(interval(first_axis_, shape_.*HeightFields::columns), box, first_axis_,
                   shape_.*HeightFields::width),
            shrink(interval(second_axis_, shape_.*HeightFields::rows), box, second_axis_,
                   shape_.*HeightFields::length)};
  }
  /// Removes cells at the ends of an interval that are outside the box. Both triangles of a cell
  /// have the extent of the cell along the two axes of the grid, so their tests against the box
  /// have the same result.
  Interval shrink(Interval cells, const LocalBox& box, int axis, btScalar size) const {
    const auto is_outside = [&](int cell) {
      const btScalar a = coordinate(cell, axis, size), b = coordinate(cell + 1, axis, size);
      return btMin(a, b) > box.max[axis] || btMax(a, b) < box.min[axis];
    };
    while (cells.begin < cells.end && is_outside(cells.begin)) ++cells.begin;
    while (cells.begin < cells.end && is_outside(cells.end - 1)) --cells.end;
    return cells;
  }

  btScalar coordinate(int point, int axis, btScalar size) const {
    return ((-size / btScalar(2)) + static_cast<btScalar>(point)) * scaling_[axis];
  }
  btVector3 vertex(int column, int row) const {
    btVector3 result(0, 0, 0);
    result[up_] = (height(column, row) - (shape_.*HeightFields::origin)[up_]) * scaling_[up_];
    result[first_axis_] = coordinate(column, first_axis_, shape_.*HeightFields::width);
    result[second_axis_] = coordinate(row, second_axis_, shape_.*HeightFields::length);
    return result;
  }
  btScalar height(int column, int row) const {
    const std::ptrdiff_t i =
        static_cast<std::ptrdiff_t>(row) * (shape_.*HeightFields::columns) + column;
    switch (shape_.*HeightFields::type) {
      case PHY_FLOAT:
        return static_cast<btScalar>((shape_.*HeightFields::floats)[i]);
      case PHY_DOUBLE:
        return static_cast<btScalar>((shape_.*HeightFields::doubles)[i]);
      case PHY_UCHAR:
        return static_cast<btScalar>((shape_.*HeightFields::bytes)[i]) *
               (shape_.*HeightFields::height_scale);
      case PHY_SHORT:
        return static_cast<btScalar>((shape_.*HeightFields::shorts)[i]) *
               (shape_.*HeightFields::height_scale);
      default:
        return 0;
    }
  }

  const btHeightfieldTerrainShape& shape_;
  btVector3 scaling_;
  int up_, first_axis_, second_axis_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
