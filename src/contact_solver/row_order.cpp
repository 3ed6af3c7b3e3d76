/// Levels of contacts and turns at bodies; see the header.
#include "src/contact_solver/row_order.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::size_t slot_of(std::int32_t id) { return static_cast<std::size_t>(id); }

/// The next turn at a body; 0 for one that is not moved.
std::uint32_t take_turn(std::int32_t id, std::uint32_t* moves) {
  return id < 0 ? 0 : moves[slot_of(id)]++;
}

}  // namespace

void RowOrder::build(std::span<const rows::RowPair> pairs, std::size_t bodies, rows::Place* places,
                     std::uint32_t* contacts, std::uint32_t* moves) {
  body_level_.assign(bodies, 0);
  contact_level_.resize(pairs.size());
  starts_.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = pairs[i];
    std::uint32_t level = 0;
    if (a >= 0) level = body_level_[slot_of(a)];
    if (b >= 0) level = std::max(level, body_level_[slot_of(b)]);
    if (a >= 0) body_level_[slot_of(a)] = level + 1;
    if (b >= 0) body_level_[slot_of(b)] = level + 1;
    contact_level_[i] = level;
    if (level == starts_.size()) starts_.push_back(0);
    ++starts_[level];
  }
  std::uint32_t before = 0;
  for (std::uint32_t& start : starts_) before += std::exchange(start, before);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    contacts[starts_[contact_level_[i]]++] = static_cast<std::uint32_t>(i);
  }
  // Through the levels each body meets its contacts in the given order.
  std::fill_n(moves, bodies, 0u);
  for (std::uint32_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = pairs[contacts[k]];
    places[k] = {a, b, take_turn(a, moves), take_turn(b, moves), k};
  }
}

std::uint32_t RowOrder::choose(std::span<const rows::Place> places, const std::uint32_t* contacts,
                               std::span<const std::uint8_t> marks, std::size_t bodies,
                               rows::Place* chosen, std::uint32_t* moves) {
  std::fill_n(moves, bodies, 0u);
  std::uint32_t count = 0;
  for (const rows::Place& place : places) {
    if (marks[contacts[place.row]] == 0) continue;
    chosen[count++] = {place.a, place.b, take_turn(place.a, moves), take_turn(place.b, moves),
                       place.row};
  }
  return count;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
