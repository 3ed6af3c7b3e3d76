/// Geometry of bodies as arrays, for pictures.
#include "python/src/bindings.hpp"
#include "src/collide/hull/triangles.hpp"
#include "src/collide/solid.hpp"

#include <map>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// Collects solids, and each hull and mesh once.
class GeometryBuilder {
 public:
  void add(std::uint32_t body, const Shape& shape) {
    detail::for_each_part(shape, [&](const auto& part, const CompoundPart* pose, std::uint32_t) {
      bodies_.push_back({body});
      // Also the number of the shape in a trajectory.
      using Kind = std::decay_t<decltype(part)>;
      kinds_.push_back({detail::KindsOf<Shape>::index_of<Kind>()});
      sizes_.push_back(size_of(part));
      const Vec3 p = pose != nullptr ? pose->position : Vec3{};
      const Quat q = pose != nullptr ? pose->orientation : Quat{};
      poses_.push_back({p.x, p.y, p.z, q.w, q.x, q.y, q.z});
    });
  }

  nb::tuple finish(std::vector<std::uint8_t>&& movable, const Vec3& acceleration) {
    return nb::make_tuple(own<std::uint32_t>(std::move(bodies_)),
                          own<std::uint8_t>(std::move(kinds_)), own<Real>(std::move(sizes_)),
                          own<Real>(std::move(poses_)), meshes_,
                          own<std::uint8_t>(std::move(movable)), to_triple(acceleration));
  }

 private:
  using Size = std::array<Real, 4>;

  static Size size_of(const Sphere& s) { return {s.radius, 0, 0, 0}; }
  static Size size_of(const Box& s) {
    return {s.half_extents.x, s.half_extents.y, s.half_extents.z, 0};
  }
  static Size size_of(const Capsule& s) { return {s.radius, s.half_height, 0, 0}; }
  static Size size_of(const Cylinder& s) { return {s.radius, s.half_height, 0, 0}; }
  static Size size_of(const Cone& s) { return {s.radius, s.half_height, 0, 0}; }
  static Size size_of(const HalfSpace& s) { return {s.normal.x, s.normal.y, s.normal.z, s.offset}; }
  static Size size_of(const Plane& s) { return {s.normal.x, s.normal.y, s.normal.z, s.offset}; }
  Size size_of(const Hull& hull) {
    return numbered(&hull.data(),
                    [&] { add_mesh(hull.vertices(), detail::triangles_of(hull), false); });
  }
  Size size_of(const TriangleMesh& mesh) {
    return numbered(mesh.data().get(), [&] { add_mesh(mesh); });
  }
  Size size_of(const Heightfield& field) {
    return numbered(field.data().get(), [&] { add_mesh(to_triangle_mesh(field)); });
  }

  /// The number of the mesh of some data, which `add` adds if it is new.
  template <class Add>
  Size numbered(const void* data, const Add& add) {
    const auto [entry, is_new] = numbers_.try_emplace(data, nb::len(meshes_));
    if (is_new) add();
    return {static_cast<Real>(entry->second), 0, 0, 0};
  }

  void add_mesh(const TriangleMesh& mesh) {
    const auto& triangles = mesh.triangles();
    add_mesh(mesh.vertices(), {triangles.begin(), triangles.end()}, mesh.two_sided());
  }
  void add_mesh(std::span<const Vec3> vertices, std::vector<Triangle>&& triangles, bool two_sided) {
    std::vector<std::array<Real, 3>> points;
    points.reserve(vertices.size());
    for (const Vec3& v : vertices) points.push_back({v.x, v.y, v.z});
    meshes_.append(nb::make_tuple(own<Real>(std::move(points)),
                                  own<std::uint32_t>(std::move(triangles)), two_sided));
  }

  std::vector<std::array<std::uint32_t, 1>> bodies_;
  std::vector<std::array<std::uint8_t, 1>> kinds_;
  std::vector<Size> sizes_;
  std::vector<std::array<Real, 7>> poses_;
  nb::list meshes_;
  std::map<const void*, std::size_t> numbers_;
};

}  // namespace

nb::tuple geometry_of(std::span<const ShownBody> bodies) {
  GeometryBuilder builder;
  std::vector<std::uint8_t> movable;
  movable.reserve(bodies.size());
  Vec3 sum;
  for (const ShownBody& body : bodies) {
    builder.add(static_cast<std::uint32_t>(movable.size()), *body.shape);
    movable.push_back(body.mass > 0 ? 1 : 0);
    if (body.mass > 0) sum += body.acceleration;
  }
  return builder.finish(std::move(movable), sum);
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
