/// Order-preserving greedy coloring; see the header.
#include "src/contact_solver/sequential_impulse/coloring.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {

void ContactColoring::reserve(std::size_t contacts, std::size_t bodies) {
  next_color_.reserve(bodies, "bodies of a solver");
  contact_color_.reserve(contacts, "contacts of a solver");
  contact_count_.reserve(contacts, "contacts of a solver");
}

void ContactColoring::build(std::span<const rows::RowPair> pairs, std::size_t bodies) {
  reserve(pairs.size(), bodies);
  std::uint32_t* const next_color = next_color_.data();
  std::uint32_t* const contact_color = contact_color_.data();
  std::uint32_t* const contact_count = contact_count_.data();
  const auto slot = [](std::int32_t id) { return static_cast<std::size_t>(id); };
  std::fill_n(next_color, bodies, 0u);
  std::uint32_t colors = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = pairs[i];
    std::uint32_t color = 0;
    if (a >= 0) color = next_color[slot(a)];
    if (b >= 0) color = std::max(color, next_color[slot(b)]);
    if (a >= 0) next_color[slot(a)] = color + 1;
    if (b >= 0) next_color[slot(b)] = color + 1;
    contact_color[i] = color;
    if (color == colors) contact_count[colors++] = 0;
    ++contact_count[color];
  }
  color_count_ = colors;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
