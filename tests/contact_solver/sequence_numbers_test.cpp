/// Sequence numbers of the changes of a body on a device.
#include "src/world/device/body_cells.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using device::Tickets;

/// Each change waits for the one before it, whatever colors the rows of a body have.
TEST(SequenceNumbers, FormOneChainPerBody) {
  constexpr std::uint64_t kLast = std::uint64_t{1} << 63;
  for (const std::uint64_t colors : {std::uint64_t{0}, std::uint64_t{1}, kLast, kLast | 1,
                                     ~std::uint64_t{0}, std::uint64_t{0x8000400020001}}) {
    std::uint32_t ticket = 0;
    for (std::uint32_t sweep = 0; sweep < 3; ++sweep) {
      const Tickets tickets(sweep, colors);
      if (sweep > 0) {
        ASSERT_GT(tickets.first, ticket);
      }
      ticket = tickets.first;
      for (std::uint32_t color = 0; color < soft_step::kColorsPerClass; ++color) {
        if ((colors >> color & 1) == 0) continue;
        ASSERT_EQ(tickets.before(color), ticket) << color;
        ASSERT_GT(tickets.after(color), ticket);
        ticket = tickets.after(color);
      }
      ASSERT_EQ(tickets.last(), ticket);
    }
  }
}

}  // namespace
}  // namespace jfpx
