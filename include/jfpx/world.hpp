/// The native engine: a world of rigid bodies that steps by itself (thesis 4.3).
#pragma once

#include <jfpx/scene.hpp>
#include <jfpx/sphere_collider.hpp>

#include <memory>
#include <span>
#include <vector>

namespace jfpx::inline JFPX_ABI {

struct WorldSettings {
  SphereColliderOptions collider;  ///< who finds sphere contacts, and how
};

/// One contact of the native engine. `b` is the immovable one where a sphere meets a box or a
/// half-space.
struct Contact {
  std::uint32_t a = 0, b = 0;  ///< BodyId::index; the place in the scene until a body is removed
  Vec3 normal;                 ///< [-], unit, from b to a
  Vec3 point;                  ///< [m], world, the middle of the overlap
  Real distance = 0;           ///< [m], <= 0: minus the penetration
  friend bool operator==(const Contact&, const Contact&) = default;
};

/// What one step did. Times are wall clock.
struct StepReport {
  std::uint64_t step = 0;             ///< number of the last step that was completed, from 1
  std::uint64_t contacts = 0;         ///< contacts found
  std::uint64_t sphere_contacts = 0;  ///< of these, between two spheres
  std::uint64_t position_iterations = 0;
  std::uint64_t velocity_iterations = 0;
  bool iterations_exhausted = false;  ///< a loop stopped at its limit with work left
  bool non_finite = false;            ///< a body left the world; the state is as before the step
  BodyId non_finite_body;             ///< the first such body
  std::uint32_t awake = 0;            ///< movable bodies awake after the step
  Backend backend = Backend::x86;     ///< who found sphere contacts
  double integrate_ms = 0, detect_ms = 0, resolve_ms = 0, total_ms = 0;
};

/// Rigid bodies and their motion. One owner: const functions may run concurrently with each other,
/// everything else excludes all other calls. Steps are deterministic to the last bit.
class JFPX_API World {
 public:
  /// Validates the scene. This version moves spheres only: boxes and half-spaces must be immovable.
  /// @throws InvalidScene, BackendUnavailable, OutOfMemory
  explicit World(const Scene& scene, const WorldSettings& settings = {});
  /// The same with sphere contacts from the given collider, which may be the caller's own.
  /// @throws InvalidArgument if it is null, InvalidScene, OutOfMemory
  World(const Scene& scene, std::unique_ptr<SphereCollider> collider);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Adds a body. @throws InvalidScene if the definition is bad.
  BodyId add(const BodyDef& body);
  /// Takes a body out and wakes what touched it.
  /// @throws InvalidArgument if the id is not of a living body of this world.
  void remove(BodyId id);

  /// One step of the scene's dt: integrate, detect, resolve. Throws nothing for physics. When a
  /// value stops being finite, or a coordinate passes kMaxCoordinate, the step is undone and
  /// reported; so are further steps, until the cause is removed or given another state.
  /// @throws OutOfMemory, DeviceError; the state is then as before the step.
  StepReport step();

  /// Living bodies in the order of their indices.
  std::span<const BodyId> bodies() const;
  /// States in the order of bodies().
  std::vector<BodyState> states() const;
  /// @throws InvalidArgument for an unknown id.
  BodyState state(BodyId id) const;
  /// Replaces the moving state, wakes the body and what touched it. An immovable body is put to
  /// its new place and stays at rest.
  /// @throws InvalidArgument for an unknown id or a value out of the range of validate().
  void set_state(BodyId id, const BodyState& state);
  bool awake(BodyId id) const;
  /// Contacts of the last step, in order: sphere pairs by (a, b), then others by (a, b). None after
  /// a failed step, or when bodies were added or removed since.
  std::span<const Contact> contacts() const;
  /// state_hash() of states().
  std::uint64_t state_hash() const;
  const Scene& scene() const;  ///< settings as given; its bodies are those of construction

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace jfpx::inline JFPX_ABI
