/// Work lists of the row solver cover all blocks, in the order of the colors.
#include "src/contact_solver/cpu/work_list.hpp"

#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

TEST(WorkList, EachBlockIsInOneItemAndColorsFollowEachOther) {
  const std::uint64_t seed = bullet::test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random.below(n)); };
  WorkList list;
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t parts = 1 + below(20), colors = below(30);
    std::vector<BlockRange> ranges(std::size_t{colors} * parts);
    std::vector<std::uint32_t> color_of_block;
    for (std::uint32_t color = 0; color < colors; ++color) {
      const bool is_small = random.below(3) == 0;
      for (std::uint32_t part = 0; part < parts; ++part) {
        const auto first = static_cast<std::uint32_t>(color_of_block.size());
        std::uint32_t size = below(200);
        if (is_small) size = part == 0 ? below(WorkList::kSmallColor + 1) : 0;
        color_of_block.resize(first + size, color);
        ranges[std::size_t{color} * parts + part] = {first, first + size};
      }
    }
    list.build(ranges, parts);
    std::vector<int> visits(color_of_block.size());
    std::vector<int> claims(list.claims());
    std::uint32_t next_item = 0, color_before = 0;
    for (const WorkStage& stage : list.stages()) {
      ASSERT_EQ(stage.first, next_item);
      ASSERT_GT(stage.last, stage.first);
      next_item = stage.last;
      for (std::uint32_t k = stage.first; k < stage.last; ++k) {
        const WorkItem& item = list.items()[k];
        ASSERT_LT(item.part, parts);
        ASSERT_EQ(claims[item.claim]++, 0);
        for (std::uint32_t block = item.blocks.first; block < item.blocks.last; ++block) {
          ++visits[block];
          ASSERT_GE(color_of_block[block], color_before);
          color_before = color_of_block[block];
        }
      }
      // Items of a stage with several items run at the same time.
      for (std::uint32_t k = stage.first; stage.last - stage.first > 1 && k < stage.last; ++k) {
        const BlockRange& blocks = list.items()[k].blocks;
        ASSERT_EQ(color_of_block[blocks.first], color_before);
        ASSERT_EQ(color_of_block[blocks.last - 1], color_before);
      }
    }
    EXPECT_EQ(next_item, list.item_count());
    EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), std::ssize(visits));
  }
}

TEST(WorkList, ClaimsOfDifferentPartsShareNoLine) {
  std::vector<BlockRange> ranges;
  for (std::uint32_t i = 0; i < 40; ++i) ranges.push_back({i * 100, (i + 1) * 100});
  WorkList list;
  list.build(ranges, 4);
  std::vector<int> part_of_line(list.claims() / kClaimsPerLine, -1);
  for (std::uint32_t i = 0; i < list.item_count(); ++i) {
    const WorkItem& item = list.items()[i];
    int& part = part_of_line[item.claim / kClaimsPerLine];
    if (part < 0) part = static_cast<int>(item.part);
    EXPECT_EQ(part, static_cast<int>(item.part));
  }
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
