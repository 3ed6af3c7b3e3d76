/// A world that records its states and all calls that change it, for replay.
#pragma once

#include <jfpx/world.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {

class RecordingReader;

/// A force that a recording can contain: one of force.hpp. User-defined forces and contact
/// generators are code and cannot be stored in a file.
using RecordableForce =
    std::variant<Gravity, Drag, Spring, Bungee, Aero, AeroControl, Buoyancy, Explosion>;

/// A World whose changes are recorded in the file of RecordingWriter. It has the functions of World
/// that a file can store, with the same results and exceptions; `jfpx replay` repeats the run. With
/// several ranks, whose functions are collective, rank 0 writes the file; a FileError is thrown on
/// rank 0 only, so the program must then end. Not thread-safe, except for reading world().
class JFPX_API RecordedWorld {
 public:
  /// @throws as World and RecordingWriter
  RecordedWorld(const std::string& path, const Scene& scene, const WorldSettings& settings = {});
  ~RecordedWorld();
  RecordedWorld(RecordedWorld&&) noexcept;
  RecordedWorld& operator=(RecordedWorld&&) noexcept;

  /// The world, for reading.
  const World& world() const;
  /// Steps the world and appends a frame. @throws also FileError if the disk is full
  StepReport step();
  /// Completes the file. @throws FileError
  void finish();

  BodyId add(const BodyDef& body);
  void remove(BodyId id);
  void replace(BodyId id, const BodyDef& body);
  void set_state(BodyId id, const BodyState& state);
  void wake(BodyId id);

  void set_friction(BodyId id, Real friction);
  void set_restitution(BodyId id, Real restitution);
  void set_acceleration(BodyId id, const Vec3& acceleration);
  void set_damping(BodyId id, Real linear, Real angular);
  void set_mass(BodyId id, Real mass);
  void set_inertia(BodyId id, const std::optional<Mat3>& inertia);
  void set_motion_locks(BodyId id, const MotionLocks& locks);
  void set_user_data(BodyId id, std::uint64_t user_data);
  void set_filter(BodyId id, const CollisionFilter& filter);
  void set_pair_ignored(BodyId a, BodyId b, bool ignored);

  void apply_force(BodyId id, const Vec3& force);
  void apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point);
  void apply_torque(BodyId id, const Vec3& torque);
  void apply_impulse(BodyId id, const Vec3& impulse);
  void apply_impulse_at_point(BodyId id, const Vec3& impulse, const Vec3& point);
  void apply_angular_impulse(BodyId id, const Vec3& impulse);

  ForceId add_force(const RecordableForce& force);
  /// Replaces the parameters of a force, like an assignment to World::force().
  /// @throws InvalidArgument if the id is unknown or of a force of another type
  void set_force(ForceId id, const RecordableForce& force);
  void remove_force(ForceId id);

  JointId add_joint(const Joint& joint);
  void set_joint(JointId id, const Joint& joint);
  void remove_joint(JointId id);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Performs the recorded calls before a step. Has no effect for a recording of RecordingWriter,
/// which contains no calls.
/// @param step from 1 to reader.steps()
/// @param world in the state before that step: created from the scene of the recording, with all
///   earlier calls and steps repeated
/// @throws InvalidArgument for another step; FileError if a call is invalid for the world
JFPX_API void repeat_calls(RecordingReader& reader, std::uint64_t step, World& world);

}  // namespace JFPX_ABI
}  // namespace jfpx
