/// The state of a world that lies on a device between steps.
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

/// A change of a body between two steps. The forces and properties of the body are always those of
/// the host, except mass and inertia.
struct BodyEdit {
  bool sets_state = false;       ///< position, orientation and velocities are those of the host
  bool sets_mass = false;        ///< mass and inertia in body axes are those of the host
  bool sets_pairs = false;       ///< the ignored pairs of the world are those of the host
  bool wakes = false;            ///< wakes the body
  bool wakes_neighbors = false;  ///< wakes the bodies in contact with it in the last step
  bool is_removed = false;       ///< the body that had the index in the last step was removed
  bool is_added = false;         ///< the body that has the index now is new
};
/// By BodyId::index.
using BodyEdits = std::unordered_map<std::uint32_t, BodyEdit>;

/// Steps of Solver::soft_step on a device, with the bits of SoftStep. The caller uploads a world,
/// then calls step() any number of times, and fetches the results that it needs. Not thread-safe.
///
/// Steps that do not wait for the host: after enqueue() or capture(), finish() must precede all
/// functions but enqueue(), capture(), is_capturing(), has_graph(), is_held(), wait_for() and
/// states().
///
/// All functions but the destructor throw DeviceError if the device fails, and OutOfMemory. After a
/// failed step(), the state on the device is that before the step.
class DeviceWorld {
 public:
  struct Result {
    std::uint64_t contacts = 0;         ///< size of World::contacts()
    std::uint64_t sphere_contacts = 0;  ///< of these, of two spheres
    std::uint32_t awake = 0;            ///< movable bodies awake after the step
    /// Device times: forces, contact search, all other stages.
    double forces_ms = 0, detect_ms = 0, resolve_ms = 0;
    std::optional<std::uint32_t> runaway;  ///< first body that is_in_world() refuses
    /// The bounds of a body's motion are not finite: the step had no effect, and SoftStep reports
    /// the error.
    bool invalid_bounds = false;
    /// A force must wake a body: the step had no effect, and the host is to apply the forces.
    bool must_wake = false;
  };
  /// Steps that finish() has found.
  struct Finished {
    std::uint64_t completed = 0;  ///< number of complete steps
    std::uint64_t deferred = 0;   ///< number of steps after them that the caller must make
    Result last;                  ///< of the last complete step, if none is missing; without times
  };

  virtual ~DeviceWorld() = default;

  /// Replaces the settings. upload() must follow.
  virtual void configure(const Scene& scene) noexcept = 0;
  /// Replaces the state on the device.
  /// @param last contacts of the last step, with their impulses and colors
  virtual void upload(const BodyStore& bodies, SubShapeTable* sub_shapes,
                      soft_step::ContactSet* last) = 0;
  /// Replaces forces and torques, and which bodies are awake.
  virtual void upload_forces(const BodyStore& bodies) = 0;
  /// Replaces the joints, and what they keep from the last step. upload() must precede. Waits.
  virtual void upload_joints(JointStore* joints) = 0;
  /// Whether edit() may add bodies with indices below `slots`.
  virtual bool has_room(std::size_t slots) const noexcept = 0;
  /// Edits bodies of the state on the device. The same edits may be repeated after a failure. May
  /// return before the device is done.
  virtual void edit(const BodyStore& bodies, const BodyEdits& edits) = 0;
  /// One step. If a body runs away, the state does not change.
  /// @param forces act in this step, as far as they wake no body; null: none
  /// @param steps  World::steps(), which gives the time
  virtual Result step(const ForceTable* forces, std::uint64_t steps) = 0;

  /// Sends the forces, and makes room, so that capture() can follow. Enables steps after hold().
  /// Waits.
  /// @param forces,steps as for step(), like those of the functions below
  virtual void prepare(const ForceTable* forces, std::uint64_t steps) = 0;
  /// Enqueues steps, before later work of a stream. wait_for(stream) must precede. Waits only
  /// if lists move. If a step cannot be completed, the later ones have no effect.
  /// @param left number of steps; becomes that of those which were not enqueued, if that fails
  virtual void enqueue(const ForceTable* forces, std::uint64_t steps, cuda::Stream stream,
                       std::uint64_t* left) = 0;
  virtual bool is_capturing(cuda::Stream stream) = 0;
  /// Adds steps to the CUDA graph that is being captured from a stream. The graph is valid as long
  /// as the version of states().
  /// @returns false, without effect, if prepare() or a step since upload() is missing
  virtual bool capture(const ForceTable* forces, std::uint64_t steps, std::uint32_t count,
                       cuda::Stream stream) = 0;
  /// Whether the last captured graph is valid.
  virtual bool has_graph() const noexcept = 0;
  /// Until step(), enqueue() or prepare(), steps of captured graphs have no effect. Waits.
  virtual void hold() = 0;
  virtual bool is_held() const noexcept = 0;
  /// Later work of the world waits for earlier work of a stream.
  virtual void wait_for(cuda::Stream stream) = 0;
  /// Waits for all steps, also of the graphs that have been launched. The state is then that after
  /// the last complete one. May be repeated after a failure.
  virtual Finished finish() = 0;

  /// The states on the device, with the lifetimes of cuda::device_states().
  virtual cuda::DeviceStates states() const noexcept = 0;
  virtual Vec3 fetch_position(std::uint32_t body) = 0;
  /// Copies what BodyState has of all bodies to the host. @param pool makes a part of the copies
  virtual void fetch_states(MotionArrays* moving, ThreadPool* pool) = 0;
  /// Copies the rest of the motion of all bodies to the host, likewise.
  virtual void fetch_other_motion(MotionArrays* moving, ThreadPool* pool) = 0;
  /// Copies the contacts of the last step, with their impulses and colors.
  virtual void fetch_contact_set(soft_step::ContactSet* last) = 0;
  /// Copies what the joints have kept in the last step.
  virtual void fetch_joints(JointStore* joints) = 0;
  /// Copies what ContactListMaker needs, of the last step or of the step before it.
  virtual void fetch_contacts(const BodiesOfStep& bodies, bool of_step_before,
                              soft_step::ContactSet* set, DetectedContacts* detected) = 0;
};

/// A world on a CUDA device. @param device its number
/// @throws BackendUnavailable with the reason, DeviceError
std::unique_ptr<DeviceWorld> make_device_world(const Scene& scene, int device = 0);

}  // namespace JFPX_ABI
}  // namespace jfpx
