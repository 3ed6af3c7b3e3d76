/// Storage of a world's particles: one array per quantity, indexed by ParticleId::index.
#pragma once

#include <jfpx/thesis/particle.hpp>

#include "src/world/bodies/id_pool.hpp"

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// State that a step changes. Copied before each step, so that a failed step can be undone.
struct ParticleMotion {
  std::vector<Vec3> position;  ///< [m]
  std::vector<Vec3> velocity;  ///< [m/s]
  std::vector<Vec3> force;     ///< [N], for the next step
};

/// Owns the particles, their ids and their free motion. Loops iterate over ids(), in the order of
/// indices.
class ParticleStore {
 public:
  explicit ParticleStore(Real dt) : dt_(dt) {}

  /// @param def must have passed validation
  /// @throws std::bad_alloc without a change
  ParticleId add(const ParticleDef& def);
  /// @param id of a particle in the store
  void remove(ParticleId id) noexcept { pool_.remove(id); }
  bool contains(ParticleId id) const noexcept { return pool_.contains(id); }
  std::span<const ParticleId> ids() const noexcept { return pool_.ids(); }
  /// Number of slots ever used; upper bound of all indices.
  std::size_t capacity() const noexcept { return pool_.capacity(); }

  /// Replaces position and velocity; an immovable particle stays at rest.
  void set_state(std::uint32_t particle, const ParticleState& state);
  /// One step of free motion: acceleration, damping, then motion at the new velocity.
  void integrate();

  bool movable(std::uint32_t particle) const { return inverse_mass_[particle] > 0; }
  Real inverse_mass(std::uint32_t particle) const { return inverse_mass_[particle]; }
  Real radius(std::uint32_t particle) const { return radius_[particle]; }
  Real restitution(std::uint32_t particle) const { return restitution_[particle]; }
  /// [m/s], velocity that the last integrate() adds to a particle at rest.
  Vec3 velocity_gain(std::uint32_t particle) const { return velocity_gain_[particle]; }

  ParticleMotion moving;

 private:
  void add_slot();

  Real dt_;
  std::vector<Vec3> acceleration_, velocity_gain_;
  std::vector<Real> inverse_mass_, radius_, restitution_;
  std::vector<Real> kept_;  ///< damping^dt
  IdPool<ParticleId> pool_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
