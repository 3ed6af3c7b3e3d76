/// Interface of a world whose state stays on a device between steps.
#pragma once

#include <jfpx/cuda/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/bodies/sub_shape_table.hpp"
#include "src/world/contacts/detected_contacts.hpp"
#include "src/world/forces/force_table.hpp"
#include "src/world/joints/joint_store.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A change of a body between two steps. Forces and properties of the body are copied from the
/// host; mass and inertia only with `sets_mass`.
struct BodyEdit {
  bool sets_state = false;       ///< copies position, orientation and velocities from the host
  bool sets_mass = false;        ///< copies mass and inertia in body axes from the host
  bool sets_pairs = false;       ///< copies the ignored pairs of the world from the host
  bool wakes = false;            ///< wakes the body
  bool wakes_neighbors = false;  ///< wakes the bodies in contact with the body in the last step
  bool is_removed = false;       ///< removes the body that had the index in the last step
  bool is_added = false;         ///< adds the body that has the index now
};
/// By BodyId::index.
using BodyEdits = std::unordered_map<std::uint32_t, BodyEdit>;

/// Steps of Solver::soft_step on a device, with the bits of SoftStep. The caller uploads a world,
/// then calls step() any number of times, and fetches the results that it needs. Not thread-safe.
///
/// Steps that do not wait for the host: after enqueue() or capture(), only enqueue(), capture(),
/// is_capturing(), has_graph(), is_held(), wait_for() and states() may be called until finish().
///
/// All functions but the destructor throw DeviceError if the device fails, and OutOfMemory. A
/// failed step() restores the state before the step.
class DeviceWorld {
 public:
  struct Result {
    std::uint64_t contacts = 0;         ///< size of World::contacts()
    std::uint64_t sphere_contacts = 0;  ///< of these, of two spheres
    std::uint32_t awake = 0;            ///< movable bodies awake after the step
    /// Device times: forces, contact search, all other stages.
    double forces_ms = 0, detect_ms = 0, resolve_ms = 0;
    std::optional<std::uint32_t> runaway;  ///< first body for which is_in_world() is false
    /// The bounds of a body's motion are not finite. The step had no effect; SoftStep reports the
    /// error on the host.
    bool invalid_bounds = false;
    /// A force must wake a body. The step had no effect; the host must apply the forces.
    bool must_wake = false;
  };
  /// Result of finish().
  struct Finished {
    std::uint64_t completed = 0;  ///< number of complete steps
    std::uint64_t deferred = 0;   ///< number of later steps that the caller must perform
    Result last;                  ///< of the last completed step if `deferred` is 0; without times
  };

  virtual ~DeviceWorld() = default;

  /// Replaces the settings. upload() must follow.
  virtual void configure(const Scene& scene) noexcept = 0;
  /// Replaces the state on the device.
  /// @param last contacts of the last step, with their impulses and colors
  /// @param keeps_velocities whether fetch_contacts() shall copy the velocities before a step
  virtual void upload(const BodyStore& bodies, SubShapeTable* sub_shapes,
                      soft_step::ContactSet* last, bool keeps_velocities) = 0;
  /// Replaces forces, torques and awake flags.
  virtual void upload_forces(const BodyStore& bodies) = 0;
  /// Replaces the joints and their impulses of the last step. upload() must precede. Waits.
  virtual void upload_joints(JointStore* joints) = 0;
  /// Whether edit() may add bodies with indices below `slots`.
  virtual bool has_room(std::size_t slots) const noexcept = 0;
  /// Edits bodies of the state on the device. The same edits may be repeated after a failure. May
  /// return before the device has completed them.
  virtual void edit(const BodyStore& bodies, const BodyEdits& edits) = 0;
  /// Performs one step. If a body leaves the world, the state does not change.
  /// @param forces of this step, except those that would wake a body; null: none
  /// @param steps  World::steps(), which determines the time
  virtual Result step(const ForceTable* forces, std::uint64_t steps) = 0;

  /// Copies the forces and reserves memory, so that capture() can follow. Enables steps after
  /// hold(). Waits.
  /// @param forces,steps as in step(), also for the functions below
  virtual void prepare(const ForceTable* forces, std::uint64_t steps) = 0;
  /// Enqueues steps, before later work of a stream. wait_for(stream) must precede. Waits only if
  /// lists are reallocated. If a step cannot be completed, all later steps have no effect.
  /// @param left number of steps; if enqueuing fails, receives the number that were not enqueued
  virtual void enqueue(const ForceTable* forces, std::uint64_t steps, cuda::Stream stream,
                       std::uint64_t* left) = 0;
  virtual bool is_capturing(cuda::Stream stream) = 0;
  /// Adds steps to the CUDA graph that is being captured from a stream. The graph is valid while
  /// the version of states() is unchanged.
  /// @returns false, without effect, if prepare() or a step since upload() is missing
  virtual bool capture(const ForceTable* forces, std::uint64_t steps, std::uint32_t count,
                       cuda::Stream stream) = 0;
  /// Whether the last captured graph is valid.
  virtual bool has_graph() const noexcept = 0;
  /// Disables the steps of captured graphs until step(), enqueue() or prepare(). Waits.
  virtual void hold() = 0;
  virtual bool is_held() const noexcept = 0;
  /// Makes later work of the world wait for earlier work of a stream.
  virtual void wait_for(cuda::Stream stream) = 0;
  /// Waits for all steps, including those of launched graphs. The state is then that after the last
  /// completed step. May be repeated after a failure.
  virtual Finished finish() = 0;

  /// The states on the device, with the lifetimes that cuda::device_states() documents.
  virtual cuda::DeviceStates states() const noexcept = 0;
  virtual Vec3 fetch_position(std::uint32_t body) = 0;
  /// Copies the columns of BodyState of all bodies to the host. @param pool copies in parallel
  virtual void fetch_states(MotionArrays* moving, ThreadPool* pool) = 0;
  /// Copies the other motion columns of all bodies to the host. @param pool copies in parallel
  virtual void fetch_other_motion(MotionArrays* moving, ThreadPool* pool) = 0;
  /// Copies the contacts of the last step, with their impulses and colors.
  virtual void fetch_contact_set(soft_step::ContactSet* last) = 0;
  /// Copies the impulses and colors of the joints of the last step.
  virtual void fetch_joints(JointStore* joints) = 0;
  /// Copies the data for ContactListMaker, of the last step or of the step before it.
  virtual void fetch_contacts(const BodiesOfStep& bodies, bool of_step_before,
                              soft_step::ContactSet* set, DetectedContacts* detected) = 0;
};

/// A world on a CUDA device, or on several ones that share its steps and its memory.
/// @param devices their numbers, 1 to device::kMostParts of them. A device that occurs more than
///   once has several parts of the work, for tests.
/// @throws BackendUnavailable with the reason, DeviceError
std::unique_ptr<DeviceWorld> make_device_world(const Scene& scene,
                                               const std::vector<int>& devices = {0});

}  // namespace JFPX_ABI
}  // namespace jfpx
