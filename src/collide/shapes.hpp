/// All shapes, and the test of any two solids.
#pragma once

#include "src/collide/shapes/box.hpp"
#include "src/collide/shapes/capsule.hpp"
#include "src/collide/shapes/plane.hpp"
#include "src/collide/shapes/sphere.hpp"
#include "src/collide/shapes/triangle_mesh.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Compound> = "compound";

/// A solid in the form that find_contact() accepts: a sphere is a SphereInstance.
template <class S>
JFPX_HD inline Posed<S> instance(const S& solid, const Transform& pose) {
  return {solid, pose};
}
JFPX_HD inline SphereInstance instance(const Sphere& sphere, const Transform& pose) {
  return {pose.origin, sphere.radius};
}

/// [m], the point that decides on which side of a triangle a solid is.
template <class S>
JFPX_HD inline const Vec3& centre_of(const Posed<S>& solid) {
  return solid.pose.origin;
}
JFPX_HD inline const Vec3& centre_of(const SphereInstance& sphere) { return sphere.centre; }

/// The contact of two solids. Each pair of kinds has one test, for one order of the kinds, in the
/// header of a solid. A missing test is a compile error.
/// @param manifold empty; receives the contact
template <class A, class B>
JFPX_HD void find_contact_of_any(const A& a, const B& b, const PairMotion& pair,
                                 PairManifold* manifold) {
  if constexpr (requires { find_contact(a, b, pair, manifold); }) {
    find_contact(a, b, pair, manifold);
  } else {
    find_contact(b, a, pair.flipped(), manifold);
    manifold->flip();
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
