/// Access to the states of a world on a CUDA device: device pointers, without a copy.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/world.hpp>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// States of the bodies of a world in device memory, one array per quantity. The element of a body
/// has the index BodyId::index; elements of unused slots have no meaning. A Vec3 is three
/// consecutive Reals (x, y, z), a Quat four (w, x, y, z), without padding.
///
/// The arrays are valid until the next step or change of the world, and must not be written. They
/// are complete, so that kernels on any stream of the device can read them. The reads must be
/// complete before the next step or change, or be enqueued on `stream`.
struct DeviceStates {
  int device = 0;                   ///< ordinal of the GPU
  Stream stream = nullptr;          ///< all work of the world is enqueued on it, in order
  std::size_t slots = 0;            ///< length of the four arrays of states
  std::size_t count = 0;            ///< number of living bodies
  const BodyId* ids = nullptr;      ///< of the living bodies, as World::bodies(): sorted by index
  const Vec3* positions = nullptr;  ///< [m], centres of mass
  const Quat* orientations = nullptr;        ///< unit quaternions
  const Vec3* velocities = nullptr;          ///< [m/s]
  const Vec3* angular_velocities = nullptr;  ///< [rad/s], world axes
};
static_assert(sizeof(Vec3) == 3 * sizeof(Real) && sizeof(Quat) == 4 * sizeof(Real));

/// Returns the states after the last step and all changes since. Copies nothing if the device has
/// them, as after a step there; otherwise uploads the world. Must not run concurrently with any
/// call on the same world.
/// @throws BackendUnavailable with the reason if the world has no device. A world has one with
///   Solver::soft_step and Backend::cuda, or Backend::automatic after that has started the device,
///   until it fails. DeviceError, OutOfMemory; the world is then unchanged.
JFPX_API DeviceStates device_states(World& world);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
