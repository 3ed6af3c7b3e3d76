/// All values of one body, for adding a body on a device between two steps.
#pragma once

#include "src/world/bodies/body_view.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Pointers to the columns of a BodyView that are constant in a step.
struct PropertyPointers : PropertyColumns<PointerColumn>, InertiaColumns<PointerColumn> {};

/// The values of a slot of the arrays of bodies.
struct SlotValues {
  std::uint32_t body = 0;
  bool has_no_contacts = false;  ///< of the former body of the slot, in the last step
  MotionColumns<ValueColumn> motion;
  PropertyColumns<ValueColumn> properties;
  InertiaColumns<ValueColumn> inertia;

  JFPX_HD void store(const MotionPointers& to_motion, const PropertyPointers& to) const {
    const std::uint32_t i = body;
    const auto put = [i](auto* column, const auto& value) { column[i] = value; };
    each_motion(put, to_motion, motion);
    each_property(put, to, properties);
    each_inertia(put, to, inertia);
  }
};

/// The values of a body on the host. @param from the arrays of its world
inline SlotValues slot_values(const BodyView& from, std::uint32_t i) {
  SlotValues values;
  values.body = i;
  const auto get = [i](auto& value, const auto* column) { value = column[i]; };
  each_motion(get, values.motion, from);
  each_property(get, values.properties, from);
  each_inertia(get, values.inertia, from);
  return values;
}

/// Values of an unused slot: a body without motion and contacts.
inline SlotValues unused_slot(std::uint32_t i) {
  SlotValues unused;
  unused.body = i;
  return unused;
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
