/// Orthonormal axes of a contact.
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Right-handed orthonormal axes of a contact; the first is the normal.
struct ContactBasis {
  Vec3 normal, tangent, bitangent;
};

/// Requires a unit vector. The tangent is perpendicular to the x or y axis, whichever has the
/// smaller |n.x| or |n.y|, so its length before normalization is at least 0.7 (erratum E4).
JFPX_HD inline ContactBasis contact_basis(const Vec3& normal) {
  Vec3 tangent;
  if (absolute(normal.x) > absolute(normal.y)) {
    const Real k = Real(1) / square_root(normal.z * normal.z + normal.x * normal.x);
    tangent = {normal.z * k, 0, -normal.x * k};
  } else {
    const Real k = Real(1) / square_root(normal.z * normal.z + normal.y * normal.y);
    tangent = {0, -normal.z * k, normal.y * k};
  }
  return {normal, tangent, cross(normal, tangent)};
}

JFPX_HD constexpr Vec3 to_contact(const ContactBasis& basis, const Vec3& v) {
  return {dot(basis.normal, v), dot(basis.tangent, v), dot(basis.bitangent, v)};
}
JFPX_HD constexpr Vec3 to_world(const ContactBasis& basis, const Vec3& v) {
  return basis.normal * v.x + basis.tangent * v.y + basis.bitangent * v.z;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
