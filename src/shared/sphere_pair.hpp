/// The one definition of sphere-sphere contact arithmetic, for g++, clang and nvcc alike.
#pragma once

#include <jfpx/contact.hpp>

namespace jfpx::inline JFPX_ABI::shared {

/// Tests two spheres in Bullet's order of operations (btSphereSphereCollisionAlgorithm): each
/// operation is one IEEE rounding, the normal is scaled by a reciprocal, and the rejection is
/// negated so that a NaN makes a contact. Coincident centres have the normal (1,0,0) (E7).
JFPX_HD inline PairResult test_sphere_pair(const SphereInstance& a, const SphereInstance& b) {
  const Vec3 d = a.centre - b.centre;
  const Real len = square_root((d.x * d.x + d.y * d.y) + d.z * d.z);
  const Real sum = a.radius + b.radius;
  PairResult r;
  if (len > sum) return r;
  r.touching = 1;
  r.distance = len - sum;
  r.normal = {1, 0, 0};
  if (len > kEpsilon) {
    const Real k = Real(1) / len;
    r.normal = d * k;
  }
  return r;
}

}  // namespace jfpx::inline JFPX_ABI::shared
