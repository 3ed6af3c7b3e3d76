/// Sub-shapes of all bodies as pointers to arrays, in host memory or on a device.
#pragma once

#include <jfpx/contact.hpp>

#include "src/collide/shapes.hpp"
#include "src/world/bodies/body_view.hpp"

#include <compare>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// A solid other than a sphere.
struct PosedSolid {
  detail::Solid solid;
  Transform pose;
  friend bool operator==(const PosedSolid&, const PosedSolid&) = default;
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

inline Wall to_wall(const HalfSpace& half_space) { return {half_space, false}; }
inline Wall to_wall(const Plane& plane) { return {{plane.normal, plane.offset}, true}; }

/// Index of the first sub-shape of each range. The ranges are: all spheres; other solids of movable
/// bodies, by kind; other solids of bodies of mass 0 (immovable or kinematic), by kind; meshes;
/// walls.
struct SubShapeRanges {
  static constexpr std::uint32_t kSolidKinds = detail::SolidKinds::kCount;
  static constexpr std::uint32_t kMeshes = 2 * kSolidKinds - 1;
  static constexpr std::uint32_t kWalls = kMeshes + 1, kCount = kWalls + 1;
  std::uint32_t begin[kCount + 1] = {};

  /// The range of a solid.
  JFPX_HD static constexpr std::uint32_t range_of(std::uint32_t kind, bool is_movable) {
    return kind == 0 || is_movable ? kind : kSolidKinds - 1 + kind;
  }
  /// The kind of the solids in a range.
  JFPX_HD static constexpr std::uint32_t kind_of_range(std::uint32_t range) {
    return range < kSolidKinds ? range : range + 1 - kSolidKinds;
  }
  JFPX_HD std::uint32_t range_of(std::uint32_t i) const {
    std::uint32_t range = 0;
    while (i >= begin[range + 1]) ++range;
    return range;
  }

  JFPX_HD std::uint32_t spheres() const { return begin[1]; }
  /// The first solid or mesh of a body of mass 0 other than a sphere.
  JFPX_HD std::uint32_t fixed_begin() const { return begin[kSolidKinds]; }
  JFPX_HD std::uint32_t meshes_begin() const { return begin[kMeshes]; }
  /// Number of all sub-shapes but walls.
  JFPX_HD std::uint32_t bounded() const { return begin[kWalls]; }
  JFPX_HD std::uint32_t all() const { return begin[kCount]; }
};

/// See SubShapeRanges for the order of the sub-shapes.
struct SubShapeView {
  using SubShape = std::uint32_t;

  SubShapeRanges ranges;
  const std::uint32_t* bodies = nullptr;   ///< by sub-shape
  const std::uint32_t* numbers = nullptr;  ///< by sub-shape: its index in the compound
  SphereInstance* all_bounds = nullptr;    ///< of solids and meshes
  PosedSolid* solids = nullptr;  ///< of solids other than spheres, and boxes around meshes
  const detail::MeshView* meshes = nullptr;
  const Wall* walls = nullptr;
  const std::uint32_t* parts = nullptr;  ///< by solid: 0, or 1 + index in `local`
  const Transform* local = nullptr;      ///< poses of parts, in body axes

  JFPX_HD std::uint32_t body(SubShape i) const { return bodies[i]; }
  /// Index of the sub-shape in its compound; 0 in a simple body.
  JFPX_HD std::uint32_t part(SubShape i) const { return numbers[i]; }
  /// Whether the body of the sub-shape is a compound.
  JFPX_HD bool is_part(SubShape i) const { return !is_wall(i) && parts[i] != 0; }
  JFPX_HD bool is_sphere(SubShape i) const { return i < ranges.spheres(); }
  JFPX_HD bool is_wall(SubShape i) const { return i >= ranges.bounded(); }
  JFPX_HD bool is_mesh(SubShape i) const { return i >= ranges.meshes_begin() && !is_wall(i); }
  JFPX_HD bool has_flat_faces(SubShape i) const {
    if (is_wall(i)) return false;
    if (is_mesh(i)) return true;
    bool result = false;
    detail::SolidKinds::visit(SubShapeRanges::kind_of_range(ranges.range_of(i)), [&](auto type) {
      result = detail::kHasFlatFaces<typename decltype(type)::type>;
    });
    return result;
  }
  JFPX_HD const PosedSolid& solid(SubShape i) const { return solids[i - ranges.spheres()]; }
  JFPX_HD const detail::MeshView& mesh(SubShape i) const {
    return meshes[i - ranges.meshes_begin()];
  }
  JFPX_HD const Wall& wall(SubShape i) const { return walls[i - ranges.bounded()]; }
  /// The sphere itself, or the bounding sphere of another solid.
  JFPX_HD const SphereInstance& bounds(SubShape i) const { return all_bounds[i]; }

  /// Calls visit(solid, pose) with the shape of a solid other than a sphere.
  template <class Visit>
  JFPX_HD void visit_solid(SubShape i, const Visit& visit) const {
    const PosedSolid& posed = solid(i);
    const std::uint32_t kind = SubShapeRanges::kind_of_range(ranges.range_of(i));
    detail::SolidKinds::visit(kind, [&](auto type) {
      if constexpr (detail::kSolidKind < typename decltype(type)::type >> 0) {
        visit(from_solid(posed.solid, type), posed.pose);
      }
    });
  }
  /// Calls visit(instance) with a solid in the form that find_contact() accepts.
  template <class Visit>
  JFPX_HD void visit_instance(SubShape i, const Visit& visit) const {
    if (is_sphere(i)) {
      visit(all_bounds[i]);
    } else {
      visit_solid(i, [&](const auto& shape, const Transform& pose) {
        visit(detail::instance(shape, pose));
      });
    }
  }

  /// Moves a solid to the pose of its body.
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
    solids[i - ranges.spheres()].pose = pose;
  }
};

/// Finds the contact of a solid and a triangle. @param solid in the form that find_contact()
/// accepts
template <class Instance>
JFPX_HD inline void find_contact_with_triangle(const Instance& solid, const detail::MeshView& mesh,
                                               std::uint32_t triangle, const Transform& pose,
                                               const detail::PairMotion& pair,
                                               detail::PairManifold* manifold) {
  detail::TriangleInstance b;
  if (!make_instance(mesh, triangle, pose, detail::centre_of(solid), &b)) return;
  find_contact(solid, b, pair, manifold);
}

/// Finds the contact of two sub-shapes. Only the second may be a mesh or a wall.
/// @param element  number of the triangle, if `q` is a mesh
/// @param centre   centre of mass of the body of `p`, which selects the side of a plane
/// @param manifold empty; receives the contact
JFPX_HD inline void find_contact(const SubShapeView& sub_shapes, SubShapeView::SubShape p,
                                 SubShapeView::SubShape q, std::uint32_t element,
                                 const Vec3& centre, const detail::PairMotion& pair,
                                 detail::PairManifold* manifold) {
  if (sub_shapes.is_mesh(q)) {
    sub_shapes.visit_instance(p, [&](const auto& a) {
      find_contact_with_triangle(a, sub_shapes.mesh(q), element, sub_shapes.solid(q).pose, pair,
                                 manifold);
    });
  } else if (sub_shapes.is_wall(q)) {
    const HalfSpace wall = sub_shapes.wall(q).solid_for(centre);
    sub_shapes.visit_instance(p, [&](const auto& a) { find_contact(a, wall, pair, manifold); });
  } else if (sub_shapes.is_sphere(p) && sub_shapes.is_sphere(q)) {
    // The arithmetic of the collider depends on the order of the spheres: use the collider's order.
    const SphereInstance &a = sub_shapes.bounds(p), &b = sub_shapes.bounds(q);
    if (p < q) return find_contact(a, b, pair, manifold);
    find_contact(b, a, pair.flipped(), manifold);
    manifold->flip();
  } else {
    sub_shapes.visit_instance(p, [&](const auto& a) {
      sub_shapes.visit_instance(
          q, [&](const auto& b) { detail::find_contact_of_any(a, b, pair, manifold); });
    });
  }
}

/// Two sub-shapes that may touch. A mesh forms a pair for each of its triangles.
struct Candidate {
  std::uint32_t a = 0, b = 0;  ///< bodies, in the order that Contact defines
  SubShapeView::SubShape sub_shape_a = 0, sub_shape_b = 0;
  std::uint32_t element = 0;  ///< number of the triangle, if sub_shape_b is a mesh
  friend bool operator==(const Candidate&, const Candidate&) = default;
  /// In the order of the members. Two numbers are compared at once, because sorting takes long.
  friend JFPX_HD std::strong_ordering operator<=>(const Candidate& x, const Candidate& y) {
    const auto joined = [](std::uint32_t high, std::uint32_t low) {
      return std::uint64_t{high} << 32 | low;
    };
    const std::uint64_t p = joined(x.a, x.b), q = joined(y.a, y.b);
    if (p != q) return p <=> q;
    const std::uint64_t s = joined(x.sub_shape_a, x.sub_shape_b);
    const std::uint64_t t = joined(y.sub_shape_a, y.sub_shape_b);
    return s != t ? s <=> t : x.element <=> y.element;
  }
};

/// A pair of sub-shapes in the order of their bodies.
/// @param element of `y`, if it is a mesh, which is always the second of a pair
JFPX_HD inline Candidate ordered(const BodyView& bodies, const SubShapeView& sub_shapes,
                                 SubShapeView::SubShape x, SubShapeView::SubShape y,
                                 std::uint32_t element = 0) {
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
  if (a_comes_first) return {a, b, x, y, element};
  return {b, a, y, x, element};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
