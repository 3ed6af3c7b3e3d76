/// The sub-shapes of a body with their world poses, for queries.
#pragma once

#include "src/collide/shapes.hpp"
#include "src/world/bodies/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Calls visit(shape, pose, part) for the shape of the body, or for each part of a compound in
/// order. The pose of a half-space or a plane is the identity. The part is the number in the
/// compound, or 0.
template <class Visit>
void for_each_posed_sub_shape(const BodyStore& bodies, std::uint32_t body, const Visit& visit) {
  const Transform whole =
      make_transform(bodies.moving.orientation[body], bodies.moving.position[body]);
  detail::for_each_part(
      bodies.shape(body), [&](const auto& shape, const CompoundPart* part, std::uint32_t number) {
        if constexpr (detail::kIsWall<std::decay_t<decltype(shape)>>) {
          visit(shape, Transform{}, number);
        } else {
          visit(shape,
                part == nullptr ? whole : whole * make_transform(part->orientation, part->position),
                number);
        }
      });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
