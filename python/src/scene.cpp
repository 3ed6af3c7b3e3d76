/// Binding of scenes.
#include "python/src/bindings.hpp"
#include "src/scenes/scenes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {

void bind_scene(nb::module_& module) {
  nb::class_<Scene>(module, "Scene")
      .def_static("from_json", [](const std::string& text) { return from_json(text); })
      .def("to_json", [](const Scene& self) { return to_json(self); })
      .def_static("load", [](const std::string& path) { return load_scene(path); })
      .def("save", [](const Scene& self, const std::string& path) { save_scene(self, path); })
      .def_static(
          "named",
          [](const std::string& name, std::optional<std::uint32_t> spheres,
             std::optional<std::uint32_t> boxes, std::uint64_t seed) {
            return scenes::make(name, {.spheres = spheres, .boxes = boxes, .seed = seed});
          },
          nb::arg("name"), nb::arg("spheres").none(), nb::arg("boxes").none(), nb::arg("seed"))
      .def("add_spheres",
           [](Scene& self, const Rows<const Real>& positions, const Vector<const Real>& radii,
              const Vector<const Real>& masses, const Rows<const Real>& velocities,
              const Rows<const Real>& acceleration, const Vector<const Real>& friction,
              const Vector<const Real>& restitution) {
             const std::size_t n = positions.shape(0);
             const auto at = [](const Vector<const Real>& values, std::size_t i) {
               return values(values.shape(0) == 1 ? 0 : i);
             };
             const auto row_at = [](const Rows<const Real>& rows, std::size_t i) {
               return vec3_at(rows, rows.shape(0) == 1 ? 0 : i);
             };
             Scene grown = self;
             grown.bodies.reserve(grown.bodies.size() + n);
             for (std::size_t i = 0; i < n; ++i) {
               BodyDef body;
               body.shape = Sphere{at(radii, i)};
               body.mass = at(masses, i);
               body.position = vec3_at(positions, i);
               body.velocity = row_at(velocities, i);
               body.acceleration = row_at(acceleration, i);
               body.friction = at(friction, i);
               body.restitution = at(restitution, i);
               grown.bodies.push_back(body);
             }
             validate(grown);
             self = std::move(grown);
           })
      .def("add_triangle_mesh",
           [](Scene& self, const Scene& body, const Rows<const Real>& vertices,
              const Rows<const std::uint32_t>& triangles, bool two_sided) {
             TriangleMeshDef mesh;
             mesh.two_sided = two_sided;
             mesh.vertices.reserve(vertices.shape(0));
             for (std::size_t i = 0; i < vertices.shape(0); ++i) {
               mesh.vertices.push_back(vec3_at(vertices, i));
             }
             mesh.triangles.reserve(triangles.shape(0));
             for (std::size_t i = 0; i < triangles.shape(0); ++i) {
               mesh.triangles.push_back({triangles(i, 0), triangles(i, 1), triangles(i, 2)});
             }
             Scene grown = self;
             grown.bodies.push_back(body.bodies.at(0));
             TriangleMesh shape(std::move(mesh));
             const TriangleMeshReport report = shape.report();
             grown.bodies.back().shape = std::move(shape);
             validate(grown);
             self = std::move(grown);
             return std::tuple(report.degenerate, report.duplicate, report.open_edges,
                               report.shared_edges, report.flipped_edges);
           })
      .def("add_heightfield",
           [](Scene& self, const Scene& body, const Rows<const Real>& heights, double spacing_x,
              double spacing_z, const std::vector<std::uint32_t>& holes, bool two_sided) {
             HeightfieldDef def{static_cast<std::uint32_t>(heights.shape(1)),
                                static_cast<std::uint32_t>(heights.shape(0)),
                                static_cast<Real>(spacing_x),
                                static_cast<Real>(spacing_z),
                                {},
                                holes,
                                two_sided};
             def.heights.reserve(heights.size());
             for (std::size_t i = 0; i < heights.shape(0); ++i) {
               for (std::size_t k = 0; k < heights.shape(1); ++k) {
                 def.heights.push_back(heights(i, k));
               }
             }
             Scene grown = self;
             grown.bodies.push_back(body.bodies.at(0));
             grown.bodies.back().shape = Heightfield(std::move(def));
             validate(grown);
             self = std::move(grown);
           })
      .def("centred",
           [](const Scene& self) {
             Scene scene = self;
             for (BodyDef& body : scene.bodies) {
               if (auto* compound = std::get_if<Compound>(&body.shape)) {
                 *compound = centred(std::move(*compound));
               } else if (auto* hull = std::get_if<Hull>(&body.shape)) {
                 *hull = centred(*hull);
               }
             }
             return scene;
           })
      .def("geometry",
           [](const Scene& self) {
             std::vector<ShownBody> bodies;
             bodies.reserve(self.bodies.size());
             for (const BodyDef& body : self.bodies) {
               bodies.push_back({&body.shape, body.mass, body.acceleration});
             }
             return geometry_of(bodies);
           })
      .def("write_poses",
           [](const Scene& self, const Rows<Real>& positions, const Rows<Real>& orientations) {
             for (std::size_t i = 0; i < self.bodies.size(); ++i) {
               set_row(positions, i, self.bodies[i].position);
               const Quat& q = self.bodies[i].orientation;
               const std::array<Real, 4> row{q.w, q.x, q.y, q.z};
               for (std::size_t k = 0; k < 4; ++k) orientations(i, k) = row[k];
             }
           })
      .def_prop_ro("name", [](const Scene& self) { return self.name; })
      .def_prop_ro("dt", [](const Scene& self) { return static_cast<double>(self.dt); })
      .def_prop_ro("bodies", [](const Scene& self) { return self.bodies.size(); })
      .def("equals", [](const Scene& self, const Scene& other) { return self == other; });
  module.def("scene_names", [] {
    std::vector<std::pair<std::string, std::string>> names;
    for (const scenes::Entry& entry : scenes::all()) names.emplace_back(entry.name, entry.summary);
    return names;
  });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
