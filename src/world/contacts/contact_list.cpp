/// Merges the contacts of a step into one sorted list; see the header.
#include "src/world/contacts/contact_list.hpp"

#include <jfpx/contact.hpp>

#include "src/base/parallel_append.hpp"
#include "src/base/parallel_for.hpp"
#include "src/world/contacts/begun_contacts.hpp"
#include "src/world/contacts/merge_contacts.hpp"

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactKey;
using soft_step::ContactView;

constexpr std::size_t kContactsPerListChunk = 4096, kContactsPerCountChunk = 512;

/// Sets the material of a contact if a contact generator has set that of its input.
void set_material(const soft_step::OwnMaterial& own, Contact* contact) {
  if (!own.is_set()) return;
  contact->friction = own.friction;
  contact->restitution = own.restitution;
}

/// Appends the points of manifolds that began to touch during the step.
void append_begun(const DetectedContacts& detected, const ContactView& contacts,
                  const BodiesOfStep& bodies, std::vector<Contact>* list) {
  for (std::uint32_t i = contacts.sphere_count; i < contacts.size(); ++i) {
    const soft_step::ManifoldInput& manifold = contacts.manifold(i);
    const ContactKey& key = manifold.key;
    if (key.is_generated()) continue;
    for (std::uint32_t p = 0; p < manifold.count; ++p) {
      if (!soft_step::has_begun(contacts, i, p)) continue;
      const Vec3 point = detected.position[key.b] + contacts.points[manifold.first + p].arm_b;
      list->push_back(
          without_material(bodies[key.a].id, bodies[key.b].id, manifold.normal, point, 0));
      set_material(manifold.material, &list->back());
    }
  }
}

}  // namespace

BegunCounts count_begun_contacts(const ContactView& contacts, const Domain* domain,
                                 ThreadPool* pool) {
  return parallel_reduce(
      pool, contacts.size(), chunk_size(contacts.size(), 64, kContactsPerCountChunk), BegunCounts(),
      [&](std::size_t first, std::size_t last) {
        BegunCounts counts;
        for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
          const soft_step::ContactKey& key = contacts.key(i);
          if (domain != nullptr && !domain->detects(key.a, key.b)) continue;
          (contacts.is_sphere(i) ? counts.spheres : counts.points) += count_begun(contacts, i);
        }
        return counts;
      },
      [](const BegunCounts& x, const BegunCounts& y) {
        return BegunCounts{x.spheres + y.spheres, x.points + y.points};
      });
}

/// Appends the contacts of ContactSet::spheres that touched at the start of the step and, with
/// `with_begun`, those that began during the step. The list has the order of the set, because each
/// item of the set yields at most one contact.
void ContactListMaker::append_spheres(const DetectedContacts& detected, const ContactView& contacts,
                                      bool with_begun, const BodiesOfStep& bodies,
                                      std::vector<Contact>* list) {
  const auto touches = [&](std::uint32_t i) { return contacts.distance(i, 0) <= 0; };
  const auto count_of = [&](std::size_t item) -> std::size_t {
    const auto i = static_cast<std::uint32_t>(item);
    return touches(i) || (with_begun && soft_step::has_begun(contacts, i, 0)) ? 1 : 0;
  };
  const auto write = [&](std::size_t item, Contact* next) {
    if (count_of(item) == 0) return next;
    const auto i = static_cast<std::uint32_t>(item);
    const auto& [key, normal, distance] = contacts.spheres[i];
    const ListedBody a = bodies[key.a], b = bodies[key.b];
    const SphereInstance sphere_b{detected.position[key.b], b.radius};
    const bool touch = touches(i);
    const Vec3 point =
        touch ? middle_point(normal, distance, sphere_b) : point_on_b(normal, sphere_b);
    *next = without_material(a.id, b.id, normal, point, touch ? distance : Real(0));
    set_material(contacts.own_material(i), next);
    return next + 1;
  };
  parallel_append(pool_, contacts.sphere_count, kContactsPerListChunk, count_of, write, &begin_,
                  list);
}

void ContactListMaker::make(const DetectedContacts& detected, const ContactView& contacts,
                            bool with_begun, const BodiesOfStep& bodies,
                            const MaterialSettings& rules, ContactList* list) {
  std::vector<Contact>& all = list->contacts;
  const auto spheres = std::span(detected.contacts).first(detected.sphere_count);
  const auto others = std::span(detected.contacts).subspan(detected.sphere_count);
  all.clear();
  append_spheres(detected, contacts, with_begun, bodies, &all);
  std::size_t middle = all.size();
  all.insert(all.end(), spheres.begin(), spheres.end());
  merge_by_bodies(middle, std::span(all), &merged_);
  const std::size_t begin = all.size();
  all.insert(all.end(), others.begin(), others.end());
  middle = all.size();
  if (with_begun) append_begun(detected, contacts, bodies, &all);
  merge_by_bodies(middle - begin, std::span(all).subspan(begin), &merged_);
  set_materials(bodies, rules, pool_, &all);
  list->detected = all.size();
  all.insert(all.end(), detected.generated.begin(), detected.generated.end());
}

void set_materials(const BodiesOfStep& bodies, const MaterialSettings& rules, ThreadPool* pool,
                   std::vector<Contact>* contacts) {
  parallel_for(pool, contacts->size(), 1024, [&](std::size_t first, std::size_t last) {
    for (Contact& c : std::span(*contacts).subspan(first, last - first)) {
      const ListedBody a = bodies[c.a.index], b = bodies[c.b.index];
      if (c.friction < 0) {
        c.friction = combined(rules.friction, a.friction, b.friction);
        c.restitution = combined(rules.restitution, a.restitution, b.restitution);
      }
      c.sensor = a.sensor || b.sensor;
    }
  });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
