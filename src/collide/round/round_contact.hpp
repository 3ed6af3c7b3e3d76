/// Contacts of round solids with all other shapes.
#pragma once

#include "src/collide/round/round_points.hpp"
#include "src/collide/shapes/hull.hpp"

#include <concepts>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Four points of two caps carry a stack as well as eight, which are too stiff for a high one.
using RoundSelection = DirectedSelection<4>;

/// A convex solid for contacts with round ones, with its radius and a point inside.
template <class S>
struct ConvexPart {
  S solid;
  Real radius = 0, size = 0;
  Vec3 centre;
};
template <Round S>
JFPX_HD ConvexPart<Frustum> convex_part(const S& solid) {
  const Frustum frustum = to_frustum(solid);
  return {frustum, 0, frustum.outer_radius(), {}};
}
JFPX_HD inline ConvexPart<BoxPolyhedron> convex_part(const Box& box) {
  return {{box.half_extents}, 0, length(box.half_extents), {}};
}
JFPX_HD inline ConvexPart<HullPolyhedron> convex_part(const HullReference& hull) {
  return {{hull.hull}, 0, hull.hull->outer_radius, hull.hull->centre};
}
JFPX_HD inline ConvexPart<CoreSegment> convex_part(const Capsule& capsule) {
  return {{capsule.half_height}, capsule.radius, capsule.half_height, {}};
}

/// A ball and a round solid, by the closest point of the solid.
template <Round S>
JFPX_HD void find_contact(const SphereInstance& a, const Posed<S>& b, const PairMotion& pair,
                          PairManifold* manifold) {
  const Frustum frustum = to_frustum(b.shape);
  Vec3 centre;
  Separation closest;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    centre = moved(a.centre, pair, part);
    const Separation local = closest_to(frustum, inverse_transform_point(b.pose, centre));
    return closest = {b.pose.basis * local.normal, local.distance - a.radius};
  };
  if (!advance(pair, separation_at, &t)) return;
  const Vec3& n = closest.normal;
  const Real overlap = closest.distance < 0 ? closest.distance : Real(0);
  const Vec3 arm = n * -(a.radius + overlap * Real(0.5));
  manifold->normal = n;
  manifold->add(arm + (a.centre - pair.origin_a), centre + arm - pair.origin_b,
                closest.distance - t * dot(pair.motion, n), 0, a.centre + arm);
}

/// The supporting feature of a round solid below or near a half-space: the ends of a line of its
/// side, or at most five points of a cap.
template <Round S>
JFPX_HD void find_contact(const Posed<S>& a, const HalfSpace& wall, const PairMotion& pair,
                          PairManifold* manifold) {
  RoundSelection selection(wall.normal);
  const Real closing = -dot(wall.normal, pair.motion);
  const Real most = pair.margin + (closing > 0 ? closing : Real(0));
  visit_lowest_points(to_frustum(a.shape), inverse_transform_direction(a.pose, -wall.normal),
                      [&](const Vec3& local, std::uint32_t feature) {
                        const Vec3 point = transform_point(a.pose, local);
                        const Real distance = dot(wall.normal, point) - wall.offset;
                        if (distance <= most) selection.add(point, distance, feature);
                      });
  selection.visit([&](const Vec3& point, Real, std::uint32_t feature) {
    add_corner(point, 0, wall, feature, pair, manifold);
  });
}

/// Two convex solids, by conservative advancement along separating axes. Not inlined, because
/// several pairs of kinds share it.
template <class A, class B>
[[gnu::noinline]] JFPX_HD void find_contact_of_convex(
    const ConvexPart<A>& a, const Transform& pose_a, const ConvexPart<B>& b,
    const Transform& pose_b, const PairMotion& pair, PairManifold* manifold) {
  const Real radii = a.radius + b.radius;
  ConvexPair<A, B> solids{
      a.solid,  b.solid,        transposed(pose_a.basis) * pose_b.basis, {}, a.centre,
      b.centre, a.size + b.size};
  ConvexAxes axes;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    solids.offset =
        transform_transpose(pose_a.basis, pose_b.origin - moved(pose_a.origin, pair, part));
    if (!find_axes(solids, radii, pair.limit + radii, &axes)) return {{}, 0, false};
    return {pose_a.basis * axes.preferred.normal, axes.preferred.distance - radii};
  };
  if (!advance(pair, separation_at, &t)) return;
  const LeastOverlap* axis = &axes.preferred;
  RoundSelection selection(axis->normal);
  const auto add = [&](const Vec3& p, Real distance, std::uint32_t feature) {
    selection.add(p, distance, feature);
  };
  manifold->is_steady =
      visit_contact_points(solids, axes.kind, *axis, a.radius, b.radius, pair.margin, add);
  // Polygons that stand for caps may miss what touches only the rim.
  if (selection.is_empty()) {
    axis = &axes.widest;
    visit_contact_points(solids, ConvexAxes::other, *axis, a.radius, b.radius, pair.margin, add);
  }
  const Real distance = axis->distance - radii;
  if (selection.is_empty() && distance <= pair.margin) {
    const Vec3 farthest = support_point(solids.a, -axis->normal);
    add(add_scaled(farthest, axis->normal, -(a.radius + distance * Real(0.5))), distance,
        kRimPoint);
  }
  manifold->normal = pose_a.basis * axis->normal;
  add_selected(selection, pose_a, pair.motion * t, pair, manifold);
}
template <Round A, class B>
requires(std::same_as<B, Box> || std::same_as<B, HullReference> || Round<B>) JFPX_HD
    void find_contact(const Posed<A>& a, const Posed<B>& b, const PairMotion& pair,
                      PairManifold* manifold) {
  find_contact_of_convex(convex_part(a.shape), a.pose, convex_part(b.shape), b.pose, pair,
                         manifold);
}
template <Round B>
JFPX_HD void find_contact(const Posed<Capsule>& a, const Posed<B>& b, const PairMotion& pair,
                          PairManifold* manifold) {
  find_contact_of_convex(convex_part(a.shape), a.pose, convex_part(b.shape), b.pose, pair,
                         manifold);
}

/// A triangle in the axes of a frustum.
struct FrustumTriangle : LocalTriangle {
  ConvexPair<Frustum, TriangleFace> pair;
  LeastOverlap closest;  ///< the best axis, improved

  /// The axes: kFaceAxis + i is cap i; kEdgeAxis is the improved axis; kEdgeAxis + 1 + 2 k and the
  /// next one are the common normals of the axis of revolution and edge k.
  static constexpr int kEdgeAxis = kFaceAxis + 2;

  JFPX_HD Real lowest(const Vec3& axis) const { return dot(axis, support_point(pair.a, -axis)); }
  /// Whether the corners of the mesh are clockwise, seen from the side of the frustum.
  JFPX_HD bool is_flipped() const { return dot(cross(edge(0), corner[2] - corner[0]), normal) < 0; }
};

/// Calls visit(overlap), until it returns false, for all axes except the normal of the triangle.
/// @returns false if a call did
template <class Visit>
JFPX_HD bool for_each_axis(const FrustumTriangle& f, const Visit& visit) {
  const auto visit_axis = [&](int index, const Vec3& n, Real error) {
    return visit(LeastOverlap{index, f.lowest(n) - f.support(n), error, n});
  };
  for (int i = 0; i < f.pair.a.cap_count(); ++i) {
    if (!visit_axis(kFaceAxis + i, -f.pair.a.cap_normal(i), f.error())) return false;
  }
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = f.edge(k);
    const Vec3 axis{edge.z, 0, -edge.x};  // the cross product with the y axis
    const Real across2 = length_squared(axis), size2 = length_squared(edge);
    if (!(across2 > 4 * kEpsilon * size2)) continue;
    const Real scale = Real(1) / square_root(across2);
    const Real error = f.error() * (square_root(size2) * scale);
    const int index = FrustumTriangle::kEdgeAxis + 1 + 2 * k;
    if (!visit_axis(index, axis * scale, error)) return false;
    if (!visit_axis(index + 1, axis * -scale, error)) return false;
  }
  return f.closest.axis < 0 || visit(f.closest);
}

/// Calls add(point, distance, feature) for the points of the contact, in the axes of the frustum;
/// the point is in the middle of the overlap. Of points on an edge whose neighbor is in the same
/// plane, only those of the frustum are kept: see points_on_triangle().
/// @returns whether two flat faces lie on each other
template <class Add>
JFPX_HD bool visit_contact_points(const FrustumTriangle& f, const LeastOverlap& axis, Real margin,
                                  const Add& add) {
  ConvexAxes::Kind kind = ConvexAxes::other;
  LeastOverlap local = axis;
  if (axis.axis == kNormalAxis) {
    const bool is_flipped = f.is_flipped();
    const auto is_kept = [&](int k) {
      const int edge = is_flipped ? (k == 2 ? 2 : 1 - k) : k;
      return (f.flat_edges >> edge & 1) == 0;
    };
    const auto triangle = make_face(
        3, [&](int k) { return f.pair.b.corner[k]; }, f.normal);
    return visit_incident(
        make_reference(triangle, is_kept, f.error()), f.pair.a, [](const Vec3& p) { return p; },
        -f.normal,
        [&](const Vec3& p, Real distance, std::uint32_t feature) {
          if (!(distance <= margin)) return;
          add(add_scaled(p, f.normal, distance * Real(-0.5)), distance, feature);
        });
  }
  if (axis.axis < FrustumTriangle::kEdgeAxis) {
    kind = ConvexAxes::face_of_a;
    local.axis = axis.axis - kFaceAxis;
  }
  return visit_contact_points(f.pair, kind, local, 0, 0, margin, add);
}

/// @param shift [m], world axes, motion of the solid since the start of the step
/// @returns false if an axis separates the shapes by more than `limit`
JFPX_HD inline bool place_triangle(const Frustum& frustum, const Mat3& axes,
                                   const TriangleInstance& triangle, const Vec3& shift, Real limit,
                                   FrustumTriangle* result, LeastOverlap* widest) {
  FrustumTriangle& f = *result;
  const Real radius = frustum.outer_radius();
  f.place(axes, triangle, shift, {}, radius);
  f.pair.a = frustum;
  TriangleFace& face = f.pair.b;
  const bool is_flipped = f.is_flipped();
  for (int k = 0; k < 3; ++k) face.corner[k] = f.corner[is_flipped ? 2 - k : k];
  face.normal = f.normal;
  f.pair.size = f.size;
  f.closest.axis = -1;
  if (!widest_separation(f, limit, widest)) return false;
  const Real before = widest->distance;
  LeastOverlap closest = *widest;
  improve(f.pair, limit, kLastRounds, &closest.normal, &closest.distance);
  find_separating_axis(f.pair, &closest.normal, &closest.distance);
  if (closest.distance > limit) return false;
  if (!(closest.distance > before + f.error())) return true;
  closest.axis = FrustumTriangle::kEdgeAxis;
  closest.error = 8 * f.error();
  f.closest = *widest = closest;
  return true;
}

/// A frustum and a triangle of a mesh. Not inlined: see find_contact_of_convex().
[[gnu::noinline]] JFPX_HD inline void find_contact_of_frustum(const Frustum& frustum,
                                                              const Transform& pose,
                                                              const TriangleInstance& b,
                                                              const PairMotion& pair,
                                                              PairManifold* manifold) {
  const Mat3& axes = pose.basis;
  FrustumTriangle triangle;
  LeastOverlap widest;
  Real t = 0;
  const auto separation_at = [&](Real part) -> Separation {
    if (!place_triangle(frustum, axes, b, pair.motion * part, pair.limit, &triangle, &widest)) {
      return {{}, 0, false};
    }
    return {axes * widest.normal, widest.distance};
  };
  if (!advance(pair, separation_at, &t)) return;
  LeastOverlap axis;
  if (!find_contact_axis(triangle, b, axes, widest, &axis)) return;
  RoundSelection selection(axis.normal);
  const auto add = [&](const Vec3& p, Real distance, std::uint32_t feature) {
    selection.add(p, distance, feature);
  };
  manifold->is_steady = visit_contact_points(triangle, axis, pair.margin, add);
  // The polygon that stands for a cap may miss what touches only the rim.
  if (selection.is_empty() && axis.axis != kNormalAxis) {
    visit_contact_points(triangle.pair, ConvexAxes::other, axis, 0, 0, pair.margin, add);
  }
  manifold->normal = axes * axis.normal;
  add_selected(selection, pose, pair.motion * t, pair, manifold);
}
template <Round S>
JFPX_HD void find_contact(const Posed<S>& a, const TriangleInstance& b, const PairMotion& pair,
                          PairManifold* manifold) {
  find_contact_of_frustum(to_frustum(a.shape), a.pose, b, pair, manifold);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
