/// Ray and overlap queries: exact tests of the bodies that a bounding-volume tree selects.
#include <jfpx/error.hpp>

#include "src/collide/mesh_queries.hpp"
#include "src/scene/scene_validate.hpp"
#include "src/world/bodies/posed_sub_shapes.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

[[noreturn]] void throw_invalid(const char* name, const std::string& value, const char* range) {
  throw InvalidArgument(std::string(name) + " is " + value + "; it must be " + range);
}

void require_position(const char* name, const Vec3& position) {
  for (int i = 0; i < 3; ++i) {
    if (!(absolute(position[i]) <= kMaxCoordinate))
      throw_invalid(name, to_text(position), "between -1e9 and 1e9");
  }
}

/// Scales by a power of two before normalization, because the square of the length may overflow or
/// underflow.
Vec3 unit_direction(const Vec3& v) {
  const Real most = std::max({absolute(v.x), absolute(v.y), absolute(v.z)});
  if (!is_finite(v) || !(most > 0))
    throw_invalid("ray direction", to_text(v), "finite and not zero");
  int exponent = 0;
  std::frexp(most, &exponent);
  const auto scaled = [exponent](Real x) { return std::ldexp(x, -exponent); };
  return normalized(Vec3{scaled(v.x), scaled(v.y), scaled(v.z)});
}

/// A valid ray with a direction of length 1.
Ray checked(const Ray& ray) {
  require_position("ray origin", ray.origin);
  if (!(ray.max_distance >= 0)) {
    throw_invalid("ray max_distance", to_text(ray.max_distance), ">= 0; infinity is allowed");
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
  for_each_posed_sub_shape(bodies, body, [&](const auto& shape, const Transform& pose) {
    const detail::RayEntry entry = enter(ray, shape, pose);
    if (entry.hit && (!first.hit || entry.distance < first.distance)) first = entry;
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
  return RayHit{bodies.id(body), entry.distance, point, entry.normal};
}

/// Order of the hits of a ray. No two hits are equal.
bool before(const RayHit& a, const RayHit& b) {
  return std::tuple(a.distance, a.body.index) < std::tuple(b.distance, b.body.index);
}

bool accepts(const BodyFilter& filter, BodyId body) { return !filter || filter(body); }

/// Whether a solid touches a shape. @param solid in the form that find_contact() accepts
/// @param extents [m], half extents of the solid's bounds
template <class Instance, class S>
bool touch(const Instance& solid, const Vec3& centre, const Vec3& extents, const S& shape,
           const Transform& pose) {
  const detail::PairMotion at_rest{{}, 0, 0, {}, {}};
  detail::PairManifold manifold;
  if constexpr (detail::kIsMesh<S>) {
    const detail::MeshView mesh = detail::view_of(shape);
    detail::visit_triangles_around(mesh, pose, centre, extents, [&](std::uint32_t triangle) {
      if (manifold.touch_count > 0) return;
      manifold.clear();
      find_contact_with_triangle(solid, mesh, triangle, pose, at_rest, &manifold);
    });
  } else if constexpr (detail::kIsWall<S>) {
    find_contact(solid, to_wall(shape).solid_for(centre), at_rest, &manifold);
  } else {
    detail::find_contact_of_any(solid, detail::instance(shape, pose), at_rest, &manifold);
  }
  return manifold.touch_count > 0;
}

/// The bodies that touch a solid.
template <class S>
std::vector<BodyId> bodies_touching(const S& solid, const Transform& pose, const QueryTree& tree,
                                    const BodyStore& bodies) {
  std::vector<BodyId> found;
  const auto instance = detail::instance(solid, pose);
  const Vec3 extents = detail::half_extents(solid, pose);
  tree.visit_around(pose.origin, extents, [&](std::uint32_t body) {
    bool touches = false;
    for_each_posed_sub_shape(bodies, body, [&](const auto& shape, const Transform& at) {
      touches = touches || touch(instance, pose.origin, extents, shape, at);
    });
    if (touches) found.push_back(bodies.id(body));
  });
  std::ranges::sort(found, {}, &BodyId::index);
  return found;
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
  std::ranges::sort(hits, before);
  return hits;
}

std::vector<BodyId> World::overlapping(const Sphere& sphere, const Vec3& centre) const {
  require_position("sphere centre", centre);
  if (!(sphere.radius > 0 && sphere.radius <= kMaxCoordinate)) {
    throw_invalid("sphere radius", to_text(sphere.radius), "> 0 and at most 1e9");
  }
  const BodyStore& bodies = impl_->bodies_with_states();
  return bodies_touching(sphere, {{}, centre}, impl_->tree_of(bodies), bodies);
}

std::vector<BodyId> World::overlapping(const Box& box, const Vec3& centre,
                                       const Quat& orientation) const {
  const Vec3& h = box.half_extents;
  for (int i = 0; i < 3; ++i) {
    if (!(h[i] > 0 && h[i] <= kMaxCoordinate)) {
      throw_invalid("box half_extents", to_text(h), "> 0 and at most 1e9 each");
    }
  }
  const std::string fault = find_fault(BodyState{centre, orientation, {}, {}});
  if (!fault.empty()) throw InvalidArgument("box " + fault);
  const Transform pose = make_transform(normalized(orientation), centre);
  const BodyStore& bodies = impl_->bodies_with_states();
  return bodies_touching(box, pose, impl_->tree_of(bodies), bodies);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
