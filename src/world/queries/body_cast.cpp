/// Casts of a solid to the sub-shapes of bodies.
#include "src/world/queries/body_cast.hpp"

#include "src/scene/scene_validate.hpp"
#include "src/world/bodies/posed_sub_shapes.hpp"
#include "src/world/bodies/sub_shape_view.hpp"
#include "src/world/queries/query_arguments.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

detail::CastEntry cast_to(const HalfSpace& half_space, const Transform&, const QuerySolid& solid,
                          const detail::ConvexCore& core, const detail::LinearMotion& motion) {
  return detail::cast(half_space, core, solid.pose, motion);
}
detail::CastEntry cast_to(const Plane& plane, const Transform&, const QuerySolid& solid,
                          const detail::ConvexCore& core, const detail::LinearMotion& motion) {
  const Vec3 centre = transform_point(solid.pose, core.centre);
  return detail::cast(to_wall(plane).solid_for(centre), core, solid.pose, motion);
}
detail::CastEntry cast_to(const detail::Mesh auto& mesh, const Transform& at,
                          const QuerySolid& solid, const detail::ConvexCore& core,
                          const detail::LinearMotion& motion) {
  const Transform in_mesh{transposed(at.basis) * solid.pose.basis, {}};
  const Vec3 half =
      std::visit([&](const auto& s) { return detail::half_extents(s, in_mesh); }, solid.shape);
  return detail::cast(detail::view_of(mesh), at, core, solid.pose, half, motion);
}
template <class S>
detail::CastEntry cast_to(const S& target, const Transform& at, const QuerySolid& solid,
                          const detail::ConvexCore& core, const detail::LinearMotion& motion) {
  const detail::LinearMotion local{inverse_transform_direction(at, motion.direction), motion.length,
                                   motion.limit};
  detail::CastEntry entry =
      detail::cast(detail::make_core(target), core, transposed(at.basis) * solid.pose.basis,
                   inverse_transform_point(at, solid.pose.origin), local);
  entry.point = transform_point(at, entry.point);
  entry.normal = normalized(at.basis * entry.normal);
  return entry;
}

}  // namespace

BodyCast::BodyCast(const ShapeCast& cast)
    : solid_(cast.shape, checked_pose(cast.shape, cast.position, cast.orientation)) {
  const Vec3 end = cast.position + cast.translation;
  for (int i = 0; i < 3; ++i) {
    if (absolute(end[i]) <= kMaxCoordinate) continue;
    throw_invalid_query("translation", to_text(cast.translation),
                        "such that the end is between -1e9 and 1e9");
  }
  core_ = std::visit([](const auto& s) { return detail::make_core(s); }, solid_.shape);
  if (cast.translation == Vec3{}) return;
  const ScaledLength translation(cast.translation);
  motion_ = {translation.unit, translation.length, 1};
}

std::optional<ShapeHit> BodyCast::hit_of(const BodyStore& bodies, std::uint32_t body,
                                         Real limit) const {
  const DeepestContact deepest = solid_.deepest_contact(bodies, body);
  if (deepest.touches) {
    // The points of contacts of tiny cylinders and cones are not always numbers.
    const Vec3 point = is_finite(deepest.point) ? deepest.point : solid_.pose.origin;
    return ShapeHit{bodies.id(body), 0, point, deepest.normal, deepest.distance, deepest.part};
  }
  if (!(motion_.length > 0)) return std::nullopt;
  detail::LinearMotion motion = motion_;
  motion.limit = limit;
  detail::CastEntry first;
  for_each_posed_sub_shape(
      bodies, body, [&](const auto& sub_shape, const Transform& at, std::uint32_t part) {
        const detail::CastEntry entry = cast_to(sub_shape, at, solid_, core_, motion);
        if (!entry.hit || (first.hit && !(entry.fraction < first.fraction))) return;
        first = entry;
        first.part += part;  // one of both is 0
        motion.limit = entry.fraction;
      });
  if (!first.hit) return std::nullopt;
  return ShapeHit{bodies.id(body), first.fraction, first.point, first.normal, 0, first.part};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
