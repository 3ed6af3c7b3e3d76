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

using DeviceRows = nb::ndarray<nb::array_api, Real, nb::ndim<2>, nb::device::cuda>;

/// Rows of the world `owner`, which lives at least as long as the result. They are not marked as
/// read-only, because not every library imports such arrays.
template <class Row>
DeviceRows rows_of(const Row* data, const cuda::DeviceStates& states, nb::handle owner) {
  return {const_cast<Row*>(data),
          {states.slots, sizeof(Row) / sizeof(Real)},
          owner,
          {},
          nb::dtype<Real>(),
          nb::device::cuda::value,
          states.device};
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
  const cuda::DeviceStates states = cuda::device_states(get());
  reading_device_ = states.device;
  return states;
}

void bind_device_states(nb::class_<PythonWorld>& world) {
  world.def("device_states", [](nb::handle_t<PythonWorld> self) {
    const cuda::DeviceStates s = nb::cast<PythonWorld&>(self).device_states();
    return nb::make_tuple(rows_of(s.positions, s, self), rows_of(s.orientations, s, self),
                          rows_of(s.velocities, s, self), rows_of(s.angular_velocities, s, self));
  });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
