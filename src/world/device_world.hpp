/// The state of a world that lies on a device between steps.
#pragma once

#include <jfpx/cuda/world.hpp>

#include "src/contact_solver/contact_set.hpp"
#include "src/world/bodies_of_step.hpp"
#include "src/world/detected_contacts.hpp"
#include "src/world/force_table.hpp"
#include "src/world/sub_shape_table.hpp"

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

  virtual ~DeviceWorld() = default;

  /// Replaces the settings. upload() must follow.
  virtual void configure(const Scene& scene) noexcept = 0;
  /// Replaces the state on the device.
  /// @param last contacts of the last step, with their impulses and colors
  virtual void upload(const BodyStore& bodies, SubShapeTable* sub_shapes,
                      soft_step::ContactSet* last) = 0;
  /// Replaces forces and torques, and which bodies are awake.
  virtual void upload_forces(const BodyStore& bodies) = 0;
  /// Whether edit() may add bodies with indices below `slots`.
  virtual bool has_room(std::size_t slots) const noexcept = 0;
  /// Edits bodies of the state on the device. The same edits may be repeated after a failure.
  virtual void edit(const BodyStore& bodies, const BodyEdits& edits) = 0;
  /// One step. If a body runs away, the state does not change.
  /// @param forces act in this step, as far as they wake no body; null: none
  /// @param time   [s], start of the step
  virtual Result step(const ForceTable* forces, double time) = 0;
  /// The states on the device, with the lifetimes of cuda::device_states().
  virtual cuda::DeviceStates states() const noexcept = 0;
  virtual Vec3 fetch_position(std::uint32_t body) = 0;
  /// Copies the motion of all bodies to the host.
  virtual void fetch_motion(MotionArrays* moving) = 0;
  /// Copies the contacts of the last step, with their impulses and colors.
  virtual void fetch_contact_set(soft_step::ContactSet* last) = 0;
  /// Copies what ContactListMaker needs, of the last step or of the step before it.
  virtual void fetch_contacts(const BodiesOfStep& bodies, bool of_step_before,
                              soft_step::ContactSet* set, DetectedContacts* detected) = 0;
};

/// A world on a CUDA device. @param device its number
/// @throws BackendUnavailable with the reason, DeviceError
std::unique_ptr<DeviceWorld> make_device_world(const Scene& scene, int device = 0);

}  // namespace JFPX_ABI
}  // namespace jfpx
