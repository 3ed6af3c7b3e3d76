/// Tests of two sub-shapes that may touch during a step.
#pragma once

#include "src/collide/speculative.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/near_bounds.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Contact of two sub-shapes: of those that may touch during the step, with the points that the
/// solver needs, and of those that touch at its start, with the points of World::contacts().
struct NearPair {
  static constexpr std::uint32_t kMaxPoints = 8;
  /// Point of World::contacts().
  struct Touch {
    Vec3 point;
    Real distance = 0;
  };
  soft_step::ContactKey key;
  Vec3 normal;
  std::uint32_t point_count = 0;  ///< 0 for sensors
  std::uint32_t touch_count = 0;
  soft_step::PointInput points[kMaxPoints];
  Touch touches[kMaxPoints];
};

/// Finds the contact of two sub-shapes that may touch during the step.
class NearPairTest {
 public:
  using SubShape = SubShapeView::SubShape;

  /// @param near receives the contact; must outlive the object
  JFPX_HD NearPairTest(const NearBounds& bounds, NearPair* near)
      : bodies_(bounds.bodies),
        sub_shapes_(bounds.sub_shapes),
        margins_(bounds.margins),
        near_(near) {}

  /// Only the second sub-shape may be a wall.
  JFPX_HD void operator()(const Candidate& pair) {
    const std::uint32_t a = pair.a, b = pair.b;
    const SubShape p = pair.sub_shape_a, q = pair.sub_shape_b;
    near_->key = {a, b, sub_shapes_.part(p), sub_shapes_.part(q)};
    near_->point_count = near_->touch_count = 0;
    const Vec3 motion = bodies_.predicted_motion(a) - bodies_.predicted_motion(b);
    const bool p_is_sphere = sub_shapes_.is_sphere(p);
    const bool q_is_sphere = !sub_shapes_.is_wall(q) && sub_shapes_.is_sphere(q);
    if (sub_shapes_.is_wall(q)) {
      const HalfSpace solid = sub_shapes_.wall(q).solid_for(origin(a));
      p_is_sphere ? sphere_on_wall(p, solid, motion) : box_on_wall(p, solid, motion);
    } else if (p_is_sphere && q_is_sphere) {
      spheres(p, q, motion);
    } else if (p_is_sphere) {
      sphere_on_box(p, q, motion, margin(p, q) + spin(q, b));
    } else if (q_is_sphere) {
      box_on_sphere(p, q, motion, margin(p, q) + spin(p, a));
    } else {
      boxes(p, q, motion, margin(p, q) + spin(p, a) + spin(q, b));
    }
    const bool any_sensor = bodies_.sensor[a] != 0 || bodies_.sensor[b] != 0;
    if (any_sensor) near_->point_count = 0;
  }

 private:
  JFPX_HD static Real smaller(Real x, Real y) { return y < x ? y : x; }
  JFPX_HD Real margin(SubShape p, SubShape q) const {
    return 2 * smaller(margins_[p], margins_[q]);
  }
  /// [m], bound of the motion of a box's surface by the rotation of its body.
  JFPX_HD Real spin(SubShape box, std::uint32_t body) const {
    if (bodies_.awake[body] == 0) return 0;
    const SphereInstance& bounds = sub_shapes_.bounds(box);
    const Real reach = length(bounds.centre - origin(body)) + bounds.radius;
    const Real turned = length(bodies_.angular_velocity[body]) * bodies_.dt;
    return smaller(turned, Real(1)) * reach;
  }
  JFPX_HD const Vec3& origin(std::uint32_t body) const { return bodies_.position[body]; }
  JFPX_HD const Vec3& origin_a() const { return origin(near_->key.a); }
  JFPX_HD const Vec3& origin_b() const { return origin(near_->key.b); }

  /// @param touch point of World::contacts()
  JFPX_HD void add(const Vec3& normal, const Vec3& arm_a, const Vec3& arm_b, Real distance,
                   std::uint32_t feature, const Vec3& touch) {
    near_->normal = normal;
    near_->points[near_->point_count++] = {arm_a, arm_b, distance, feature};
    report(touch, distance);
  }
  /// Adds a point of World::contacts() if the shapes touch there.
  JFPX_HD void report(const Vec3& point, Real distance) {
    if (distance <= 0) near_->touches[near_->touch_count++] = {point, distance};
  }

  JFPX_HD void spheres(SubShape p, SubShape q, const Vec3& motion) {
    const SphereInstance &x = sub_shapes_.bounds(p), &y = sub_shapes_.bounds(q);
    // The arithmetic of the collider depends on the order of the spheres, which is its own.
    const bool swapped = p > q;
    detail::SpeculativeContact c = swapped ? detail::find_speculative(y, x, -motion, margin(p, q))
                                           : detail::find_speculative(x, y, motion, margin(p, q));
    if (!c.found) return;
    const Vec3 point = middle_point(c.normal, c.distance, swapped ? x : y);
    if (swapped) c.normal = -c.normal;
    const Real overlap = c.distance < 0 ? c.distance * Real(0.5) : Real(0);
    add(c.normal, x.centre - c.normal * (x.radius + overlap) - origin_a(),
        y.centre + c.normal * (y.radius + overlap) - origin_b(), c.distance, 0, point);
  }

  JFPX_HD void sphere_on_wall(SubShape p, const HalfSpace& solid, const Vec3& motion) {
    const SphereInstance& s = sub_shapes_.bounds(p);
    const Vec3& n = solid.normal;
    const Real distance = (dot(n, s.centre) - solid.offset) - s.radius;
    const Real closing = -dot(n, motion);
    if (!(distance <= 2 * margins_[p] + (closing > 0 ? closing : Real(0)))) return;
    const Real overlap = distance < 0 ? distance : Real(0);
    const Vec3 point = s.centre - n * (s.radius + overlap * Real(0.5));
    add(n, point - origin_a(), point - origin_b(), distance, 0, point);
  }

  /// The order of the corners is that of collide(box, pose, half_space).
  JFPX_HD void box_on_wall(SubShape p, const HalfSpace& solid, const Vec3& motion) {
    const PosedBox& box = sub_shapes_.box(p);
    const Vec3 &n = solid.normal, &h = box.box.half_extents;
    const Real closing = -dot(n, motion);
    const Real limit = 2 * margins_[p] + spin(p, near_->key.a) + (closing > 0 ? closing : Real(0));
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      const Vec3 local{(corner & 1) != 0 ? h.x : -h.x, (corner & 2) != 0 ? h.y : -h.y,
                       (corner & 4) != 0 ? h.z : -h.z};
      const Vec3 vertex = transform_point(box.pose, local);
      const Real distance = dot(n, vertex) - solid.offset;
      if (!(distance <= limit)) continue;
      const Real overlap = distance < 0 ? distance : Real(0);
      const Vec3 point = vertex - n * (overlap * Real(0.5));
      add(n, point - origin_a(), point - origin_b(), distance, corner, point);
    }
  }

  JFPX_HD void sphere_on_box(SubShape sphere, SubShape box, const Vec3& motion, Real margin) {
    const SphereInstance& s = sub_shapes_.bounds(sphere);
    const PosedBox& b = sub_shapes_.box(box);
    const detail::SpeculativePoint c =
        detail::find_speculative(s, b.box, b.pose, motion, margin, origin_b());
    if (!c.contact.found) return;
    const Vec3 arm_a = c.arm_a + (s.centre - origin_a());
    add(c.contact.normal, arm_a, c.arm_b, c.contact.distance, 0, s.centre + c.arm_a);
  }

  JFPX_HD void box_on_sphere(SubShape box, SubShape sphere, const Vec3& motion, Real margin) {
    const SphereInstance& s = sub_shapes_.bounds(sphere);
    const PosedBox& b = sub_shapes_.box(box);
    const detail::SpeculativePoint c =
        detail::find_speculative(s, b.box, b.pose, -motion, margin, origin_a());
    if (!c.contact.found) return;
    const Vec3 arm_b = c.arm_a + (s.centre - origin_b());
    add(-c.contact.normal, c.arm_b, arm_b, c.contact.distance, 0, s.centre + c.arm_a);
  }

  JFPX_HD void boxes(SubShape p, SubShape q, const Vec3& motion, Real margin) {
    const PosedBox &x = sub_shapes_.box(p), &y = sub_shapes_.box(q);
    Manifold manifold;
    const Real t =
        detail::find_speculative(x.box, x.pose, y.box, y.pose, motion, margin, &manifold);
    if (t < 0) return;
    const Vec3 moved = motion * t;
    const Real gap = -dot(moved, manifold.normal);
    for (int i = 0; i < manifold.count; ++i) {
      report(manifold.points[i].point, manifold.points[i].distance + gap);
    }
    detail::remove_redundant_points(&manifold);
    near_->normal = manifold.normal;
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[i];
      near_->points[near_->point_count++] = {point.point - moved - origin_a(),
                                             point.point - origin_b(), point.distance + gap,
                                             point.feature};
    }
  }

  const BodyView& bodies_;
  const SubShapeView& sub_shapes_;
  const Real* margins_;
  NearPair* near_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
