/// Sphere-sphere contact arithmetic, defined once for g++, clang and nvcc.
#pragma once

#include <jfpx/contact.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The contact of two spheres with the difference of centres d = a - b, its length len, and the sum
/// of radii. Coincident centres have the normal (1,0,0) (erratum E7).
JFPX_HD inline PairResult sphere_pair_contact(const Vec3& d, Real len, Real sum) {
  PairResult r;
  r.touching = 1;
  r.distance = len - sum;
  r.normal = {1, 0, 0};
  if (len > kEpsilon) {
    const Real k = Real(1) / len;
    r.normal = d * k;
  }
  return r;
}

/// Tests two spheres with the order of operations of Bullet's btSphereSphereCollisionAlgorithm:
/// each operation is one IEEE rounding, the normal is scaled by a reciprocal, and a NaN fails the
/// rejection test and therefore yields a contact.
JFPX_HD inline PairResult test_sphere_pair(const SphereInstance& a, const SphereInstance& b) {
  const Vec3 d = a.centre - b.centre;
  const Real len = square_root((d.x * d.x + d.y * d.y) + d.z * d.z);
  const Real sum = a.radius + b.radius;
  if (len > sum) return {};
  return sphere_pair_contact(d, len, sum);
}

/// Branch-free version for lists that mix touching and separated pairs, where a branch would be
/// unpredictable. Always writes *contact. Returns true if the spheres touch.
JFPX_HD inline bool find_sphere_contact(const SphereInstance& a, const SphereInstance& b,
                                        PairContact* contact) {
  const Vec3 d = a.centre - b.centre;
  const Real len = square_root((d.x * d.x + d.y * d.y) + d.z * d.z);
  const Real sum = a.radius + b.radius;
  const PairResult r = sphere_pair_contact(d, len, sum);
  contact->normal = r.normal;
  contact->distance = r.distance;
  return !(len > sum);
}

/// Version with a margin: spheres up to `threshold` apart are in contact.
JFPX_HD inline PairResult test_sphere_pair(const SphereInstance& a, const SphereInstance& b,
                                           Real threshold) {
  const Vec3 d = a.centre - b.centre;
  const Real len = square_root((d.x * d.x + d.y * d.y) + d.z * d.z);
  const Real sum = a.radius + b.radius;
  if (len > sum + threshold) return {};
  return sphere_pair_contact(d, len, sum);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
