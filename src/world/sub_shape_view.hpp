/// Sub-shapes of all bodies as pointers to arrays, in host memory or on a device.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/shape.hpp>

#include "src/world/body_view.hpp"

#include <compare>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

struct PosedBox {
  Box box;
  Transform pose;
};

/// A half-space or a plane.
struct Wall {
  HalfSpace solid;  ///< for a plane: its back side
  bool two_sided = false;

  /// The solid half-space for a body whose centre of mass is at `centre`.
  JFPX_HD HalfSpace solid_for(const Vec3& centre) const {
    if (!two_sided || !(dot(solid.normal, centre) < solid.offset)) return solid;
    return {-solid.normal, -solid.offset};
  }
};

/// See SubShapeTable for the order of the sub-shapes.
struct SubShapeView {
  using SubShape = std::uint32_t;

  SubShape sphere_count = 0;   ///< the sub-shapes before it are spheres
  SubShape fixed_begin = 0;    ///< the first box or wall of mass 0
  SubShape bounded_count = 0;  ///< number of spheres and boxes: the others are walls
  SubShape count = 0;
  const std::uint32_t* bodies = nullptr;   ///< by sub-shape
  const std::uint32_t* numbers = nullptr;  ///< by sub-shape: its index in the compound
  SphereInstance* all_bounds = nullptr;    ///< of spheres and boxes
  PosedBox* boxes = nullptr;
  const Wall* walls = nullptr;
  const std::uint32_t* parts = nullptr;  ///< by sphere or box: 0, or 1 + index in `local`
  const Transform* local = nullptr;      ///< poses of parts, in body axes

  JFPX_HD std::uint32_t body(SubShape i) const { return bodies[i]; }
  /// Index of the sub-shape in its compound; 0 in a simple body.
  JFPX_HD std::uint32_t part(SubShape i) const { return numbers[i]; }
  /// Whether the body of the sub-shape is a compound.
  JFPX_HD bool is_part(SubShape i) const { return !is_wall(i) && parts[i] != 0; }
  JFPX_HD bool is_sphere(SubShape i) const { return i < sphere_count; }
  JFPX_HD bool is_wall(SubShape i) const { return i >= bounded_count; }
  JFPX_HD const PosedBox& box(SubShape i) const { return boxes[i - sphere_count]; }
  JFPX_HD const Wall& wall(SubShape i) const { return walls[i - bounded_count]; }
  /// The sphere itself, or the bounding sphere of the box.
  JFPX_HD const SphereInstance& bounds(SubShape i) const { return all_bounds[i]; }

  /// Moves a sphere or box to the pose of its body.
  JFPX_HD void update_pose(const BodyView& store, SubShape i) const {
    const Vec3& position = store.position[bodies[i]];
    SphereInstance& bounds = all_bounds[i];
    bounds.centre = position;
    if (is_sphere(i) && parts[i] == 0) return;
    Transform pose = make_transform(store.orientation[bodies[i]], position);
    if (parts[i] != 0) {
      const Transform& of_part = local[parts[i] - 1];
      bounds.centre = transform_point(pose, of_part.origin);
      if (is_sphere(i)) return;
      pose = {pose.basis * of_part.basis, bounds.centre};
    }
    boxes[i - sphere_count].pose = pose;
  }
};

/// Two sub-shapes that may touch.
struct Candidate {
  std::uint32_t a = 0, b = 0;  ///< bodies, in the order that Contact defines
  SubShapeView::SubShape sub_shape_a = 0, sub_shape_b = 0;
  friend auto operator<=>(const Candidate&, const Candidate&) = default;
};

/// A pair of sub-shapes in the order of their bodies.
JFPX_HD inline Candidate ordered(const BodyView& bodies, const SubShapeView& sub_shapes,
                                 SubShapeView::SubShape x, SubShapeView::SubShape y) {
  const std::uint32_t a = sub_shapes.body(x), b = sub_shapes.body(y);
  const bool a_is_sphere = bodies.radius[a] > 0, b_is_sphere = bodies.radius[b] > 0;
  const bool any_compound = sub_shapes.is_part(x) || sub_shapes.is_part(y);
  bool a_comes_first = a < b;
  if (!(a_is_sphere && b_is_sphere)) {
    if (!any_compound && a_is_sphere != b_is_sphere) {
      a_comes_first = a_is_sphere;
    } else if (bodies.movable(a) != bodies.movable(b)) {
      a_comes_first = bodies.movable(a);
    }
  }
  if (a_comes_first) return {a, b, x, y};
  return {b, a, y, x};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
