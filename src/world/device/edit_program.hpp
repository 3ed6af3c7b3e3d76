/// Changes of single bodies between two steps on a device.
#pragma once

#include "src/world/device/atomic.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/met_contacts.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The values of a BodyEdit.
struct EditedBody {
  std::uint32_t body = 0;
  bool sets_state = false, wakes = false, wakes_neighbors = false;
  BodyState state;
  Mat3 inverse_inertia;
  Vec3 force, torque, acceleration;
  Real velocity_kept = 1, angular_velocity_kept = 1;
};

/// Wakes the bodies in contact with some of the edited bodies, then edits these.
struct EditProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = 3;
  StepData data;
  const EditedBody* edits = nullptr;
  std::uint32_t count = 0;
  bool any_wakes_neighbors = false;
  const Touch* last_touches = nullptr;  ///< of the last step
  std::uint32_t last_touch_count = 0;
  Vec3* acceleration = nullptr;                                     ///< as BodyView
  Real *velocity_kept = nullptr, *angular_velocity_kept = nullptr;  ///< as BodyView

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (any_wakes_neighbors) wake_neighbors(team);
    team.for_each(count, [&](std::uint32_t k) { edit(edits[k]); });
  }

 private:
  template <class Team>
  JFPX_HD void wake_neighbors(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    team.for_each(bodies.capacity, [&](std::uint32_t i) { d.marked[i] = 0; });
    team.for_each(count, [&](std::uint32_t k) {
      if (edits[k].wakes_neighbors) d.marked[edits[k].body] = 1;
    });
    const auto wake = [&](std::uint32_t a, std::uint32_t b) {
      if (bodies.sensor[a] != 0 || bodies.sensor[b] != 0) return;
      if (d.marked[a] != 0 && bodies.movable(b)) d.step.motion.wake(bodies, b);
      if (d.marked[b] != 0 && bodies.movable(a)) d.step.motion.wake(bodies, a);
    };
    const soft_step::ContactView contacts = d.last_contacts();
    team.spread(contacts.size(), [&](std::uint32_t i) {
      const soft_step::ContactKey& key = contacts.key(i);
      const bool touched = contacts.is_sphere(i) && contacts.distance(i, 0) <= 0;
      if (touched || soft_step::count_met(contacts, i) > 0) wake(key.a, key.b);
    });
    team.for_each(last_touch_count,
                  [&](std::uint32_t i) { wake(last_touches[i].pair.a, last_touches[i].pair.b); });
  }

  JFPX_HD void edit(const EditedBody& e) const {
    const MotionPointers& motion = data.step.motion;
    const std::uint32_t i = e.body;
    if (e.sets_state) {
      motion.position[i] = e.state.position;
      motion.orientation[i] = e.state.orientation;
      motion.velocity[i] = e.state.velocity;
      motion.angular_velocity[i] = e.state.angular_velocity;
      motion.inverse_inertia[i] = e.inverse_inertia;
    }
    motion.force[i] = e.force;
    motion.torque[i] = e.torque;
    acceleration[i] = e.acceleration;
    velocity_kept[i] = e.velocity_kept;
    angular_velocity_kept[i] = e.angular_velocity_kept;
    if (e.wakes) motion.wake(data.step.bodies, i);
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
