/// Construction of the tree of the queries: bounds of bodies.
#include "src/world/queries/query_tree.hpp"

#include "src/world/bodies/posed_sub_shapes.hpp"

#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Rounded outwards: the extents have an error of at most 4 u of themselves, and the bounds one of
/// u times the coordinate, where u is half of kEpsilon.
Aabb bounds_around(const Vec3& centre, const Vec3& extents) {
  Aabb bounds;
  for (int i = 0; i < 3; ++i) {
    const Real reach = extents[i] + 4 * kEpsilon * (absolute(centre[i]) + extents[i]);
    bounds.lower[i] = centre[i] - reach;
    bounds.upper[i] = centre[i] + reach;
  }
  return bounds;
}

/// The bounds of a body; empty for a wall.
Aabb bounds_of(const BodyStore& bodies, std::uint32_t body) {
  Aabb bounds = TreeBlock::kEmpty;
  for_each_posed_sub_shape(
      bodies, body, [&](const auto& shape, const Transform& pose, std::uint32_t) {
        using S = std::decay_t<decltype(shape)>;
        if constexpr (!detail::kIsWall<S>) {
          bounds = merged(bounds, bounds_around(pose.origin, detail::half_extents(shape, pose)));
        }
      });
  return bounds;
}

}  // namespace

void QueryTree::build(const BodyStore& bodies) {
  walls_.clear();
  bodies_.clear();
  bounds_.clear();
  for (const BodyId id : bodies.ids()) {
    const Aabb bounds = bounds_of(bodies, id.index);
    if (bounds == TreeBlock::kEmpty) {
      walls_.push_back(id.index);
    } else {
      bodies_.push_back(id.index);
      bounds_.push_back(bounds);
    }
  }
  tree_.build(bounds_, bodies_);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
