/// Binding of the states of a world in device memory, as arrays that share it through DLPack.
#include <jfpx/cuda/world.hpp>

#include "python/src/world.hpp"

#if JFPX_HAS_CUDA
#include "src/base/cuda/device_buffer.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// Rows of Reals in the memory of a GPU, which belong to a world.
struct DeviceRows {
  nb::object owner;
  std::uint64_t changes;  ///< of the world, for which the rows are valid
  void* data;
  std::size_t rows, columns;
  int device;
};

/// For the garbage collector; the world clears a cycle through its functions.
int traverse_rows(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (nb::inst_ready(self)) Py_VISIT(nb::inst_ptr<DeviceRows>(self)->owner.ptr());
  return 0;
}
PyType_Slot kRowsSlots[] = {{Py_tp_traverse, reinterpret_cast<void*>(traverse_rows)}, {0, nullptr}};

template <class Row>
DeviceRows rows_of(const Row* data, const cuda::DeviceStates& states, nb::handle owner) {
  return {.owner = nb::borrow(owner),
          .changes = nb::cast<PythonWorld&>(owner).changes(),
          .data = const_cast<Row*>(data),
          .rows = states.slots,
          .columns = sizeof(Row) / sizeof(Real),
          .device = states.device};
}

/// A capsule of DLPack. It is not marked as read-only, because not every library imports such
/// arrays.
nb::ndarray<Real, nb::ndim<2>, nb::device::cuda> to_dlpack(const DeviceRows& self,
                                                           const nb::kwargs& options) {
  if (self.changes != nb::cast<PythonWorld&>(self.owner).changes()) {
    throw InvalidArgument("the world has changed since device_states()");
  }
  if (options.contains("copy") && nb::bool_(nb::object(options["copy"]))) {
    throw nb::buffer_error("states in device memory are shared, not copied");
  }
  return {self.data,         {self.rows, self.columns}, self.owner, {},
          nb::dtype<Real>(), nb::device::cuda::value,   self.device};
}

}  // namespace

void PythonWorld::wait_for_readers() {
#if JFPX_HAS_CUDA
  if (!reading_device_) return;
  const cuda::DeviceGuard guard(*reading_device_);
  reading_device_.reset();
  JFPX_CUDA_TRY(cudaDeviceSynchronize());
#endif
}

cuda::DeviceStates PythonWorld::device_states() {
  if (in_use_) throw ConcurrentUse(UseGuard::message("world"));
  const cuda::DeviceStates states = cuda::device_states(*existing());
  reading_device_ = states.device;
  return states;
}

void PythonWorld::enqueue_steps(std::uint32_t count, cuda::Stream stream) {
  if (in_use_) throw ConcurrentUse(UseGuard::message("world"));
  World& world = *existing();
  const UseGuard guard(in_use_, "world");
  const nb::gil_scoped_release release;
  cuda::enqueue_steps(world, count, stream);
}

StepReport PythonWorld::finish_steps() {
  if (in_use_) throw ConcurrentUse(UseGuard::message("world"));
  World& world = *existing();
  const UseGuard guard(in_use_, "world");
  const nb::gil_scoped_release release;
  return cuda::finish_steps(world);
}

void bind_device_states(nb::module_& module, nb::class_<PythonWorld>& world) {
  nb::class_<DeviceRows>(
      module, "DeviceRows", nb::type_slots(kRowsSlots),
      "Array of World.device_states() in the memory of a GPU. Valid until step(), run() or a "
      "change of the world; steps of enqueue_steps() change it in place. Must not be written.")
      .def("__dlpack__", &to_dlpack,
           "A capsule of DLPack that shares the array. Raises InvalidArgument after a step or "
           "change of the world, BufferError if `copy` is true.")
      .def(
          "__dlpack_device__",
          [](const DeviceRows& self) {
            return std::pair<int, int>(nb::device::cuda::value, self.device);
          },
          "(2, ordinal of the GPU): 2 is CUDA in DLPack.")
      .def_prop_ro(
          "shape", [](const DeviceRows& self) { return std::pair(self.rows, self.columns); },
          "(rows, columns): a row for each BodyId.index; 4 columns for orientations, otherwise 3.");
  world.def("device_states", [](nb::handle_t<PythonWorld> self) {
    const cuda::DeviceStates s = nb::cast<PythonWorld&>(self).device_states();
    return nb::make_tuple(rows_of(s.positions, s, self), rows_of(s.orientations, s, self),
                          rows_of(s.velocities, s, self), rows_of(s.angular_velocities, s, self));
  });
  world.def("device_version", [](PythonWorld& self) { return self.device_states().version; })
      .def("enqueue_steps",
           [](PythonWorld& self, std::uint32_t count, std::uintptr_t stream) {
             self.enqueue_steps(count, reinterpret_cast<cuda::Stream>(stream));
           })
      .def("finish_steps", [](PythonWorld& self) { return to_python(self.finish_steps()); });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
