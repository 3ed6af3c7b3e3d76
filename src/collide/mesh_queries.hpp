/// Rays and overlaps with triangle meshes.
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
    const MeshTriangle& triangle = mesh.triangles[index];
    if (mesh.two_sided == 0 && !(dot(triangle.normal, direction_) < 0)) return -1;
    Vec3 x, y, z;
    for (int k = 0; k < 3; ++k) {
      const Vec3 corner = mesh.vertices[triangle.vertices[k]] - origin_;
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
    distance /= area;
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

/// The first hit of a ray up to a distance. A one-sided triangle is hit from its front only. The
/// normal points to the side from which the ray comes. Of triangles at the same distance, the one
/// with the lowest number is hit.
inline RayEntry enter(const Vec3& origin, const Vec3& direction, const TriangleMesh& mesh,
                      const Transform& pose, Real max_distance) {
  const MeshView view = view_of(mesh);
  const Vec3 from = inverse_transform_point(pose, origin);
  const Vec3 along = inverse_transform_direction(pose, direction);
  const MeshRay ray(from, along);
  RayEntry first;
  std::uint32_t triangle = 0;
  TreeTraversal::visit_along(view.tree, from, along, max_distance, [&](std::uint32_t index) {
    const Real distance = ray.hit(view, index);
    const bool is_hit = distance >= 0 && distance <= max_distance;
    if (is_hit && (!first.hit || distance < first.distance ||
                   (distance == first.distance && index < triangle))) {
      first.hit = true;
      first.distance = distance;
      triangle = index;
    }
    return first.hit ? first.distance : max_distance;
  });
  if (!first.hit) return first;
  const Vec3 normal = view.triangles[triangle].normal;
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
  TreeTraversal::visit_around(mesh.tree, inverse_transform_point(pose, centre), half, visit);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
