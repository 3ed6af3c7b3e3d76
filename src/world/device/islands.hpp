/// Islands of bodies on a device.
#pragma once

#include "src/world/device/atomic.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Label of the set of a body: its lowest index, once all unions are complete.
JFPX_HD inline std::uint32_t island_of(const StepData& d, std::uint32_t body) {
  for (;;) {
    const std::uint32_t parent = load_shared(&d.parent[body]);
    if (parent == body) return body;
    const std::uint32_t above = load_shared(&d.parent[parent]);
    // Path halving. If another thread has changed the parent, this change is not needed.
    if (above != parent) atomic_exchange_if(&d.parent[body], parent, above);
    body = above;
  }
}

JFPX_HD inline void unite(const StepData& d, std::uint32_t a, std::uint32_t b) {
  for (;;) {
    a = island_of(d, a);
    b = island_of(d, b);
    if (a == b) return;
    const std::uint32_t low = a < b ? a : b, high = a < b ? b : a;
    if (atomic_exchange_if(&d.parent[high], high, low) == high) return;
  }
}

/// As SoftStep::find_islands().
template <class Team, class Touches>
JFPX_HD void find_islands(const Team& team, const StepData& d, const Touches& touches) {
  const BodyView& bodies = d.step.bodies;
  const soft_step::ContactView contacts = d.contacts();
  team.for_each(bodies.capacity, [&](std::uint32_t i) {
    d.parent[i] = i;
    d.marked[i] = 0;
  });
  const soft_step::JointView joints = d.joints();
  team.spread(joints.count, [&](std::uint32_t joint) {
    soft_step::with_joined_bodies(joints, joint, [&](std::uint32_t a, std::uint32_t b) {
      if (bodies.movable(a) && bodies.movable(b)) unite(d, a, b);
    });
  });
  team.for_each(contacts.size(), [&](std::uint32_t i) {
    const soft_step::ContactKey& key = contacts.key(i);
    if (bodies.movable(key.a) && bodies.movable(key.b) && touches(contacts, i)) {
      unite(d, key.a, key.b);
    }
  });
  team.spread(joints.count, [&](std::uint32_t joint) {
    soft_step::with_joined_bodies(joints, joint, [&](std::uint32_t a, std::uint32_t b) {
      const bool a_carries = bodies.is_carrier(a);
      if (!a_carries && !bodies.is_carrier(b)) return;
      d.marked[island_of(d, a_carries ? b : a)] = soft_step::kTouchesFastBody;
    });
  });
  team.for_each(contacts.size(), [&](std::uint32_t i) {
    const soft_step::ContactKey& key = contacts.key(i);
    const bool a_carries = bodies.is_carrier(key.a);
    if ((a_carries || bodies.is_carrier(key.b)) && touches(contacts, i)) {
      d.marked[island_of(d, a_carries ? key.b : key.a)] = soft_step::kTouchesFastBody;
    }
  });
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
