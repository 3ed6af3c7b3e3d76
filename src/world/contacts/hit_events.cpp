/// Hit events from the impulses of contacts and the velocities before the step; see the header.
///
/// As in Box2D, a hit is a contact that pushed in the step and whose points approached before.
#include "src/world/contacts/hit_events.hpp"

#include <jfpx/contact.hpp>

#include "src/base/parallel_append.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactView;

constexpr std::size_t kContactsPerHitChunk = 4096;

/// Computes the hits of one contact after the other.
class HitsOfContacts {
 public:
  HitsOfContacts(const DetectedContacts& start, const ContactView& contacts,
                 const BodiesOfStep& bodies, Real least)
      : start_(start), contacts_(contacts), bodies_(bodies), least_(least) {}

  /// 1 if a point of the contact is a hit, otherwise 0.
  std::size_t count(std::uint32_t contact) const { return fastest_of(contact).speed >= least_; }
  /// @returns the end of the hits
  HitEvent* write(std::uint32_t contact, HitEvent* next) const {
    const Fastest fastest = fastest_of(contact);
    if (!(fastest.speed >= least_)) return next;
    const auto& key = contacts_.key(contact);
    const BodyId a = bodies_[key.a].id, b = bodies_[key.b].id;
    const Vec3 normal = contacts_.normal(contact), point = position(contact, fastest.point);
    const bool swapped = a.index > b.index;
    *next++ = {swapped ? b : a,
               swapped ? a : b,
               swapped ? -normal : normal,
               point,
               fastest.speed,
               swapped ? key.part_b : key.part_a,
               swapped ? key.part_a : key.part_b};
    return next;
  }

 private:
  struct Fastest {
    std::uint32_t point = 0;
    Real speed = 0;  ///< [m/s], of approach; 0 if no point pushed
  };

  /// The point with the largest approach speed among those that pushed; of equal ones, the first.
  Fastest fastest_of(std::uint32_t contact) const {
    Fastest fastest;
    if (contacts_.key(contact).is_generated()) return fastest;
    const soft_step::KeptImpulse* const kept =
        contacts_.impulses + contacts_.first_impulse(contact);
    for (std::uint32_t p = 0; p < contacts_.impulse_count(contact); ++p) {
      if (!kept[p].has_pushed()) continue;
      const Real speed = approach_speed(contact, p);
      if (speed > fastest.speed) fastest = {p, speed};
    }
    return fastest;
  }
  Real approach_speed(std::uint32_t contact, std::uint32_t point) const {
    const auto& key = contacts_.key(contact);
    Vec3 relative = start_.velocity[key.b] - start_.velocity[key.a];
    // The points of two balls are on the line of their centres.
    if (!contacts_.is_sphere(contact)) {
      const soft_step::PointInput& p = contacts_.points[contacts_.manifold(contact).first + point];
      relative += cross(start_.angular_velocity[key.b], p.arm_b) -
                  cross(start_.angular_velocity[key.a], p.arm_a);
    }
    return dot(contacts_.normal(contact), relative);
  }
  /// As in World::contacts().
  Vec3 position(std::uint32_t contact, std::uint32_t point) const {
    const std::uint32_t b = contacts_.key(contact).b;
    if (!contacts_.is_sphere(contact)) {
      return start_.position[b] + contacts_.points[contacts_.manifold(contact).first + point].arm_b;
    }
    const auto& [key, normal, distance] = contacts_.spheres[contact];
    const SphereInstance sphere{start_.position[b], bodies_[b].radius};
    return distance <= 0 ? middle_point(normal, distance, sphere) : point_on_b(normal, sphere);
  }

  const DetectedContacts& start_;
  const ContactView& contacts_;
  const BodiesOfStep& bodies_;
  Real least_;
};

/// Keeps the fastest of the hits of each pair of bodies; of equally fast ones, the first.
void merge_pairs(std::vector<HitEvent>* hits) {
  const auto pair_of = [](const HitEvent& hit) { return std::tuple(hit.a.index, hit.b.index); };
  std::ranges::stable_sort(*hits, {}, pair_of);
  std::size_t count = 0;
  for (const HitEvent& hit : *hits) {
    HitEvent* const last = count > 0 ? &(*hits)[count - 1] : nullptr;
    if (last == nullptr || pair_of(*last) != pair_of(hit)) {
      (*hits)[count++] = hit;
    } else if (hit.approach_speed > last->approach_speed) {
      *last = hit;
    }
  }
  hits->resize(count);
}

}  // namespace

void find_hits(const DetectedContacts& start, const ContactView& contacts,
               const BodiesOfStep& bodies, Real least, ThreadPool* pool,
               std::vector<HitEvent>* hits) {
  const HitsOfContacts from(start, contacts, bodies, least);
  std::vector<std::size_t> begin;
  hits->clear();
  parallel_append(
      pool, contacts.size(), kContactsPerHitChunk,
      [&](std::size_t i) { return from.count(static_cast<std::uint32_t>(i)); },
      [&](std::size_t i, HitEvent* next) {
        return from.write(static_cast<std::uint32_t>(i), next);
      },
      &begin, hits);
  merge_pairs(hits);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
