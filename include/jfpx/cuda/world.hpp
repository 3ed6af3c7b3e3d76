/// Worlds on a CUDA device: their states as device pointers, without a copy, and steps that do not
/// wait for the host.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/world.hpp>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// States of the bodies of a world in device memory, one array per quantity. The element of a body
/// has the index BodyId::index; elements of unused slots have no meaning. A Vec3 is three
/// consecutive Reals (x, y, z), a Quat four (w, x, y, z), without padding.
///
/// The arrays must not be written. Steps change them in place; they are valid until `version`
/// changes. When device_states() returns, the arrays are complete, and kernels on any stream of the
/// device can read them. If enqueued or replayed steps are in progress, only kernels that follow
/// these steps on their stream can read them. The reads must be complete before the next step or
/// change, or precede it on `stream` or on the stream that is passed to enqueue_steps().
struct DeviceStates {
  int device = 0;                   ///< ordinal of the GPU
  Stream stream = nullptr;          ///< all work of the world is enqueued on it, except graphs
  std::size_t slots = 0;            ///< length of the four arrays of states
  std::size_t count = 0;            ///< number of living bodies
  const BodyId* ids = nullptr;      ///< of the living bodies, sorted by index as in World::bodies()
  const Vec3* positions = nullptr;  ///< [m], centres of mass
  const Quat* orientations = nullptr;        ///< unit quaternions
  const Vec3* velocities = nullptr;          ///< [m/s]
  const Vec3* angular_velocities = nullptr;  ///< [rad/s], world axes
  /// In device memory: number of enqueued and replayed steps that were deferred to the host; see
  /// enqueue_steps(). The states are those before the deferred steps.
  const std::uint64_t* deferred_steps = nullptr;
  /// Changes when arrays are reallocated, and when captured graphs of steps become invalid: when
  /// bodies are added or removed, a list of contacts needs more memory, the world moves to the
  /// host, add_force(), remove_force() or restore() is called, masses change in a world with
  /// forces, ignored pairs change, or the first filter is set.
  std::uint64_t version = 0;
};
static_assert(sizeof(Vec3) == 3 * sizeof(Real) && sizeof(Quat) == 4 * sizeof(Real));

/// Returns the states after the last step and all later changes. Copies nothing if the states are
/// on the device, as after a step there; otherwise copies the changes, or uploads the world. Waits
/// for enqueued or replayed steps only if there are changes to copy. Must not run concurrently with
/// any call on the same world.
/// @throws BackendUnavailable with the reason if the world has no device. A world with
///   Solver::soft_step has a device with Backend::cuda, or once Backend::automatic has started it,
///   until the device fails. DeviceError, OutOfMemory; the world is then unchanged.
JFPX_API DeviceStates device_states(World& world);

/// Enqueues `count` steps on the device, after earlier work of `stream` and before its later work,
/// and returns without waiting for them. Every function of World that reads or changes the state
/// waits like finish_steps(). All results equal those of World::step(), bit for bit.
///
/// A step is deferred to the host if a list of contacts is too short, a body leaves the world, or a
/// force must wake a body. This step and all later ones then have no effect on the device; the host
/// performs them when it waits. Kernels read the number of deferred steps from
/// DeviceStates::deferred_steps. Steps with user-defined forces or contact generators, and all
/// steps of a sleeping world, are performed before the call returns. If a CUDA call fails, the CPU
/// performs the steps, and finish_steps() reports the reason.
///
/// If `stream` is being captured, the steps become part of its CUDA graph, and each launch of the
/// graph performs them. Graphs, enqueued steps and single steps may alternate. After a change of
/// the world, the steps of a graph are deferred until device_states(), step() or enqueue_steps()
/// has copied the change to the device. Requirements:
///   - the world has performed a step on the device since it moved there, there are no user-defined
///     forces and contact generators, and device_states() has been called after the last change;
///   - a graph is launched only while DeviceStates::version is that of the capture, and not
///     concurrently with another call on the world; the caller orders the streams if several
///     streams launch graphs of the world or enqueue steps;
///   - after an exception, the captured graph is discarded;
///   - while a stream is being captured, no other function of the world is called.
/// While a graph is valid, waiting for the steps of the world waits for the whole device.
///
/// A reference from World::force() must not be used for a change while steps are in progress: call
/// force() again, which waits. Must not run concurrently with any call on the same world.
/// @param stream a cudaStream_t of the device of the world; null: the default stream
/// @throws BackendUnavailable like device_states(); InvalidArgument if the stream is being captured
///   and a requirement is not met; OutOfMemory and the exceptions of World::step() if steps are
///   performed at once; DeviceError if a call fails while the stream is being captured
JFPX_API void enqueue_steps(World& world, std::uint32_t count, Stream stream);

/// Waits for all enqueued steps and for the steps of all launched graphs, then performs the
/// deferred steps.
/// @returns the report of the last of these steps, without times of the stages; if there are none,
///   the report of the last earlier step. A failure of the device is reported once.
/// @throws the exceptions of World::step(); the remaining steps are then dropped
JFPX_API StepReport finish_steps(World& world);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
