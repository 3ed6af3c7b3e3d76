/// A bounding-volume tree of axis-aligned boxes, for the queries of a World.
#pragma once

#include <jfpx/query.hpp>

#include "src/collide/tree_traversal.hpp"
#include "src/world/bodies/body_store.hpp"

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Selects candidate bodies for the exact test of a query. A node is a block of a BlockTree.
///
/// Queries are conservative: they visit every body that the exact test in world_queries.cpp finds,
/// including its rounding errors. Let u be half of kEpsilon, and let D be the largest coordinate
/// difference between the query and the corners of a node. The distance, the radius and the half
/// diagonal of every solid in the node are at most sqrt(3) D.
///   - build() rounds the bounds of a body outwards, by more than their error.
///   - Rays: if the exact test returns a distance t, the point origin + t direction is inside the
///     bounds, with an error of at most 50 u D for a sphere (the distance from the line and the
///     half chord are rounded), and at most 300 u D for a box (the rotation of a part of a compound
///     differs from an orthonormal matrix by up to 140 u).
///   - Casts: a solid touches a body within 16 u of the sum of their sizes, and their axes may
///     differ from orthonormal ones as above; see TreeTraversal.
///   - Distances: as casts; see TreeTraversal.
///   - Overlaps: all errors are proportional to D + R, where R is the largest half extent of the
///     query. The largest one is that of two boxes with nearly parallel edges: collide() may report
///     them as touching if their gap along the common normal is below 2 sqrt(epsilon) times the sum
///     of the half diagonals. Their distance is at most sqrt(3) times that gap, which gives
///     6 sqrt(epsilon) (D + R).
/// TreeTraversal has the margins.
class QueryTree {
 public:
  /// Replaces the contents by all bodies, in O(n) time. Memory is kept for the next call.
  /// @throws std::bad_alloc, OutOfMemory; the tree may then only be destroyed or built again
  void build(const BodyStore& bodies);

  /// Calls limit = visit(body) for the walls, then for each body that the ray may hit at a distance
  /// of at most the current limit [m]. The initial limit is ray.max_distance.
  /// @param ray with a direction of length 1
  template <class Visit>
  void visit_along(const Ray& ray, const Visit& visit) const {
    Real limit = ray.max_distance;
    for (const std::uint32_t wall : walls_) limit = visit(wall);
    TreeTraversal::visit_along(tree_.view(), ray.origin, ray.direction, limit, visit);
  }

  /// Calls limit = visit(body) for the walls, then for each body that a solid may touch after it
  /// has moved by at most the current limit [m].
  /// @param direction of length 1
  template <class Visit>
  void visit_swept(const Vec3& centre, const Vec3& half_extents, const Vec3& direction, Real limit,
                   const Visit& visit) const {
    for (const std::uint32_t wall : walls_) limit = visit(wall);
    TreeTraversal::visit_swept(tree_.view(), centre, half_extents, direction, limit, visit);
  }

  /// Calls limit = visit(body) for the walls, then for each body whose distance from a solid with
  /// the given bounds may be at most the current limit [m].
  /// @param limit [m], >= 0, initial limit
  template <class Visit>
  void visit_nearby(const Vec3& centre, const Vec3& half_extents, Real limit,
                    const Visit& visit) const {
    for (const std::uint32_t wall : walls_) limit = visit(wall);
    TreeTraversal::visit_nearby(tree_.view(), centre, half_extents, limit, visit);
  }

  /// Calls visit(body) for the walls, and for each body that a solid with the given bounds may
  /// touch.
  template <class Visit>
  void visit_around(const Vec3& centre, const Vec3& half_extents, const Visit& visit) const {
    for (const std::uint32_t wall : walls_) visit(wall);
    TreeTraversal::visit_around(tree_.view(), centre, half_extents, visit);
  }

 private:
  std::vector<std::uint32_t> walls_;  ///< bodies without bounds
  BlockTree tree_;                    ///< of all other bodies
  // During build(): the bodies of the tree.
  std::vector<std::uint32_t> bodies_;
  std::vector<Aabb> bounds_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
