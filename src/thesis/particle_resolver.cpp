/// Resolution of particle contacts: deepest contact first, then largest target change of velocity
/// first. Each correction updates the other contacts of its particles.
#include "src/thesis/particle_resolver.hpp"

#include "src/thesis/contact_response.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Calls act(particle, sign) for the particles of a contact. A motion along sign * normal separates
/// them.
template <class Act>
void for_both(const ParticleContact& c, Act act) {
  act(c.a, Real(1));
  if (c.b != ParticleContact::kNoParticle) act(c.b, Real(-1));
}

/// Velocity of a relative to b along the normal; negative if they approach.
Real separating(const ParticleContact& c, std::span<const Vec3> velocity) {
  Vec3 relative = velocity[c.a];
  if (c.b != ParticleContact::kNoParticle) relative -= velocity[c.b];
  return dot(relative, c.normal);
}

/// Contribution of the last step's acceleration to separating(); restitution does not apply to it.
Real separating_from_acceleration(const ParticleContact& c, const ParticleStore& particles) {
  Vec3 relative = particles.velocity_gain(c.a);
  if (c.b != ParticleContact::kNoParticle) relative -= particles.velocity_gain(c.b);
  return dot(relative, c.normal);
}

}  // namespace

void ParticleResolver::list_contacts_of(const ParticleStore& particles,
                                        std::span<const ParticleContact> contacts) {
  first_.assign(particles.capacity() + 1, 0);
  for (const ParticleContact& c : contacts) {
    for_both(c, [&](std::uint32_t p, Real) { ++first_[p + 1]; });
  }
  for (std::size_t p = 1; p < first_.size(); ++p) first_[p] += first_[p - 1];
  contacts_of_.resize(first_.back());
  next_ = first_;
  for (std::uint32_t i = 0; i < contacts.size(); ++i) {
    for_both(contacts[i], [&](std::uint32_t p, Real) { contacts_of_[next_[p]++] = i; });
  }
}

/// Corrects the contact with the largest key until no key exceeds epsilon.
/// @param key     returns the required correction of contact i
/// @param correct corrects a contact
template <class Key, class Correct>
std::uint64_t ParticleResolver::relax(std::span<const ParticleContact> contacts,
                                      std::uint64_t limit, Real epsilon, bool* exhausted, Key key,
                                      Correct correct) {
  keys_.resize(contacts.size());
  for (std::uint32_t i = 0; i < contacts.size(); ++i) keys_[i] = key(i);
  queue_.assign(keys_);
  for (std::uint64_t done = 0; done < limit; ++done) {
    const std::uint32_t worst = queue_.top();
    if (!(queue_.key(worst) > epsilon)) return done;
    correct(worst);
    for_both(contacts[worst], [&](std::uint32_t p, Real) {
      for (std::uint32_t k = first_[p]; k < first_[p + 1]; ++k)
        queue_.update(contacts_of_[k], key(contacts_of_[k]));
    });
  }
  *exhausted |= queue_.key(queue_.top()) > epsilon;
  return limit;
}

void ParticleResolver::resolve(ParticleStore& particles, std::span<const ParticleContact> contacts,
                               const ParticleSettings& settings, ParticleReport* report) {
  if (contacts.empty()) return;
  list_contacts_of(particles, contacts);
  const std::uint64_t limit =
      settings.max_iterations != 0 ? settings.max_iterations : std::uint64_t{8} * contacts.size();
  const auto inverse_mass = [&](const ParticleContact& c) {
    Real sum = 0;
    for_both(c, [&](std::uint32_t p, Real) { sum += particles.inverse_mass(p); });
    return sum;
  };

  distance_.resize(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) distance_[i] = contacts[i].distance;
  const auto separate = [&](std::uint32_t worst) {
    const ParticleContact& c = contacts[worst];
    const Real pseudo_impulse = -distance_[worst] / inverse_mass(c);
    for_both(c, [&](std::uint32_t p, Real side) {
      const Vec3 shift = c.normal * (side * pseudo_impulse * particles.inverse_mass(p));
      particles.moving.position[p] += shift;
      for (std::uint32_t k = first_[p]; k < first_[p + 1]; ++k) {
        const ParticleContact& neighbor = contacts[contacts_of_[k]];
        const Real along = dot(neighbor.normal, shift);
        distance_[contacts_of_[k]] += neighbor.a == p ? along : -along;
      }
    });
  };
  report->position_iterations = relax(
      contacts, limit, settings.position_epsilon, &report->iterations_exhausted,
      [&](std::uint32_t i) { return -distance_[i]; }, separate);

  const auto target_change = [&](std::uint32_t i) {
    const ParticleContact& c = contacts[i];
    return detail::target_delta_velocity(separating(c, particles.moving.velocity),
                                         separating_from_acceleration(c, particles), c.restitution,
                                         settings.restitution_velocity);
  };
  const auto bounce = [&](std::uint32_t worst) {
    const ParticleContact& c = contacts[worst];
    const Real impulse = target_change(worst) / inverse_mass(c);
    for_both(c, [&](std::uint32_t p, Real side) {
      particles.moving.velocity[p] += c.normal * (side * impulse * particles.inverse_mass(p));
    });
  };
  report->velocity_iterations = relax(contacts, limit, settings.velocity_epsilon,
                                      &report->iterations_exhausted, target_change, bounce);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
