/// Addition, removal and free motion of particles.
#include "src/thesis/particle_store.hpp"

#include "src/base/power.hpp"
#include "src/world/bodies/integrate.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

/// Adds an unused slot. If an allocation fails, capacity() is unchanged, because the pool is last.
void ParticleStore::add_slot() {
  const std::size_t slots = capacity() + 1;
  const auto all = [slots](auto&... arrays) { (arrays.resize(slots), ...); };
  all(moving.position, moving.velocity, moving.force, acceleration_, velocity_gain_, inverse_mass_,
      radius_, restitution_, kept_);
  pool_.add_slot();
}

ParticleId ParticleStore::add(const ParticleDef& def) {
  if (pool_.is_full()) add_slot();
  const ParticleId id = pool_.add();
  const std::uint32_t i = id.index;

  inverse_mass_[i] = def.mass > 0 ? Real(1) / def.mass : Real(0);
  radius_[i] = def.radius;
  restitution_[i] = def.restitution;
  kept_[i] = static_cast<Real>(detail::power(def.damping, dt_));
  acceleration_[i] = def.acceleration;
  velocity_gain_[i] = moving.force[i] = {};
  set_state(i, {def.position, def.velocity});
  return id;
}

void ParticleStore::set_state(std::uint32_t i, const ParticleState& state) {
  moving.position[i] = state.position;
  moving.velocity[i] = movable(i) ? state.velocity : Vec3{};
}

void ParticleStore::integrate() {
  for (const ParticleId id : ids()) {
    const std::uint32_t i = id.index;
    const Vec3 force = std::exchange(moving.force[i], {});
    if (!movable(i)) continue;
    const Vec3 acceleration = add_scaled(acceleration_[i], force, inverse_mass_[i]);
    velocity_gain_[i] = detail::integrated_velocity({}, acceleration, dt_, kept_[i]);
    moving.velocity[i] =
        detail::integrated_velocity(moving.velocity[i], acceleration, dt_, kept_[i]);
    moving.position[i] = detail::integrated_position(moving.position[i], moving.velocity[i], dt_);
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
