/// Tests of two sub-shapes that may touch during a step.
#pragma once

#include <jfpx/world.hpp>

#include "src/collide/speculative.hpp"
#include "src/contact_solver/contact_set.hpp"
#include "src/world/body_store.hpp"
#include "src/world/sub_shape_table.hpp"

#include <algorithm>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Results for a part of the pairs. Contacts of sensors are only in `touching`.
struct NearPairs {
  std::vector<soft_step::SphereContactInput> spheres;
  std::vector<soft_step::ManifoldInput> manifolds;
  std::vector<soft_step::PointInput> points;
  std::vector<Contact> touching;  ///< those with distance <= 0
  void clear() {
    spheres.clear();
    manifolds.clear();
    points.clear();
    touching.clear();
  }
};

/// Appends the contacts of two sub-shapes that may touch during the step.
class NearPairTest {
 public:
  using SubShape = SubShapeTable::SubShape;

  /// @param margins by sub-shape [m]
  NearPairTest(const BodyStore& bodies, const SubShapeTable& sub_shapes,
               std::span<const Real> margins, NearPairs* near)
      : bodies_(bodies), sub_shapes_(sub_shapes), margins_(margins), near_(near) {}

  /// Sub-shape p belongs to body a, q to body b; only q may be a wall.
  void operator()(std::uint32_t a, std::uint32_t b, SubShape p, SubShape q) {
    key_ = {a, b, sub_shapes_.part(p), sub_shapes_.part(q)};
    first_ = near_->points.size();
    const Vec3 motion = bodies_.predicted_motion(a) - bodies_.predicted_motion(b);
    const bool p_is_sphere = sub_shapes_.is_sphere(p);
    const bool q_is_sphere = !sub_shapes_.is_wall(q) && sub_shapes_.is_sphere(q);
    if (sub_shapes_.is_wall(q)) {
      const HalfSpace solid = sub_shapes_.wall(q).solid_for(bodies_.moving.position[a]);
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
  }

 private:
  Real margin(SubShape p, SubShape q) const { return 2 * std::min(margins_[p], margins_[q]); }
  /// [m], bound of the motion of a box's surface by the rotation of its body.
  Real spin(SubShape box, std::uint32_t body) const {
    if (bodies_.moving.awake[body] == 0) return 0;
    const SphereInstance& bounds = sub_shapes_.bounds(box);
    const Real reach = length(bounds.centre - bodies_.moving.position[body]) + bounds.radius;
    const Real turned = length(bodies_.moving.angular_velocity[body]) * bodies_.dt();
    return std::min(turned, Real(1)) * reach;
  }
  Vec3 origin(std::uint32_t body) const { return bodies_.moving.position[body]; }

  /// @param public_point as in Contact
  void add(const Vec3& normal, const Vec3& arm_a, const Vec3& arm_b, Real distance,
           std::uint32_t feature, const Vec3& public_point) {
    near_->points.push_back({arm_a, arm_b, distance, feature});
    normal_ = normal;
    report(normal, public_point, distance);
  }
  /// Adds a public contact if the shapes touch.
  void report(const Vec3& normal, const Vec3& point, Real distance) {
    if (!(distance <= 0)) return;
    near_->touching.push_back({bodies_.id(key_.a), bodies_.id(key_.b), normal, point, distance});
  }
  void finish() {
    const auto count = static_cast<std::uint32_t>(near_->points.size() - first_);
    if (count == 0) return;
    if (bodies_.sensor(key_.a) || bodies_.sensor(key_.b)) return near_->points.resize(first_);
    near_->manifolds.push_back({key_, normal_, static_cast<std::uint32_t>(first_), count});
  }

  void spheres(SubShape p, SubShape q, const Vec3& motion) {
    const SphereInstance &x = sub_shapes_.bounds(p), &y = sub_shapes_.bounds(q);
    // The arithmetic of the collider depends on the order of the spheres, which is its own.
    const bool swapped = p > q;
    detail::SpeculativeContact c = swapped ? detail::find_speculative(y, x, -motion, margin(p, q))
                                           : detail::find_speculative(x, y, motion, margin(p, q));
    if (!c.found) return;
    const Vec3 point = middle_point(c.normal, c.distance, swapped ? x : y);
    if (swapped) c.normal = -c.normal;
    const Real overlap = c.distance < 0 ? c.distance * Real(0.5) : Real(0);
    add(c.normal, x.centre - c.normal * (x.radius + overlap) - origin(key_.a),
        y.centre + c.normal * (y.radius + overlap) - origin(key_.b), c.distance, 0, point);
    finish();
  }

  void sphere_on_wall(SubShape p, const HalfSpace& solid, const Vec3& motion) {
    const SphereInstance& s = sub_shapes_.bounds(p);
    const Vec3& n = solid.normal;
    const Real distance = (dot(n, s.centre) - solid.offset) - s.radius;
    const Real closing = -dot(n, motion);
    if (!(distance <= 2 * margins_[p] + std::max(closing, Real(0)))) return;
    const Real overlap = distance < 0 ? distance : Real(0);
    const Vec3 point = s.centre - n * (s.radius + overlap * Real(0.5));
    add(n, point - origin(key_.a), point - origin(key_.b), distance, 0, point);
    finish();
  }

  /// The order of the corners is that of collide(box, pose, half_space).
  void box_on_wall(SubShape p, const HalfSpace& solid, const Vec3& motion) {
    const SubShapeTable::PosedBox& box = sub_shapes_.box(p);
    const Vec3 &n = solid.normal, &h = box.box.half_extents;
    const Real closing = -dot(n, motion);
    const Real limit = 2 * margins_[p] + spin(p, key_.a) + std::max(closing, Real(0));
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      const Vec3 local{(corner & 1) != 0 ? h.x : -h.x, (corner & 2) != 0 ? h.y : -h.y,
                       (corner & 4) != 0 ? h.z : -h.z};
      const Vec3 vertex = transform_point(box.pose, local);
      const Real distance = dot(n, vertex) - solid.offset;
      if (!(distance <= limit)) continue;
      const Real overlap = distance < 0 ? distance : Real(0);
      const Vec3 point = vertex - n * (overlap * Real(0.5));
      add(n, point - origin(key_.a), point - origin(key_.b), distance, corner, point);
    }
    finish();
  }

  void sphere_on_box(SubShape sphere, SubShape box, const Vec3& motion, Real margin) {
    const SphereInstance& s = sub_shapes_.bounds(sphere);
    const SubShapeTable::PosedBox& b = sub_shapes_.box(box);
    const detail::SpeculativePoint c =
        detail::find_speculative(s, b.box, b.pose, motion, margin, origin(key_.b));
    if (!c.contact.found) return;
    const Vec3 arm_a = c.arm_a + (s.centre - origin(key_.a));
    add(c.contact.normal, arm_a, c.arm_b, c.contact.distance, 0, s.centre + c.arm_a);
    finish();
  }

  void box_on_sphere(SubShape box, SubShape sphere, const Vec3& motion, Real margin) {
    const SphereInstance& s = sub_shapes_.bounds(sphere);
    const SubShapeTable::PosedBox& b = sub_shapes_.box(box);
    const detail::SpeculativePoint c =
        detail::find_speculative(s, b.box, b.pose, -motion, margin, origin(key_.a));
    if (!c.contact.found) return;
    const Vec3 arm_b = c.arm_a + (s.centre - origin(key_.b));
    add(-c.contact.normal, c.arm_b, arm_b, c.contact.distance, 0, s.centre + c.arm_a);
    finish();
  }

  void boxes(SubShape p, SubShape q, const Vec3& motion, Real margin) {
    const SubShapeTable::PosedBox &x = sub_shapes_.box(p), &y = sub_shapes_.box(q);
    Manifold manifold;
    const Real t =
        detail::find_speculative(x.box, x.pose, y.box, y.pose, motion, margin, &manifold);
    if (t < 0) return;
    const Vec3 moved = motion * t;
    const Real gap = -dot(moved, manifold.normal);
    for (int i = 0; i < manifold.count; ++i) {
      report(manifold.normal, manifold.points[i].point, manifold.points[i].distance + gap);
    }
    detail::remove_redundant_points(&manifold);
    normal_ = manifold.normal;
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[i];
      near_->points.push_back({point.point - moved - origin(key_.a), point.point - origin(key_.b),
                               point.distance + gap, point.feature});
    }
    finish();
  }

  const BodyStore& bodies_;
  const SubShapeTable& sub_shapes_;
  std::span<const Real> margins_;
  NearPairs* near_;
  soft_step::ContactKey key_;
  std::size_t first_ = 0;
  Vec3 normal_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
