/// Brute-force oracle for the contacts of a world, which tests all pairs of sub-shapes of all
/// bodies.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/collide/sphere_pair.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/bodies/sub_shape_view.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Finds all contacts of the bodies in a store, in the order that World guarantees.
class ContactOracle {
 public:
  explicit ContactOracle(const BodyStore& bodies) : bodies_(bodies) {
    for (const BodyId id : bodies.ids()) add_sub_shapes(id.index);
    for (const SubShape& p : sub_shapes_) {
      for (const SubShape& q : sub_shapes_) {
        const bool movable = bodies.movable(p.body) || bodies.movable(q.body);
        if (p.body == q.body || !movable || !comes_first(p.body, q.body)) continue;
        const CollisionFilter &f = bodies.filter(p.body), &g = bodies.filter(q.body);
        const bool filters_match = (f.category & g.mask) != 0 && (g.category & f.mask) != 0;
        if (filters_match && !bodies.pair_ignored({p.body, q.body})) test(p, q);
      }
    }
    std::ranges::stable_sort(found_, {}, &Found::order);
  }

  std::vector<Contact> contacts() const {
    std::vector<Contact> contacts;
    for (const Found& f : found_) contacts.push_back(f.contact);
    return contacts;
  }

 private:
  struct SubShape {
    std::uint32_t body = 0, part = 0;
    Transform pose;
    Shape shape;
    bool is_sphere() const { return std::holds_alternative<Sphere>(shape); }
    bool is_wall() const {
      return std::holds_alternative<HalfSpace>(shape) || std::holds_alternative<Plane>(shape);
    }
    bool is_mesh() const {
      return std::holds_alternative<TriangleMesh>(shape) ||
             std::holds_alternative<Heightfield>(shape);
    }
    detail::MeshView mesh() const {
      const auto* heightfield = std::get_if<Heightfield>(&shape);
      return heightfield != nullptr ? detail::view_of(*heightfield)
                                    : detail::view_of(std::get<TriangleMesh>(shape));
    }
    /// Order of the kinds: that of SolidShape, meshes, walls.
    int kind() const {
      constexpr int kSolids = static_cast<int>(std::variant_size_v<SolidShape>);
      if (is_mesh()) return kSolids;
      return is_wall() ? kSolids + 1 : static_cast<int>(solid().index());
    }
    SolidShape solid() const {
      SolidShape result;
      const auto copy = [&](const auto& s) {
        if constexpr (std::is_constructible_v<SolidShape, decltype(s)>) result = s;
      };
      std::visit(copy, shape);
      return result;
    }
    SphereInstance sphere() const { return {pose.origin, std::get<Sphere>(shape).radius}; }
  };
  struct Found {
    /// Sort key: sphere pairs first, then by bodies, then by sub-shapes: by kind, each kind
    /// in the order of the parts.
    std::tuple<bool, std::uint32_t, std::uint32_t, int, std::uint32_t, int, std::uint32_t> order;
    Contact contact;
  };

  void add_sub_shapes(std::uint32_t body) {
    const BodyState state = bodies_.state(body);
    const Transform pose = make_transform(state.orientation, state.position);
    const auto* compound = std::get_if<Compound>(&bodies_.shape(body));
    if (compound == nullptr) return sub_shapes_.push_back({body, 0, pose, bodies_.shape(body)});
    std::uint32_t number = 0;
    for (const CompoundPart& part : compound->parts) {
      const Transform local = make_transform(part.orientation, part.position);
      const Shape shape = std::visit([](const auto& s) -> Shape { return s; }, part.shape);
      sub_shapes_.push_back({body, number++, pose * local, shape});
    }
  }

  bool comes_first(std::uint32_t x, std::uint32_t y) const {
    const Shape &a = bodies_.shape(x), &b = bodies_.shape(y);
    if (!std::holds_alternative<Compound>(a) && !std::holds_alternative<Compound>(b)) {
      const int spheres = std::holds_alternative<Sphere>(a) + std::holds_alternative<Sphere>(b);
      if (spheres == 2) return x < y;
      if (spheres == 1) return std::holds_alternative<Sphere>(a);
    }
    return std::pair(!bodies_.movable(x), x) < std::pair(!bodies_.movable(y), y);
  }

  void test(const SubShape& p, const SubShape& q) {
    if (p.is_sphere() && q.is_sphere()) {
      const bool swap = p.body > q.body;  // the collider tests the lower index first
      const SphereInstance a = (swap ? q : p).sphere(), b = (swap ? p : q).sphere();
      const PairResult r = detail::test_sphere_pair(a, b);
      if (r.touching == 0) return;
      add(p, q, swap ? -r.normal : r.normal, middle_point(r.normal, r.distance, b), r.distance);
    } else if (q.is_mesh()) {
      test_triangles(p, q);
    } else if (q.is_wall()) {
      add(p, q, collide(p.solid(), p.pose, solid(q.shape, p.body)));
    } else {
      add(p, q, collide(p.solid(), p.pose, q.solid(), q.pose));
    }
  }

  /// Tests all triangles of a mesh or a heightfield.
  void test_triangles(const SubShape& p, const SubShape& mesh) {
    const detail::MeshView view = mesh.mesh();
    const auto test_solid = [&](const auto& solid) {
      for (std::uint32_t i = 0; i < view.triangle_count; ++i) {
        if (!view.has_triangle(i)) continue;
        detail::PairManifold found;
        find_contact_with_triangle(detail::instance(solid, p.pose), view, i, mesh.pose, {}, &found);
        for (std::uint32_t k = 0; k < found.touch_count; ++k) {
          const auto& [point, distance] = found.touches[k];
          add(p, mesh, found.normal, point, distance);
        }
      }
    };
    std::visit(test_solid, p.solid());
  }

  /// The half-space with which a wall collides with a body.
  HalfSpace solid(const Shape& wall, std::uint32_t body) const {
    if (const auto* half_space = std::get_if<HalfSpace>(&wall)) return *half_space;
    const auto& plane = std::get<Plane>(wall);
    const bool behind = dot(plane.normal, bodies_.moving.position[body]) < plane.offset;
    return behind ? HalfSpace{-plane.normal, -plane.offset} : HalfSpace{plane.normal, plane.offset};
  }

  void add(const SubShape& p, const SubShape& q, const Vec3& normal, const Vec3& point,
           Real distance) {
    found_.push_back(
        {{!(p.is_sphere() && q.is_sphere()), p.body, q.body, p.kind(), p.part, q.kind(), q.part},
         without_material(bodies_.id(p.body), bodies_.id(q.body), normal, point, distance)});
  }
  void add(const SubShape& p, const SubShape& q, const Manifold& m) {
    for (int k = 0; k < m.count; ++k) {
      add(p, q, m.normal, m.points[k].point, m.points[k].distance);
    }
  }

  const BodyStore& bodies_;
  std::vector<SubShape> sub_shapes_;
  std::vector<Found> found_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
