/// A world as an object of Python.
#pragma once

#include <jfpx/cuda/world.hpp>

#include "python/src/bindings.hpp"
#include "python/src/communicator.hpp"
#include "src/world/world_impl.hpp"

#include <memory>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {

/// Owns a World and the functions of Python that act in it. Every access fails while a step runs,
/// and after close().
class PythonWorld {
 public:
  /// @param communicator an object such as jfpx.mpi.Communicator, or None
  /// @param rank,size    its rank and size
  PythonWorld(const Scene& scene, WorldSettings settings, nb::object communicator,
              std::uint32_t rank, std::uint32_t size)
      : communicator_(std::move(communicator)), scene_(scene) {
    if (!communicator_.is_none()) {
      settings.communicator =
          std::make_shared<PythonCommunicator>(communicator_, rank, size, &in_use_);
    }
    world_ = std::make_unique<World>(scene, settings);
  }
  ~PythonWorld() { free(); }
  PythonWorld(const PythonWorld&) = delete;
  PythonWorld& operator=(const PythonWorld&) = delete;

  /// @throws Closed, ConcurrentUse
  const World& get() const {
    if (in_use_) throw ConcurrentUse(UseGuard::message("world"));
    return *existing();
  }
  /// For changes: waits for the work of a GPU that may read device_states().
  /// @throws Closed, ConcurrentUse, DeviceError
  World& get() {
    if (in_use_ || queries_ > 0) throw ConcurrentUse(UseGuard::message("world"));
    World& world = *existing();
    wait_for_readers();
    ++changes_;
    return world;
  }

  /// The scene of the constructor, with the settings that restore() has replaced.
  Scene scene() const {
    Scene scene = get().settings();
    scene.bodies = scene_.bodies;
    scene.ignored_pairs = scene_.ignored_pairs;
    scene.joints = scene_.joints;
    return scene;
  }

  /// Calls query(world, i) for all i < count without Python's global lock. Runs due signal
  /// handlers. Other threads may query the world at the same time, but not change it.
  /// @throws Closed, ConcurrentUse, the exceptions of the queries and of signal handlers
  template <class Query>
  void for_each_query(std::size_t count, const Query& query) const {
    const World& world = get();
    const QueryGuard guard(queries_);
    const nb::gil_scoped_release release;
    const SignalInterrupt interrupt;
    for_each_interruptible(count, [&](std::size_t i) { query(world, i); });
  }

  mutable std::vector<BodyState>
      copied_states;  ///< buffer for copies of states, under the global lock

  /// One step without Python's global lock.
  StepReport step();
  /// Up to `steps` steps, and fewer if one is undone. Between steps, handles signals of Python.
  StepReport run(std::uint64_t steps);
  /// States in device memory, valid until the next step or change.
  cuda::DeviceStates device_states();
  /// Steps on a GPU that do not wait, and the wait for them. device_states() of before stay valid.
  void enqueue_steps(std::uint32_t count, cuda::Stream stream);
  StepReport finish_steps();
  /// Changes when device_states() of before become invalid.
  std::uint64_t changes() const {
    return world_ == nullptr ? ~std::uint64_t{0}
                             : changes_ + WorldAccess::impl(*world_).mirror.departures;
  }
  /// Frees the world now. Every later access fails.
  void close();

  ForceId add_function(nb::object function);
  void remove_force(ForceId id);
  ContactGeneratorId add_generator(nb::object function);
  void remove_generator(ContactGeneratorId id);

  /// Visits the functions and the communicator, for the garbage collector.
  int traverse(visitproc visit, void* arg) const;

 private:
  struct QueryGuard {
    explicit QueryGuard(std::atomic<unsigned>& queries) : queries_(queries) { ++queries_; }
    ~QueryGuard() { --queries_; }
    QueryGuard(const QueryGuard&) = delete;
    QueryGuard& operator=(const QueryGuard&) = delete;
    std::atomic<unsigned>& queries_;
  };

  /// @throws DeviceError
  void wait_for_readers();
  void free() noexcept;
  World* existing() const {
    if (world_ == nullptr) throw Closed("the world is closed");
    return world_.get();
  }

  std::vector<std::pair<ForceId, nb::object>> functions_;  // outlive the world, which calls them
  std::vector<std::pair<ContactGeneratorId, nb::object>> generators_;  // likewise
  nb::object communicator_;                                            // likewise
  std::atomic<bool> in_use_ = false;           // outlives the communicator's calls
  mutable std::atomic<unsigned> queries_ = 0;  ///< in progress without Python's global lock
  Scene scene_;                                ///< of the constructor
  std::unique_ptr<World> world_;
  std::uint64_t changes_ = 0;
  std::optional<int> reading_device_;  ///< has work that may read device_states()
};

/// ForceContext or ContactContext of a call of a function, which is invalid afterwards.
template <class Context>
struct FunctionContext {
  Context* context = nullptr;
  Context& get() const {
    if (context == nullptr) {
      throw InvalidArgument(
          "a context is valid only while the function that received it is called");
    }
    return *context;
  }
};

/// Calls a function of Python, which the PythonWorld owns, with a FunctionContext.
class PythonFunction {
 public:
  explicit PythonFunction(PyObject* function) : function_(function) {}

  template <class Context>
  void operator()(Context& context) const {
    const nb::gil_scoped_acquire acquire;
    const nb::object argument = nb::cast(FunctionContext<Context>{&context}, nb::rv_policy::move);
    struct Invalidate {
      const nb::object& argument;
      ~Invalidate() { nb::inst_ptr<FunctionContext<Context>>(argument)->context = nullptr; }
    } const invalidate{argument};
    const nb::handle function = function_;
    function(argument);
  }

 private:
  PyObject* function_;
};

/// Binds the functions of StepView.
template <class Context>
void bind_step_view(nb::class_<FunctionContext<Context>>& context) {
  using Self = FunctionContext<Context>;
  context.def_prop_ro("dt", [](const Self& self) { return self.get().dt(); })
      .def_prop_ro("time", [](const Self& self) { return self.get().time(); })
      .def("size", [](const Self& self) { return self.get().bodies().size(); })
      .def("bodies",
           [](const Self& self) {
             std::vector<IdTuple> ids;
             for (const BodyId id : self.get().bodies()) ids.push_back(to_tuple(id));
             return ids;
           })
      .def("state",
           [](const Self& self, IdTuple id) {
             const BodyState s = self.get().state(python::to_id(id));
             return nb::make_tuple(to_triple(s.position), to_quadruple(s.orientation),
                                   to_triple(s.velocity), to_triple(s.angular_velocity));
           })
      .def("write_states",
           [](const Self& self, const Rows<Real>& positions, const Rows<Real>& orientations,
              const Rows<Real>& velocities, const Rows<Real>& angular_velocities) {
             std::vector<BodyState> states;
             for (const BodyId id : self.get().bodies()) states.push_back(self.get().state(id));
             fill({positions, orientations, velocities, angular_velocities}, states);
           })
      .def("mass", [](const Self& self, IdTuple id) { return self.get().mass(python::to_id(id)); })
      .def("awake",
           [](const Self& self, IdTuple id) { return self.get().awake(python::to_id(id)); });
}

/// A report as the tuple jfpx.StepReport, in the order of its fields.
nb::tuple to_python(const StepReport& report);

/// A filter that calls `filter`, which it refers to, for each body; none for None.
BodyFilter to_filter(const nb::object& filter);

void bind_forces(nb::module_& module, nb::class_<PythonWorld>& world);
void bind_joints(nb::class_<PythonWorld>& world);
void bind_contacts(nb::class_<PythonWorld>& world);
void bind_contact_generators(nb::module_& module, nb::class_<PythonWorld>& world);
void bind_drawing(nb::class_<PythonWorld>& world);
void bind_device_states(nb::module_& module, nb::class_<PythonWorld>& world);

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
