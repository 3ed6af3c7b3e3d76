/// Binding of worlds: bodies, states, steps.
#include "python/src/world.hpp"

#include "src/scene/scene_validate.hpp"

#include <algorithm>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

int traverse_world(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  return nb::inst_ptr<PythonWorld>(self)->traverse(visit, arg);
}

int clear_world(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<PythonWorld>(self)->close();
  return 0;
}

PyType_Slot kWorldSlots[] = {{Py_tp_traverse, reinterpret_cast<void*>(traverse_world)},
                             {Py_tp_clear, reinterpret_cast<void*>(clear_world)},
                             {0, nullptr}};

WorldSettings world_settings(const std::string& backend, const std::string& algorithm,
                             unsigned threads, int device, const std::vector<int>& devices,
                             double hit_speed) {
  return {.collider = collider_options(backend, algorithm, 1, device),
          .devices = devices,
          .threads = threads,
          .hit_speed = static_cast<Real>(hit_speed)};
}

/// Replaces all states, or none if one is invalid.
void set_states(World& world, const std::vector<BodyState>& states) {
  const std::vector<BodyId> bodies(world.bodies().begin(), world.bodies().end());
  if (states.size() != bodies.size()) {
    throw InvalidArgument("there are " + std::to_string(states.size()) +
                          " states; there must be one for each of " +
                          std::to_string(bodies.size()) + " bodies");
  }
  for (const BodyState& state : states) {
    if (const std::string fault = find_fault(state); !fault.empty()) {
      throw InvalidArgument("state: " + fault);
    }
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) world.set_state(bodies[i], states[i]);
}

nb::tuple to_python(const BodyState& s) {
  return nb::make_tuple(to_triple(s.position), to_quadruple(s.orientation), to_triple(s.velocity),
                        to_triple(s.angular_velocity));
}

void bind_bodies(nb::class_<PythonWorld>& world) {
  world.def("size", [](const PythonWorld& self) { return self.get().bodies().size(); })
      .def("bodies",
           [](const PythonWorld& self) {
             std::vector<IdTuple> ids;
             for (const BodyId id : self.get().bodies()) ids.push_back(to_tuple(id));
             return ids;
           })
      .def("add",
           [](PythonWorld& self, const Scene& scene) {
             std::vector<IdTuple> ids;
             for (const BodyDef& body : scene.bodies) ids.push_back(to_tuple(self.get().add(body)));
             return ids;
           })
      .def("remove", [](PythonWorld& self, IdTuple id) { self.get().remove(to_id(id)); })
      .def("definition",
           [](const PythonWorld& self, IdTuple id) {
             Scene scene;
             scene.bodies.push_back(self.get().definition(to_id(id)));
             return scene;
           })
      .def("replace", [](PythonWorld& self, IdTuple id,
                         const Scene& scene) { self.get().replace(to_id(id), scene.bodies.at(0)); })
      .def("contains",
           [](const PythonWorld& self, IdTuple id) { return self.get().contains(to_id(id)); })
      .def("body_at", [](const PythonWorld& self,
                         std::uint32_t index) { return to_tuple(self.get().body_at(index)); })
      .def("write_states",
           [](const PythonWorld& self, const Rows<Real>& positions, const Rows<Real>& orientations,
              const Rows<Real>& velocities, const Rows<Real>& angular_velocities) {
             self.get().states(&self.copied_states);
             fill({positions, orientations, velocities, angular_velocities}, self.copied_states);
           })
      .def("set_states",
           [](PythonWorld& self, const Rows<const Real>& positions,
              const Rows<const Real>& orientations, const Rows<const Real>& velocities,
              const Rows<const Real>& angular_velocities) {
             std::vector<BodyState> states(positions.shape(0));
             for (std::size_t i = 0; i < states.size(); ++i) {
               const auto& q = orientations;
               states[i] = {.position = vec3_at(positions, i),
                            .orientation = {q(i, 0), q(i, 1), q(i, 2), q(i, 3)},
                            .velocity = vec3_at(velocities, i),
                            .angular_velocity = vec3_at(angular_velocities, i)};
             }
             set_states(self.get(), states);
           })
      .def("state", [](const PythonWorld& self,
                       IdTuple id) { return to_python(self.get().state(to_id(id))); })
      .def("moving_to",
           [](const PythonWorld& self, IdTuple id, Triple position, Quadruple orientation) {
             const World& of = self.get();
             const BodyState goal{to_vec3(position), to_quat(orientation), {}, {}};
             if (const std::string fault = find_fault(goal); !fault.empty()) {
               throw InvalidArgument("the goal has a " + fault);
             }
             return to_python(moving_to(of.state(to_id(id)), goal.position,
                                        normalized(goal.orientation), of.settings().dt));
           })
      .def("set_state",
           [](PythonWorld& self, IdTuple id, Triple position, Quadruple orientation,
              Triple velocity, Triple angular_velocity) {
             self.get().set_state(to_id(id), {.position = to_vec3(position),
                                              .orientation = to_quat(orientation),
                                              .velocity = to_vec3(velocity),
                                              .angular_velocity = to_vec3(angular_velocity)});
           })
      .def("apply_force", [](PythonWorld& self, IdTuple id,
                             Triple force) { self.get().apply_force(to_id(id), to_vec3(force)); })
      .def("apply_force_at_point",
           [](PythonWorld& self, IdTuple id, Triple force, Triple point) {
             self.get().apply_force_at_point(to_id(id), to_vec3(force), to_vec3(point));
           })
      .def("apply_torque",
           [](PythonWorld& self, IdTuple id, Triple torque) {
             self.get().apply_torque(to_id(id), to_vec3(torque));
           })
      .def("apply_impulse",
           [](PythonWorld& self, IdTuple id, Triple impulse) {
             self.get().apply_impulse(to_id(id), to_vec3(impulse));
           })
      .def("apply_impulse_at_point",
           [](PythonWorld& self, IdTuple id, Triple impulse, Triple point) {
             self.get().apply_impulse_at_point(to_id(id), to_vec3(impulse), to_vec3(point));
           })
      .def("apply_angular_impulse", [](PythonWorld& self, IdTuple id, Triple impulse) {
        self.get().apply_angular_impulse(to_id(id), to_vec3(impulse));
      });
}

void bind_properties(nb::class_<PythonWorld>& world) {
  world
      .def("geometry",
           [](const PythonWorld& self) {
             const World& shown = self.get();
             std::vector<ShownBody> bodies;
             bodies.reserve(shown.bodies().size());
             for (const BodyId id : shown.bodies()) {
               bodies.push_back({&shown.shape(id), shown.mass(id), shown.acceleration(id)});
             }
             return geometry_of(bodies);
           })
      .def("write_awake",
           [](const PythonWorld& self, const Vector<std::uint8_t>& awake) {
             const World& shown = self.get();
             std::size_t row = 0;
             for (const BodyId id : shown.bodies()) awake(row++) = shown.awake(id) ? 1 : 0;
           })
      .def("awake", [](const PythonWorld& self, IdTuple id) { return self.get().awake(to_id(id)); })
      .def("wake", [](PythonWorld& self, IdTuple id) { self.get().wake(to_id(id)); })
      .def("mass", [](const PythonWorld& self, IdTuple id) { return self.get().mass(to_id(id)); })
      .def("set_mass",
           [](PythonWorld& self, IdTuple id, Real mass) { self.get().set_mass(to_id(id), mass); })
      .def("friction",
           [](const PythonWorld& self, IdTuple id) { return self.get().friction(to_id(id)); })
      .def("set_friction", [](PythonWorld& self, IdTuple id,
                              Real friction) { self.get().set_friction(to_id(id), friction); })
      .def("restitution",
           [](const PythonWorld& self, IdTuple id) { return self.get().restitution(to_id(id)); })
      .def("set_restitution",
           [](PythonWorld& self, IdTuple id, Real restitution) {
             self.get().set_restitution(to_id(id), restitution);
           })
      .def("acceleration", [](const PythonWorld& self,
                              IdTuple id) { return to_triple(self.get().acceleration(to_id(id))); })
      .def("set_acceleration",
           [](PythonWorld& self, IdTuple id, Triple acceleration) {
             self.get().set_acceleration(to_id(id), to_vec3(acceleration));
           })
      .def("damping",
           [](const PythonWorld& self, IdTuple id) {
             return std::pair(self.get().linear_damping(to_id(id)),
                              self.get().angular_damping(to_id(id)));
           })
      .def("set_damping", [](PythonWorld& self, IdTuple id, Real linear,
                             Real angular) { self.get().set_damping(to_id(id), linear, angular); })
      .def("motion_locks",
           [](const PythonWorld& self, IdTuple id) {
             const MotionLocks locks = self.get().motion_locks(to_id(id));
             return std::pair(std::tuple(locks.linear_x, locks.linear_y, locks.linear_z),
                              std::tuple(locks.angular_x, locks.angular_y, locks.angular_z));
           })
      .def("set_motion_locks",
           [](PythonWorld& self, IdTuple id, const std::array<bool, 3>& linear,
              const std::array<bool, 3>& angular) {
             self.get().set_motion_locks(
                 to_id(id), {linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]});
           })
      .def("sensor",
           [](const PythonWorld& self, IdTuple id) { return self.get().sensor(to_id(id)); })
      .def("filter",
           [](const PythonWorld& self, IdTuple id) {
             const CollisionFilter filter = self.get().filter(to_id(id));
             return std::pair(filter.category, filter.mask);
           })
      .def("set_filter",
           [](PythonWorld& self, IdTuple id, std::uint32_t category, std::uint32_t mask) {
             self.get().set_filter(to_id(id), {.category = category, .mask = mask});
           })
      .def("pair_ignored", [](const PythonWorld& self, IdTuple a,
                              IdTuple b) { return self.get().pair_ignored(to_id(a), to_id(b)); })
      .def("set_pair_ignored", [](PythonWorld& self, IdTuple a, IdTuple b, bool ignored) {
        self.get().set_pair_ignored(to_id(a), to_id(b), ignored);
      });
}

}  // namespace

nb::tuple to_python(const StepReport& r) {
  std::optional<IdTuple> lost;
  if (r.non_finite) lost = to_tuple(r.non_finite_body);
  return nb::make_tuple(r.step, r.contacts, r.sphere_contacts, r.generated_contacts,
                        r.position_iterations, r.velocity_iterations, r.iterations_exhausted,
                        r.non_finite, lost, r.awake, std::string(to_string(r.backend)),
                        std::string(to_string(r.algorithm)), std::string(to_string(r.choice)),
                        r.device_failure, r.integrate_ms, r.detect_ms, r.resolve_ms, r.total_ms);
}

void fill(const StateArrays& arrays, std::span<const BodyState> states) {
  for (const Rows<Real>* array :
       {&arrays.positions, &arrays.orientations, &arrays.velocities, &arrays.angular_velocities}) {
    if (array->shape(0) != states.size()) {
      throw InvalidArgument("an array has " + std::to_string(array->shape(0)) +
                            " rows; it must have one for each of " + std::to_string(states.size()) +
                            " bodies");
    }
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Quat& q = states[i].orientation;
    set_row(arrays.positions, i, states[i].position);
    const std::array<Real, 4> row{q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 4; ++k) arrays.orientations(i, k) = row[k];
    set_row(arrays.velocities, i, states[i].velocity);
    set_row(arrays.angular_velocities, i, states[i].angular_velocity);
  }
}

StepReport PythonWorld::step() {
  World& world = get();
  const UseGuard guard(in_use_, "world");
  const nb::gil_scoped_release release;
  return world.step();
}

StepReport PythonWorld::run(std::uint64_t steps) {
  using Clock = Interrupt::Clock;
  World& world = get();
  const UseGuard guard(in_use_, "world");
  const nb::gil_scoped_release release;
  StepReport report;
  Clock::time_point checked = Clock::now();
  for (std::uint64_t i = 0; i < steps && !report.non_finite; ++i) {
    report = world.step();
    if (Clock::now() - checked < Interrupt::kInterval) continue;
    handle_signals();
    checked = Clock::now();
  }
  return report;
}

void PythonWorld::close() {
  if (in_use_ || queries_ > 0) throw ConcurrentUse(UseGuard::message("world"));
  free();
}

void PythonWorld::free() noexcept {
  try {
    wait_for_readers();
  } catch (const Error&) {
    // The device is lost.
  }
  world_.reset();
  functions_.clear();
  generators_.clear();
  communicator_.reset();
}

int PythonWorld::traverse(visitproc visit, void* arg) const {
  for (const auto& [id, function] : functions_) Py_VISIT(function.ptr());
  for (const auto& [id, function] : generators_) Py_VISIT(function.ptr());
  Py_VISIT(communicator_.ptr());
  return 0;
}

void bind_world(nb::module_& module) {
  nb::class_<PythonWorld> world(module, "World", nb::type_slots(kWorldSlots));
  world
      .def(
          "__init__",
          [](PythonWorld* self, const Scene& scene, const std::string& backend,
             const std::string& algorithm, unsigned threads, int device,
             const std::vector<int>& devices, double hit_speed, nb::object communicator,
             std::uint32_t rank, std::uint32_t size) {
            new (self) PythonWorld(
                scene, world_settings(backend, algorithm, threads, device, devices, hit_speed),
                std::move(communicator), rank, size);
          },
          nb::arg("scene"), nb::arg("backend"), nb::arg("algorithm"), nb::arg("threads"),
          nb::arg("device"), nb::arg("devices"), nb::arg("hit_speed"),
          nb::arg("communicator").none(), nb::arg("rank"), nb::arg("size"))
      .def("step", [](PythonWorld& self) { return to_python(self.step()); })
      .def("run", [](PythonWorld& self, std::uint64_t steps) { return to_python(self.run(steps)); })
      .def("close", &PythonWorld::close)
      .def("time", [](const PythonWorld& self) { return self.get().time(); })
      .def("steps", [](const PythonWorld& self) { return self.get().steps(); })
      .def("state_hash", [](const PythonWorld& self) { return self.get().state_hash(); })
      .def("save_states",
           [](const PythonWorld& self, const std::string& path) { write_states(self.get(), path); })
      .def("snapshot",
           [](const PythonWorld& self) {
             const Snapshot snapshot = self.get().snapshot();
             return nb::bytes(snapshot.bytes.data(), snapshot.bytes.size());
           })
      .def("restore",
           [](PythonWorld& self, const nb::bytes& snapshot) {
             const auto* first = static_cast<const std::byte*>(snapshot.data());
             self.get().restore({.bytes = {first, first + snapshot.size()}});
           })
      .def("scene", &PythonWorld::scene);
  bind_bodies(world);
  bind_properties(world);
  bind_forces(module, world);
  bind_joints(world);
  bind_contacts(world);
  bind_contact_generators(module, world);
  bind_drawing(world);
  bind_device_states(module, world);
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
