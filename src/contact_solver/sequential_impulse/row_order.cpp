/// Sorting by color and numbering by body; see the header.
#include "src/contact_solver/sequential_impulse/row_order.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// The next sequence number at a body; 0 for a body that rows do not move.
std::uint32_t next_sequence(std::int32_t id, std::uint32_t* contact_counts) {
  return id < 0 ? 0 : contact_counts[static_cast<std::size_t>(id)]++;
}

}  // namespace

void RowOrder::reserve(std::size_t contacts, std::size_t bodies) {
  coloring_.reserve(contacts, bodies);
  next_slot_.reserve(contacts, "contacts of a solver");
}

void RowOrder::build(std::span<const rows::RowPair> pairs, std::size_t bodies,
                     rows::ScheduledContact* schedule, std::uint32_t* slot_contacts,
                     std::uint32_t* contact_counts) {
  reserve(pairs.size(), bodies);
  coloring_.build(pairs, bodies);
  std::uint32_t slots = 0;
  for (std::uint32_t color = 0; color < coloring_.colors(); ++color) {
    next_slot_[color] = slots;
    slots += coloring_.contacts_of(color);
  }
  const std::uint32_t* const colors = coloring_.colors_of_contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    slot_contacts[next_slot_[colors[i]]++] = static_cast<std::uint32_t>(i);
  }
  // The order of colors preserves the given order of the contacts of each body.
  std::fill_n(contact_counts, bodies, 0u);
  for (std::uint32_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = pairs[slot_contacts[k]];
    schedule[k] = {a, b, next_sequence(a, contact_counts), next_sequence(b, contact_counts), k};
  }
}

std::uint32_t RowOrder::select(std::span<const rows::ScheduledContact> schedule,
                               const std::uint32_t* slot_contacts,
                               std::span<const std::uint8_t> selected, std::size_t bodies,
                               rows::ScheduledContact* reduced, std::uint32_t* contact_counts) {
  std::fill_n(contact_counts, bodies, 0u);
  std::uint32_t count = 0;
  for (const rows::ScheduledContact& contact : schedule) {
    if (selected[slot_contacts[contact.slot]] == 0) continue;
    reduced[count++] = {contact.a, contact.b, next_sequence(contact.a, contact_counts),
                        next_sequence(contact.b, contact_counts), contact.slot};
  }
  return count;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
