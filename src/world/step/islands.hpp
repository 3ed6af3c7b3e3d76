/// Islands: sets of movable bodies that are connected by contacts and joints. An island wakes and
/// falls asleep as a whole.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/step/soft_step_stages.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Disjoint sets of bodies. The label of a set is its lowest index, whatever the order of the
/// unions. Concurrent unions link the higher of two roots to the lower one (after Jayanti and
/// Tarjan 2016).
struct DisjointSets {
  std::uint32_t* parent = nullptr;  ///< by body: a body of the same set, index not higher

  /// Label of the set of a body, once all unions are complete.
  JFPX_HD std::uint32_t find(std::uint32_t body) const {
    for (;;) {
      const std::uint32_t above = load_shared(&parent[body]);
      if (above == body) return body;
      const std::uint32_t next = load_shared(&parent[above]);
      // Path halving. A failed exchange is harmless: another thread has changed the parent.
      if (next != above) atomic_exchange_if(&parent[body], above, next);
      body = next;
    }
  }
  JFPX_HD void unite(std::uint32_t a, std::uint32_t b) const {
    for (;;) {
      a = find(a);
      b = find(b);
      if (a == b) return;
      const std::uint32_t low = a < b ? a : b, high = a < b ? b : a;
      if (atomic_exchange_if(&parent[high], high, low) == high) return;
    }
  }
};

/// Wakes islands and puts them to sleep. All threads of a team call the functions: a PoolTeam or
/// the team of a device.
struct Islands {
  const StepBodies& step;
  ContactView contacts;
  JointView joints;
  DisjointSets sets;
  std::uint8_t* marked = nullptr;         ///< by label of an island
  bool any_carriers = true;               ///< whether `step` may have kinematic bodies in motion
  const std::uint32_t* mobile = nullptr;  ///< bodies that are not immovable; null: all of `step`
  std::uint32_t mobile_count = 0;

  /// Wakes the islands that touch an awake body or a kinematic body in motion.
  template <class Team>
  JFPX_HD void wake_touched(const Team& team) const {
    mark_touched(team);
    wake_marked(team);
  }
  /// Puts islands to sleep if all their bodies have been slow for long enough.
  template <class Team>
  JFPX_HD void put_to_sleep(const Team& team) const {
    mark_restless(team);
    put_unmarked_to_sleep(team);
  }

  // The parts of these functions. Several ranks combine their marks in between.

  template <class Team>
  JFPX_HD void mark_touched(const Team& team) const {
    const BodyView& bodies = step.bodies;
    find(team, [&](std::uint32_t i) { return will_touch(bodies, contacts, i); });
    for_each_body(team, [&](std::uint32_t body) {
      if (!bodies.is_active(body)) return;
      std::uint8_t* const mark = &marked[sets.find(body)];
      if (load_shared(mark) == 0) store_shared(mark, kTouchesSlowBody);
    });
    for_each_body(team, [&](std::uint32_t body) {
      if (bodies.is_active(body) && !bodies.is_slow(body)) mark(body, kTouchesFastBody);
    });
  }
  template <class Team>
  JFPX_HD void wake_marked(const Team& team) const {
    const BodyView& bodies = step.bodies;
    for_each_body(team, [&](std::uint32_t body) {
      if (!bodies.is_asleep(body)) return;
      soft_step::wake_touched(bodies, step.motion, body, marked[sets.find(body)]);
    });
  }

  template <class Team>
  JFPX_HD void mark_restless(const Team& team) const {
    const BodyView& bodies = step.bodies;
    find(team, [&](std::uint32_t i) { return has_touched(contacts, i); });
    for_each_body(team, [&](std::uint32_t body) {
      if (bodies.is_active(body) && !bodies.is_at_rest(body)) mark(body, 1);
    });
  }
  template <class Team>
  JFPX_HD void put_unmarked_to_sleep(const Team& team) const {
    const BodyView& bodies = step.bodies;
    for_each_body(team, [&](std::uint32_t body) {
      if (bodies.is_active(body) && marked[sets.find(body)] == 0) step.motion.put_to_sleep(body);
    });
  }

  /// The mark of the island of a body.
  std::uint8_t mark_of(std::uint32_t body) const { return marked[sets.find(body)]; }
  /// Combines the mark of the island of a body with that of another rank. @returns whether it has
  /// changed
  bool combine_mark(std::uint32_t body, std::uint8_t other) const {
    std::uint8_t& mark = marked[sets.find(body)];
    if (other == 0 || other == mark || mark == kTouchesFastBody) return false;
    mark = other;
    return true;
  }

 private:
  JFPX_HD void mark(std::uint32_t body, std::uint8_t value) const {
    store_shared(&marked[sets.find(body)], value);
  }

  template <class Team, class F>
  JFPX_HD void for_each_body(const Team& team, const F& f) const {
    const BodyView& bodies = step.bodies;
    if (mobile == nullptr) {
      team.for_each(bodies.count, [&](std::uint32_t i) { f(bodies.ids[i].index); });
    } else {
      team.for_each(mobile_count, [&](std::uint32_t i) { f(mobile[i]); });
    }
  }

  /// Unites the movable bodies of joints, and of contacts for which touches(contact) is true. Marks
  /// the islands that touch, or are joined with, a kinematic body in motion, which would not carry
  /// a sleeping body.
  template <class Team, class Touches>
  JFPX_HD void find(const Team& team, const Touches& touches) const {
    const BodyView& bodies = step.bodies;
    team.for_each(bodies.capacity, [&](std::uint32_t i) {
      sets.parent[i] = i;
      marked[i] = 0;
    });
    team.for_each_nowait(joints.count, [&](std::uint32_t joint) {
      with_joined_bodies(joints, joint, [&](std::uint32_t a, std::uint32_t b) {
        if (bodies.movable(a) && bodies.movable(b)) sets.unite(a, b);
      });
    });
    team.for_each(contacts.size(), [&](std::uint32_t i) {
      const ContactKey& key = contacts.key(i);
      if (bodies.movable(key.a) && bodies.movable(key.b) && touches(i)) sets.unite(key.a, key.b);
    });
    if (!any_carriers) return;
    team.for_each_nowait(joints.count, [&](std::uint32_t joint) {
      with_joined_bodies(joints, joint, [&](std::uint32_t a, std::uint32_t b) {
        const bool a_carries = bodies.is_carrier(a);
        if (a_carries || bodies.is_carrier(b)) mark(a_carries ? b : a, kTouchesFastBody);
      });
    });
    team.for_each(contacts.size(), [&](std::uint32_t i) {
      const ContactKey& key = contacts.key(i);
      const bool a_carries = bodies.is_carrier(key.a);
      if ((a_carries || bodies.is_carrier(key.b)) && touches(i)) {
        mark(a_carries ? key.b : key.a, kTouchesFastBody);
      }
    });
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
