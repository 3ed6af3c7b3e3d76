/// All shapes, and the test of any two solids.
#pragma once

#include "src/collide/shapes/box.hpp"
#include "src/collide/shapes/capsule.hpp"
#include "src/collide/shapes/cone.hpp"
#include "src/collide/shapes/cylinder.hpp"
#include "src/collide/shapes/hull.hpp"
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

/// [kg m^2], inertia tensor of a solid about its centre of mass, in its axes. The centre is the
/// origin, except for a hull.
template <class S>
Mat3 central_inertia(const S& solid, Real mass) {
  return diagonal(moments_of_inertia(solid, mass));
}
inline Mat3 central_inertia(const Hull& hull, Real mass) { return hull.central_inertia(mass); }

/// [m], the point that decides on which side of a triangle a solid is.
template <class S>
JFPX_HD inline Vec3 centre_of(const Posed<S>& solid) {
  return solid.pose.origin;
}
JFPX_HD inline Vec3 centre_of(const Posed<HullReference>& solid) {
  return transform_point(solid.pose, solid.shape.hull->centre);
}
JFPX_HD inline Vec3 centre_of(const SphereInstance& sphere) { return sphere.centre; }

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
