/// Bounds of the motion of sub-shapes during a step.
#pragma once

#include "src/collide/block_tree.hpp"
#include "src/world/bodies/sub_shape_view.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Trees of the solids of mass 0 other than spheres. An item is the number of a sub-shape minus
/// SubShapeRanges::fixed_begin(), which does not depend on movable bodies.
struct FixedTreesView {
  BlockTreeView immovable, kinematic;
};

enum class PairKind : std::uint8_t {
  none,       ///< not in contact, whatever the shapes
  spheres,    ///< two bodies that are spheres
  compounds,  ///< two spheres, at least one of a compound
  general     ///< all others
};

/// Bounds and pair tests of a step's contact search.
struct SweptBounds {
  using SubShape = SubShapeView::SubShape;

  BodyView bodies;
  SubShapeView sub_shapes;
  const Vec3* motion = nullptr;     ///< [m], by body: BodyView::predicted_motion()
  Real* margins = nullptr;          ///< [m], by sub-shape
  SphereInstance* swept = nullptr;  ///< by sub-shape, without walls: bounds of the step's motion
  /// By solid other than a sphere of a movable body, the first is SubShapeRanges::spheres(): bounds
  /// of the step's motion.
  Aabb* boxes = nullptr;
  Real largest_margin = 0;                         ///< [m]
  const cpu::HullKernels* hull_kernels = nullptr;  ///< null on a device

  /// Fills swept[i] and boxes with a sphere and a box that enclose the motion of the sub-shape, and
  /// margins[i].
  JFPX_HD void sweep(SubShape i) const {
    // The margin is at most this fraction of the size, so that small bodies do not get contacts
    // with all their neighbors.
    constexpr Real kMarginPerSize = Real(0.04);
    const SphereInstance& bounds = sub_shapes.bounds(i);
    Real size = bounds.radius;
    if (!sub_shapes.is_sphere(i)) {
      sub_shapes.visit_solid(
          i, [&](const auto& solid, const Transform&) { size = detail::least_half_width(solid); });
    }
    margins[i] = smaller(largest_margin, size * kMarginPerSize);
    const std::uint32_t body = sub_shapes.body(i);
    SphereInstance sphere{bounds.centre, bounds.radius + margins[i]};
    if (bodies.awake[body] != 0) {
      const Vec3 half_motion = motion[body] * Real(0.5);
      const Real arm = length(bounds.centre - bodies.position[body]);
      const Real reach = sub_shapes.is_sphere(i) ? arm : arm + bounds.radius;
      const Real turned = length(bodies.turning(body)) * bodies.dt;
      sphere.centre += half_motion;
      sphere.radius += length(half_motion) + smaller(turned, Real(2)) * reach;
    }
    set_bounds(i, sphere);
  }
  /// sweep() without margin and motion: bounds of the sub-shape at its current pose.
  JFPX_HD void enclose(SubShape i) const {
    margins[i] = 0;
    set_bounds(i, sub_shapes.bounds(i));
  }

  /// @param a,b sub-shapes whose swept bounds touch, a < b
  JFPX_HD PairKind kind_of(SubShape a, SubShape b) const {
    const std::uint32_t x = sub_shapes.body(a), y = sub_shapes.body(b);
    const bool any_movable = bodies.movable(x) || bodies.movable(y);
    if (x == y || !any_movable || !bodies.may_collide(x, y)) return PairKind::none;
    if (!sub_shapes.is_sphere(b)) {
      const bool meet = sub_shapes.is_sphere(a)
                            ? may_meet(a, b)
                            : overlap(box_of(a), box_of(b)) && may_meet(a, b) && may_meet(b, a);
      return meet ? PairKind::general : PairKind::none;
    }
    return bodies.radius[x] > 0 && bodies.radius[y] > 0 ? PairKind::spheres : PairKind::compounds;
  }

  /// The contact of a pair of kind `spheres`.
  JFPX_HD detail::SpeculativeContact test_spheres(SubShape a, SubShape b) const {
    const Vec3 relative = motion[sub_shapes.body(a)] - motion[sub_shapes.body(b)];
    return detail::find_speculative(sub_shapes.bounds(a), sub_shapes.bounds(b), relative,
                                    2 * smaller(margins[a], margins[b]));
  }

  /// Whether the swept bounds of a solid touch another sub-shape than a sphere. Conservative.
  JFPX_HD bool may_meet(SubShape i, SubShape other) const {
    if (sub_shapes.is_wall(other)) {
      const Vec3& centre = bodies.position[sub_shapes.body(i)];
      const HalfSpace solid = sub_shapes.wall(other).solid_for(centre);
      const Real height = dot(solid.normal, swept[i].centre) - solid.offset;
      return height <= swept[i].radius + 8 * kEpsilon * absolute(solid.offset);
    }
    const Real most = swept[i].radius + swept[other].radius;
    if (!(length_squared(swept[i].centre - swept[other].centre) <=
          most * most * (1 + 64 * kEpsilon)))
      return false;
    // The bounding sphere of a wide floor contains everything above it. During the step, each
    // point of the solid stays within 2 * moved of the solid at the start.
    const Real moved = swept[other].radius - sub_shapes.bounds(other).radius;
    const PosedSolid& posed = sub_shapes.solid(other);
    const Vec3& centre = swept[i].centre;
    const Real far = sum(posed.pose.origin) + swept[other].radius + sum(centre);
    // A centre at a distance of at most kEpsilon counts as inside.
    const Real radius =
        swept[i].radius + posed.solid.radius + 2 * moved + 16 * kEpsilon * far + kEpsilon;
    const Vec3 local = transform_transpose(posed.pose.basis, centre - posed.pose.origin);
    const Vec3 outside = detail::offset_from_box(local, {posed.solid.half_extents});
    return length_squared(outside) <= radius * radius;
  }

  /// [m], the distance below which the sub-shapes of a candidate have a contact
  JFPX_HD Real margin_of(const Candidate& pair) const {
    const SubShape p = pair.sub_shape_a, q = pair.sub_shape_b;
    if (sub_shapes.is_wall(q)) return 2 * margins[p] + spin(p);
    if (sub_shapes.is_mesh(q)) {
      const Real size = sub_shapes.bounds(p).radius;
      return 2 * smaller(margins[p], margins[q]) + spin(p) +
             smaller(turn_of_mesh(q), Real(1)) * size;
    }
    return 2 * smaller(margins[p], margins[q]) + spin(p) + spin(q);
  }

  /// [m], predicted relative motion of the sub-shapes of a candidate. A mesh has the motion of its
  /// point at the centre of the solid.
  JFPX_HD Vec3 motion_of(const Candidate& pair) const {
    const Vec3 relative = motion[pair.a] - motion[pair.b];
    if (sub_shapes.is_wall(pair.sub_shape_b) || !sub_shapes.is_mesh(pair.sub_shape_b) ||
        bodies.awake[pair.b] == 0) {
      return relative;
    }
    const Vec3 arm = sub_shapes.bounds(pair.sub_shape_a).centre - bodies.position[pair.b];
    return relative - cross(bodies.turning(pair.b), arm) * bodies.dt;
  }

  /// [m], the part of margin_of() that does not depend on motion, for two solids
  JFPX_HD Real distance_margin(const Candidate& pair) const {
    return 2 * smaller(margins[pair.sub_shape_a], margins[pair.sub_shape_b]);
  }
  /// [m], the smaller bounding radius of two solids
  JFPX_HD Real smaller_radius(const Candidate& pair) const {
    return smaller(sub_shapes.bounds(pair.sub_shape_a).radius,
                   sub_shapes.bounds(pair.sub_shape_b).radius);
  }

  /// Bounds of a solid of mass 0 in the tree. If they do not overlap query_bounds() of a movable
  /// sub-shape, the two have no contact: as in may_meet(), each includes its own motion and margin,
  /// with twice the error.
  JFPX_HD Aabb tree_bounds(SubShape fixed) const {
    const Real moved = swept[fixed].radius - sub_shapes.bounds(fixed).radius;
    return box_around(fixed, sub_shapes.solid(fixed).pose.origin, 2 * moved);
  }
  JFPX_HD Aabb query_bounds(SubShape i) const {
    if (!sub_shapes.is_sphere(i)) return box_of(i);
    const SphereInstance& sphere = swept[i];
    const Real reach = sphere.radius + 32 * kEpsilon * (sum(sphere.centre) + sphere.radius);
    const Vec3 half{reach, reach, reach};
    return {sphere.centre - half, sphere.centre + half};
  }
  /// Calls visit(fixed, element) in any order for the walls, the solids of mass 0 except spheres,
  /// and the triangles of meshes that a movable sub-shape may touch. Only triangles have an element
  /// other than 0.
  template <class Visit>
  JFPX_HD void visit_fixed(SubShape i, const FixedTreesView& trees, const Visit& visit) const {
    const std::uint32_t body = sub_shapes.body(i);
    const auto test = [&](SubShape fixed) {
      if (!bodies.may_collide(body, sub_shapes.body(fixed)) || !may_meet(i, fixed)) return;
      if (sub_shapes.is_mesh(fixed)) {
        visit_triangles(i, fixed, visit);
      } else {
        visit(fixed, 0u);
      }
    };
    const Aabb box = query_bounds(i);
    const SubShape first = sub_shapes.ranges.fixed_begin();
    const auto test_item = [&](std::uint32_t item) { test(first + item); };
    trees.immovable.visit_overlapping(box, test_item);
    trees.kinematic.visit_overlapping(box, test_item);
    for (SubShape wall = sub_shapes.ranges.bounded(); wall < sub_shapes.ranges.all(); ++wall) {
      test(wall);
    }
  }

 private:
  /// The swept box of a solid of a movable body other than a sphere.
  JFPX_HD const Aabb& box_of(SubShape i) const { return boxes[i - sub_shapes.ranges.spheres()]; }
  /// A box around a solid other than a sphere, moved to `centre` and enlarged by `more`.
  JFPX_HD Aabb box_around(SubShape i, const Vec3& centre, Real more) const {
    const PosedSolid& posed = sub_shapes.solid(i);
    const Real far = sum(centre) + swept[i].radius;
    const Real reach = posed.solid.radius + more + 32 * kEpsilon * far + kEpsilon;
    Aabb box;
    for (int k = 0; k < 3; ++k) {
      const Real half =
          reach + detail::projected_half_length(posed.solid.half_extents, posed.pose.basis.row[k]);
      box.lower[k] = centre[k] - half;
      box.upper[k] = centre[k] + half;
    }
    return box;
  }
  /// @param sphere encloses the sub-shape during the step
  JFPX_HD void set_bounds(SubShape i, const SphereInstance& sphere) const {
    swept[i] = rounded(sphere);
    const SubShapeRanges& ranges = sub_shapes.ranges;
    if (i < ranges.spheres() || i >= ranges.fixed_begin()) return;
    const Real moved = swept[i].radius - sub_shapes.bounds(i).radius;
    boxes[i - ranges.spheres()] = box_around(i, swept[i].centre, moved);
  }
  /// Calls visit(mesh, triangle) for the triangles of a mesh whose motion may touch that of a
  /// sub-shape. Conservative.
  template <class Visit>
  JFPX_HD void visit_triangles(SubShape i, SubShape mesh, const Visit& visit) const {
    const detail::MeshView& view = sub_shapes.mesh(mesh);
    const Transform& pose = sub_shapes.solid(mesh).pose;
    const SphereInstance& sphere = swept[i];
    const Vec3 offset = sphere.centre - pose.origin;
    Real reach = sphere.radius + margins[mesh];
    if (bodies.awake[sub_shapes.body(mesh)] != 0) {
      const Real distance = length(offset) + reach;
      reach +=
          length(motion[sub_shapes.body(mesh)]) + smaller(turn_of_mesh(mesh), Real(2)) * distance;
    }
    reach += 64 * kEpsilon * (sum(sphere.centre) + sum(pose.origin) + reach);
    const Vec3 local = transform_transpose(pose.basis, offset), half{reach, reach, reach};
    if (view.is_grid()) return visit_grid(mesh, {local - half, local + half}, local, reach, visit);
    view.tree.visit_overlapping({local - half, local + half}, [&](std::uint32_t index) {
      const detail::MeshTriangle& triangle = view.triangles[index];
      const Vec3& corner = view.vertices[triangle.vertices[0]];
      if (is_near_plane(triangle.normal, local - corner, reach)) visit(mesh, index);
    });
  }
  /// The same for a heightfield. Not inlined, so that the search of meshes keeps its registers on a
  /// device; therefore `visit` is copied.
  template <class Visit>
  [[gnu::noinline]] JFPX_HD void visit_grid(SubShape mesh, const Aabb& box, Vec3 local, Real reach,
                                            Visit visit) const {
    const detail::MeshView& view = sub_shapes.mesh(mesh);
    view.grid.visit_overlapping(box, [&](std::uint32_t index) {
      Vec3 corner[3];
      view.grid.get_corners(index, corner);
      const detail::TriangleArea area(corner[0], corner[1], corner[2]);
      if (is_near_plane(area.unit_normal(), local - corner[0], reach)) visit(mesh, index);
    });
  }
  /// @param arm [m], from a point of the plane
  JFPX_HD static bool is_near_plane(const Vec3& normal, const Vec3& arm, Real reach) {
    return absolute(dot(normal, arm)) <= reach + 8 * kEpsilon * sum(arm);
  }
  /// [rad], rotation of a mesh in the step.
  JFPX_HD Real turn_of_mesh(SubShape mesh) const {
    const std::uint32_t body = sub_shapes.body(mesh);
    if (bodies.awake[body] == 0) return 0;
    return length(bodies.turning(body)) * bodies.dt;
  }
  /// Enlarges by more than the rounding errors of the centre and of the radius.
  JFPX_HD static SphereInstance rounded(SphereInstance sphere) {
    const Vec3& c = sphere.centre;
    const Real largest = larger(larger(absolute(c.x), absolute(c.y)), absolute(c.z));
    sphere.radius += 8 * kEpsilon * (largest + sphere.radius);
    return sphere;
  }
  /// [m], upper bound of the motion of a solid's surface by rotation; 0 for a sphere.
  JFPX_HD Real spin(SubShape i) const {
    const std::uint32_t body = sub_shapes.body(i);
    if (sub_shapes.is_sphere(i) || bodies.awake[body] == 0) return 0;
    const SphereInstance& bounds = sub_shapes.bounds(i);
    const Real reach = length(bounds.centre - bodies.position[body]) + bounds.radius;
    const Real turned = length(bodies.turning(body)) * bodies.dt;
    return smaller(turned, Real(1)) * reach;
  }
  JFPX_HD static Real smaller(Real a, Real b) { return b < a ? b : a; }
  /// Sum of the absolute coordinates, which is not less than the length.
  JFPX_HD static Real sum(const Vec3& v) { return absolute(v.x) + absolute(v.y) + absolute(v.z); }
  JFPX_HD static Real larger(Real a, Real b) { return a < b ? b : a; }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
