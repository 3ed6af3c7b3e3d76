/// Members of a World and helpers of its functions.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"
#include "src/world/callback_registry.hpp"
#include "src/world/contact_events.hpp"
#include "src/world/contact_finder.hpp"
#include "src/world/contact_resolver.hpp"
#include "src/world/wake_propagation.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

struct World::Impl {
  Impl(const Scene& given, std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
      : scene(given),
        bodies(given.dt, given.sleep),
        contact_finder(std::move(collider), broad_phase) {
    for (const BodyDef& def : given.bodies) bodies.add(def);
  }

  /// Wakes the bodies in contact with a body that is removed or moved.
  void wake_neighbors(BodyId body) {
    for (const Contact& c : contacts) {
      if (c.a == body) bodies.wake(c.b.index);
      if (c.b == body) bodies.wake(c.a.index);
    }
  }

  /// Wakes all bodies, because a new or removed callback may affect any of them.
  void wake_all() {
    for (const BodyId id : bodies.ids()) bodies.wake(id.index);
  }

  double time() const { return static_cast<double>(steps) * static_cast<double>(scene.dt); }

  bool advance(StepReport* report);
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
  bool bodies_changed = true;  ///< since the last call of contact_finder.set_bodies()
  /// Contacts of the last step that was not undone, without those of removed bodies.
  std::vector<Contact> contacts;
  std::vector<Contact> contacts_before;  ///< of the step before it
  bool contacts_are_new = false;         ///< during a step: `contacts` belongs to this step
  bool shows_contacts = false;           ///< false after a change of bodies or an undone step
  ContactEvents events;
  MotionArrays before;  ///< state that an undone step restores
  std::uint64_t steps = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
