/// Closest points by the algorithm of Gilbert, Johnson and Keerthi (1988), and their depth by the
/// pair tests of contacts.
#include "src/collide/closest_points.hpp"

#include <jfpx/collide.hpp>

#include "src/collide/core_distance.hpp"
#include "src/collide/mesh_queries.hpp"

#include <algorithm>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
namespace {

constexpr double kInfiniteDistance = std::numeric_limits<double>::infinity();

/// Bounds of the distance that are this close to each other are accurate.
double tolerance_of(const CorePair& pair) { return pair.size * 0x1p-42; }

/// The closest points of cores, of which a is translated by `shift`, or a lower bound of their
/// distance that exceeds `enough`. The search may end early if edges are nearly parallel, so it is
/// repeated from its results.
WidestAxis find_apart(const CorePair& pair, const Wide& shift, const Wide& start, double enough) {
  constexpr int kMostRounds = 4;
  WidestAxis best;
  Wide from = start;
  for (int i = 0; i < kMostRounds; ++i) {
    const WidestAxis next = widest_of_separated(pair, shift, from, pair.size * 0x1p-50, enough);
    if (i == 0 || next.distance < best.distance) {
      best.distance = next.distance;
      best.direction = next.direction;
      best.on_a = next.on_a;
    }
    if (i == 0 || next.widest > best.widest) best.widest = next.widest, best.axis = next.axis;
    if (best.widest > enough || best.distance - best.widest <= tolerance_of(pair)) break;
    from = i % 2 == 0 ? best.axis : best.direction;
  }
  return best;
}

/// The direction of the closest points, unless the cores are less separated along it, by more than
/// the rounding errors.
Wide widest_axis(const CorePair& pair, const WidestAxis& closest) {
  const double least = pair.separation(closest.axis) - tolerance_of(pair);
  return pair.separation(closest.direction) >= least ? closest.direction : closest.axis;
}

/// Two cores in the axes of the target, which is a.
CorePair core_pair(const ConvexCore& target, const ConvexCore& solid, const Mat3& rotation,
                   const Vec3& offset) {
  CorePair pair{target, solid, WideMatrix(rotation), Wide(offset)};
  pair.size =
      static_cast<double>(target.reach) + static_cast<double>(solid.reach) + length(Wide(offset));
  return pair;
}
double sum_of_radii(const CorePair& pair) {
  return static_cast<double>(pair.a.radius) + static_cast<double>(pair.b.radius);
}

/// The deepest point of a contact, unless the solids overlap less along the axis of `pair`.
void replace_by_contact(const Manifold& contact, const CorePair& cores, const Transform& pose,
                        ClosestPair* pair) {
  if (contact.count == 0) return;
  const ManifoldPoint* deepest = contact.points;
  for (int i = 1; i < contact.count; ++i) {
    if (contact.points[i].distance < deepest->distance) deepest = contact.points + i;
  }
  // The points of contacts of tiny cylinders and cones are not always numbers.
  if (!is_finite(deepest->point)) return;
  const Wide opposite(inverse_transform_direction(pose, contact.normal));
  const Wide axis = opposite * (-1 / length(opposite));
  const double distance = cores.separation(axis) - sum_of_radii(cores);
  if (!(distance >= static_cast<double>(pair->distance) - cores.error())) return;
  pair->distance = static_cast<Real>(distance);
  pair->normal = normalized(contact.normal);
  pair->point = add_scaled(deepest->point, pair->normal, pair->distance * Real(-0.5));
}

}  // namespace

ClosestPair find_closest(const ConvexCore& target, const ConvexCore& solid, const Mat3& rotation,
                         const Vec3& offset, Real limit) {
  const CorePair pair = core_pair(target, solid, rotation, offset);
  const Wide solid_centre = pair.offset + pair.rotation * Wide(solid.centre);
  const Wide between = Wide(target.centre) - solid_centre;
  const double apart = length(between);
  Wide axis = apart > 0 ? between * (1 / apart) : Wide(0, 1, 0);
  if (const auto* triangle = std::get_if<TriangleFace>(&target.core)) {
    const Wide normal(triangle->normal);
    axis = dot(normal, axis) > 0 ? normal : -normal;
  }
  const double radii = sum_of_radii(pair);
  // More than the errors of the distance that is compared with the limit, which is rounded to Real.
  const double enough = static_cast<double>(limit) * (1 + static_cast<double>(kEpsilon)) + radii +
                        pair.error() + 2 * tolerance_of(pair);
  WidestAxis closest = find_apart(pair, {}, axis, enough);
  if (closest.widest > enough) return {};
  ClosestPair result;
  // The closest point of a thin triangle may be too close by a rounding error.
  double between_cores = std::max(closest.distance, closest.widest);
  const bool is_accurate = closest.distance - closest.widest <= tolerance_of(pair);
  if (closest.widest > (is_accurate ? pair.size * 0x1p-30 : pair.clear_gap())) {
    axis = widest_axis(pair, closest);
  } else {
    // The points are too close for an accurate direction. Those of cores that are parted a little
    // are clear.
    axis = closest.axis;
    between_cores = find_widest(pair, radii + pair.error(), &axis);
    const double parted = std::max(pair.clear_gap() - between_cores, 0.0);
    closest = find_apart(pair, axis * parted, axis, kInfiniteDistance);
    closest.axis = axis;
    axis = exact_axis(pair, axis, widest_axis(pair, closest));
    between_cores = pair.separation(axis);
    result.is_inside = !(between_cores > pair.error());
  }
  // The centre of a ball is exact.
  const bool is_ball = std::holds_alternative<CorePoint>(solid.core);
  const Wide on_target = is_ball ? pair.offset + axis * between_cores : closest.on_a;
  result.distance = static_cast<Real>(between_cores - radii);
  result.found = result.distance <= limit;
  result.normal = to_vec3(-axis);
  result.point = to_vec3(on_target - axis * static_cast<double>(target.radius));
  return result;
}

ClosestPair find_closest(const PlacedSolid& target, const PlacedSolid& solid, Real limit) {
  const Transform& at = target.pose;
  const Mat3 rotation = transposed(at.basis) * solid.pose.basis;
  const Vec3 offset = inverse_transform_point(at, solid.pose.origin);
  ClosestPair pair = find_closest(target.core, solid.core, rotation, offset, limit);
  if (!pair.found) return pair;
  pair.point = transform_point(at, pair.point);
  pair.normal = normalized(at.basis * pair.normal);
  if (pair.is_inside) {
    replace_by_contact(collide(solid.shape, solid.pose, target.shape, at),
                       core_pair(target.core, solid.core, rotation, offset), at, &pair);
  }
  return pair;
}

ClosestPair find_closest(const HalfSpace& target, const PlacedSolid& solid, Real limit) {
  const Wide n(target.normal);
  const WideMatrix axes(solid.pose.basis);
  const Wide lowest =
      axes * support_of(solid.core, axes.transpose_times(-n)) + Wide(solid.pose.origin);
  const double above = dot(n, lowest) - static_cast<double>(target.offset);
  ClosestPair pair;
  pair.distance = static_cast<Real>(above - static_cast<double>(solid.core.radius));
  pair.found = pair.distance <= limit;
  pair.normal = target.normal;
  pair.point = to_vec3(lowest - n * above);
  return pair;
}

ClosestPair find_closest(const MeshView& mesh, const Transform& mesh_pose, const PlacedSolid& solid,
                         const Vec3& half_extents, Real limit) {
  const Mat3 rotation = transposed(mesh_pose.basis) * solid.pose.basis;
  const Vec3 from = inverse_transform_point(mesh_pose, solid.pose.origin);
  const Vec3 centre = from + rotation * solid.core.centre;
  ClosestPair closest;
  Vec3 origin;
  const auto visit = [&](std::uint32_t triangle) {
    Vec3 corner[3];
    mesh.get_corners(triangle, corner);
    const Vec3 start = corner[0], normal = mesh.normal(triangle, corner);
    for (Vec3& p : corner) p -= start;
    if (mesh.two_sided == 0 && dot(normal, centre - start) < 0) return limit;
    ClosestPair pair =
        find_closest(make_core(corner, normal), solid.core, rotation, from - start, limit);
    pair.distance = std::max(pair.distance, Real(0));
    pair.part = triangle;
    const bool is_first =
        !closest.found || pair.distance < closest.distance || triangle < closest.part;
    if (pair.found && is_first) {
      closest = pair;
      origin = start;
      limit = pair.distance;
    }
    return limit;
  };
  visit_triangles_nearby(mesh, from, half_extents, limit, visit);
  if (!closest.found) return {};
  closest.point = transform_point(mesh_pose, closest.point + origin);
  closest.normal = normalized(mesh_pose.basis * closest.normal);
  return closest;
}

}  // namespace detail
namespace {

constexpr Real kUnlimited = std::numeric_limits<Real>::infinity();

ClosestPoints to_points(const detail::ClosestPair& pair) {
  return {pair.distance, pair.normal, add_scaled(pair.point, pair.normal, pair.distance),
          pair.point};
}

}  // namespace

ClosestPoints closest_points(const SolidShape& a, const Transform& pose_a, const SolidShape& b,
                             const Transform& pose_b) {
  return to_points(detail::find_closest(detail::PlacedSolid(b, pose_b),
                                        detail::PlacedSolid(a, pose_a), kUnlimited));
}

ClosestPoints closest_points(const SolidShape& solid, const Transform& pose,
                             const HalfSpace& half_space) {
  return to_points(detail::find_closest(half_space, detail::PlacedSolid(solid, pose), kUnlimited));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
