/// Binding of forces: those of force.hpp, and functions of Python.
#include "python/src/world.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

std::optional<BodyId> to_id(const std::optional<IdTuple>& id) {
  if (!id) return std::nullopt;
  return python::to_id(*id);
}

/// An attachment as a tuple of Python: (body or None, point).
using AttachmentTuple = std::pair<std::optional<IdTuple>, Triple>;
Attachment to_attachment(const AttachmentTuple& from) {
  return {.body = to_id(from.first), .point = to_vec3(from.second)};
}

template <class Law>
std::uint64_t add_spring(PythonWorld& self, const AttachmentTuple& a, const AttachmentTuple& b,
                         Real stiffness, Real damping, Real rest_length) {
  return self.get()
      .add_force(Law{.a = to_attachment(a),
                     .b = to_attachment(b),
                     .stiffness = stiffness,
                     .damping = damping,
                     .rest_length = rest_length})
      .number;
}

void bind_force_context(nb::module_& module) {
  using Self = FunctionContext<ForceContext>;
  nb::class_<Self> binding(module, "ForceContext");
  bind_step_view(binding);
  binding.def("wake", [](Self& self, IdTuple id) { self.get().wake(python::to_id(id)); })
      .def("apply_force",
           [](Self& self, IdTuple id, Triple force) {
             self.get().apply_force(python::to_id(id), to_vec3(force));
           })
      .def("apply_torque",
           [](Self& self, IdTuple id, Triple torque) {
             self.get().apply_torque(python::to_id(id), to_vec3(torque));
           })
      .def("apply_force_at_point",
           [](Self& self, IdTuple id, Triple force, Triple point) {
             self.get().apply_force_at_point(python::to_id(id), to_vec3(force), to_vec3(point));
           })
      .def("apply_forces", [](Self& self, const Rows<const Real>& forces) {
        ForceContext& context = self.get();
        for (std::size_t i = 0; i < context.bodies().size(); ++i) {
          context.apply_force(context.bodies()[i], vec3_at(forces, i));
        }
      });
}

}  // namespace

ForceId PythonWorld::add_function(nb::object function) {
  World& world = get();
  functions_.reserve(functions_.size() + 1);
  const ForceId id = world.add_force(PythonFunction(function.ptr()));
  functions_.emplace_back(id, std::move(function));
  return id;
}

void PythonWorld::remove_force(ForceId id) {
  get().remove_force(id);
  std::erase_if(functions_, [&](const auto& entry) { return entry.first == id; });
}

void bind_forces(nb::module_& module, nb::class_<PythonWorld>& world) {
  bind_force_context(module);
  world
      .def("add_function",
           [](PythonWorld& self, nb::object function) {
             return self.add_function(std::move(function)).number;
           })
      .def(
          "add_gravity",
          [](PythonWorld& self, Triple acceleration, std::optional<IdTuple> body) {
            return self.get()
                .add_force(Gravity{.acceleration = to_vec3(acceleration), .body = to_id(body)})
                .number;
          },
          nb::arg("acceleration"), nb::arg("body").none())
      .def(
          "add_drag",
          [](PythonWorld& self, Real linear, Real quadratic, Triple wind,
             std::optional<IdTuple> body) {
            return self.get()
                .add_force(Drag{.linear = linear,
                                .quadratic = quadratic,
                                .wind = to_vec3(wind),
                                .body = to_id(body)})
                .number;
          },
          nb::arg("linear"), nb::arg("quadratic"), nb::arg("wind"), nb::arg("body").none())
      .def("add_spring", &add_spring<Spring>)
      .def("add_bungee", &add_spring<Bungee>)
      .def(
          "add_buoyancy",
          [](PythonWorld& self, Triple normal, Real offset, Real density, Real gravity,
             std::optional<IdTuple> body) {
            return self.get()
                .add_force(Buoyancy{.liquid = {.normal = to_vec3(normal), .offset = offset},
                                    .density = density,
                                    .gravity = gravity,
                                    .body = to_id(body)})
                .number;
          },
          nb::arg("normal"), nb::arg("offset"), nb::arg("density"), nb::arg("gravity"),
          nb::arg("body").none())
      .def("add_explosion",
           [](PythonWorld& self, Triple centre, Real start, Real peak_force, Real speed,
              Real thickness, Real duration) {
             return self.get()
                 .add_force(Explosion{.centre = to_vec3(centre),
                                      .start = start,
                                      .peak_force = peak_force,
                                      .speed = speed,
                                      .thickness = thickness,
                                      .duration = duration})
                 .number;
           })
      .def("remove_force",
           [](PythonWorld& self, std::uint64_t number) { self.remove_force({number}); })
      .def("forces", [](const PythonWorld& self) {
        std::vector<std::uint64_t> numbers;
        for (const ForceId id : self.get().forces()) numbers.push_back(id.number);
        return numbers;
      });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
