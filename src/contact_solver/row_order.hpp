/// Puts the contacts of a group in an order in which neighbours rarely wait for each other, and
/// tells each contact when it is its turn at its bodies.
#pragma once

#include <jfpx/config.hpp>

#include "src/contact_solver/row_walk.hpp"

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Owns its buffers, which only grow. One thread at a time.
class JFPX_API RowOrder {
 public:
  /// Sorts contacts, given in the order that each body must keep, by level: one more than the
  /// highest level of those before it that move one of its bodies.
  /// @param places, contacts [pairs.size()]: by place, and which contact is there
  /// @param moves [bodies]: places that move a body
  void build(std::span<const rows::RowPair> pairs, std::size_t bodies, rows::Place* places,
             std::uint32_t* contacts, std::uint32_t* moves);
  /// The same order, of some places only: those of contacts with a mark.
  /// @return how many
  static std::uint32_t choose(std::span<const rows::Place> places, const std::uint32_t* contacts,
                              std::span<const std::uint8_t> marks, std::size_t bodies,
                              rows::Place* chosen, std::uint32_t* moves);
  /// Of the last build().
  std::uint32_t levels() const noexcept { return static_cast<std::uint32_t>(starts_.size()); }

 private:
  std::vector<std::uint32_t> body_level_, contact_level_, starts_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
