/// Binding of forces: those of force.hpp, and functions of Python.
#include "python/src/world.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// Calls a function of Python, which the PythonWorld owns.
class PythonForce {
 public:
  explicit PythonForce(PyObject* function) : function_(function) {}
  void operator()(ForceContext& context) const {
    const nb::gil_scoped_acquire acquire;
    const nb::object argument = nb::cast(FunctionContext{&context}, nb::rv_policy::move);
    struct Invalidate {
      const nb::object& argument;
      ~Invalidate() { nb::inst_ptr<FunctionContext>(argument)->context = nullptr; }
    } const invalidate{argument};
    const nb::handle function = function_;
    function(argument);
  }

 private:
  PyObject* function_;
};

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

void bind_context(nb::module_& module) {
  nb::class_<FunctionContext>(module, "ForceContext")
      .def_prop_ro("dt", [](const FunctionContext& self) { return self.get().dt(); })
      .def_prop_ro("time", [](const FunctionContext& self) { return self.get().time(); })
      .def("size", [](const FunctionContext& self) { return self.get().bodies().size(); })
      .def("bodies",
           [](const FunctionContext& self) {
             std::vector<IdTuple> ids;
             for (const BodyId id : self.get().bodies()) ids.push_back(to_tuple(id));
             return ids;
           })
      .def("state",
           [](const FunctionContext& self, IdTuple id) {
             const BodyState s = self.get().state(python::to_id(id));
             return nb::make_tuple(to_triple(s.position), to_quadruple(s.orientation),
                                   to_triple(s.velocity), to_triple(s.angular_velocity));
           })
      .def("write_states",
           [](const FunctionContext& self, const Rows<Real>& positions,
              const Rows<Real>& orientations, const Rows<Real>& velocities,
              const Rows<Real>& angular_velocities) {
             std::vector<BodyState> states;
             for (const BodyId id : self.get().bodies()) states.push_back(self.get().state(id));
             fill({positions, orientations, velocities, angular_velocities}, states);
           })
      .def("mass", [](const FunctionContext& self,
                      IdTuple id) { return self.get().mass(python::to_id(id)); })
      .def("awake", [](const FunctionContext& self,
                       IdTuple id) { return self.get().awake(python::to_id(id)); })
      .def("wake", [](FunctionContext& self, IdTuple id) { self.get().wake(python::to_id(id)); })
      .def("apply_force",
           [](FunctionContext& self, IdTuple id, Triple force) {
             self.get().apply_force(python::to_id(id), to_vec3(force));
           })
      .def("apply_torque",
           [](FunctionContext& self, IdTuple id, Triple torque) {
             self.get().apply_torque(python::to_id(id), to_vec3(torque));
           })
      .def("apply_force_at_point",
           [](FunctionContext& self, IdTuple id, Triple force, Triple point) {
             self.get().apply_force_at_point(python::to_id(id), to_vec3(force), to_vec3(point));
           })
      .def("apply_forces", [](FunctionContext& self, const Rows<const Real>& forces) {
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
  const ForceId id = world.add_force(PythonForce(function.ptr()));
  functions_.emplace_back(id, std::move(function));
  return id;
}

void PythonWorld::remove_force(ForceId id) {
  get().remove_force(id);
  std::erase_if(functions_, [&](const auto& entry) { return entry.first == id; });
}

void bind_forces(nb::module_& module, nb::class_<PythonWorld>& world) {
  bind_context(module);
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
