/// Binding of contact generators that are functions of Python.
#include "python/src/world.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

using GeneratorContext = FunctionContext<ContactContext>;

/// @throws InvalidArgument if the size of an array is not that of the list
void require_one_for_each(const Vector<const Real>& array,
                          std::span<const DetectedContact> contacts) {
  if (array.shape(0) == contacts.size()) return;
  throw InvalidArgument("an array has " + std::to_string(array.shape(0)) +
                        " values; it must have one for each of " + std::to_string(contacts.size()) +
                        " detected contacts");
}

void write_detected(const GeneratorContext& self, const Rows<std::int64_t>& pairs,
                    const Rows<std::int64_t>& parts, const Rows<Real>& normals,
                    const Rows<Real>& points, const Vector<Real>& distances,
                    const Vector<Real>& frictions, const Vector<Real>& restitutions) {
  const std::span<const DetectedContact> contacts = self.get().detected();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const DetectedContact& c = contacts[i];
    pairs(0, i) = c.a.index;
    pairs(1, i) = c.b.index;
    parts(0, i) = c.part_a;
    parts(1, i) = c.part_b;
    set_row(normals, i, c.normal);
    set_row(points, i, c.point);
    distances(i) = c.distance;
    frictions(i) = c.friction;
    restitutions(i) = c.restitution;
  }
}

template <class T>
void set_values(const GeneratorContext& self, const Vector<const Real>& values,
                T DetectedContact::*member) {
  const std::span<DetectedContact> contacts = self.get().detected();
  require_one_for_each(values, contacts);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    contacts[i].*member = static_cast<T>(values(i));
  }
}

void bind_contact_context(nb::module_& module) {
  nb::class_<GeneratorContext> context(module, "ContactContext");
  bind_step_view(context);
  context
      .def("detected_count",
           [](const GeneratorContext& self) { return self.get().detected().size(); })
      .def("write_detected", &write_detected)
      .def("set_frictions",
           [](const GeneratorContext& self, const Vector<const Real>& values) {
             set_values(self, values, &DetectedContact::friction);
           })
      .def("set_restitutions",
           [](const GeneratorContext& self, const Vector<const Real>& values) {
             set_values(self, values, &DetectedContact::restitution);
           })
      .def("set_ignored",
           [](const GeneratorContext& self, const Vector<const Real>& values) {
             set_values(self, values, &DetectedContact::ignored);
           })
      .def("add", [](const GeneratorContext& self, IdTuple a, IdTuple b, Triple normal,
                     Triple point, Real distance, Real friction, Real restitution) {
        self.get().add({.a = python::to_id(a),
                        .b = python::to_id(b),
                        .normal = to_vec3(normal),
                        .point = to_vec3(point),
                        .distance = distance,
                        .friction = friction,
                        .restitution = restitution});
      });
}

}  // namespace

ContactGeneratorId PythonWorld::add_generator(nb::object function) {
  World& world = get();
  generators_.reserve(generators_.size() + 1);
  const ContactGeneratorId id = world.add_contact_generator(PythonFunction(function.ptr()));
  generators_.emplace_back(id, std::move(function));
  return id;
}

void PythonWorld::remove_generator(ContactGeneratorId id) {
  get().remove_contact_generator(id);
  std::erase_if(generators_, [&](const auto& entry) { return entry.first == id; });
}

void bind_contact_generators(nb::module_& module, nb::class_<PythonWorld>& world) {
  bind_contact_context(module);
  world
      .def("add_contact_generator",
           [](PythonWorld& self, nb::object function) {
             return self.add_generator(std::move(function)).number;
           })
      .def("remove_contact_generator",
           [](PythonWorld& self, std::uint64_t number) { self.remove_generator({number}); })
      .def("contact_generators", [](const PythonWorld& self) {
        std::vector<std::uint64_t> numbers;
        for (const ContactGeneratorId id : self.get().contact_generators()) {
          numbers.push_back(id.number);
        }
        return numbers;
      });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
