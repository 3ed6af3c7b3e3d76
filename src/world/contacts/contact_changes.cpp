/// The list of detected contacts for contact generators, and the use of its changes; see the
/// header.
#include "src/world/contacts/contact_changes.hpp"

#include <jfpx/contact.hpp>

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/scene/field_fault.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactKey;
using soft_step::ContactView;
using soft_step::ManifoldInput;
using soft_step::OwnMaterial;

constexpr std::size_t kContactsPerListChunk = 1024;
constexpr std::uint32_t kNoContact = std::numeric_limits<std::uint32_t>::max();

/// Middle of the overlap or gap at a point of a manifold.
Vec3 middle_of(const ContactView& contacts, const ManifoldInput& manifold, std::uint32_t point,
               const Vec3& position_b) {
  const soft_step::PointInput& p = contacts.points[manifold.first + point];
  return position_b + (p.arm_b + manifold.normal * (p.distance * Real(0.5)));
}

/// The material of a pair by the rules of the world.
OwnMaterial material_of(const BodyStore& bodies, const MaterialSettings& rules, std::uint32_t a,
                        std::uint32_t b) {
  return {combined(rules.friction, bodies.friction(a), bodies.friction(b)),
          combined(rules.restitution, bodies.restitution(a), bodies.restitution(b))};
}

/// The number in the set of a contact of World::contacts(). Touching points do not have the number
/// of their manifold: it is the one of the same bodies with the same normal and the nearest point.
/// @param position by body [m], at the start of the step
std::uint32_t number_in_set(const ContactView& contacts, std::span<const Vec3> position,
                            const Contact& contact) {
  const std::pair pair(contact.a.index, contact.b.index);
  const auto pair_of = [](const auto& input) { return std::pair(input.key.a, input.key.b); };
  const std::span spheres(contacts.spheres, contacts.sphere_count);
  const auto sphere = std::ranges::lower_bound(spheres, pair, {}, pair_of);
  if (sphere != spheres.end() && pair_of(*sphere) == pair) {
    return static_cast<std::uint32_t>(sphere - spheres.begin());
  }
  const std::span manifolds(contacts.manifolds, contacts.manifold_count);
  std::uint32_t nearest = kNoContact;
  Real least = kMaxReal;
  auto next = std::ranges::lower_bound(manifolds, pair, {}, pair_of);
  for (; next != manifolds.end() && pair_of(*next) == pair; ++next) {
    if (next->key.is_generated() || !(next->normal == contact.normal)) continue;
    for (std::uint32_t p = 0; p < next->count; ++p) {
      const Vec3 middle = middle_of(contacts, *next, p, position[pair.second]);
      const Real distance2 = length_squared(middle - contact.point);
      if (!(distance2 < least)) continue;
      least = distance2;
      nearest = contacts.sphere_count + static_cast<std::uint32_t>(next - manifolds.begin());
    }
  }
  return nearest;
}

void require_valid(const DetectedContact& contact) {
  require_in_range("detected contact: friction", contact.friction, kNotNegative);
  require_in_range("detected contact: restitution", contact.restitution, kZeroToOne);
}

}  // namespace

void ContactChanges::start(const BodyStore& bodies, const MaterialSettings& rules, ThreadPool* pool,
                           ContactSet* set, DetectedContacts* found) {
  is_made_ = false;
  bodies_ = &bodies;
  rules_ = rules;
  pool_ = pool;
  set_ = set;
  found_ = found;
}

void ContactChanges::start(std::vector<Contact>* contacts) {
  is_made_ = false;
  contacts_ = contacts;
}

std::span<DetectedContact> ContactChanges::contacts() {
  if (!is_made_) make_list();
  is_made_ = true;
  return list_;
}

void ContactChanges::make_list() {
  if (contacts_ == nullptr) {
    make_list_of_set();
    return;
  }
  list_.clear();
  for (const Contact& c : *contacts_) {
    if (c.sensor) continue;
    list_.push_back({c.a, c.b, 0, 0, c.normal, c.point, c.distance, c.friction, c.restitution});
  }
}

void ContactChanges::make_list_of_set() {
  const ContactView contacts = set_->view();
  const std::vector<Vec3>& position = found_->position;
  resize_geometric(&list_, contacts.size());
  parallel_for(
      pool_, contacts.size(), kContactsPerListChunk, [&](std::size_t first, std::size_t last) {
        for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
          const ContactKey& key = contacts.key(i);
          DetectedContact& item = list_[i];
          item = {bodies_->id(key.a), bodies_->id(key.b), key.part_a, key.part_b,
                  contacts.normal(i)};
          const OwnMaterial material = material_of(*bodies_, rules_, key.a, key.b);
          item.friction = material.friction;
          item.restitution = material.restitution;
          if (contacts.is_sphere(i)) {
            item.distance = contacts.spheres[i].distance;
            item.point =
                middle_point(item.normal, item.distance, {position[key.b], bodies_->radius(key.b)});
            continue;
          }
          item.distance = kMaxReal;
          for (std::uint32_t p = 0; p < contacts.impulse_count(i); ++p) {
            if (!(contacts.distance(i, p) < item.distance)) continue;
            item.distance = contacts.distance(i, p);
            item.point = middle_of(contacts, contacts.manifold(i), p, position[key.b]);
          }
        }
      });
}

/// Checks the list and gives each contact with a changed material its own.
void ContactChanges::change_materials() {
  const std::size_t spheres = set_->spheres.size();
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const DetectedContact& item = list_[i];
    require_valid(item);
    const OwnMaterial of_bodies = material_of(*bodies_, rules_, item.a.index, item.b.index);
    if (item.friction == of_bodies.friction && item.restitution == of_bodies.restitution) continue;
    found_->any_own_material = true;
    const OwnMaterial own{item.friction, item.restitution};
    if (i >= spheres) {
      set_->manifolds[i - spheres].material = own;
      continue;
    }
    if (set_->sphere_materials.empty()) assign_geometric(&set_->sphere_materials, spheres, {});
    set_->sphere_materials[i] = own;
  }
}

/// Removes the touching points of ignored contacts from DetectedContacts::contacts.
void ContactChanges::remove_touches() {
  const ContactView contacts = set_->view();
  std::vector<Contact>& touches = found_->contacts;
  std::size_t kept = 0, kept_of_spheres = 0;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (i == found_->sphere_count) kept_of_spheres = kept;
    const std::uint32_t number = number_in_set(contacts, found_->position, touches[i]);
    if (number == kNoContact || !list_[number].ignored) touches[kept++] = touches[i];
  }
  if (found_->sphere_count == touches.size()) kept_of_spheres = kept;
  found_->sphere_count = kept_of_spheres;
  touches.resize(kept);
}

/// Removes the ignored contacts from the set. @returns the number of touching spheres
std::size_t ContactChanges::remove_contacts() {
  const std::size_t spheres = set_->spheres.size();
  std::size_t kept = 0, touching = 0;
  for (std::size_t i = 0; i < spheres; ++i) {
    if (list_[i].ignored) {
      touching += set_->spheres[i].distance <= 0 ? 1 : 0;
      continue;
    }
    if (!set_->sphere_materials.empty()) set_->sphere_materials[kept] = set_->sphere_materials[i];
    set_->spheres[kept++] = set_->spheres[i];
  }
  set_->spheres.resize(kept);
  if (!set_->sphere_materials.empty()) set_->sphere_materials.resize(kept);
  kept = 0;
  for (std::size_t m = 0; m < set_->manifolds.size(); ++m) {
    // The points stay where they are, without a contact.
    if (!list_[spheres + m].ignored) set_->manifolds[kept++] = set_->manifolds[m];
  }
  set_->manifolds.resize(kept);
  return touching;
}

std::size_t ContactChanges::apply(std::vector<BodyPair>* ignored) {
  if (!is_made_) return 0;
  change_materials();
  for (const DetectedContact& item : list_) {
    if (item.ignored) ignored->push_back({item.a.index, item.b.index});
  }
  if (ignored->empty()) return 0;
  remove_touches();
  return remove_contacts();
}

void ContactChanges::apply(std::size_t* detected, std::size_t* of_spheres) {
  if (!is_made_) return;
  for (const DetectedContact& item : list_) require_valid(item);
  const std::size_t count = *detected, spheres = *of_spheres;
  auto item = list_.begin();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts_->size(); ++i) {
    Contact& contact = (*contacts_)[i];
    if (i < count && !contact.sensor) {
      contact.friction = item->friction;
      contact.restitution = item->restitution;
      if ((item++)->ignored) {
        --*detected;
        if (i < spheres) --*of_spheres;
        continue;
      }
    }
    (*contacts_)[kept++] = contact;
  }
  contacts_->resize(kept);
}

void set_own_materials(const DetectedContacts& detected, const ContactView& contacts,
                       ThreadPool* pool, std::vector<Contact>* list) {
  if (!detected.any_own_material) return;
  parallel_for(pool, list->size(), kContactsPerListChunk, [&](std::size_t first, std::size_t last) {
    for (Contact& c : std::span(*list).subspan(first, last - first)) {
      if (c.sensor) continue;
      const std::uint32_t number = number_in_set(contacts, detected.position, c);
      if (number == kNoContact) continue;
      const OwnMaterial own = contacts.own_material(number);
      if (!own.is_set()) continue;
      c.friction = own.friction;
      c.restitution = own.restitution;
    }
  });
}

std::span<DetectedContact> ContactContext::detected() { return changes_->contacts(); }

}  // namespace JFPX_ABI
}  // namespace jfpx
