/// The particles of a world: one array per quantity, indexed by ParticleId::index.
#pragma once

#include <jfpx/particle.hpp>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// What a step may change. Copied before each step, so that a failed one leaves no trace.
struct ParticleMotion {
  std::vector<Vec3> position;  ///< [m]
  std::vector<Vec3> velocity;  ///< [m/s]
  std::vector<Vec3> force;     ///< [N], of the coming step
};

/// Owns the particles, their ids and their free motion. Slots of removed particles are reused
/// under a new generation; loops run over ids(), in the order of indices.
class ParticleStore {
 public:
  explicit ParticleStore(Real dt) : dt_(dt) {}

  /// @param def must have passed validation @throws std::bad_alloc; nothing has changed then
  ParticleId add(const ParticleDef& def);
  /// @param id must be contained
  void remove(ParticleId id) noexcept;
  bool contains(ParticleId id) const noexcept;
  std::span<const ParticleId> ids() const noexcept { return ids_; }
  /// Slots ever used; indices are below it.
  std::size_t capacity() const noexcept { return generation_.size(); }

  /// Puts a particle somewhere; an immovable one stays at rest.
  void set_state(std::uint32_t particle, const ParticleState& state);
  /// One step of free motion: accelerated, damped once, then moved at the new velocity.
  void integrate();

  bool movable(std::uint32_t particle) const { return inverse_mass_[particle] > 0; }
  Real inverse_mass(std::uint32_t particle) const { return inverse_mass_[particle]; }
  Real radius(std::uint32_t particle) const { return radius_[particle]; }
  Real restitution(std::uint32_t particle) const { return restitution_[particle]; }
  /// [m/s], of the velocity: what the last integrate() added to a particle at rest.
  Vec3 gained(std::uint32_t particle) const { return gained_[particle]; }

  ParticleMotion moving;

 private:
  void add_slot();

  Real dt_;
  std::vector<Vec3> acceleration_, gained_;
  std::vector<Real> inverse_mass_, radius_, restitution_;
  std::vector<Real> kept_;  ///< damping^dt
  std::vector<std::uint32_t> generation_;
  std::vector<ParticleId> ids_;
  std::vector<std::uint32_t> free_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
