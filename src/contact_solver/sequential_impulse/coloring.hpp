/// Order-preserving greedy coloring of contacts.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/buffer.hpp"
#include "src/contact_solver/sequential_impulse/row_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Assigns a color to each contact. Contacts of one color share no moving body, so that they can be
/// solved in parallel.
///
/// Graph colorings of constraint solvers usually choose any free color. This one preserves the
/// order of the contacts of each body: the color of a contact is one more than the highest color of
/// the earlier contacts that move one of its bodies, which is its level in the dependency graph.
/// Solving the colors in ascending order therefore yields the results of the serial order.
///
/// Owns its buffers, which grow and never shrink. One thread at a time.
class JFPX_API ContactColoring {
 public:
  /// Reserves memory for build(). @throws OutOfMemory
  void reserve(std::size_t contacts, std::size_t bodies);
  /// @param pairs in the order that must be preserved
  /// @param bodies number of bodies; every id >= 0 is below it
  /// @throws OutOfMemory
  void build(std::span<const rows::RowPair> pairs, std::size_t bodies);

  std::uint32_t colors() const noexcept { return color_count_; }
  /// The color of every contact.
  const std::uint32_t* colors_of_contacts() const noexcept { return contact_color_.data(); }
  /// The number of contacts of a color, which is at least 1.
  std::uint32_t contacts_of(std::uint32_t color) const { return contact_count_[color]; }

 private:
  std::uint32_t color_count_ = 0;
  Buffer<std::uint32_t> next_color_;     ///< by body: lowest possible color of the next contact
  Buffer<std::uint32_t> contact_color_;  ///< by contact
  Buffer<std::uint32_t> contact_count_;  ///< by color
};

}  // namespace JFPX_ABI
}  // namespace jfpx
