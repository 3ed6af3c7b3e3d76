/// The contacts of the last two steps of a World.
#pragma once

#include "src/base/lazy.hpp"
#include "src/world/contacts/contact_changes.hpp"
#include "src/world/contacts/contact_events.hpp"
#include "src/world/contacts/contact_list.hpp"
#include "src/world/contacts/contacts_by_body.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Contacts of the last two steps, without undone steps.
struct StepContacts {
  enum class State {
    kept,      ///< `last` precedes the step in progress, whose contacts are not detected yet
    found,     ///< `last` is of the step in progress, or complete
    repeated,  ///< the last step was skipped, because the world was at rest: `before` equals `last`
  };

  explicit StepContacts(ThreadPool* pool) : maker(pool) {}

  void begin_step() noexcept {
    state = State::kept;
    events.invalidate();
    by_body.invalidate();
    forces.invalidate();
    hits.invalidate();
  }
  /// Stores the contacts of the last step as those of the step before.
  void begin_detection() noexcept {
    swap_steps();
    last.invalidate();
    forces.invalidate();
    hits.invalidate();
    state = State::found;
  }
  void complete_step() noexcept { shows_list = shows_events = has_forces = true; }
  /// Completes a step in which no body was awake.
  void repeat_step() noexcept {
    if (state != State::repeated) events.invalidate();
    state = State::repeated;
    complete_step();
  }
  /// Undoes a step that begin_step() began.
  void undo_step() noexcept {
    if (state == State::found) swap_steps();
    state = State::kept;
    shows_list = shows_events = false;
  }

  /// Made on demand from the contact set of the solver and `detected`. Bodies may have been removed
  /// since.
  Lazy<ContactList> last, before;
  DetectedContacts detected, detected_before;  ///< of the same steps, unless on a device
  ContactListMaker maker;
  ContactChanges changes;                  ///< of the step in progress
  ContactsByBody by_body;                  ///< of `last`
  ContactEvents events;                    ///< of both
  Lazy<std::vector<ContactForce>> forces;  ///< of the contacts of `last`
  Lazy<std::vector<HitEvent>> hits;        ///< of the contacts of `last`
  State state = State::kept;
  /// Whether World::contacts() returns `last`: not after a body was added or removed.
  bool shows_list = false;
  bool shows_events = false;  ///< whether World::contact_events() compares both lists, and
                              ///< hit_events() shows `hits`
  /// Whether World::contact_forces() has those of the contacts: not after restore(), because a
  /// snapshot has no arms.
  bool has_forces = false;

 private:
  void swap_steps() noexcept {
    std::swap(last, before);
    std::swap(detected, detected_before);
  }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
