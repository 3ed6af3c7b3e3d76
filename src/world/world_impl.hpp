/// What a World is made of.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"
#include "src/world/contact_events.hpp"
#include "src/world/contact_finder.hpp"
#include "src/world/contact_resolver.hpp"
#include "src/world/registry.hpp"
#include "src/world/waking.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

struct World::Impl {
  /// What this engine asks of a body beyond what every scene must be. @throws InvalidScene
  static void require_native(const BodyDef& def, std::uint64_t body);

  Impl(const Scene& given, std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
      : scene(given),
        bodies(given.dt, given.sleep),
        contact_finder(std::move(collider), broad_phase) {
    for (std::size_t i = 0; i < given.bodies.size(); ++i) {
      require_native(given.bodies[i], i);
      bodies.add(given.bodies[i]);
    }
  }

  /// Who rested on a body that goes away or is put elsewhere must notice.
  void wake_neighbours(std::uint32_t body) {
    for (const Contact& c : contacts) {
      if (c.a == body) bodies.wake(c.b);
      if (c.b == body) bodies.wake(c.a);
    }
  }

  /// What comes or goes and acts in every step is news to all bodies, whichever it may act on.
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
  Waking waking;
  ContactResolver resolver;
  Registry<ForceContext, ForceId> forces{"force"};
  Registry<ContactContext, ContactGeneratorId> generators{"contact generator"};
  bool bodies_changed = true;  ///< since the narrow phase last heard of them
  /// Of the last step that was not undone, whatever has been added since: who rests on whom.
  std::vector<Contact> contacts;
  std::vector<Contact> contacts_before;  ///< of the step before it
  bool contacts_are_new = false;         ///< in a step: they are already of this one
  bool shows_contacts = false;           ///< users see none after a change or an undone step
  ContactEvents events;
  MotionArrays before;  ///< the state that a failed step goes back to
  std::uint64_t steps = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
