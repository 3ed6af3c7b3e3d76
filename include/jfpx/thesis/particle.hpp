/// Particles: point masses and small balls without orientation (thesis 3.7, after Millington). Used
/// by the demos of the thesis; independent of World.
#pragma once

#include <jfpx/scene.hpp>
#include <jfpx/sphere_collider.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Identifies a particle of one ParticleWorld for the lifetime of the particle. The id of a removed
/// particle is never reused.
struct ParticleId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;
  friend bool operator==(const ParticleId&, const ParticleId&) = default;
};

/// Definition of a particle. SI units.
struct ParticleDef {
  Real mass = 1;                         ///< [kg], >= 0; 0 means immovable
  Vec3 position = {};                    ///< [m]
  Vec3 velocity = {};                    ///< [m/s]; an immovable particle stays at rest
  Vec3 acceleration{0, Real(-9.81), 0};  ///< [m/s^2], constant; ignored by an immovable particle
  Real damping = 1;                      ///< [-], fraction of velocity kept per second, in (0, 1]
  Real radius = 0;       ///< [m], >= 0; a particle of radius 0 collides with grounds only
  Real restitution = 0;  ///< [-], in [0, 1]; two particles combine as sqrt(e0 * e1)
};

struct ParticleState {
  Vec3 position;  ///< [m]
  Vec3 velocity;  ///< [m/s]
  friend bool operator==(const ParticleState&, const ParticleState&) = default;
};

/// One contact between two particles, or of a particle with a ground.
struct ParticleContact {
  static constexpr std::uint32_t kNoParticle = 0xffffffffu;
  std::uint32_t a = 0;            ///< ParticleId::index
  std::uint32_t b = kNoParticle;  ///< ParticleId::index, or kNoParticle for a contact with a ground
  Vec3 normal;                    ///< [-], unit, towards a
  Real distance = 0;              ///< [m], <= 0: minus the penetration
  Real restitution = 0;           ///< [-], of the pair
  friend bool operator==(const ParticleContact&, const ParticleContact&) = default;
};

struct ParticleSettings {
  Real dt = Real(1) / Real(60);  ///< [s], > 0: length of a step
  /// Immovable obstacles. A contact with a ground has the restitution of the particle.
  std::vector<HalfSpace> grounds = {};
  /// Maximum number of corrections per step in each loop; 0 means 8 per contact.
  std::uint32_t max_iterations = 0;
  Real velocity_epsilon = Real(1e-4);      ///< [m/s], > 0: smaller closing speeds remain
  Real position_epsilon = Real(1e-4);      ///< [m], > 0: smaller penetrations remain
  Real restitution_velocity = Real(0.25);  ///< [m/s], >= 0: slower contacts do not bounce
  SphereColliderOptions collider = {};     ///< finds the contacts between particles
};

/// Result of one step.
struct ParticleReport {
  std::uint64_t step = 0;      ///< number of the last completed step, from 1
  std::uint64_t contacts = 0;  ///< contacts found
  std::uint64_t position_iterations = 0, velocity_iterations = 0;
  bool iterations_exhausted = false;  ///< a solver loop stopped at its limit with work left
  bool non_finite = false;            ///< a particle left the world; the step was undone
  ParticleId non_finite_particle;     ///< the first such particle
};

/// Particles and their motion. Const functions may run concurrently with each other; every other
/// function excludes all other calls. Steps are deterministic to the last bit, with any collider.
class JFPX_THESIS_API ParticleWorld {
 public:
  /// @throws InvalidArgument with the name of the bad setting; BackendUnavailable
  explicit ParticleWorld(const ParticleSettings& settings = {});
  ~ParticleWorld();
  ParticleWorld(ParticleWorld&&) noexcept;
  ParticleWorld& operator=(ParticleWorld&&) noexcept;

  /// @throws InvalidArgument with the name of the bad field, its value and its range
  ParticleId add(const ParticleDef& particle);
  /// @throws InvalidArgument, here and below, for an id of no living particle of this world
  void remove(ParticleId id);
  /// Living particles in the order of their indices.
  std::span<const ParticleId> particles() const;
  bool contains(ParticleId id) const noexcept;

  ParticleState state(ParticleId id) const;
  /// @throws InvalidArgument also for a value out of its range
  void set_state(ParticleId id, const ParticleState& state);
  /// Adds to the force [N] of the next step; has no effect on an immovable particle.
  /// @throws InvalidArgument also for a force that is not finite
  void apply_force(ParticleId id, const Vec3& force);

  /// One step: integration, detection, resolution. When a value is no longer finite, or a
  /// coordinate exceeds kMaxCoordinate, the step is undone and reported.
  /// @throws OutOfMemory, DeviceError; the state is then as before the step
  ParticleReport step();

  double time() const;  ///< [s], completed steps times dt
  /// Contacts of the last step: those between particles by (a, b), then those with grounds by (a,
  /// index of the ground in the settings). Empty after a failed step, and after particles were
  /// removed.
  std::span<const ParticleContact> contacts() const;
  const ParticleSettings& settings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
