/// Queries by a linear scan: the reference for the tree of a World.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/collide/closest_points.hpp"
#include "src/collide/mesh_queries.hpp"
#include "src/collide/shape_cast.hpp"
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

  std::vector<ShapeHit> cast_shape_through(const ShapeCast& cast,
                                           const BodyFilter& filter = {}) const {
    std::vector<ShapeHit> hits;
    for (const Body& body : bodies_) {
      const std::optional<ShapeHit> hit = hit_of(cast, body);
      if (hit && (!filter || filter(body.id))) hits.push_back(*hit);
    }
    std::ranges::stable_sort(hits, {}, &ShapeHit::fraction);
    return hits;
  }

  std::vector<BodyDistance> bodies_within(const DistanceQuery& query,
                                          const BodyFilter& filter = {}) const {
    std::vector<BodyDistance> found;
    for (const Body& body : bodies_) {
      const std::optional<BodyDistance> one = distance_of(query, body);
      if (one && (!filter || filter(body.id))) found.push_back(*one);
    }
    std::ranges::stable_sort(found, {}, &BodyDistance::distance);
    return found;
  }

  /// @param orientation of length 1
  std::vector<BodyId> overlapping(const SolidShape& shape, const Vec3& position,
                                  const Quat& orientation = {}) const {
    return bodies_touching(shape, make_transform(normalized(orientation), position));
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
        for (std::uint32_t i = 0; i < shape.parts.size(); ++i) {
          const CompoundPart& part = shape.parts[i];
          const Transform local = make_transform(part.orientation, part.position);
          std::visit([&](const auto& s) { visit(s, pose * local, i); }, part.shape);
        }
      } else {
        visit(shape, make_transform(body.orientation, body.position), 0u);
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
      first = {true, distance, pose.basis * (dot(n, along) > 0 ? -n : n), i};
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
      for_each_sub_shape(body, [&](const auto& shape, const Transform& pose, std::uint32_t part) {
        detail::RayEntry entry = enter(ray, shape, pose);
        entry.part += part;
        if (entry.hit && (!first.hit || entry.distance < first.distance)) first = entry;
      });
      if (!first.hit || first.distance > ray.max_distance) continue;
      const Vec3 point = add_scaled(ray.origin, ray.direction, first.distance);
      if (!is_finite(point) || (filter && !filter(body.id))) continue;
      found(RayHit{body.id, first.distance, point, first.normal, first.part});
    }
  }

  /// Calls visit(normal, point, distance, triangle) for the points where a solid touches a
  /// sub-shape.
  template <class S, class Visit>
  static void visit_touches(const SolidShape& solid, const Transform& at, const S& shape,
                            const Transform& pose, const Visit& visit) {
    Manifold found;
    if constexpr (std::is_same_v<S, HalfSpace>) {
      found = collide(solid, at, shape);
    } else if constexpr (std::is_same_v<S, Plane>) {
      found = collide(solid, at, facing_side(shape, centre_of(solid, at)));
    } else if constexpr (detail::kIsMesh<S>) {
      const detail::MeshView mesh = detail::view_of(shape);
      for (std::uint32_t i = 0; i < mesh.triangle_count; ++i) {
        if (!mesh.has_triangle(i)) continue;
        detail::PairManifold manifold;
        std::visit(
            [&](const auto& s) {
              find_contact_with_triangle(detail::instance(s, at), mesh, i, pose, {}, &manifold);
            },
            solid);
        for (std::uint32_t k = 0; k < manifold.touch_count; ++k) {
          visit(manifold.normal, manifold.touches[k].point, manifold.touches[k].distance, i);
        }
      }
    } else {
      found = collide(solid, at, SolidShape(shape), pose);
    }
    for (int i = 0; i < found.count; ++i) {
      visit(found.normal, found.points[i].point, found.points[i].distance, 0u);
    }
  }
  static Vec3 centre_of(const SolidShape& solid, const Transform& at) {
    return std::visit([&](const auto& s) { return detail::centre_of(detail::instance(s, at)); },
                      solid);
  }
  static HalfSpace facing_side(const Plane& plane, const Vec3& centre) {
    if (dot(plane.normal, centre) < plane.offset) return {-plane.normal, -plane.offset};
    return {plane.normal, plane.offset};
  }

  /// The first entry of all sub-shapes, and of all triangles of a mesh.
  template <class S>
  static detail::CastEntry cast_to(const SolidShape& solid, const Transform& at,
                                   const detail::LinearMotion& motion, const S& shape,
                                   const Transform& pose) {
    const auto make = [](const auto& s) { return detail::make_core(s); };
    const detail::ConvexCore moving = std::visit(make, solid);
    const Mat3 rotation = transposed(pose.basis) * at.basis;
    const Vec3 from = inverse_transform_point(pose, at.origin);
    detail::LinearMotion local = motion;
    local.direction = inverse_transform_direction(pose, motion.direction);
    detail::CastEntry first;
    if constexpr (std::is_same_v<S, HalfSpace>) {
      return detail::cast(shape, moving, at, motion);
    } else if constexpr (std::is_same_v<S, Plane>) {
      return detail::cast(facing_side(shape, transform_point(at, moving.centre)), moving, at,
                          motion);
    } else if constexpr (detail::kIsMesh<S>) {
      const detail::MeshView mesh = detail::view_of(shape);
      for (std::uint32_t i = 0; i < mesh.triangle_count; ++i) {
        if (!mesh.has_triangle(i)) continue;
        Vec3 corner[3];
        mesh.get_corners(i, corner);
        const Vec3 start = corner[0], normal = mesh.normal(i, corner);
        for (Vec3& p : corner) p -= start;
        const Vec3 centre = from + rotation * moving.centre;
        if (mesh.two_sided == 0 && dot(normal, centre - start) < 0) continue;
        detail::CastEntry entry =
            detail::cast(detail::make_core(corner, normal), moving, rotation, from - start, local);
        if (!entry.hit || entry.is_inside) continue;
        entry.point += start;
        entry.part = i;
        if (!first.hit || entry.fraction < first.fraction) first = entry;
      }
    } else {
      first = detail::cast(detail::make_core(shape), moving, rotation, from, local);
    }
    first.point = transform_point(pose, first.point);
    first.normal = normalized(pose.basis * first.normal);
    return first;
  }

  static std::optional<ShapeHit> deepest_of(const SolidShape& solid, const Transform& at,
                                            const Body& body) {
    std::optional<ShapeHit> deepest;
    for_each_sub_shape(body, [&](const auto& shape, const Transform& pose, std::uint32_t part) {
      if (!bounds_overlap(solid, at, shape, pose)) return;
      visit_touches(
          solid, at, shape, pose,
          [&](const Vec3& normal, const Vec3& point, Real distance, std::uint32_t triangle) {
            if (deepest && !(distance < deepest->distance)) return;
            deepest = ShapeHit{body.id, 0, point, normal, distance, part + triangle};
          });
    });
    return deepest;
  }

  /// The closest points of a sub-shape, of all triangles of a mesh.
  template <class S>
  static detail::ClosestPair closest_to(const SolidShape& shape, const Transform& at,
                                        const S& target, const Transform& pose) {
    const detail::PlacedSolid solid(shape, at);
    constexpr Real kUnlimited = std::numeric_limits<Real>::infinity();
    if constexpr (std::is_same_v<S, HalfSpace>) {
      return detail::find_closest(target, solid, kUnlimited);
    } else if constexpr (std::is_same_v<S, Plane>) {
      return detail::find_closest(facing_side(target, transform_point(at, solid.core.centre)),
                                  solid, kUnlimited);
    } else if constexpr (detail::kIsMesh<S>) {
      const Mat3 rotation = transposed(pose.basis) * at.basis;
      const Vec3 from = inverse_transform_point(pose, at.origin);
      const Vec3 centre = from + rotation * solid.core.centre;
      const detail::MeshView mesh = detail::view_of(target);
      detail::ClosestPair closest;
      for (std::uint32_t i = 0; i < mesh.triangle_count; ++i) {
        if (!mesh.has_triangle(i)) continue;
        Vec3 corner[3];
        mesh.get_corners(i, corner);
        const Vec3 start = corner[0], normal = mesh.normal(i, corner);
        for (Vec3& p : corner) p -= start;
        if (mesh.two_sided == 0 && dot(normal, centre - start) < 0) continue;
        detail::ClosestPair pair = detail::find_closest(
            detail::make_core(corner, normal), solid.core, rotation, from - start, kUnlimited);
        pair.distance = std::max(pair.distance, Real(0));
        pair.point += start;
        pair.part = i;
        if (!closest.found || pair.distance < closest.distance) closest = pair;
      }
      if (!closest.found) return {};
      closest.point = transform_point(pose, closest.point);
      closest.normal = normalized(pose.basis * closest.normal);
      return closest;
    } else {
      return detail::find_closest(detail::PlacedSolid(target, pose), solid, kUnlimited);
    }
  }

  static std::optional<BodyDistance> distance_of(const DistanceQuery& query, const Body& body) {
    const Transform at = make_transform(normalized(query.orientation), query.position);
    detail::ClosestPair closest;
    for_each_sub_shape(body, [&](const auto& shape, const Transform& pose, std::uint32_t part) {
      detail::ClosestPair pair = closest_to(query.shape, at, shape, pose);
      pair.part += part;
      if constexpr (detail::kIsMesh<std::decay_t<decltype(shape)>>) {
        const auto deepest = pair.distance == 0 ? deepest_of(query.shape, at, body) : std::nullopt;
        if (pair.found && deepest) {
          pair.distance = deepest->distance;
          pair.normal = deepest->normal;
          pair.part = deepest->part;
          pair.point = add_scaled(deepest->point, pair.normal, pair.distance * Real(-0.5));
        }
      }
      if (!pair.found || (closest.found && !(pair.distance < closest.distance))) return;
      closest = pair;
    });
    if (!closest.found || !(closest.distance <= query.max_distance)) return std::nullopt;
    return BodyDistance{body.id,        closest.distance,
                        closest.point,  add_scaled(closest.point, closest.normal, closest.distance),
                        closest.normal, closest.part};
  }

  static std::optional<ShapeHit> hit_of(const ShapeCast& cast, const Body& body) {
    const Transform at = make_transform(normalized(cast.orientation), cast.position);
    const std::optional<ShapeHit> deepest = deepest_of(cast.shape, at, body);
    if (deepest || cast.translation == Vec3{}) return deepest;
    int exponent = 0;
    const Vec3& v = cast.translation;
    std::frexp(std::max({absolute(v.x), absolute(v.y), absolute(v.z)}), &exponent);
    const auto mantissa = [exponent](Real x) { return std::ldexp(x, -exponent); };
    const Real size = std::ldexp(length({mantissa(v.x), mantissa(v.y), mantissa(v.z)}), exponent);
    const detail::LinearMotion motion{unit_direction(v), size, 1};
    detail::CastEntry first;
    for_each_sub_shape(body, [&](const auto& shape, const Transform& pose, std::uint32_t part) {
      detail::CastEntry entry = cast_to(cast.shape, at, motion, shape, pose);
      entry.part += part;
      if (entry.hit && (!first.hit || entry.fraction < first.fraction)) first = entry;
    });
    if (!first.hit) return std::nullopt;
    return ShapeHit{body.id, first.fraction, first.point, first.normal, 0, first.part};
  }
  /// As in a World, in which parallel edges of boxes with disjoint bounds do not touch.
  template <class S>
  static bool bounds_overlap(const SolidShape& solid, const Transform& at, const S& shape,
                             const Transform& pose) {
    if constexpr (!detail::kIsWall<S>) {
      const Vec3 half = detail::half_extents(shape, pose);
      const Vec3 own =
          std::visit([&](const auto& s) { return detail::half_extents(s, at); }, solid);
      for (int i = 0; i < 3; ++i) {
        const Real apart = absolute(pose.origin[i] - at.origin[i]), reach = half[i] + own[i];
        if (apart > reach + 64 * kEpsilon * (apart + reach)) return false;
      }
    }
    return true;
  }

  std::vector<BodyId> bodies_touching(const SolidShape& solid, const Transform& at) const {
    std::vector<BodyId> found;
    for (const Body& body : bodies_) {
      bool any = false;
      for_each_sub_shape(body, [&](const auto& shape, const Transform& pose, std::uint32_t) {
        visit_touches(solid, at, shape, pose,
                      [&](const Vec3&, const Vec3&, Real, std::uint32_t) { any = true; });
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
