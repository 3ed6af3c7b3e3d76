/// Ray and overlap queries by a linear scan: the reference for the tree of a World.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/collide/mesh_queries.hpp"
#include "src/world/bodies/sub_shape_view.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Tests all bodies in the order of World::bodies(), with the arithmetic of the queries of a World.
/// Valid until the world changes.
class LinearQueries {
 public:
  explicit LinearQueries(const World& world) {
    for (const BodyId id : world.bodies()) {
      const BodyState state = world.state(id);
      bodies_.push_back({id, &world.shape(id), state.position, state.orientation});
    }
  }

  std::optional<RayHit> cast_ray(const Ray& ray, const BodyFilter& filter = {}) const {
    std::optional<RayHit> closest;
    for_each_hit(ray, filter, [&closest](const RayHit& hit) {
      if (!closest || hit.distance < closest->distance) closest = hit;
    });
    return closest;
  }

  std::vector<RayHit> cast_ray_through(const Ray& ray, const BodyFilter& filter = {}) const {
    std::vector<RayHit> hits;
    for_each_hit(ray, filter, [&hits](const RayHit& hit) { hits.push_back(hit); });
    std::ranges::stable_sort(hits, {}, &RayHit::distance);
    return hits;
  }

  std::vector<BodyId> overlapping(const Sphere& sphere, const Vec3& centre) const {
    return bodies_touching(sphere, {{}, centre});
  }

  /// @param orientation of length 1
  std::vector<BodyId> overlapping(const Box& box, const Vec3& centre,
                                  const Quat& orientation) const {
    return bodies_touching(box, make_transform(normalized(orientation), centre));
  }

 private:
  struct Body {
    BodyId id;
    const Shape* shape;
    Vec3 position;
    Quat orientation;
  };

  template <class Visit>
  static void for_each_sub_shape(const Body& body, const Visit& visit) {
    const auto visit_parts = [&](const auto& shape) {
      if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, Compound>) {
        const Transform pose = make_transform(body.orientation, body.position);
        for (const CompoundPart& part : shape.parts) {
          const Transform local = make_transform(part.orientation, part.position);
          std::visit([&](const auto& s) { visit(s, pose * local); }, part.shape);
        }
      } else {
        visit(shape, make_transform(body.orientation, body.position));
      }
    };
    std::visit(visit_parts, *body.shape);
  }

  template <class S>
  static detail::RayEntry enter(const Ray& ray, const S& shape, const Transform& pose) {
    if constexpr (detail::kIsMesh<S>) {
      return enter_mesh(ray, detail::view_of(shape), pose);
    } else if constexpr (detail::kIsSolid<S>) {
      return detail::enter(ray.origin, ray.direction, shape, pose);
    } else {
      return detail::enter(ray.origin, ray.direction, shape);
    }
  }

  /// The first hit of all triangles, without the tree.
  static detail::RayEntry enter_mesh(const Ray& ray, const detail::MeshView& mesh,
                                     const Transform& pose) {
    const Vec3 from = inverse_transform_point(pose, ray.origin);
    const Vec3 along = inverse_transform_direction(pose, ray.direction);
    const detail::MeshRay ray_in_mesh(from, along);
    detail::RayEntry first;
    for (std::uint32_t i = 0; i < mesh.triangle_count; ++i) {
      if (!mesh.has_triangle(i)) continue;
      const Real distance = ray_in_mesh.hit(mesh, i);
      if (!(distance >= 0) || (first.hit && distance >= first.distance)) continue;
      Vec3 corners[3];
      mesh.get_corners(i, corners);
      const Vec3 n = mesh.normal(i, corners);
      first = {true, distance, pose.basis * (dot(n, along) > 0 ? -n : n)};
    }
    return first;
  }

  /// Scales by a power of two before the normalization, as in a World.
  static Vec3 unit_direction(const Vec3& v) {
    int exponent = 0;
    std::frexp(std::max({absolute(v.x), absolute(v.y), absolute(v.z)}), &exponent);
    const auto scaled = [exponent](Real x) { return std::ldexp(x, -exponent); };
    return normalized(Vec3{scaled(v.x), scaled(v.y), scaled(v.z)});
  }

  template <class Found>
  void for_each_hit(const Ray& given, const BodyFilter& filter, const Found& found) const {
    const Ray ray{given.origin, unit_direction(given.direction), given.max_distance};
    for (const Body& body : bodies_) {
      detail::RayEntry first;
      for_each_sub_shape(body, [&](const auto& shape, const Transform& pose) {
        const detail::RayEntry entry = enter(ray, shape, pose);
        if (entry.hit && (!first.hit || entry.distance < first.distance)) first = entry;
      });
      if (!first.hit || first.distance > ray.max_distance) continue;
      const Vec3 point = add_scaled(ray.origin, ray.direction, first.distance);
      if (!is_finite(point) || (filter && !filter(body.id))) continue;
      found(RayHit{body.id, first.distance, point, first.normal});
    }
  }

  static bool touches_mesh(const SolidShape& solid, const Transform& at,
                           const detail::MeshView& mesh, const Transform& pose) {
    bool any = false;
    for (std::uint32_t i = 0; i < mesh.triangle_count; ++i) {
      if (!mesh.has_triangle(i)) continue;
      detail::PairManifold manifold;
      std::visit(
          [&](const auto& s) {
            find_contact_with_triangle(detail::instance(s, at), mesh, i, pose, {}, &manifold);
          },
          solid);
      any |= manifold.touch_count > 0;
    }
    return any;
  }

  std::vector<BodyId> bodies_touching(const SolidShape& solid, const Transform& at) const {
    const auto touches = [&](const auto& shape, const Transform& pose) {
      using S = std::decay_t<decltype(shape)>;
      if constexpr (std::is_same_v<S, HalfSpace>) {
        return collide(solid, at, shape).count > 0;
      } else if constexpr (std::is_same_v<S, Plane>) {
        const bool behind = dot(shape.normal, at.origin) < shape.offset;
        return collide(solid, at,
                       behind ? HalfSpace{-shape.normal, -shape.offset}
                              : HalfSpace{shape.normal, shape.offset})
                   .count > 0;
      } else if constexpr (detail::kIsMesh<S>) {
        return touches_mesh(solid, at, detail::view_of(shape), pose);
      } else {
        return collide(solid, at, SolidShape(shape), pose).count > 0;
      }
    };
    std::vector<BodyId> found;
    for (const Body& body : bodies_) {
      bool any = false;
      for_each_sub_shape(body, [&](const auto& shape, const Transform& pose) {
        any = any || touches(shape, pose);
      });
      if (any) found.push_back(body.id);
    }
    return found;
  }

  std::vector<Body> bodies_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
