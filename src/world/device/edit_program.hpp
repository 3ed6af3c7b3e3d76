/// Changes of single bodies between two steps on a device.
#pragma once

#include "src/contact_solver/soft_step/colors.hpp"
#include "src/world/contacts/begun_contacts.hpp"
#include "src/world/device/slot_values.hpp"
#include "src/world/device/start_step.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The values of a BodyEdit.
struct EditedBody {
  std::uint32_t body = 0;
  bool sets_state = false, wakes = false, wakes_neighbors = false, is_removed = false;
  BodyState state;
  Mat3 inverse_inertia;
  Vec3 force, torque;
  PropertyColumns<ValueColumn> properties;
};

/// Inertia of a body whose BodyEdit::sets_mass is set.
struct EditedMass {
  std::uint32_t body = 0;
  InertiaColumns<ValueColumn> inertia;
};

/// Wakes the bodies in contact with edited bodies, discards the contacts of removed bodies, edits
/// the bodies, and then replaces slots.
struct EditProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kEdit;
  StepData data;
  PropertyPointers properties;
  const EditedBody* edits = nullptr;
  std::uint32_t count = 0;
  const EditedMass* masses = nullptr;
  std::uint32_t mass_count = 0;
  const SlotValues* replaced = nullptr;
  std::uint32_t replaced_count = 0;
  bool visits_contacts = false;   ///< whether an edit wakes neighbors or removes a body
  Touch* last_touches = nullptr;  ///< of the last step
  std::uint32_t last_touch_count = 0;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    start_state(team, data);
    team.sync();
    if (visits_contacts) visit_contacts(team);
    team.for_each(count, [&](std::uint32_t k) { edit(edits[k]); });
    team.for_each(mass_count, [&](std::uint32_t k) { edit_mass(masses[k]); });
    team.for_each(replaced_count, [&](std::uint32_t k) { replace(replaced[k]); });
  }

 private:
  static constexpr std::uint8_t kWakesNeighbors = 1, kIsRemoved = 2;

  /// Wakes neighbors, and removes the color of contacts of removed bodies, because new bodies may
  /// reuse their slots: MatchProgram ignores contacts without color.
  template <class Team>
  JFPX_HD void visit_contacts(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    team.for_each(bodies.capacity, [&](std::uint32_t i) { d.marked[i] = 0; });
    team.for_each(count, [&](std::uint32_t k) {
      const EditedBody& e = edits[k];
      d.marked[e.body] = static_cast<std::uint8_t>((e.wakes_neighbors ? kWakesNeighbors : 0) |
                                                   (e.is_removed ? kIsRemoved : 0));
    });
    const auto wake = [&](std::uint32_t a, std::uint32_t b) {
      if (bodies.sensor[a] != 0 || bodies.sensor[b] != 0) return;
      if ((d.marked[a] & kWakesNeighbors) != 0 && bodies.movable(b)) {
        d.step.motion.wake(bodies, b);
      }
      if ((d.marked[b] & kWakesNeighbors) != 0 && bodies.movable(a)) {
        d.step.motion.wake(bodies, a);
      }
    };
    const soft_step::ContactView contacts = d.last_contacts();
    team.for_each_nowait(contacts.size(), [&](std::uint32_t i) {
      const soft_step::ContactKey& key = contacts.key(i);
      const auto marks = d.marked[key.a] | d.marked[key.b];
      if (marks == 0 || contacts.colors[i] == soft_step::kNoColor) return;
      const bool touched = contacts.is_sphere(i) && contacts.distance(i, 0) <= 0;
      if (touched || soft_step::count_begun(contacts, i) > 0) wake(key.a, key.b);
      if ((marks & kIsRemoved) != 0) contacts.colors[i] = soft_step::kNoColor;
    });
    team.for_each(last_touch_count, [&](std::uint32_t i) {
      Touch& touch = last_touches[i];
      const auto marks = d.marked[touch.pair.a] | d.marked[touch.pair.b];
      if (marks == 0 || touch.is_of_removed_body != 0) return;
      wake(touch.pair.a, touch.pair.b);
      if ((marks & kIsRemoved) != 0) touch.is_of_removed_body = 1;
    });
  }

  JFPX_HD void edit(const EditedBody& e) const {
    const MotionPointers& motion = data.step.motion;
    const std::uint32_t i = e.body;
    const auto put = [i](auto* column, const auto& value) { column[i] = value; };
    if (e.sets_state) {
      each_state(put, motion, e.state);
      motion.inverse_inertia[i] = e.inverse_inertia;
    }
    motion.force[i] = e.force;
    motion.torque[i] = e.torque;
    each_property(put, properties, e.properties);
    if (e.wakes && data.step.bodies.movable(i)) motion.wake(data.step.bodies, i);
  }

  JFPX_HD void edit_mass(const EditedMass& mass) const {
    const std::uint32_t i = mass.body;
    const auto put = [i](auto* column, const auto& value) { column[i] = value; };
    each_inertia(put, properties, mass.inertia);
    data.step.motion.refresh_inertia(data.step.bodies, i);
  }

  JFPX_HD void replace(const SlotValues& values) const {
    values.store(data.step.motion, properties);
    if (values.has_no_contacts) {
      data.last().spheres_of[values.body] = data.last().manifolds_of[values.body] = {};
    }
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
