/// Ray and overlap queries: linear scans over all bodies, without an acceleration structure.
#include <jfpx/collide.hpp>
#include <jfpx/error.hpp>

#include "src/collide/ray.hpp"
#include "src/scene/scene_validate.hpp"
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

Transform pose_of(const BodyStore& bodies, std::uint32_t body) {
  return make_transform(bodies.moving.orientation[body], bodies.moving.position[body]);
}

/// Calls visit(shape, pose) for the shape of the body, or for each part of a compound.
template <class Visit>
void for_each_sub_shape(const BodyStore& bodies, std::uint32_t body, const Visit& visit) {
  const Transform pose = pose_of(bodies, body);
  const auto visit_parts = [&](const auto& shape) {
    using S = std::decay_t<decltype(shape)>;
    if constexpr (std::is_same_v<S, Compound>) {
      for (const CompoundPart& part : shape.parts) {
        const Transform local = make_transform(part.orientation, part.position);
        std::visit([&](const auto& s) { visit(s, pose * local); }, part.shape);
      }
    } else if constexpr (std::is_same_v<S, Sphere> || std::is_same_v<S, Box>) {
      visit(shape, pose);
    } else {
      visit(shape, Transform{});
    }
  };
  std::visit(visit_parts, bodies.shape(body));
}

detail::RayEntry enter(const Ray& ray, const Sphere& sphere, const Transform& pose) {
  return detail::enter(ray.origin, ray.direction, SphereInstance{pose.origin, sphere.radius});
}
detail::RayEntry enter(const Ray& ray, const Box& box, const Transform& pose) {
  return detail::enter(ray.origin, ray.direction, box, pose);
}
template <class Wall>
detail::RayEntry enter(const Ray& ray, const Wall& wall, const Transform&) {
  return detail::enter(ray.origin, ray.direction, wall);
}

/// The first entry into a body; of parts at the same distance, that of the first part.
detail::RayEntry enter(const Ray& ray, const BodyStore& bodies, std::uint32_t body) {
  detail::RayEntry first;
  for_each_sub_shape(bodies, body, [&](const auto& shape, const Transform& pose) {
    const detail::RayEntry entry = enter(ray, shape, pose);
    if (entry.hit && (!first.hit || entry.distance < first.distance)) first = entry;
  });
  return first;
}

/// Calls `found` with each hit, in the order of bodies.
template <class Found>
void for_each_hit(const Ray& given, const BodyStore& bodies, const BodyFilter& filter,
                  const Found& found) {
  const Ray ray = checked(given);
  for (const BodyId id : bodies.ids()) {
    const detail::RayEntry entry = enter(ray, bodies, id.index);
    if (!entry.hit || entry.distance > ray.max_distance) continue;
    const Vec3 point = add_scaled(ray.origin, ray.direction, entry.distance);
    // A ray nearly parallel to a wall may intersect it at a distance beyond the range of Real.
    if (!is_finite(point) || (filter && !filter(id))) continue;
    found(RayHit{id, entry.distance, point, entry.normal});
  }
}

bool touch(const SphereInstance& sphere, const Sphere& other, const Transform& pose) {
  return !(length(sphere.centre - pose.origin) > sphere.radius + other.radius);
}
bool touch(const SphereInstance& sphere, const Box& box, const Transform& pose) {
  return collide(sphere, box, pose).touching;
}
template <class Wall>
bool touch(const SphereInstance& sphere, const Wall& wall, const Transform&) {
  return collide(sphere, wall).touching;
}

struct PosedBox {
  Box box;
  Transform pose;
};
bool touch(const PosedBox& box, const Sphere& sphere, const Transform& pose) {
  return collide(SphereInstance{pose.origin, sphere.radius}, box.box, box.pose).touching;
}
bool touch(const PosedBox& box, const Box& other, const Transform& pose) {
  return collide(box.box, box.pose, other, pose).count > 0;
}
template <class Wall>
bool touch(const PosedBox& box, const Wall& wall, const Transform&) {
  return collide(box.box, box.pose, wall).count > 0;
}

/// @param solid a SphereInstance or a PosedBox
template <class Solid>
std::vector<BodyId> bodies_touching(const Solid& solid, const BodyStore& bodies) {
  std::vector<BodyId> found;
  for (const BodyId id : bodies.ids()) {
    bool touches = false;
    for_each_sub_shape(bodies, id.index, [&](const auto& shape, const Transform& pose) {
      touches = touches || touch(solid, shape, pose);
    });
    if (touches) found.push_back(id);
  }
  return found;
}

}  // namespace

std::optional<RayHit> World::cast_ray(const Ray& ray, const BodyFilter& filter) const {
  std::optional<RayHit> closest;
  for_each_hit(ray, impl_->bodies, filter, [&closest](const RayHit& hit) {
    if (!closest || hit.distance < closest->distance) closest = hit;
  });
  return closest;
}

std::vector<RayHit> World::cast_ray_through(const Ray& ray, const BodyFilter& filter) const {
  std::vector<RayHit> hits;
  for_each_hit(ray, impl_->bodies, filter, [&hits](const RayHit& hit) { hits.push_back(hit); });
  std::ranges::sort(hits, {},
                    [](const RayHit& hit) { return std::tuple(hit.distance, hit.body.index); });
  return hits;
}

std::vector<BodyId> World::overlapping(const Sphere& sphere, const Vec3& centre) const {
  require_position("sphere centre", centre);
  if (!(sphere.radius > 0 && sphere.radius <= kMaxCoordinate)) {
    throw_invalid("sphere radius", to_text(sphere.radius), "> 0 and at most 1e9");
  }
  return bodies_touching(SphereInstance{centre, sphere.radius}, impl_->bodies);
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
  return bodies_touching(PosedBox{box, pose}, impl_->bodies);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
