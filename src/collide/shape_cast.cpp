/// Conservative advancement (Mirtich 1996) of two convex shapes along separating axes, which are
/// those of the closest points (Gilbert, Johnson and Keerthi 1988).
///
/// The distance of two convex shapes is a convex function of the motion. An axis that separates
/// them bounds it from below by a line: the shapes do not touch before the gap along the axis has
/// closed, and never if it does not close. The steps are those of Newton's method, and do not pass
/// the contact.
#include "src/collide/shape_cast.hpp"

#include "src/collide/core_distance.hpp"
#include "src/collide/mesh_queries.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

CastEntry cast(const ConvexCore& target, const ConvexCore& moving, const Mat3& rotation,
               const Vec3& offset, const LinearMotion& motion) {
  // At a grazing angle the last steps are short. The shape then stops before it touches.
  constexpr int kMostAdvances = 64;
  const double reach = static_cast<double>(target.reach) + static_cast<double>(moving.reach);
  CorePair pair{target, moving, WideMatrix(rotation), Wide(offset), reach};
  // Positions are relative to that where the centres are closest: far from a small target,
  // coordinates from the start would be inaccurate.
  const Wide direction(motion.direction);
  const auto motion_length = static_cast<double>(motion.length);
  const Wide moving_centre = pair.rotation * Wide(moving.centre), target_centre(target.centre);
  const Wide between = pair.offset + moving_centre - target_centre;
  const double ahead = -dot(between, direction);
  const Wide beside = between + direction * ahead;
  const double outside = -(reach * 1.0001 + static_cast<double>(kEpsilon) * std::abs(ahead));
  if (length(beside) > -outside || ahead < outside) return {};
  const Wide base = beside + target_centre - moving_centre;

  const double radii = static_cast<double>(target.radius) + static_cast<double>(moving.radius);
  bool has_moved = outside > -ahead;
  double s = has_moved ? outside : -ahead;
  const auto fraction = [&] { return static_cast<Real>((ahead + s) / motion_length); };
  CastEntry entry;
  if (has_moved && !(fraction() <= motion.limit)) return {};
  Wide axis = -(beside + direction * s);
  const double apart = length(axis);
  axis = apart > 0 ? axis * (1 / apart) : Wide(0, 1, 0);
  if (const auto* triangle = std::get_if<TriangleFace>(&target.core)) {
    const Wide normal(triangle->normal);
    axis = dot(normal, axis) > 0 ? normal : -normal;
  }
  for (int i = 0;; ++i) {
    pair.offset = base + direction * s;
    Wide n = axis;
    const double gap = find_widest(pair, radii + pair.error(), &n) - radii;
    const double closing = dot(n, direction);
    const bool touches = !(gap > pair.error()) || i == kMostAdvances;
    if (!(closing > 0)) {
      if (!touches || !has_moved) return {};
      break;  // the axis of the last step
    }
    axis = n;
    if (!has_moved && gap < -pair.error()) entry.is_inside = true;
    if (gap > 0) {
      s += gap / closing;
      if (!(fraction() <= motion.limit)) return {};
      has_moved = true;
    }
    if (touches) break;
  }
  entry.hit = true;
  entry.fraction = has_moved ? fraction() : Real(0);
  pair.offset = base + direction * s;
  // The closest points of touching cores are those of cores that are parted a little.
  const double separation = pair.separation(axis);
  const double parted = std::max(pair.clear_gap() - separation, 0.0);
  const WidestAxis closest = widest_of_separated(pair, axis * parted, axis, pair.error() * 0.5);
  const bool is_as_wide = pair.separation(closest.direction) >= separation - pair.error();
  if (is_as_wide && dot(closest.direction, direction) > 0) axis = closest.direction;
  axis = exact_axis(pair, direction, axis);
  entry.normal = to_vec3(-axis);
  entry.point = to_vec3(closest.on_a - axis * static_cast<double>(target.radius));
  return entry;
}

CastEntry cast(const HalfSpace& target, const ConvexCore& moving, const Transform& pose,
               const LinearMotion& motion) {
  const Vec3& n = target.normal;
  const Vec3 lowest =
      pose.basis * to_vec3(support_of(moving, Wide(inverse_transform_direction(pose, -n)))) +
      pose.origin;
  const Real height = dot(n, lowest) - target.offset - moving.radius;
  const Real closing = -dot(n, motion.direction);
  if (!(closing > 0)) return {};
  const Real distance = (height > 0 ? height : Real(0)) / closing;
  const Real fraction = distance / motion.length;
  if (!(fraction <= motion.limit)) return {};
  const Vec3 point = add_scaled(lowest, n, -moving.radius);
  return {true, false, fraction, add_scaled(point, motion.direction, distance), n, 0};
}

CastEntry cast(const MeshView& mesh, const Transform& mesh_pose, const ConvexCore& moving,
               const Transform& pose, const Vec3& half_extents, const LinearMotion& motion) {
  const Mat3 rotation = transposed(mesh_pose.basis) * pose.basis;
  const Vec3 from = inverse_transform_point(mesh_pose, pose.origin);
  const Vec3 centre = from + rotation * moving.centre;
  LinearMotion local = motion;
  local.direction = inverse_transform_direction(mesh_pose, motion.direction);
  CastEntry first;
  Vec3 origin;
  const auto visit = [&](std::uint32_t triangle) {
    Vec3 corner[3];
    mesh.get_corners(triangle, corner);
    const Vec3 start = corner[0], normal = mesh.normal(triangle, corner);
    for (Vec3& p : corner) p -= start;
    const bool is_behind = dot(normal, centre - start) < 0;
    if (mesh.two_sided != 0 || !is_behind) {
      CastEntry entry = cast(make_core(corner, normal), moving, rotation, from - start, local);
      entry.part = triangle;
      const bool is_first = !first.hit || entry.fraction < first.fraction || triangle < first.part;
      if (entry.hit && !entry.is_inside && is_first) {
        first = entry;
        origin = start;
        local.limit = entry.fraction;
      }
    }
    return local.limit * motion.length;
  };
  visit_triangles_swept(mesh, from, half_extents, local.direction, motion.limit * motion.length,
                        visit);
  first.point = transform_point(mesh_pose, first.point + origin);
  first.normal = normalized(mesh_pose.basis * first.normal);
  return first;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
