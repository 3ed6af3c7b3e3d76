/// The forces of a world as pointers to arrays, in host memory or on a device.
#pragma once

#include <jfpx/force.hpp>
#include <jfpx/recorded_world.hpp>

#include "src/world/bodies/solid_part.hpp"

#include <cstdint>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {

/// A force in the list of a body or in the list of all bodies. A spring is in the lists of both
/// ends.
struct ForceItem {
  static constexpr std::uint32_t kNoBody = 0xffffffffu;

  std::uint32_t order = 0;        ///< place of the force among all forces
  std::uint32_t kind = 0;         ///< index of its type in RecordableForce
  std::uint32_t number = 0;       ///< index in the array of its kind
  std::uint32_t is_end_b = 0;     ///< of a spring: 1 if the list is that of the body of end b
  std::uint32_t other = kNoBody;  ///< of a spring: body of the other end
};

/// The forces of one kind.
template <class F>
struct ForceArray {
  const F* forces = nullptr;
  std::uint32_t count = 0;
};

template <class Kinds>
struct ForceArrays;
/// The forces by kind.
template <class... Kinds>
struct ForceArrays<std::variant<Kinds...>> : ForceArray<Kinds>... {
  template <class F>
  JFPX_HD const ForceArray<F>& array() const {
    return *this;
  }
  /// Calls visit(force) with the force of an item.
  template <class Visit>
  JFPX_HD void visit(const ForceItem& item, const Visit& visit) const {
    std::uint32_t kind = 0;
    ((item.kind == kind++ ? visit(array<Kinds>().forces[item.number]) : void()), ...);
  }
};

struct ForceView : ForceArrays<RecordableForce> {
  const ForceItem* on_all = nullptr;          ///< forces on all bodies
  const ForceItem* on_body = nullptr;         ///< forces that refer to a body, by body
  const std::uint32_t* first_item = nullptr;  ///< by body, one additional entry: index in `on_body`
  const Real* mass = nullptr;                 ///< [kg], by body; empty without Gravity
  const SolidPart* parts = nullptr;           ///< by body
  const std::uint32_t* first_part = nullptr;  ///< by body, one more entry; empty without Buoyancy
  std::uint32_t on_all_count = 0, on_body_count = 0, first_item_count = 0, mass_count = 0,
                part_count = 0, first_part_count = 0;

  /// Calls visit(item) for the forces on a body, in the order in which they act.
  template <class Visit>
  JFPX_HD void for_each_on(std::uint32_t body, const Visit& visit) const {
    std::uint32_t all = 0, own = first_item[body];
    const std::uint32_t end = first_item[body + 1];
    while (all < on_all_count || own < end) {
      const bool takes_own =
          own < end && (all == on_all_count || on_body[own].order < on_all[all].order);
      visit(takes_own ? on_body[own++] : on_all[all++]);
    }
  }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
