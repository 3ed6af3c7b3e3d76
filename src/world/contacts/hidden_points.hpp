/// Contact points at seams between boxes and hulls.
///
/// A body that moves over flush boxes or hulls would catch on their edges and on the faces between
/// them, because each contact knows one solid only. A point is hidden by another contact of the
/// same body if the union of both solids has no surface there with the normal of the point. Jolt
/// (enhanced internal edge removal) discards contacts of a mesh or compound in a similar way; this
/// rule needs no order of the contacts, and also applies to separate bodies.
#pragma once

#include "src/collide/polyhedron.hpp"
#include "src/world/contacts/swept_bounds.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// A contact of a candidate pair. Its surface is the solid b or the solid a.
struct SurfaceContact {
  const Candidate* pair = nullptr;
  Vec3 normal;  ///< unit, from b to a
  const detail::SolverPoint* points = nullptr;
  std::uint32_t count = 0;
  bool is_a = false;  ///< whether the surface is the solid a

  JFPX_HD SubShapeView::SubShape surface() const {
    return is_a ? pair->sub_shape_a : pair->sub_shape_b;
  }
  /// Unit, out of the surface.
  JFPX_HD Vec3 outward() const { return is_a ? -normal : normal; }
  JFPX_HD Real least_distance() const {
    Real least = points[0].distance;
    for (std::uint32_t i = 1; i < count; ++i) {
      if (points[i].distance < least) least = points[i].distance;
    }
    return least;
  }
  /// [m], a point near the surface.
  JFPX_HD Vec3 place_of(const BodyView& bodies, const detail::SolverPoint& point) const {
    return is_a ? bodies.position[pair->a] + point.arm_a : bodies.position[pair->b] + point.arm_b;
  }
};

namespace detail {

/// Calls visit(polyhedron, pose) if a sub-shape is a box or a hull.
template <class Visit>
JFPX_HD inline void visit_polyhedron(const SubShapeView& sub_shapes, SubShapeView::SubShape i,
                                     const Visit& visit) {
  if (sub_shapes.is_sphere(i) || sub_shapes.is_wall(i) || sub_shapes.is_mesh(i)) return;
  sub_shapes.visit_solid(i, [&](const auto& solid, const Transform& pose) {
    using S = std::decay_t<decltype(solid)>;
    if constexpr (std::is_same_v<S, Box>) {
      visit(BoxPolyhedron{solid.half_extents}, pose);
    } else if constexpr (std::is_same_v<S, HullReference>) {
      visit(HullPolyhedron{solid.hull}, pose);
    }
  });
}

/// [m], largest height of a point above the plane of a face: at most its distance from the
/// polyhedron, and <= 0 inside.
template <class P>
JFPX_HD Real height_above(const P& polyhedron, const Transform& pose, const Vec3& point) {
  const Vec3 local = transform_transpose(pose.basis, point - pose.origin);
  Real most = dot(polyhedron.face_normal(0), local) - polyhedron.face_offset(0);
  for (int i = 1; i < polyhedron.face_count(); ++i) {
    const Real height = dot(polyhedron.face_normal(i), local) - polyhedron.face_offset(i);
    most = height > most ? height : most;
  }
  return most;
}

/// @param tolerance [m], most distance of flush faces
/// @returns bit i: the point i of `contact` is hidden by the contact `other`
JFPX_HD inline std::uint32_t find_hidden(const SweptBounds& bounds, const SurfaceContact& contact,
                                         const SurfaceContact& other, Real tolerance) {
  /// [rad], between normals that count as equal
  constexpr Real kSameNormal = Real(1e-3);
  /// Cosine of the most angle between the normal of a contact with a face and that of the face.
  constexpr Real kFaceCosine = Real(0.9);
  const auto same = [](const Vec3& x, const Vec3& y) {
    return length_squared(x - y) <= kSameNormal * kSameNormal;
  };
  const Vec3 normal = contact.outward(), cover_normal = other.outward();
  if (same(normal, cover_normal)) return 0;
  std::uint32_t hidden = 0;
  const auto test = [&](const auto& solid, const Transform& pose, const auto& cover,
                        const Transform& cover_pose) {
    const Mat3& axes = cover_pose.basis;
    const int number = facing_face(cover, -transform_transpose(axes, cover_normal));
    const Vec3 face = axes * cover.face_normal(number);
    if (!(dot(face, cover_normal) >= kFaceCosine) || same(normal, face)) return;
    const Vec3 offset = pose.origin - cover_pose.origin;
    // In a concave corner, the solid is in front of the face of the other one.
    const Real in_front = dot(face, offset) + solid.support(transform_transpose(pose.basis, face)) -
                          cover.face_offset(number);
    if (!(in_front <= tolerance)) return;
    // At a convex edge of the union, the other one is behind the plane of the contact.
    const Real reach = cover.support(transform_transpose(axes, normal)) - dot(normal, offset) -
                       solid.support(transform_transpose(pose.basis, normal));
    if (!(reach > tolerance * Real(1. / 32))) return;
    const Real least = other.least_distance();
    for (std::uint32_t i = 0; i < contact.count; ++i) {
      const SolverPoint& point = contact.points[i];
      if (!(least <= point.distance + tolerance)) continue;
      const Vec3 place = contact.place_of(bounds.bodies, point);
      const Real height = height_above(solid, pose, place);
      if (height_above(cover, cover_pose, place) <= (height > 0 ? height : 0) + tolerance) {
        hidden |= 1u << i;
      }
    }
  };
  visit_polyhedron(bounds.sub_shapes, contact.surface(), [&](const auto& solid, const auto& pose) {
    visit_polyhedron(bounds.sub_shapes, other.surface(),
                     [&](const auto& cover, const auto& at) { test(solid, pose, cover, at); });
  });
  return hidden;
}

}  // namespace detail

/// Whether a contact may hide points or have hidden points: one of the solids is a box or a hull,
/// and the other one is convex.
JFPX_HD inline bool is_polyhedral(const SubShapeView& sub_shapes, const Candidate& pair) {
  const auto is_polyhedron = [&](SubShapeView::SubShape i) {
    return !sub_shapes.is_mesh(i) && sub_shapes.has_flat_faces(i);
  };
  if (sub_shapes.is_wall(pair.sub_shape_b) || sub_shapes.is_mesh(pair.sub_shape_b)) return false;
  return is_polyhedron(pair.sub_shape_a) || is_polyhedron(pair.sub_shape_b);
}

/// Whether a body does not move and is not moved.
JFPX_HD inline bool is_immovable(const BodyView& bodies, std::uint32_t body) {
  return !bodies.movable(body) && !bodies.is_carrier(body);
}

/// Whether hidden_points() may find hidden points of a contact, or points that it hides.
JFPX_HD inline bool may_hide(const SweptBounds& bounds, const Candidate& pair) {
  const SubShapeView& sub_shapes = bounds.sub_shapes;
  return (is_immovable(bounds.bodies, pair.b) || sub_shapes.is_part(pair.sub_shape_a) ||
          sub_shapes.is_part(pair.sub_shape_b)) &&
         is_polyhedral(sub_shapes, pair);
}

/// The points of a contact that another contact of the same body a hides. Both may_hide() and have
/// points. They have the same solid on one side; on the other side are parts of one body, or
/// immovable bodies.
/// @returns bit i: the point i of `contact` is hidden
JFPX_HD inline std::uint32_t hidden_points(const SweptBounds& bounds, SurfaceContact contact,
                                           SurfaceContact other) {
  const Candidate &pair = *contact.pair, &cover = *other.pair;
  const bool same_b = pair.b == cover.b;
  SubShapeView::SubShape moving = pair.sub_shape_a;
  if (pair.sub_shape_a == cover.sub_shape_a) {
    if (!same_b && !(is_immovable(bounds.bodies, pair.b) && is_immovable(bounds.bodies, cover.b))) {
      return 0;
    }
  } else if (same_b && pair.sub_shape_b == cover.sub_shape_b) {
    moving = pair.sub_shape_b;
    contact.is_a = other.is_a = true;
  } else {
    return 0;
  }
  return detail::find_hidden(bounds, contact, other, bounds.margins[moving] * Real(1. / 16));
}

/// Removes points from a list. @param hidden bit i: point i @returns the number of other points
JFPX_HD inline std::uint32_t remove_points(std::uint32_t hidden, std::uint32_t count,
                                           detail::SolverPoint* points) {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((hidden >> i & 1) == 0) points[kept++] = points[i];
  }
  return kept;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
