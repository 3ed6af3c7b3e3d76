/// Addition, removal and free motion of particles.
#include "src/world/particle_store.hpp"

#include "src/base/power.hpp"
#include "src/base/reserve.hpp"
#include "src/world/integrate.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

bool before(ParticleId a, ParticleId b) { return a.index < b.index; }

}  // namespace

/// Either adds a slot or changes nothing: capacity() counts generations, which grow last. Reserves
/// memory for free_, so that remove() never allocates.
void ParticleStore::add_slot() {
  const std::size_t slots = capacity() + 1;
  reserve_geometric(&free_, slots);
  reserve_geometric(&ids_, slots);
  const auto all = [slots](auto&... arrays) { (arrays.resize(slots), ...); };
  all(moving.position, moving.velocity, moving.force, acceleration_, velocity_gain_, inverse_mass_,
      radius_, restitution_, kept_, generation_);
  free_.push_back(static_cast<std::uint32_t>(slots - 1));
}

ParticleId ParticleStore::add(const ParticleDef& def) {
  if (free_.empty()) add_slot();
  const std::uint32_t i = free_.back();
  const ParticleId id{i, generation_[i]};
  ids_.insert(std::upper_bound(ids_.begin(), ids_.end(), id, before), id);
  free_.pop_back();

  inverse_mass_[i] = def.mass > 0 ? Real(1) / def.mass : Real(0);
  radius_[i] = def.radius;
  restitution_[i] = def.restitution;
  kept_[i] = static_cast<Real>(detail::power(def.damping, dt_));
  acceleration_[i] = def.acceleration;
  velocity_gain_[i] = moving.force[i] = {};
  set_state(i, {def.position, def.velocity});
  return id;
}

void ParticleStore::remove(ParticleId id) noexcept {
  // A slot is retired when its generations are exhausted, because ids are never reused.
  if (generation_[id.index] + 1 != 0) free_.push_back(id.index);
  ++generation_[id.index];
  ids_.erase(std::lower_bound(ids_.begin(), ids_.end(), id, before));
}

bool ParticleStore::contains(ParticleId id) const noexcept {
  const auto found = std::lower_bound(ids_.begin(), ids_.end(), id, before);
  return found != ids_.end() && *found == id;
}

void ParticleStore::set_state(std::uint32_t i, const ParticleState& state) {
  moving.position[i] = state.position;
  moving.velocity[i] = movable(i) ? state.velocity : Vec3{};
}

void ParticleStore::integrate() {
  for (const ParticleId id : ids_) {
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
