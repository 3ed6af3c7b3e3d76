/// A triangle of a mesh as partner of a solid, and which normals a contact with it may have.
///
/// A solid that slides over a flat or concave edge must not collide with the edge, which is inside
/// the surface. A contact may therefore only have a proximal normal of the surface (Clarke,
/// Ledyaev, Stern and Wolenski 1998): a direction from the supporting feature of the triangle (its
/// face, an edge or a vertex) that forms no acute angle with any direction into the surface at that
/// feature. These are the normals of the face; at a convex edge, the normals between those of both
/// faces; at a convex vertex, the polar cone of its edges; at a flat or concave feature, none but
/// the normals of faces. The rule looks at the neighbors of one triangle only. Contacts do not
/// depend on an order of the triangles, or on other contacts.
#pragma once

#include "src/collide/mesh_view.hpp"
#include "src/collide/pair_manifold.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Features of a triangle: edge i is kEdge + i, vertex i is kVertex + i.
inline constexpr int kFace = 0, kEdge = 1, kVertex = 4;

JFPX_HD constexpr int next_corner(int i) { return i == 2 ? 0 : i + 1; }

/// A triangle relative to a solid.
struct TriangleInstance {
  const MeshView* mesh = nullptr;
  std::uint32_t triangle = 0;
  Mat3 basis;      ///< axes of the mesh
  Vec3 corner[3];  ///< [m], world axes, from the centre of the solid at the start of the step
  Vec3 normal;     ///< unit, world axes, of the side on which the solid is

  /// Calls visit(n) with the unit normals, in world axes, of the neighbors at convex edges.
  template <class Visit>
  JFPX_HD void visit_convex_neighbors(const Visit& visit) const {
    const Vec3 local = transform_transpose(basis, normal);
    const std::uint32_t flat_edges = mesh->flat_edges(triangle);
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t opposite = mesh->opposite(triangle, k);
      if (opposite == kNoVertex || (flat_edges >> k & 1) != 0) continue;
      const Vec3 start = position(k), across = mesh->position(opposite) - start;
      if (!(dot(local, across) < 0)) continue;
      const Vec3 along = position(next_corner(k)) - start;
      const Vec3 own = position(next_corner(next_corner(k))) - start;
      const Vec3 n = normalized(cross(across, along));
      visit(basis * (dot(local, cross(along, own)) < 0 ? -n : n));
    }
  }

  /// Whether `n` is a proximal normal at a feature of the triangle, with respect to its neighbors.
  /// @param n unit, world axes
  JFPX_HD bool is_proximal(int feature, const Vec3& n) const {
    if (feature == kFace) return true;
    const Vec3 local = transform_transpose(basis, n);
    if (feature >= kVertex) {
      const std::uint32_t vertex = mesh->vertex(triangle, feature - kVertex);
      const Vec3 at = mesh->position(vertex);
      return mesh->all_neighbors(vertex, [&](std::uint32_t neighbor) {
        return points_away(local, mesh->position(neighbor) - at);
      });
    }
    const int edge = feature - kEdge;
    const std::uint32_t opposite = mesh->opposite(triangle, edge);
    if (opposite == kNoVertex) return true;
    const Vec3 start = position(edge), along = position(next_corner(edge)) - start;
    const Vec3 across = mesh->position(opposite) - start;
    return points_away(local,
                       add_scaled(across, along, -(dot(across, along) / length_squared(along))));
  }

 private:
  /// Whether a unit vector forms no acute angle with a direction into the surface. At a seam in a
  /// plane, rounding must not exclude the normals of both triangles.
  JFPX_HD static bool points_away(const Vec3& n, const Vec3& into) {
    constexpr Real kSine = Real(1e-3);
    const Real along = dot(n, into);
    return !(along > 0) || along * along <= kSine * kSine * length_squared(into);
  }
  /// [m], of a corner in the axes of the mesh
  JFPX_HD Vec3 position(int k) const { return mesh->position(mesh->vertex(triangle, k)); }
};

/// @param centre [m], of the solid
/// @returns false if the triangle has no contact with the solid, because it is one-sided and the
///   centre is behind it
JFPX_HD inline bool make_instance(const MeshView& mesh, std::uint32_t triangle,
                                  const Transform& pose, const Vec3& centre,
                                  TriangleInstance* result) {
  result->mesh = &mesh;
  result->triangle = triangle;
  result->basis = pose.basis;
  const Vec3 offset = pose.origin - centre;
  Vec3 corner[3];
  mesh.get_corners(triangle, corner);
  for (int k = 0; k < 3; ++k) result->corner[k] = pose.basis * corner[k] + offset;
  result->normal = pose.basis * mesh.normal(triangle, corner);
  if (dot(result->normal, result->corner[0]) > 0) {
    if (mesh.two_sided == 0) return false;
    result->normal = -result->normal;
  }
  return true;
}

/// The point of a triangle that is closest to a point (Ericson 2005, 5.1.5).
struct ClosestOnTriangle {
  Vec3 offset;  ///< [m], from the closest point to the point
  int feature = kFace;
};
JFPX_HD inline ClosestOnTriangle closest_on(const TriangleInstance& triangle, const Vec3& p) {
  const Vec3 &a = triangle.corner[0], &b = triangle.corner[1], &c = triangle.corner[2];
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const Real ab_ap = dot(ab, ap), ac_ap = dot(ac, ap);
  if (ab_ap <= 0 && ac_ap <= 0) return {ap, kVertex};
  const Vec3 bp = p - b;
  const Real ab_bp = dot(ab, bp), ac_bp = dot(ac, bp);
  if (ab_bp >= 0 && ac_bp <= ab_bp) return {bp, kVertex + 1};
  const Real of_c = ab_ap * ac_bp - ab_bp * ac_ap;
  if (of_c <= 0 && ab_ap >= 0 && ab_bp <= 0) {
    return {add_scaled(ap, ab, -(ab_ap / (ab_ap - ab_bp))), kEdge};
  }
  const Vec3 cp = p - c;
  const Real ab_cp = dot(ab, cp), ac_cp = dot(ac, cp);
  if (ac_cp >= 0 && ab_cp <= ac_cp) return {cp, kVertex + 2};
  const Real of_b = ab_cp * ac_ap - ab_ap * ac_cp;
  if (of_b <= 0 && ac_ap >= 0 && ac_cp <= 0) {
    return {add_scaled(ap, ac, -(ac_ap / (ac_ap - ac_cp))), kEdge + 2};
  }
  const Real of_a = ab_bp * ac_cp - ab_cp * ac_bp;
  const Real along = ac_bp - ab_bp, back = ab_cp - ac_cp;
  if (of_a <= 0 && along >= 0 && back >= 0) {
    return {add_scaled(bp, c - b, -(along / (along + back))), kEdge + 1};
  }
  return {triangle.normal * dot(triangle.normal, ap), kFace};
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
