/// The sub-shapes of a body with their poses in the world, as the queries test them.
#pragma once

#include "src/world/body_store.hpp"

#include <type_traits>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {

/// Calls visit(shape, pose) for the shape of the body, or for each part of a compound in order. The
/// pose of a half-space or a plane is the identity.
template <class Visit>
void for_each_posed_sub_shape(const BodyStore& bodies, std::uint32_t body, const Visit& visit) {
  const auto pose = [&] {
    return make_transform(bodies.moving.orientation[body], bodies.moving.position[body]);
  };
  const auto visit_parts = [&](const auto& shape) {
    using S = std::decay_t<decltype(shape)>;
    if constexpr (std::is_same_v<S, Compound>) {
      const Transform whole = pose();
      for (const CompoundPart& part : shape.parts) {
        const Transform local = make_transform(part.orientation, part.position);
        std::visit([&](const auto& s) { visit(s, whole * local); }, part.shape);
      }
    } else if constexpr (std::is_same_v<S, Sphere> || std::is_same_v<S, Box>) {
      visit(shape, pose());
    } else {
      visit(shape, Transform{});
    }
  };
  std::visit(visit_parts, bodies.shape(body));
}

/// Half extents of the bounds of a sub-shape along the axes of the world, with an error of at most
/// two epsilon of themselves.
inline Vec3 half_extents(const Sphere& sphere, const Transform&) {
  return {sphere.radius, sphere.radius, sphere.radius};
}
inline Vec3 half_extents(const Box& box, const Transform& pose) {
  const auto along = [&box](const Vec3& row) {
    return dot(box.half_extents, {absolute(row.x), absolute(row.y), absolute(row.z)});
  };
  return {along(pose.basis.row[0]), along(pose.basis.row[1]), along(pose.basis.row[2])};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
