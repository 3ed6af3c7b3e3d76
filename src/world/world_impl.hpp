/// Members of a World and helpers of its functions.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"
#include "src/world/callback_registry.hpp"
#include "src/world/contact_events.hpp"
#include "src/world/contact_finder.hpp"
#include "src/world/contact_resolver.hpp"
#include "src/world/lazy_query_tree.hpp"
#include "src/world/wake_propagation.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

struct World::Impl {
  Impl(const Scene& given, std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
      : scene(given),
        bodies(given.dt, given.sleep),
        contact_finder(std::move(collider), broad_phase) {
    for (const BodyDef& def : given.bodies) bodies.add(def);
    bodies.set_ignored_pairs(given.ignored_pairs);  // a body of the scene has the index of its slot
  }

  /// Wakes the bodies in contact with a body that is removed or changed.
  void wake_neighbors(BodyId body) {
    for (const Contact& c : contacts) {
      if (c.sensor) continue;
      if (c.a == body) bodies.wake(c.b.index);
      if (c.b == body) bodies.wake(c.a.index);
    }
  }

  /// Wakes a body and the bodies in contact with it.
  void wake_with_neighbors(BodyId body) {
    bodies.wake(body.index);
    wake_neighbors(body);
  }

  /// Wakes all bodies, because a new or removed callback may affect any of them.
  void wake_all() {
    for (const BodyId id : bodies.ids()) bodies.wake(id.index);
  }

  /// Must be called after a body was added or removed, or got another state by set_state().
  void note_change() noexcept {
    bodies_changed = true;
    query_tree.invalidate();
  }

  std::span<const Contact> contacts_to_resolve();

  double time() const { return static_cast<double>(steps) * static_cast<double>(scene.dt); }

  bool advance(StepReport* report);
  /// Restores the state before the step, including the contacts that wake_neighbors() uses, and
  /// empties World::contacts() and World::contact_events().
  void undo() noexcept {
    std::swap(bodies.moving, before);
    if (contacts_are_new) std::swap(contacts, contacts_before);
    shows_contacts = false;
    events.clear();
  }

  Scene scene;
  BodyStore bodies;
  ContactFinder contact_finder;
  WakePropagation propagate_waking;
  ContactResolver resolver;
  CallbackRegistry<ForceContext, ForceId> forces{"force"};
  CallbackRegistry<ContactContext, ContactGeneratorId> generators{"contact generator"};
  bool bodies_changed = true;  ///< whether contact_finder.set_bodies() must be called
  LazyQueryTree query_tree;
  /// Contacts of the last step that was not undone, without those of removed bodies.
  std::vector<Contact> contacts;
  std::vector<Contact> resolved;  ///< during a step with sensors: the contacts of other bodies
  std::vector<Contact> contacts_before;  ///< during a step: those of the previous step, for undo()
  bool contacts_are_new = false;  ///< whether `contacts` and `contacts_before` have been swapped
  /// Whether World::contacts() returns `contacts`; false after a body was added or removed, or a
  /// step undone.
  bool shows_contacts = false;
  ContactEvents events;
  MotionArrays before;  ///< state that an undone step restores
  std::uint64_t steps = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
