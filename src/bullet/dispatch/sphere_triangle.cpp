/// The nearest point of a triangle: the projection of the center if it is inside the prism over the
/// triangle, and otherwise the nearest point of an edge.
#include "src/bullet/dispatch/sphere_triangle.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Whether `p` is inside the prism over a triangle along its normal.
bool is_in_prism(const btVector3& p, const btVector3* v, const btVector3& normal) {
  const btScalar r1 = (v[1] - v[0]).cross(normal).dot(p - v[0]);
  const btScalar r2 = (v[2] - v[1]).cross(normal).dot(p - v[1]);
  const btScalar r3 = (v[0] - v[2]).cross(normal).dot(p - v[2]);
  return (r1 > 0 && r2 > 0 && r3 > 0) || (r1 <= 0 && r2 <= 0 && r3 <= 0);
}

/// Squared distance of `p` and the edge from `begin` to `end`; sets the nearest point of the edge.
btScalar edge_distance2(const btVector3& p, const btVector3& begin, const btVector3& end,
                        btVector3* nearest) {
  btVector3 gap = p - begin;
  const btVector3 edge = end - begin;
  btScalar t = edge.dot(gap);
  if (t > 0) {
    const btScalar length2 = edge.dot(edge);
    if (t < length2) {
      t /= length2;
      gap -= t * edge;
    } else {
      t = 1;
      gap -= edge;
    }
  } else {
    t = 0;
  }
  *nearest = begin + t * edge;
  return gap.dot(gap);
}

}  // namespace

bool find_contact(const SphereTriangleInput& sphere, const btVector3* vertices,
                  SphereTriangleContact* contact) {
  const btVector3& center = sphere.center;
  const btScalar reach = sphere.radius + sphere.threshold;
  btVector3 normal = (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]);
  const btScalar length2 = normal.length2();
  if (!(length2 >= SIMD_EPSILON * SIMD_EPSILON)) return false;
  normal /= btSqrt(length2);
  btScalar height = (center - vertices[0]).dot(normal);
  if (height < btScalar(0)) {
    height *= btScalar(-1);
    normal *= btScalar(-1);
  }
  if (!(height < reach)) return false;
  btVector3 point;
  if (is_in_prism(center, vertices, normal)) {
    point = center - normal * height;
  } else {
    btScalar smallest = reach * reach;
    bool found = false;
    for (int i = 0; i < 3; ++i) {
      btVector3 nearest;
      const btScalar distance2 =
          edge_distance2(center, vertices[i], vertices[(i + 1) % 3], &nearest);
      if (!(distance2 < smallest)) continue;
      smallest = distance2;
      point = nearest;
      found = true;
    }
    if (!found) return false;
  }
  const btVector3 gap = center - point;
  const btScalar distance2 = gap.length2();
  if (!(distance2 < reach * reach)) return false;
  contact->point_on_triangle = point;
  if (distance2 > SIMD_EPSILON) {
    contact->normal_on_triangle = gap;
    contact->normal_on_triangle.normalize();
    contact->distance = -(sphere.radius - btSqrt(distance2));
  } else {
    contact->normal_on_triangle = normal;
    contact->distance = -sphere.radius;
  }
  return true;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
