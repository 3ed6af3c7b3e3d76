/// Pair tests of a solid and the sub-shapes of bodies.
#include "src/world/queries/solid_query.hpp"

#include <jfpx/collide.hpp>

#include "src/collide/mesh_queries.hpp"
#include "src/world/bodies/posed_sub_shapes.hpp"
#include "src/world/bodies/sub_shape_view.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Calls visit(contact) for the points where a solid touches a sub-shape, until it returns false.
/// The triangles of a mesh come in any order, and are the parts of their contacts.
template <class S, class Visit>
void visit_touches(const QuerySolid& solid, const S& shape, const Transform& at,
                   const Visit& visit) {
  if constexpr (detail::kIsMesh<S>) {
    const detail::PairMotion at_rest{{}, 0, 0, {}, {}};
    const detail::MeshView mesh = detail::view_of(shape);
    detail::PairManifold manifold;
    bool goes_on = true;
    const auto visit_triangle = [&](const auto& instance, std::uint32_t triangle) {
      manifold.clear();
      find_contact_with_triangle(instance, mesh, triangle, at, at_rest, &manifold);
      for (std::uint32_t i = 0; i < manifold.touch_count && goes_on; ++i) {
        const auto& [point, distance] = manifold.touches[i];
        goes_on = visit(DeepestContact{true, point, manifold.normal, distance, triangle});
      }
    };
    const auto visit_triangles = [&](const auto& s) {
      const auto instance = detail::instance(s, solid.pose);
      detail::visit_triangles_around(mesh, at, solid.pose.origin, solid.half_extents,
                                     [&](std::uint32_t triangle) {
                                       if (goes_on) visit_triangle(instance, triangle);
                                     });
    };
    std::visit(visit_triangles, solid.shape);
  } else {
    Manifold manifold;
    if constexpr (detail::kIsWall<S>) {
      const Vec3 centre = std::visit(
          [&](const auto& s) { return detail::centre_of(detail::instance(s, solid.pose)); },
          solid.shape);
      manifold = collide(solid.shape, solid.pose, to_wall(shape).solid_for(centre));
    } else {
      manifold = collide(solid.shape, solid.pose, SolidShape(shape), at);
    }
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& p = manifold.points[i];
      if (!visit(DeepestContact{true, p.point, manifold.normal, p.distance})) return;
    }
  }
}

/// Whether the bounds of a sub-shape overlap those of a solid. The margin is less than that of
/// QueryTree.
template <class S>
bool bounds_overlap(const QuerySolid& solid, const S& shape, const Transform& at) {
  if constexpr (!detail::kIsWall<S>) {
    const Vec3 half = detail::half_extents(shape, at);
    for (int i = 0; i < 3; ++i) {
      const Real apart = absolute(at.origin[i] - solid.pose.origin[i]);
      const Real reach = half[i] + solid.half_extents[i];
      if (apart > reach + 64 * kEpsilon * (apart + reach)) return false;
    }
  }
  return true;
}

}  // namespace

QuerySolid::QuerySolid(const SolidShape& solid, const Transform& at) : shape(solid), pose(at) {
  half_extents = std::visit([&](const auto& s) { return detail::half_extents(s, pose); }, shape);
}

bool QuerySolid::touches(const BodyStore& bodies, std::uint32_t body) const {
  bool found = false;
  for_each_posed_sub_shape(bodies, body,
                           [&](const auto& sub_shape, const Transform& at, std::uint32_t) {
                             if (found) return;
                             visit_touches(*this, sub_shape, at, [&](const DeepestContact&) {
                               found = true;
                               return false;
                             });
                           });
  return found;
}

namespace {

/// @param part    number of the shape in its compound, or 0
/// @param deepest receives the contact if it is deeper
template <class S>
void find_deepest(const QuerySolid& solid, const S& shape, const Transform& at, std::uint32_t part,
                  DeepestContact* deepest) {
  if (!bounds_overlap(solid, shape, at)) return;
  DeepestContact own;
  visit_touches(solid, shape, at, [&](const DeepestContact& c) {
    const bool is_first = c.distance == own.distance && c.part < own.part;
    if (!own.touches || c.distance < own.distance || is_first) own = c;
    return true;
  });
  if (!own.touches || (deepest->touches && !(own.distance < deepest->distance))) return;
  *deepest = own;
  deepest->part += part;  // one of both is 0
}

}  // namespace

DeepestContact QuerySolid::deepest_contact(const BodyStore& bodies, std::uint32_t body) const {
  DeepestContact deepest;
  for_each_posed_sub_shape(bodies, body,
                           [&](const auto& sub_shape, const Transform& at, std::uint32_t part) {
                             find_deepest(*this, sub_shape, at, part, &deepest);
                           });
  return deepest;
}

template <class S>
DeepestContact QuerySolid::deepest_contact(const S& mesh, const Transform& at) const {
  DeepestContact deepest;
  find_deepest(*this, mesh, at, 0, &deepest);
  return deepest;
}
template DeepestContact QuerySolid::deepest_contact(const TriangleMesh&, const Transform&) const;
template DeepestContact QuerySolid::deepest_contact(const Heightfield&, const Transform&) const;

}  // namespace JFPX_ABI
}  // namespace jfpx
