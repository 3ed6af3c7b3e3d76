/// Sequence numbers of the changes of a body on a device.
#include "src/world/device/body_cells.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using device::Turns;

/// Each change waits for the one before it, whatever colors the rows of a body have.
TEST(SequenceNumbers, FormOneChainPerBody) {
  constexpr std::uint64_t kLast = std::uint64_t{1} << 63;
  for (const std::uint64_t colors : {std::uint64_t{0}, std::uint64_t{1}, kLast, kLast | 1,
                                     ~std::uint64_t{0}, std::uint64_t{0x8000400020001}}) {
    std::uint32_t turn = 0;  // before the first sweep
    for (std::uint32_t sweep = 0; sweep < 3; ++sweep) {
      const Turns turns(sweep, colors);
      ASSERT_EQ(turns.first, turn);
      for (std::uint32_t color = 0; color < soft_step::kColors; ++color) {
        if ((colors >> color & 1) == 0) continue;
        ASSERT_EQ(turns.before(color), turn) << color;
        ASSERT_GT(turns.after(color), turn);
        turn = turns.after(color);
      }
      ASSERT_EQ(turns.before_body(), turn);
      ASSERT_GT(turns.after_body(), turn);
      turn = turns.after_body();
    }
  }
}

}  // namespace
}  // namespace jfpx
