/// Tests of the cells of rows on the CPU.
#include "src/contact_solver/soft_step/cpu/row_table.hpp"

#include "tests/support/seed.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace jfpx {
namespace {

using soft_step::RowTable;

/// Cells in the order of the rows, with random sizes.
TEST(RowTable, DividesRowsIntoCellsInOrder) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint32_t> small(0, 3);
  RowTable table;
  EXPECT_EQ(table.size(), 0u);
  for (int round = 0; round < 20; ++round) {
    const RowTable::Shape shape{small(random), small(random), small(random), small(random)};
    table.start(shape);
    std::vector<std::size_t> cells;
    for (std::size_t b = 0; b < shape.parts; ++b) {
      for (std::size_t c = 0; c < shape.inner_colors; ++c) cells.push_back(table.inner(b, c));
    }
    for (std::size_t c = 0; c < shape.crossing_colors; ++c) {
      for (std::size_t b = 0; b < shape.parts; ++b) cells.push_back(table.crossing(b, c));
    }
    for (std::size_t b = 0; b < shape.fixed_parts; ++b) cells.push_back(table.fixed(b));
    cells.push_back(table.overflow());
    std::vector<std::uint32_t> sizes;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      ASSERT_EQ(cells[k], k);
      sizes.push_back(small(random));
      table.set_size(cells[k], sizes.back());
    }
    table.scan();
    std::uint32_t begin = 0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      ASSERT_EQ(table.begin(cells[k]), begin);
      begin += sizes[k];
      ASSERT_EQ(table.end(cells[k]), begin);
    }
    ASSERT_EQ(table.size(), begin);
  }
}

}  // namespace
}  // namespace jfpx
