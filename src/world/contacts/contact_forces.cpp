/// Forces of contact points from their impulses; see the header.
#include "src/world/contacts/contact_forces.hpp"

#include "src/base/parallel_append.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactView;
using soft_step::KeptImpulse;

constexpr std::size_t kContactsPerForceChunk = 4096;

bool pushes(const KeptImpulse& kept) { return kept.normal > 0 || !(kept.friction == Vec3{}); }

/// Computes the forces of one contact after the other.
class ForcesOfContacts {
 public:
  ForcesOfContacts(const ContactView& contacts, Real inverse_h, const BodyStore& bodies)
      : contacts_(contacts), inverse_h_(inverse_h), bodies_(bodies) {}

  std::uint32_t count(std::uint32_t contact) const {
    const KeptImpulse* const kept = contacts_.impulses + contacts_.first_impulse(contact);
    return static_cast<std::uint32_t>(
        std::count_if(kept, kept + contacts_.impulse_count(contact), pushes));
  }
  /// @returns the end of the forces
  ContactForce* write(std::uint32_t contact, ContactForce* next) const {
    const KeptImpulse* const kept = contacts_.impulses + contacts_.first_impulse(contact);
    const auto& key = contacts_.key(contact);
    const Vec3 torque = torque_of(contact);
    for (std::uint32_t p = 0; p < contacts_.impulse_count(contact); ++p) {
      if (!pushes(kept[p])) continue;
      ContactForce& force = *next++;
      force.a = bodies_.id(key.a);
      force.b = bodies_.id(key.b);
      force.normal = contacts_.normal(contact);
      set_arms(contact, p, &force);
      const Real along = kept[p].normal > 0 ? kept[p].normal : Real(0);
      force.force = (force.normal * along + kept[p].friction) * inverse_h_;
      force.torque = torque;
      force.part_a = key.is_generated() ? 0 : key.part_a;
      force.part_b = key.is_generated() ? 0 : key.part_b;
    }
    return next;
  }

 private:
  /// The share of each point in the torque of rolling and spinning friction.
  Vec3 torque_of(std::uint32_t contact) const {
    if (contacts_.rolling_impulses == nullptr) return {};
    const std::uint32_t points = count(contact);
    if (points == 0) return {};
    return contacts_.rolling_impulses[contact] * (inverse_h_ / static_cast<Real>(points));
  }
  void set_arms(std::uint32_t contact, std::uint32_t point, ContactForce* force) const {
    if (!contacts_.is_sphere(contact)) {
      const soft_step::PointInput& arms =
          contacts_.points[contacts_.manifold(contact).first + point];
      force->arm_a = arms.arm_a, force->arm_b = arms.arm_b;
      return;
    }
    const auto& [key, normal, distance] = contacts_.spheres[contact];
    const Real half_overlap = distance < 0 ? distance * Real(0.5) : Real(0);  // as RowSetup
    force->arm_a = normal * -(bodies_.radius(key.a) + half_overlap);
    force->arm_b = normal * (bodies_.radius(key.b) + half_overlap);
  }

  const ContactView& contacts_;
  Real inverse_h_;
  const BodyStore& bodies_;
};

}  // namespace

void make_contact_forces(const ContactView& contacts, Real inverse_h, const BodyStore& bodies,
                         ThreadPool* pool, std::vector<ContactForce>* forces) {
  const ForcesOfContacts from(contacts, inverse_h, bodies);
  std::vector<std::size_t> begin;
  forces->clear();
  parallel_append(
      pool, contacts.size(), kContactsPerForceChunk,
      [&](std::size_t i) { return std::size_t{from.count(static_cast<std::uint32_t>(i))}; },
      [&](std::size_t i, ContactForce* next) {
        return from.write(static_cast<std::uint32_t>(i), next);
      },
      &begin, forces);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
