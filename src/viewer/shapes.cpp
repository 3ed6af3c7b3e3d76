/// Extents of shapes, and intersections of rays with them.
#include "src/viewer/shapes.hpp"

#include "src/scene/compound.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

Real ray_distance(const Shape& shape, const BodyState& state, const Vec3& from,
                  const Vec3& direction) {
  Real nearest = kMaxReal;
  for_each_solid(shape, state, [&](const auto& solid, const BodyState& at) {
    const jfpx::detail::RayEntry entry = jfpx::detail::enter(from, direction, solid, pose(at));
    if (entry.hit) nearest = std::min(nearest, entry.distance);
  });
  return nearest;
}

Real size_of(const Shape& shape) { return outer_radius(shape); }

BodyState placed(const CompoundPart& part, const BodyState& body) {
  return {to_world_point(body, part.position), body.orientation * part.orientation, {}, {}};
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
