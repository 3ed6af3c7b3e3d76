/// Rays, casts, distances and overlaps: exact tests of the bodies that a bounding-volume tree
/// selects.
#include <jfpx/error.hpp>

#include "src/collide/mesh_queries.hpp"
#include "src/scene/scene_validate.hpp"
#include "src/world/bodies/posed_sub_shapes.hpp"
#include "src/world/queries/body_cast.hpp"
#include "src/world/queries/body_gap.hpp"
#include "src/world/queries/query_arguments.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

void require_position(const char* name, const Vec3& position) {
  for (int i = 0; i < 3; ++i) {
    if (!(absolute(position[i]) <= kMaxCoordinate))
      throw_invalid_query(name, to_text(position), "between -1e9 and 1e9");
  }
}

Vec3 unit_direction(const Vec3& v) {
  if (!is_finite(v) || v == Vec3{}) {
    throw_invalid_query("ray direction", to_text(v), "finite and not zero");
  }
  return ScaledLength(v).unit;
}

/// A valid ray with a direction of length 1.
Ray checked(const Ray& ray) {
  require_position("ray origin", ray.origin);
  if (!(ray.max_distance >= 0)) {
    throw_invalid_query("ray max_distance", to_text(ray.max_distance), ">= 0; infinity is allowed");
  }
  return {ray.origin, unit_direction(ray.direction), ray.max_distance};
}

/// A solid or a mesh has a pose; a wall has none.
template <class S>
detail::RayEntry enter(const Ray& ray, const S& shape, const Transform& pose) {
  if constexpr (detail::kIsMesh<S>) {
    return detail::enter(ray.origin, ray.direction, shape, pose, ray.max_distance);
  } else if constexpr (detail::kIsSolid<S>) {
    return detail::enter(ray.origin, ray.direction, shape, pose);
  } else {
    return detail::enter(ray.origin, ray.direction, shape);
  }
}

/// The first entry of a ray into a body. Among parts at the same distance, the first part is hit.
detail::RayEntry enter(const Ray& ray, const BodyStore& bodies, std::uint32_t body) {
  detail::RayEntry first;
  for_each_posed_sub_shape(bodies, body,
                           [&](const auto& shape, const Transform& pose, std::uint32_t part) {
                             const detail::RayEntry entry = enter(ray, shape, pose);
                             if (!entry.hit || (first.hit && !(entry.distance < first.distance)))
                               return;
                             first = entry;
                             first.part += part;  // one of both is 0
                           });
  return first;
}

/// The hit of a body within the ray's length.
std::optional<RayHit> hit_of(const Ray& ray, const BodyStore& bodies, std::uint32_t body) {
  const detail::RayEntry entry = enter(ray, bodies, body);
  if (!entry.hit || entry.distance > ray.max_distance) return std::nullopt;
  const Vec3 point = add_scaled(ray.origin, ray.direction, entry.distance);
  // A ray nearly parallel to a wall may intersect it at a distance beyond the range of Real.
  if (!is_finite(point)) return std::nullopt;
  return RayHit{bodies.id(body), entry.distance, point, entry.normal, entry.part};
}

/// Order of the hits of a ray. No two hits are equal.
bool before(const RayHit& a, const RayHit& b) {
  return std::tuple(a.distance, a.body.index) < std::tuple(b.distance, b.body.index);
}

bool accepts(const BodyFilter& filter, BodyId body) { return !filter || filter(body); }

/// Order of the hits of a cast. No two hits are equal.
bool before(const ShapeHit& a, const ShapeHit& b) {
  return std::tuple(a.fraction, a.body.index) < std::tuple(b.fraction, b.body.index);
}

/// Order of the bodies of a distance query. No two are equal.
bool before(const BodyDistance& a, const BodyDistance& b) {
  return std::tuple(a.distance, a.body.index) < std::tuple(b.distance, b.body.index);
}

}  // namespace

std::optional<RayHit> World::cast_ray(const Ray& given, const BodyFilter& filter) const {
  const Ray ray = checked(given);
  const BodyStore& bodies = impl_->bodies_with_states();
  std::optional<RayHit> closest;
  impl_->tree_of(bodies).visit_along(ray, [&](std::uint32_t body) {
    const std::optional<RayHit> hit = hit_of(ray, bodies, body);
    if (hit && (!closest || before(*hit, *closest)) && accepts(filter, hit->body)) closest = hit;
    return closest ? closest->distance : ray.max_distance;
  });
  return closest;
}

std::vector<RayHit> World::cast_ray_through(const Ray& given, const BodyFilter& filter) const {
  const Ray ray = checked(given);
  const BodyStore& bodies = impl_->bodies_with_states();
  std::vector<RayHit> hits;
  impl_->tree_of(bodies).visit_along(ray, [&](std::uint32_t body) {
    const std::optional<RayHit> hit = hit_of(ray, bodies, body);
    if (hit && accepts(filter, hit->body)) hits.push_back(*hit);
    return ray.max_distance;
  });
  std::ranges::sort(hits, [](const RayHit& a, const RayHit& b) { return before(a, b); });
  return hits;
}

std::optional<ShapeHit> World::cast_shape(const ShapeCast& given, const BodyFilter& filter) const {
  const BodyCast cast(given);
  const BodyStore& bodies = impl_->bodies_with_states();
  std::optional<ShapeHit> first;
  cast.visit_candidates(impl_->tree_of(bodies), [&](std::uint32_t body) {
    const Real limit = first ? first->fraction : Real(1);
    const std::optional<ShapeHit> hit = cast.hit_of(bodies, body, limit);
    if (hit && (!first || before(*hit, *first)) && accepts(filter, hit->body)) first = hit;
    return first ? first->fraction : Real(1);
  });
  return first;
}

std::vector<ShapeHit> World::cast_shape_through(const ShapeCast& given,
                                                const BodyFilter& filter) const {
  const BodyCast cast(given);
  const BodyStore& bodies = impl_->bodies_with_states();
  std::vector<ShapeHit> hits;
  cast.visit_candidates(impl_->tree_of(bodies), [&](std::uint32_t body) {
    const std::optional<ShapeHit> hit = cast.hit_of(bodies, body, 1);
    if (hit && accepts(filter, hit->body)) hits.push_back(*hit);
    return Real(1);
  });
  std::ranges::sort(hits, [](const ShapeHit& a, const ShapeHit& b) { return before(a, b); });
  return hits;
}

std::optional<BodyDistance> World::closest_body(const DistanceQuery& query,
                                                const BodyFilter& filter) const {
  const BodyGap gap(query);
  const BodyStore& bodies = impl_->bodies_with_states();
  std::optional<BodyDistance> closest;
  const auto limit = [&] {
    if (!closest) return query.max_distance;
    return std::max(closest->distance, Real(0));  // the depth of an overlap is no bound of a tree
  };
  gap.visit_candidates(impl_->tree_of(bodies), query.max_distance, [&](std::uint32_t body) {
    const std::optional<BodyDistance> found = gap.to(bodies, body, limit());
    if (found && (!closest || before(*found, *closest)) && accepts(filter, found->body)) {
      closest = found;
    }
    return limit();
  });
  return closest;
}

std::vector<BodyDistance> World::bodies_within(const DistanceQuery& query,
                                               const BodyFilter& filter) const {
  const BodyGap gap(query);
  const BodyStore& bodies = impl_->bodies_with_states();
  std::vector<BodyDistance> found;
  gap.visit_candidates(impl_->tree_of(bodies), query.max_distance, [&](std::uint32_t body) {
    const std::optional<BodyDistance> one = gap.to(bodies, body, query.max_distance);
    if (one && accepts(filter, one->body)) found.push_back(*one);
    return query.max_distance;
  });
  std::ranges::sort(found, [](const auto& a, const auto& b) { return before(a, b); });
  return found;
}

std::vector<BodyId> World::overlapping(const SolidShape& shape, const Vec3& position,
                                       const Quat& orientation, const BodyFilter& filter) const {
  const QuerySolid solid(shape, checked_pose(shape, position, orientation));
  const BodyStore& bodies = impl_->bodies_with_states();
  std::vector<BodyId> found;
  impl_->tree_of(bodies).visit_around(position, solid.half_extents, [&](std::uint32_t body) {
    const BodyId id = bodies.id(body);
    if (solid.touches(bodies, body) && accepts(filter, id)) found.push_back(id);
  });
  std::ranges::sort(found, {}, &BodyId::index);
  return found;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
