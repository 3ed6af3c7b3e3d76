/// Rays, overlaps and casts with triangle meshes and heightfields.
#pragma once

#include "src/collide/box_pair.hpp"
#include "src/collide/mesh_bounds.hpp"
#include "src/collide/mesh_triangle.hpp"
#include "src/collide/ray.hpp"
#include "src/collide/tree_traversal.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Test of a ray and triangles in the axes of a mesh (Woop, Benthin and Wald 2013). The vertices
/// are sheared, so that the ray is an axis: errors are proportional to the distance of a vertex,
/// not to its square. A ray through a common edge of two triangles hits at least one of them,
/// because the products for the edge are exactly opposite.
class MeshRay {
 public:
  /// @param direction unit
  MeshRay(const Vec3& origin, const Vec3& direction) : origin_(origin), direction_(direction) {
    for (int i = 0; i < 3; ++i) {
      if (absolute(direction[i]) > absolute(direction[along_])) along_ = i;
    }
    across_ = (along_ + 1) % 3;
    up_ = (along_ + 2) % 3;
    scale_ = Real(1) / direction[along_];
    shear_across_ = direction[across_] * scale_;
    shear_up_ = direction[up_] * scale_;
  }

  /// [m], distance of the hit; negative if there is none.
  Real hit(const MeshView& mesh, std::uint32_t index) const {
    Vec3 corners[3];
    mesh.get_corners(index, corners);
    if (mesh.two_sided == 0 && !(dot(mesh.normal(index, corners), direction_) < 0)) return -1;
    Vec3 x, y, z;
    for (int k = 0; k < 3; ++k) {
      const Vec3 corner = corners[k] - origin_;
      x[k] = corner[across_] - shear_across_ * corner[along_];
      y[k] = corner[up_] - shear_up_ * corner[along_];
      z[k] = corner[along_] * scale_;
    }
    // Far from the ray, products are less accurate than the triangle is large.
    if (have_same_sign(x) || have_same_sign(y)) return -1;
    scale(x, y);
    Real area = 0, distance = 0;
    bool any_left = false, any_right = false;
    for (int k = 0; k < 3; ++k) {
      const int i = next_corner(k), j = next_corner(i);
      const Real weight = x[i] * y[j] - y[i] * x[j];
      any_left |= weight > 0;
      any_right |= weight < 0;
      area += weight;
      distance += weight * z[k];
    }
    if ((any_left && any_right) || area == 0) return -1;
    // In the plane of a tiny triangle, products underflow: the mean may be outside of its range.
    distance = std::clamp(distance / area, std::min({z.x, z.y, z.z}), std::max({z.x, z.y, z.z}));
    return distance >= 0 ? distance : Real(-1);
  }
  const Vec3& direction() const { return direction_; }

 private:
  /// Multiplies by a power of two, so that products of small numbers do not underflow.
  static void scale(Vec3& x, Vec3& y) {
    Real most = 0;
    for (int k = 0; k < 3; ++k) most = std::max({most, absolute(x[k]), absolute(y[k])});
    if (!(most > 0 && most < Real(1e-8))) return;
    int exponent = 0;
    std::frexp(most, &exponent);
    for (int k = 0; k < 3; ++k) {
      x[k] = std::ldexp(x[k], -exponent);
      y[k] = std::ldexp(y[k], -exponent);
    }
  }
  static bool have_same_sign(const Vec3& v) {
    return (v.x > 0 && v.y > 0 && v.z > 0) || (v.x < 0 && v.y < 0 && v.z < 0);
  }

  Vec3 origin_, direction_;
  int along_ = 0, across_ = 1, up_ = 2;
  Real scale_ = 0, shear_across_ = 0, shear_up_ = 0;
};

/// [m], the largest coordinate difference between a point and the corners of a tile.
inline Real distance_to_corners(const GridView& grid, std::uint32_t tile, const Vec3& p) {
  const Aabb box = grid.bounds_of_tile(tile);
  Real most = 0;
  for (int i = 0; i < 3; ++i) {
    most = std::max({most, absolute(box.lower[i] - p[i]), absolute(box.upper[i] - p[i])});
  }
  return most;
}

/// Calls limit = visit(triangle) for each triangle of a tile that a ray may hit at a distance of at
/// most the current limit [m], or that a box may touch whose centre moves along the ray.
/// Conservative, with the margin of TreeTraversal.
/// @param reach [m], half extents of the box
template <class Visit>
Real visit_tile_along(const GridView& grid, std::uint32_t tile, const Vec3& origin,
                      const Vec3& reach, const Vec3& direction, Real limit, const Visit& visit) {
  const GridView::CellRange columns = grid.columns_of_tile(tile), rows = grid.rows_of_tile(tile);
  const Real widest = std::max(reach.x, reach.z);
  const Real size = distance_to_corners(grid, tile, origin) + widest;
  const Real margin = size * ((widest > 0 ? 512 : 256) * kEpsilon) + kLostLength;
  const Real margin_x = margin + reach.x, margin_z = margin + reach.z;
  // The ray is beyond the tile. The lower limit keeps the distance finite.
  const Real far = 2 * (size + widest + margin) /
                   std::max({absolute(direction.x), absolute(direction.z), kEpsilon * kEpsilon});
  for (std::uint32_t row = rows.begin; row < rows.end; ++row) {
    // The part of the ray above the row, and its interval along x.
    Real enters = 0, leaves = std::min(limit, far);
    const Real near_z = grid.place_z(row) - margin_z - origin.z;
    const Real far_z = grid.place_z(row + 1) + margin_z - origin.z;
    if (absolute(direction.z) * far > margin) {
      const Real p = near_z / direction.z, q = far_z / direction.z;
      enters = std::max(enters, std::min(p, q));
      leaves = std::min(leaves, std::max(p, q));
    } else if (near_z > margin || far_z < -margin) {
      continue;
    }
    if (!(enters <= leaves)) continue;
    const Real x = origin.x + direction.x * enters, end = origin.x + direction.x * leaves;
    const GridView::CellRange cells = grid.cells_between(
        std::min(x, end) - margin_x, std::max(x, end) + margin_x, grid.columns, grid.spacing_x);
    const std::uint32_t last = std::min(cells.end, columns.end);
    for (std::uint32_t i = std::max(cells.begin, columns.begin); i < last; ++i) {
      const std::uint32_t first = 2 * (row * grid.columns + i);
      for (std::uint32_t k = 0; k < 2; ++k) {
        if (grid.has_triangle(first + k)) limit = visit(first + k);
      }
    }
  }
  return limit;
}

/// Calls limit = visit(triangle) for each triangle that a ray may hit at a distance of at most the
/// current limit [m].
template <class Visit>
void visit_triangles_along(const MeshView& mesh, const Vec3& origin, const Vec3& direction,
                           Real limit, const Visit& visit) {
  if (!mesh.is_grid()) {
    TreeTraversal::visit_along(mesh.tree, origin, direction, limit, visit);
    return;
  }
  TreeTraversal::visit_along(mesh.tree, origin, direction, limit, [&](std::uint32_t tile) {
    return limit = visit_tile_along(mesh.grid, tile, origin, {}, direction, limit, visit);
  });
}

/// Calls limit = visit(triangle) for each triangle that a solid may touch after it has moved by at
/// most the current limit [m].
/// @param centre,half_extents [m], of the bounds of the solid, in the axes of the mesh
template <class Visit>
void visit_triangles_swept(const MeshView& mesh, const Vec3& centre, const Vec3& half_extents,
                           const Vec3& direction, Real limit, const Visit& visit) {
  const auto visit_tile = [&](std::uint32_t tile) {
    return limit = visit_tile_along(mesh.grid, tile, centre, half_extents, direction, limit, visit);
  };
  if (mesh.is_grid()) {
    TreeTraversal::visit_swept(mesh.tree, centre, half_extents, direction, limit, visit_tile);
  } else {
    TreeTraversal::visit_swept(mesh.tree, centre, half_extents, direction, limit, visit);
  }
}

/// [m], lower bound of the distance of a box and a triangle.
inline Real gap_of_bounds(const Vec3 (&corner)[3], const Vec3& centre, const Vec3& half_extents) {
  Vec3 gap;
  for (int i = 0; i < 3; ++i) {
    const auto [least, most] = std::minmax({corner[0][i], corner[1][i], corner[2][i]});
    const Real beside = std::max(least - centre[i], centre[i] - most) - half_extents[i];
    gap[i] = std::max(beside, Real(0));
  }
  return length(gap);
}

/// Calls limit = visit(triangle) for the triangles of the cell that is closest to a point, whose
/// distance is a good first limit.
template <class Visit>
Real visit_closest_cell(const GridView& grid, const Vec3& point, Real limit, const Visit& visit) {
  const auto cell_at = [](Real p, std::uint32_t vertices, Real spacing) {
    const Real last = GridView::place(vertices - 1, vertices, spacing);
    const Real inside = std::clamp(p, -last, last);
    return GridView::cells_between(inside, inside, vertices, spacing).begin;
  };
  const std::uint32_t cell = cell_at(point.z, grid.rows, grid.spacing_z) * grid.columns +
                             cell_at(point.x, grid.columns, grid.spacing_x);
  for (std::uint32_t k = 0; k < 2; ++k) {
    if (grid.has_triangle(2 * cell + k)) limit = visit(2 * cell + k);
  }
  return limit;
}

/// Calls limit = visit(triangle) for each triangle whose distance from a solid may be at most the
/// current limit [m]. May visit a triangle twice.
/// @param centre,half_extents [m], of the bounds of the solid, in the axes of the mesh
/// @param limit               [m], >= 0, initial limit; may be infinite
template <class Visit>
void visit_triangles_nearby(const MeshView& mesh, const Vec3& centre, const Vec3& half_extents,
                            Real limit, const Visit& visit) {
  if (!mesh.is_grid()) {
    TreeTraversal::visit_nearby(mesh.tree, centre, half_extents, limit, visit);
    return;
  }
  const GridView& grid = mesh.grid;
  limit = visit_closest_cell(grid, centre, limit, visit);
  const Real reach = std::max({half_extents.x, half_extents.y, half_extents.z});
  TreeTraversal::visit_nearby(mesh.tree, centre, half_extents, limit, [&](std::uint32_t tile) {
    const Real size = distance_to_corners(grid, tile, centre) + reach;
    const Real margin = size * TreeTraversal::kGapMargin + kLostLength;
    const Real around = limit + margin;
    const Vec3 r = half_extents + Vec3{around, around, around};
    grid.visit_overlapping_in(tile, {centre - r, centre + r}, [&](std::uint32_t triangle) {
      Vec3 corner[3];
      grid.get_corners(triangle, corner);
      if (gap_of_bounds(corner, centre, half_extents) <= limit + margin) limit = visit(triangle);
    });
    return limit;
  });
}

/// The first hit of a ray up to a distance. A one-sided triangle is hit from its front only. The
/// normal points to the side from which the ray comes. Of triangles at the same distance, the one
/// with the lowest number is hit.
inline RayEntry enter(const Vec3& origin, const Vec3& direction, const Mesh auto& mesh,
                      const Transform& pose, Real max_distance) {
  const MeshView view = view_of(mesh);
  const Vec3 from = inverse_transform_point(pose, origin);
  const Vec3 along = inverse_transform_direction(pose, direction);
  const MeshRay ray(from, along);
  RayEntry first;
  visit_triangles_along(view, from, along, max_distance, [&](std::uint32_t index) {
    const Real distance = ray.hit(view, index);
    const bool is_hit = distance >= 0 && distance <= max_distance;
    if (is_hit && (!first.hit || distance < first.distance ||
                   (distance == first.distance && index < first.part))) {
      first.hit = true;
      first.distance = distance;
      first.part = index;
    }
    return first.hit ? first.distance : max_distance;
  });
  if (!first.hit) return first;
  Vec3 corners[3];
  view.get_corners(first.part, corners);
  const Vec3 normal = view.normal(first.part, corners);
  first.normal = pose.basis * (dot(normal, along) > 0 ? -normal : normal);
  return first;
}

/// Calls visit(triangle) for the triangles that a solid with the given bounds may touch.
/// @param centre,half_extents [m], world axes
template <class Visit>
void visit_triangles_around(const MeshView& mesh, const Transform& pose, const Vec3& centre,
                            const Vec3& half_extents, const Visit& visit) {
  const Mat3 to_mesh = transposed(pose.basis);
  // More than the rounding of the centre.
  const Vec3 offset = centre - pose.origin;
  const Real error = 64 * kEpsilon * (absolute(offset.x) + absolute(offset.y) + absolute(offset.z));
  const Vec3 half{projected_half_length(half_extents, to_mesh.row[0]) + error,
                  projected_half_length(half_extents, to_mesh.row[1]) + error,
                  projected_half_length(half_extents, to_mesh.row[2]) + error};
  const Vec3 middle = inverse_transform_point(pose, centre);
  if (!mesh.is_grid()) {
    TreeTraversal::visit_around(mesh.tree, middle, half, visit);
    return;
  }
  const Real reach = std::max({half.x, half.y, half.z});
  TreeTraversal::visit_around(mesh.tree, middle, half, [&](std::uint32_t tile) {
    const GridView& grid = mesh.grid;
    const Real size = distance_to_corners(grid, tile, middle) + reach;
    const Real margin = size * TreeTraversal::kOverlapMargin + kLostLength;
    const Vec3 r = half + Vec3{margin, margin, margin};
    grid.visit_overlapping_in(tile, {middle - r, middle + r}, visit);
  });
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
