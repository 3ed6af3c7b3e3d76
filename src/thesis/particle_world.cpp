/// ParticleWorld: validation and the step of integration, detection and resolution.
#include <jfpx/error.hpp>
#include <jfpx/thesis/particle.hpp>

#include "src/scene/field_fault.hpp"
#include "src/thesis/particle_resolver.hpp"

#include <new>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

void validate(const ParticleState& state) {
  require_in_range("position", state.position, kInWorld);
  require_in_range("velocity", state.velocity, kFinite);
}

void validate(const ParticleDef& def) {
  const std::string found = find_mass_fault(def.mass);
  if (!found.empty()) throw InvalidArgument(found);
  validate(ParticleState{def.position, def.velocity});
  require_in_range("acceleration", def.acceleration, kFinite);
  require_in_range("damping", def.damping, kAboveZeroToOne);
  require_in_range("radius", def.radius, Interval{0, kMaxCoordinate, ">= 0 and at most 1e9"});
  require_in_range("restitution", def.restitution, kZeroToOne);
}

void validate(const ParticleSettings& settings) {
  require_in_range("dt", settings.dt, kStepLength);
  for (const HalfSpace& ground : settings.grounds) {
    require_in_range("normal of a ground", ground.normal, kUnitVector);
    require_in_range("offset of a ground", ground.offset, kInWorld);
  }
  require_in_range("velocity_epsilon", settings.velocity_epsilon, kPositive);
  require_in_range("position_epsilon", settings.position_epsilon, kPositive);
  require_in_range("restitution_velocity", settings.restitution_velocity, kNotNegative);
}

}  // namespace

struct ParticleWorld::Impl {
  explicit Impl(const ParticleSettings& given)
      : settings(given), particles(given.dt), collider(make_sphere_collider(given.collider)) {
    for (HalfSpace& ground : settings.grounds) {
      const Real scale = Real(1) / length(ground.normal);
      ground.normal *= scale;
      ground.offset *= scale;
    }
  }

  std::uint32_t require_alive(ParticleId id) const {
    if (particles.contains(id)) return id.index;
    throw InvalidArgument("particle id (index " + std::to_string(id.index) + ", generation " +
                          std::to_string(id.generation) +
                          ") is unknown; it must be of a living particle of this world");
  }

  bool advance(ParticleReport* report);
  bool all_in_world(ParticleReport* report) const;
  void find_contacts();
  void undo() noexcept {
    std::swap(particles.moving, before);
    contacts.clear();
  }

  ParticleSettings settings;
  ParticleStore particles;
  std::unique_ptr<SphereCollider> collider;
  ParticleResolver resolver;
  std::vector<SphereInstance> spheres;     ///< particles with a radius > 0
  std::vector<std::uint32_t> particle_of;  ///< by sphere
  std::vector<ParticleContact> contacts;
  ParticleMotion before;  ///< state that an undone step restores
  std::uint64_t steps = 0;
};

void ParticleWorld::Impl::find_contacts() {
  contacts.clear();
  spheres.clear();
  particle_of.clear();
  for (const ParticleId id : particles.ids()) {
    if (!(particles.radius(id.index) > 0)) continue;
    spheres.push_back({particles.moving.position[id.index], particles.radius(id.index)});
    particle_of.push_back(id.index);
  }
  for (const SphereContact& c : collider->find_contacts(spheres)) {
    const std::uint32_t a = particle_of[c.a], b = particle_of[c.b];
    if (!particles.movable(a) && !particles.movable(b)) continue;
    const Real restitution = square_root(particles.restitution(a) * particles.restitution(b));
    contacts.push_back({a, b, c.normal, c.distance, restitution});
  }
  for (const ParticleId id : particles.ids()) {
    const std::uint32_t a = id.index;
    if (!particles.movable(a)) continue;
    for (const HalfSpace& ground : settings.grounds) {
      const Real distance =
          dot(ground.normal, particles.moving.position[a]) - ground.offset - particles.radius(a);
      if (distance > 0) continue;
      contacts.push_back(
          {a, ParticleContact::kNoParticle, ground.normal, distance, particles.restitution(a)});
    }
  }
}

bool ParticleWorld::Impl::all_in_world(ParticleReport* report) const {
  for (const ParticleId id : particles.ids()) {
    if (kInWorld.contains(particles.moving.position[id.index]) &&
        is_finite(particles.moving.velocity[id.index])) {
      continue;
    }
    report->non_finite = true;
    report->non_finite_particle = id;
    return false;
  }
  return true;
}

bool ParticleWorld::Impl::advance(ParticleReport* report) {
  particles.integrate();
  if (!all_in_world(report)) return false;
  find_contacts();
  report->contacts = contacts.size();
  resolver.resolve(particles, contacts, settings, report);
  return all_in_world(report);
}

ParticleReport ParticleWorld::step() {
  Impl& w = *impl_;
  ParticleReport report;
  try {
    w.before = w.particles.moving;
  } catch (const std::bad_alloc&) {
    throw OutOfMemory("no memory to keep the state of " + std::to_string(w.particles.ids().size()) +
                      " particles during a step");
  }
  try {
    if (w.advance(&report)) {
      ++w.steps;
    } else {
      w.undo();
    }
  } catch (const std::bad_alloc&) {
    const std::size_t found = w.contacts.size();
    w.undo();
    throw OutOfMemory("no memory for a step of " + std::to_string(w.particles.ids().size()) +
                      " particles with more than " + std::to_string(found) + " contacts");
  } catch (...) {
    w.undo();
    throw;
  }
  report.step = w.steps;
  return report;
}

ParticleWorld::ParticleWorld(const ParticleSettings& settings) {
  validate(settings);
  impl_ = std::make_unique<Impl>(settings);
}
ParticleWorld::~ParticleWorld() = default;
ParticleWorld::ParticleWorld(ParticleWorld&&) noexcept = default;
ParticleWorld& ParticleWorld::operator=(ParticleWorld&&) noexcept = default;

ParticleId ParticleWorld::add(const ParticleDef& particle) {
  validate(particle);
  return impl_->particles.add(particle);
}

void ParticleWorld::remove(ParticleId id) {
  impl_->require_alive(id);
  impl_->particles.remove(id);
  impl_->contacts.clear();
}

std::span<const ParticleId> ParticleWorld::particles() const { return impl_->particles.ids(); }

bool ParticleWorld::contains(ParticleId id) const noexcept { return impl_->particles.contains(id); }

ParticleState ParticleWorld::state(ParticleId id) const {
  const std::uint32_t i = impl_->require_alive(id);
  return {impl_->particles.moving.position[i], impl_->particles.moving.velocity[i]};
}

void ParticleWorld::set_state(ParticleId id, const ParticleState& state) {
  const std::uint32_t i = impl_->require_alive(id);
  validate(state);
  impl_->particles.set_state(i, state);
}

void ParticleWorld::apply_force(ParticleId id, const Vec3& force) {
  const std::uint32_t i = impl_->require_alive(id);
  require_in_range("force", force, kFinite);
  impl_->particles.moving.force[i] += force;
}

double ParticleWorld::time() const {
  return static_cast<double>(impl_->steps) * static_cast<double>(impl_->settings.dt);
}

std::span<const ParticleContact> ParticleWorld::contacts() const { return impl_->contacts; }

const ParticleSettings& ParticleWorld::settings() const { return impl_->settings; }

}  // namespace JFPX_ABI
}  // namespace jfpx
