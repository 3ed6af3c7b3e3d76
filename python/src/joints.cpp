/// Binding of joints. A joint is a name and a tuple of its fields, in the order of each_field().
#include "python/src/world.hpp"
#include "src/scene/joint_fields.hpp"

#include <cstddef>
#include <type_traits>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// A JointId as a tuple of Python: (index, generation).
IdTuple to_tuple(JointId id) { return {id.index, id.generation}; }
JointId to_joint_id(const IdTuple& id) { return {id.first, id.second}; }

void from_python(nb::handle value, BodyId* out) { *out = python::to_id(nb::cast<IdTuple>(value)); }
void from_python(nb::handle value, std::optional<BodyId>* out) {
  out->reset();
  if (!value.is_none()) from_python(value, &out->emplace());
}
void from_python(nb::handle value, Vec3* out) { *out = to_vec3(nb::cast<Triple>(value)); }
void from_python(nb::handle value, Quat* out) {
  const auto [w, x, y, z] = nb::cast<std::tuple<double, double, double, double>>(value);
  *out = {static_cast<Real>(w), static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z)};
}
void from_python(nb::handle value, Real* out) { *out = static_cast<Real>(nb::cast<double>(value)); }
void from_python(nb::handle value, bool* out) { *out = nb::cast<bool>(value); }
void from_python(nb::handle value, std::uint64_t* out) { *out = nb::cast<std::uint64_t>(value); }

nb::object to_object(const BodyId& id) { return nb::cast(python::to_tuple(id)); }
nb::object to_object(const std::optional<BodyId>& id) { return id ? to_object(*id) : nb::none(); }
nb::object to_object(const Vec3& v) { return to_triple(v); }
nb::object to_object(const Quat& q) { return nb::make_tuple(q.w, q.x, q.y, q.z); }
template <class T>
requires std::is_arithmetic_v<T> nb::object to_object(T value) { return nb::cast(value); }

template <class T>
bool read_if(const std::string& name, const nb::tuple& fields, Joint* joint) {
  if (name != kJointName<T>) return false;
  std::size_t i = 0;
  each_field(joint->emplace<T>(),
             [&](const auto&, auto& member) { from_python(fields[i++], &member); });
  return true;
}
template <class... T>
bool read_any(const std::string& name, const nb::tuple& fields, std::variant<T...>* joint) {
  return (read_if<T>(name, fields, joint) || ...);
}
Joint to_joint(const std::string& name, const nb::tuple& fields) {
  Joint joint;
  if (!read_any(name, fields, &joint)) throw InvalidArgument("there is no joint \"" + name + "\"");
  return joint;
}

nb::tuple to_python(const Joint& joint) {
  return std::visit(
      []<class T>(const T& value) {
        nb::list fields;
        each_field(value,
                   [&](const auto&, const auto& member) { fields.append(to_object(member)); });
        return nb::make_tuple(kJointName<T>, nb::tuple(fields));
      },
      joint);
}

}  // namespace

void bind_joints(nb::class_<PythonWorld>& world) {
  world
      .def("add_joint",
           [](PythonWorld& self, const std::string& name, const nb::tuple& fields) {
             return to_tuple(self.get().add_joint(to_joint(name, fields)));
           })
      .def("set_joint",
           [](PythonWorld& self, IdTuple id, const std::string& name, const nb::tuple& fields) {
             self.get().set_joint(to_joint_id(id), to_joint(name, fields));
           })
      .def("remove_joint",
           [](PythonWorld& self, IdTuple id) { self.get().remove_joint(to_joint_id(id)); })
      .def("joints",
           [](const PythonWorld& self) {
             std::vector<IdTuple> ids;
             for (const JointId id : self.get().joints()) ids.push_back(to_tuple(id));
             return ids;
           })
      .def("joint", [](const PythonWorld& self,
                       IdTuple id) { return to_python(self.get().joint(to_joint_id(id))); })
      .def("joint_state", [](const PythonWorld& self, IdTuple id) {
        const JointState state = self.get().joint_state(to_joint_id(id));
        return nb::make_tuple(to_triple(state.point_a), to_triple(state.point_b), state.length,
                              state.tension, to_triple(state.force), to_triple(state.torque),
                              state.position, state.speed);
      });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
