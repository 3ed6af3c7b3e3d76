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
/// changes. They are complete when device_states() returns, so that kernels on any stream of the
/// device can read them, unless enqueued or replayed steps are in progress: then only kernels that
/// follow these steps on their stream can. The reads must be complete before the next step or
/// change, or precede it on the stream that enqueue_steps() gets, or on `stream`.
struct DeviceStates {
  int device = 0;                   ///< ordinal of the GPU
  Stream stream = nullptr;          ///< all work of the world is enqueued on it, except graphs
  std::size_t slots = 0;            ///< length of the four arrays of states
  std::size_t count = 0;            ///< number of living bodies
  const BodyId* ids = nullptr;      ///< of the living bodies, as World::bodies(): sorted by index
  const Vec3* positions = nullptr;  ///< [m], centres of mass
  const Quat* orientations = nullptr;        ///< unit quaternions
  const Vec3* velocities = nullptr;          ///< [m/s]
  const Vec3* angular_velocities = nullptr;  ///< [rad/s], world axes
  /// In device memory: number of enqueued and replayed steps that the device has deferred to the
  /// host; see enqueue_steps(). The states are those before these steps.
  const std::uint64_t* deferred_steps = nullptr;
  /// Changes when arrays move, and whenever a captured graph of steps becomes invalid: when bodies
  /// come or go, when a list of contacts needs more memory, when the world moves to the host, when
  /// add_force(), remove_force() or restore() is called, when masses change in a world with forces,
  /// and when ignored pairs change or the first filter is set.
  std::uint64_t version = 0;
};
static_assert(sizeof(Vec3) == 3 * sizeof(Real) && sizeof(Quat) == 4 * sizeof(Real));

/// Returns the states after the last step and all changes since. Copies nothing if the device has
/// them, as after a step there; otherwise sends the changes, or uploads the world. Waits for
/// enqueued or replayed steps only if there are changes to send. Must not run concurrently with any
/// call on the same world.
/// @throws BackendUnavailable with the reason if the world has no device. A world has one with
///   Solver::soft_step and Backend::cuda, or Backend::automatic after that has started the device,
///   until it fails. DeviceError, OutOfMemory; the world is then unchanged.
JFPX_API DeviceStates device_states(World& world);

/// Enqueues `count` steps on the device, after earlier work of `stream` and before its later work,
/// and returns without waiting for them. Every function of World that reads or changes the state
/// waits, as finish_steps() does; all results are those of World::step(), bit for bit.
///
/// The device defers a step to the host if a list of contacts is too short, if a body runs away, or
/// if a force must wake a body. This step and those after it then have no effect on the device, and
/// the host makes them when it waits. Kernels read the number of these steps from
/// DeviceStates::deferred_steps. Steps with user-defined forces or contact generators, and all
/// steps of a sleeping world, are made before the call returns. If a CUDA call fails, the CPU makes
/// the steps, and finish_steps() reports the reason.
///
/// If `stream` is being captured, the steps become part of its CUDA graph, and each launch of the
/// graph makes them. Graphs, enqueued steps and single steps may follow each other; after a change
/// of the world, the steps of a graph are deferred until device_states(), step() or enqueue_steps()
/// has sent the change. Requirements:
///   - the world has made a step on the device since it moved there, there are no user-defined
///     forces and contact generators, and device_states() has been called after the last change;
///   - a graph is launched only while DeviceStates::version is that of the capture, and not
///     concurrently with another call on the world; the caller orders streams, if several launch
///     graphs of the world, or enqueue steps;
///   - after an exception, the captured graph is discarded;
///   - while a stream is being captured, no other function of the world is called.
/// As long as a graph is valid, waiting for the steps of the world waits for the whole device.
///
/// A reference from World::force() must not be used for a change while steps are in progress: call
/// force() again, which waits. Must not run concurrently with any call on the same world.
/// @param stream a cudaStream_t of the device of the world; null: the default stream
/// @throws BackendUnavailable as device_states(); InvalidArgument if the stream is being captured
///   and a requirement is not met; OutOfMemory and the exceptions of World::step() if steps are
///   made at once; DeviceError if a call fails while the stream is being captured
JFPX_API void enqueue_steps(World& world, std::uint32_t count, Stream stream);

/// Waits for all enqueued steps, and for those of all graphs that have been launched, and makes the
/// deferred steps.
/// @returns the report of the last of these steps, without times of the stages; if there are none,
///   that of the last earlier one. A failure of the device is reported once.
/// @throws as World::step(); the steps that were not yet made are then left out
JFPX_API StepReport finish_steps(World& world);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
