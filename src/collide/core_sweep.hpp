/// Sweep of a ball along a line against a fixed shape, for continuous collision.
#pragma once

#include "src/collide/shapes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Distance of a point from a shape, in the axes of the shape. A distance of at most 0 is inside;
/// the normal is not set then.
JFPX_HD inline Separation point_separation(const Vec3& p, const HalfSpace& half_space) {
  return {half_space.normal, dot(half_space.normal, p) - half_space.offset};
}
JFPX_HD inline Separation point_separation(const Vec3& p, const Box& box) {
  const Vec3 offset = offset_from_box(p, box);
  const Real distance = length(offset);
  if (!(distance > 0)) return {};
  return {offset * (Real(1) / distance), distance};
}
JFPX_HD inline Separation point_separation(const Vec3& p, const Capsule& capsule) {
  const Real h = capsule.half_height, y = p.y > h ? p.y - h : p.y < -h ? p.y + h : Real(0);
  const Vec3 offset{p.x, y, p.z};
  const Real distance = length(offset);
  if (!(distance > capsule.radius)) return {};
  return {offset * (Real(1) / distance), distance - capsule.radius};
}
template <Round S>
JFPX_HD Separation point_separation(const Vec3& p, const S& solid) {
  return closest_to(to_frustum(solid), p);
}
JFPX_HD inline Separation point_separation(const Vec3& p, const HullReference& hull) {
  const HullPoint closest = closest_to(*hull.hull, p);
  return {closest.normal, closest.distance};
}
/// The triangle has no inside.
JFPX_HD inline Separation point_separation(const Vec3& p, const TriangleInstance& triangle) {
  const Vec3 offset = closest_on(triangle, p).offset;
  const Real distance = length(offset);
  if (!(distance > 0)) return {};
  return {offset * (Real(1) / distance), distance};
}

/// A ball that moves along a line, in the axes of a fixed shape.
struct CoreMotion {
  Vec3 from, motion;  ///< [m]
  Real radius = 0;    ///< [m], > 0
  Real error = 0;     ///< [m], of `from`
};

/// Conservative advancement (Mirtich 1996) of a ball to a convex shape without thickness or with an
/// inside. A ball that overlaps the shape at the start is made smaller, so that its centre never
/// reaches the shape. A centre that is inside at the start does not collide.
/// @param t receives the fraction of the motion in [0, 1] after which the ball touches
/// @returns whether it does
template <class S>
JFPX_HD bool sweep_core(const CoreMotion& core, const S& shape, Real* t) {
  // At a grazing angle the last steps are short. The ball then stops before it touches.
  constexpr int kMostAdvances = 64;
  constexpr Real kShare = Real(15) / 16, kTolerance = Real(1) / 64;
  Separation s = point_separation(core.from, shape);
  if (!(s.distance > core.error)) return false;
  const Real closest = s.distance * kShare;
  const Real target = core.radius < closest ? core.radius : closest;
  *t = 0;
  for (int i = 0;; ++i) {
    const Real gap = s.distance - target;
    const bool touches = !(gap > target * kTolerance) || i == kMostAdvances;
    if (touches && i > 0) return true;
    const Real closing = -dot(core.motion, s.normal);
    if (!(closing > 0)) return false;
    if (touches) return true;
    *t += gap / closing;
    if (!(*t <= 1)) return false;
    s = point_separation(add_scaled(core.from, core.motion, *t), shape);
  }
}

/// Calls hit(t) for the triangles of a mesh that a ball touches. A one-sided triangle is touched by
/// balls whose centre starts in front of it. Triangles after the first one may be left out.
/// @param hit returns the least t of all calls so far, or more than 1
template <class Hit>
JFPX_HD void sweep_core_to_mesh(const CoreMotion& core, const MeshView& mesh, const Hit& hit) {
  // The bounds of a long diagonal contain most of a mesh, those of its parts do not.
  constexpr int kParts = 8;
  const Real reach = core.radius * Real(1.25) + core.error;
  const bool is_long = length_squared(core.motion) > 16 * core.radius * core.radius;
  const int parts = is_long ? kParts : 1;
  const Vec3 half{reach, reach, reach};
  Real first = 2;
  for (int part = 0; part < parts; ++part) {
    const Real end = Real(part + 1) / Real(parts);
    const Vec3 a = add_scaled(core.from, core.motion, Real(part) / Real(parts));
    const Vec3 b = add_scaled(core.from, core.motion, end);
    const Aabb box = merged({a - half, a + half}, {b - half, b + half});
    mesh.visit_overlapping(box, [&](std::uint32_t index) {
      TriangleInstance triangle;
      if (!make_instance(mesh, index, {}, core.from, &triangle)) return;
      Real t = 0;
      const CoreMotion relative{{}, core.motion, core.radius, core.error};
      if (sweep_core(relative, triangle, &t)) first = hit(t);
    });
    if (first <= end) return;
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
