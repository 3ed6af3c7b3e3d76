/// Greedy coloring in the order of hashes; see the header.
#include "src/contact_solver/greedy_coloring.hpp"

#include "src/base/reserve.hpp"

#include <algorithm>
#include <bit>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {
void GreedyColoring::start(std::size_t bodies) {
  assign_geometric(&used_, bodies, 0);
  uncolored_.clear();
}

void GreedyColoring::add(const ContactKey& key, std::uint8_t* color) {
  uncolored_.push_back({color_order(key), key, color});
}

void GreedyColoring::finish() {
  std::ranges::sort(uncolored_, [](const Uncolored& x, const Uncolored& y) {
    return std::tie(x.hash, x.key) < std::tie(y.hash, y.key);
  });
  for (const Uncolored& contact : uncolored_) {
    std::uint64_t &a = used_[contact.key.a], &b = used_[contact.key.b];
    const int color = std::countr_one(a | b);
    *contact.color = static_cast<std::uint8_t>(color);
    if (color == kOverflowColor) continue;
    a |= std::uint64_t{1} << color;
    b |= std::uint64_t{1} << color;
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
