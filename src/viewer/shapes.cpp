/// Extents of shapes, and intersections of rays with them.
#include "src/viewer/shapes.hpp"

#include "src/scene/compound.hpp"
#include "src/viewer/mesh_geometry.hpp"
#include "src/viewer/surface_mesh.hpp"

#include <algorithm>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

Real ray_distance(const Shape& shape, const BodyState& state, const Vec3& from,
                  const Vec3& direction) {
  Real nearest = kMaxReal;
  for_each_solid(shape, state, [&](const auto& solid, const BodyState& at) {
    const jfpx::detail::RayEntry entry = jfpx::detail::enter(from, direction, solid, pose(at));
    if (entry.hit) nearest = std::min(nearest, entry.distance);
  });
  return nearest;
}

Real size_of(const Shape& shape) { return outer_radius(shape); }

Vec3 middle_of(const Shape& shape) {
  const TriangleMesh mesh = mesh_of(shape);
  return has_surface(mesh) ? centre_of(mesh) : Vec3{};
}

Real reach_of(const Shape& shape) {
  const TriangleMesh mesh = mesh_of(shape);
  if (!has_surface(mesh)) return size_of(shape);
  const Aabb bounds = bounds_of(mesh);
  return length(bounds.upper - bounds.lower) / 2;
}

Aabb bounds_of(const TriangleMesh& mesh, const BodyDef& body) {
  const Aabb local = bounds_of(mesh);
  const Vec3 half = (local.upper - local.lower) * Real(0.5);
  const Mat3 basis = to_matrix(body.orientation);
  const Vec3 centre = body.position + basis * centre_of(mesh);
  Vec3 reach;
  for (int i = 0; i < 3; ++i) reach[i] = jfpx::detail::projected_half_length(half, basis.row[i]);
  return {centre - reach, centre + reach};
}

BodyState placed(const CompoundPart& part, const BodyState& body) {
  return {to_world_point(body, part.position), body.orientation * part.orientation, {}, {}};
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
