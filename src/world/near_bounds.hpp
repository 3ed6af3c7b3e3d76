/// Bounds of the motion of sub-shapes during a step.
#pragma once

#include "src/collide/speculative.hpp"
#include "src/world/sub_shape_view.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

enum class PairKind : std::uint8_t {
  none,       ///< not in contact, whatever the shapes
  spheres,    ///< two bodies that are spheres
  compounds,  ///< two spheres, at least one of a compound
  others
};

/// Bounds and pair tests of a step's contact search.
struct NearBounds {
  using SubShape = SubShapeView::SubShape;

  BodyView bodies;
  SubShapeView sub_shapes;
  const Vec3* motion = nullptr;     ///< [m], by body: BodyView::predicted_motion()
  Real* margins = nullptr;          ///< [m], by sub-shape
  SphereInstance* swept = nullptr;  ///< by sub-shape, without walls: bounds of the step's motion
  Real largest_margin = 0;          ///< [m]

  /// Fills swept[i] with a sphere that encloses the motion of the sub-shape, and margins[i].
  JFPX_HD void sweep(SubShape i) const {
    // The margin is at most this part of the size, so that small bodies do not collect contacts
    // with everything around them.
    constexpr Real kMarginPerSize = Real(0.04);
    const SphereInstance& bounds = sub_shapes.bounds(i);
    const Real size =
        sub_shapes.is_sphere(i) ? bounds.radius : smallest_half_extent(sub_shapes.box(i).box);
    margins[i] = smaller(largest_margin, size * kMarginPerSize);
    const std::uint32_t body = sub_shapes.body(i);
    SphereInstance sphere{bounds.centre, bounds.radius + margins[i]};
    if (bodies.awake[body] != 0) {
      const Vec3 half_motion = motion[body] * Real(0.5);
      const Real arm = length(bounds.centre - bodies.position[body]);
      const Real reach = sub_shapes.is_sphere(i) ? arm : arm + bounds.radius;
      const Real turned = length(bodies.angular_velocity[body]) * bodies.dt;
      sphere.centre += half_motion;
      sphere.radius += length(half_motion) + smaller(turned, Real(2)) * reach;
    }
    // For the rounding errors of the centre and of the radius.
    const Vec3& c = sphere.centre;
    const Real largest = larger(larger(absolute(c.x), absolute(c.y)), absolute(c.z));
    sphere.radius += 8 * kEpsilon * (largest + sphere.radius);
    swept[i] = sphere;
  }

  /// @param a,b sub-shapes whose swept bounds touch, a < b
  JFPX_HD PairKind kind_of(SubShape a, SubShape b) const {
    const std::uint32_t x = sub_shapes.body(a), y = sub_shapes.body(b);
    const bool any_movable = bodies.movable(x) || bodies.movable(y);
    if (x == y || !any_movable || !bodies.may_collide(x, y)) return PairKind::none;
    if (!sub_shapes.is_sphere(b)) return PairKind::others;
    return bodies.radius[x] > 0 && bodies.radius[y] > 0 ? PairKind::spheres : PairKind::compounds;
  }

  /// The contact of a pair of kind `spheres`.
  JFPX_HD detail::SpeculativeContact test_spheres(SubShape a, SubShape b) const {
    const Vec3 relative = motion[sub_shapes.body(a)] - motion[sub_shapes.body(b)];
    return detail::find_speculative(sub_shapes.bounds(a), sub_shapes.bounds(b), relative,
                                    2 * smaller(margins[a], margins[b]));
  }

  /// Whether the swept bounds of a movable sub-shape touch a fixed one. Conservative.
  JFPX_HD bool may_meet(SubShape i, SubShape fixed) const {
    if (sub_shapes.is_wall(fixed)) {
      const Vec3& centre = bodies.position[sub_shapes.body(i)];
      const HalfSpace solid = sub_shapes.wall(fixed).solid_for(centre);
      const Real height = dot(solid.normal, swept[i].centre) - solid.offset;
      return height <= swept[i].radius + 8 * kEpsilon * absolute(solid.offset);
    }
    const Real most = swept[i].radius + swept[fixed].radius;
    if (!(length_squared(swept[i].centre - swept[fixed].centre) <=
          most * most * (1 + 64 * kEpsilon)))
      return false;
    // The bounding sphere of a wide floor contains everything above it. During the step, no point
    // of the box is farther than 2 * moved from the box at the start.
    const Real moved = swept[fixed].radius - sub_shapes.bounds(fixed).radius;
    const PosedBox& box = sub_shapes.box(fixed);
    const Vec3& centre = swept[i].centre;
    const Real far = sum(box.pose.origin) + swept[fixed].radius + sum(centre);
    // A centre that is not farther than kEpsilon counts as inside.
    const Real radius = swept[i].radius + 2 * moved + 16 * kEpsilon * far + kEpsilon;
    const Vec3 local = transform_transpose(box.pose.basis, centre - box.pose.origin);
    return length_squared(detail::offset_from_box(local, box.box)) <= radius * radius;
  }

 private:
  JFPX_HD static Real smaller(Real a, Real b) { return b < a ? b : a; }
  /// Sum of the absolute coordinates, which is not less than the length.
  JFPX_HD static Real sum(const Vec3& v) { return absolute(v.x) + absolute(v.y) + absolute(v.z); }
  JFPX_HD static Real larger(Real a, Real b) { return a < b ? b : a; }
  JFPX_HD static Real smallest_half_extent(const Box& box) {
    const Vec3& h = box.half_extents;
    return smaller(smaller(h.x, h.y), h.z);
  }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
