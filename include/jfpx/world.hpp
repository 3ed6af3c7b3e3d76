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

/// One contact of the native engine. `b` is immovable where a body meets the environment.
struct Contact {
  std::uint32_t a = 0, b = 0;  ///< positions in World::bodies()
  Vec3 normal;                 ///< [-], unit, from b to a
  Vec3 point;                  ///< [m], world, the middle of the overlap
  Real distance = 0;           ///< [m], <= 0: minus the penetration
  friend bool operator==(const Contact&, const Contact&) = default;
};

/// What one step did. Times are wall clock.
struct StepReport {
  std::uint64_t step = 0;             ///< number of this step, from 1
  std::uint64_t contacts = 0;         ///< contacts found
  std::uint64_t sphere_contacts = 0;  ///< of these, between two spheres
  std::uint64_t position_iterations = 0;
  std::uint64_t velocity_iterations = 0;
  bool iterations_exhausted = false;  ///< a loop stopped at its limit with work left
  bool non_finite = false;            ///< a body left the finite numbers; the state is frozen
  BodyId non_finite_body;             ///< the first such body
  std::uint32_t awake = 0;            ///< movable bodies awake after the step
  Backend backend = Backend::x86;     ///< who found sphere contacts
  double integrate_ms = 0, detect_ms = 0, resolve_ms = 0, total_ms = 0;
};

/// Rigid bodies and their motion. One owner: const functions may run concurrently with each other,
/// everything else excludes all other calls. Steps are deterministic to the last bit.
class JFPX_API World {
 public:
  /// Validates the scene. @throws InvalidScene, BackendUnavailable, OutOfMemory
  explicit World(const Scene& scene, const WorldSettings& settings = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Adds a body. @throws InvalidScene if the definition is bad.
  BodyId add(const BodyDef& body);
  /// Takes a body out. @throws InvalidArgument if the id is not of a living body of this world.
  void remove(BodyId id);

  /// One step of the scene's dt: integrate, detect, resolve. Throws nothing for physics; after a
  /// non-finite state further steps change nothing and report it again.
  /// @throws OutOfMemory, DeviceError; the state is then as before the step.
  StepReport step();

  /// Living bodies in the order of their indices.
  std::span<const BodyId> bodies() const;
  /// States in the order of bodies().
  std::vector<BodyState> states() const;
  /// @throws InvalidArgument for an unknown id.
  BodyState state(BodyId id) const;
  /// Replaces the moving state and wakes the body.
  /// @throws InvalidArgument for an unknown id or a value that is not finite.
  void set_state(BodyId id, const BodyState& state);
  bool awake(BodyId id) const;
  /// Contacts of the last step, in order: sphere pairs by (a, b), then others by (a, b).
  std::span<const Contact> contacts() const;
  /// state_hash() of states().
  std::uint64_t state_hash() const;
  const Scene& scene() const;  ///< settings as given; its bodies are those of construction

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace jfpx::inline JFPX_ABI
