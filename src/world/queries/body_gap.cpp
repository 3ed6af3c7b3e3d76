/// Distances of a solid from the sub-shapes of bodies.
#include "src/world/queries/body_gap.hpp"

#include "src/world/bodies/posed_sub_shapes.hpp"
#include "src/world/bodies/sub_shape_view.hpp"
#include "src/world/queries/query_arguments.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using detail::ClosestPair;
using detail::PlacedSolid;

ClosestPair find_gap(const HalfSpace& half_space, const Transform&, const PlacedSolid& solid,
                     Real limit) {
  return detail::find_closest(half_space, solid, limit);
}
ClosestPair find_gap(const Plane& plane, const Transform&, const PlacedSolid& solid, Real limit) {
  const Vec3 centre = transform_point(solid.pose, solid.core.centre);
  return detail::find_closest(to_wall(plane).solid_for(centre), solid, limit);
}
Vec3 half_extents_in(const SolidShape& shape, const Transform& pose) {
  return std::visit([&](const auto& s) { return detail::half_extents(s, pose); }, shape);
}
/// The distance of a mesh that the solid overlaps is that of the deepest contact.
ClosestPair find_gap(const detail::Mesh auto& mesh, const Transform& at, const PlacedSolid& solid,
                     Real limit) {
  const Transform in_mesh{transposed(at.basis) * solid.pose.basis, {}};
  ClosestPair pair = detail::find_closest(detail::view_of(mesh), at, solid,
                                          half_extents_in(solid.shape, in_mesh), limit);
  if (!pair.found || pair.distance > 0) return pair;
  const DeepestContact deepest = QuerySolid(solid.shape, solid.pose).deepest_contact(mesh, at);
  if (deepest.touches) {
    pair.distance = deepest.distance;
    pair.normal = deepest.normal;
    pair.part = deepest.part;
    pair.point = add_scaled(deepest.point, deepest.normal, deepest.distance * Real(-0.5));
  }
  return pair;
}
template <class S>
ClosestPair find_gap(const S& target, const Transform& at, const PlacedSolid& solid, Real limit) {
  return detail::find_closest(PlacedSolid(target, at), solid, limit);
}

}  // namespace

BodyGap::BodyGap(const DistanceQuery& query)
    : solid_(query.shape, checked_pose(query)),
      half_extents_(half_extents_in(solid_.shape, solid_.pose)) {}

std::optional<BodyDistance> BodyGap::to(const BodyStore& bodies, std::uint32_t body,
                                        Real limit) const {
  ClosestPair closest;
  for_each_posed_sub_shape(
      bodies, body, [&](const auto& sub_shape, const Transform& at, std::uint32_t part) {
        const ClosestPair pair = find_gap(sub_shape, at, solid_, limit);
        if (!pair.found || (closest.found && !(pair.distance < closest.distance))) return;
        closest = pair;
        closest.part += part;  // one of both is 0
        limit = std::max(pair.distance, Real(0));
      });
  if (!closest.found) return std::nullopt;
  const Vec3 query_point = add_scaled(closest.point, closest.normal, closest.distance);
  return BodyDistance{bodies.id(body), closest.distance, closest.point,
                      query_point,     closest.normal,   closest.part};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
