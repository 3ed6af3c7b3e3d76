/// Greedy coloring in the order of hashes; see the header.
#include "src/contact_solver/soft_step/greedy_coloring.hpp"

#include "src/base/reserve.hpp"

#include <algorithm>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

void GreedyColoring::start(std::size_t bodies) {
  assign_geometric(&used_, bodies, 0);
  uncolored_.clear();
}

void GreedyColoring::append(std::span<const Uncolored> contacts) {
  if (contacts.empty()) return;
  const std::lock_guard lock(mutex_);
  uncolored_.insert(uncolored_.end(), contacts.begin(), contacts.end());
}

void GreedyColoring::finish() {
  std::ranges::sort(uncolored_, [](const Uncolored& x, const Uncolored& y) {
    return std::tie(x.order, x.contact) < std::tie(y.order, y.contact);
  });
  for (const Uncolored& contact : uncolored_) {
    std::uint64_t &a = used_[contact.a], &b = used_[contact.b];
    const std::uint8_t color = lowest_free_color(a | b);
    *contact.color = color;
    if (color == kOverflowColor) continue;
    a |= std::uint64_t{1} << color;
    b |= std::uint64_t{1} << color;
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
