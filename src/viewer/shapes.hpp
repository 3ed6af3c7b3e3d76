/// Solids and extents of bodies, and intersections of rays with them.
#pragma once

#include <jfpx/scene.hpp>

#include "src/collide/shapes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Distance along the unit direction of a ray at which it enters a shape. kMaxReal if the ray
/// misses the shape or the shape lies behind its origin. Planes are never hit, because they do not
/// move.
Real ray_distance(const Shape& shape, const BodyState& state, const Vec3& from,
                  const Vec3& direction);

/// Radius of a ball around the body's position that contains the shape [m]; 0 for planes.
Real size_of(const Shape& shape);
/// A point near which the shape is, in body axes: the centre of the bounds of a mesh, and the
/// origin for other shapes.
Vec3 middle_of(const Shape& shape);
/// Radius of a ball around middle_of() that contains the shape [m]; 0 for planes.
Real reach_of(const Shape& shape);
/// Bounds in world coordinates of a placed mesh that has a surface.
Aabb bounds_of(const TriangleMesh& mesh, const BodyDef& body);
/// The state of a part of a compound body, at rest.
BodyState placed(const CompoundPart& part, const BodyState& body);
/// Calls visit(solid, state) for the solids of a body: its shape, or the parts of a compound.
/// Planes and meshes have no solids.
template <class Visit>
void for_each_solid(const Shape& shape, const BodyState& state, const Visit& visit) {
  jfpx::detail::for_each_part(
      shape, [&](const auto& solid, const CompoundPart* part, std::uint32_t) {
        if constexpr (jfpx::detail::kIsSolid<std::decay_t<decltype(solid)>>) {
          visit(solid, part != nullptr ? placed(*part, state) : state);
        }
      });
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
