/// Orders the contacts of a group for the dataflow sweeps of a GPU, and numbers the contacts at
/// each body.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/buffer.hpp"
#include "src/contact_solver/sequential_impulse/coloring.hpp"
#include "src/contact_solver/sequential_impulse/dataflow_sweep.hpp"

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Sorts contacts by color. In this order every contact follows the contacts on which it depends,
/// so that the sweeps terminate. Adjacent contacts rarely depend on each other, which keeps waiting
/// times short. Owns its buffers, which grow and never shrink. One thread at a time.
class JFPX_API RowOrder {
 public:
  /// Reserves memory for build(). @throws OutOfMemory
  void reserve(std::size_t contacts, std::size_t bodies);
  /// Schedules contacts, given in the order that each body must preserve.
  /// @param schedule [pairs.size()] by slot
  /// @param slot_contacts [pairs.size()] the index of the contact in each slot
  /// @param contact_counts [bodies] the number of scheduled contacts that move a body
  /// @throws OutOfMemory
  void build(std::span<const rows::RowPair> pairs, std::size_t bodies,
             rows::ScheduledContact* schedule, std::uint32_t* slot_contacts,
             std::uint32_t* contact_counts);
  /// Reduces a schedule to the contacts whose entry in `selected` is not 0, in the same order.
  /// @return the number of selected contacts
  static std::uint32_t select(std::span<const rows::ScheduledContact> schedule,
                              const std::uint32_t* slot_contacts,
                              std::span<const std::uint8_t> selected, std::size_t bodies,
                              rows::ScheduledContact* reduced, std::uint32_t* contact_counts);
  /// The number of colors of the last build().
  std::uint32_t colors() const noexcept { return coloring_.colors(); }

 private:
  ContactColoring coloring_;
  Buffer<std::uint32_t> next_slot_;  ///< by color
};

}  // namespace JFPX_ABI
}  // namespace jfpx
