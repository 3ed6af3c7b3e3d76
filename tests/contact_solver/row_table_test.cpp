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

/// Aligned groups of rows belong to one cell, to one crossing color, or to one part of fixed rows,
/// and threads that divide a color do not share them.
TEST(RowTable, AlignsInnerCellsColorsFixedPartsAndTheOverflow) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint32_t> small(0, 20), few(0, 3);
  constexpr std::uint32_t kAlignment = 8;
  RowTable table;
  for (int round = 0; round < 50; ++round) {
    const RowTable::Shape shape{1 + few(random), few(random), few(random), few(random)};
    table.start(shape, kAlignment);
    std::vector<std::uint32_t> sizes;
    for (std::size_t cell = 0; cell <= table.overflow(); ++cell) {
      sizes.push_back(small(random));
      table.set_size(cell, sizes.back());
    }
    table.scan();
    std::uint32_t end = 0;
    for (std::size_t cell = 0; cell < sizes.size(); ++cell) {
      ASSERT_EQ(table.end(cell) - table.begin(cell), sizes[cell]);
      const bool is_first_of_color = shape.crossing_colors > 0 && cell >= table.crossing(0, 0) &&
                                     (cell - table.crossing(0, 0)) % shape.parts == 0;
      const bool is_crossing = cell >= shape.parts * shape.inner_colors && cell < table.fixed(0);
      if (is_crossing && !is_first_of_color) {
        ASSERT_EQ(table.begin(cell), end);
      } else {
        ASSERT_EQ(table.begin(cell) % kAlignment, 0u);
        ASSERT_LT(table.begin(cell) - end, kAlignment);
      }
      end = table.end(cell);
    }
    ASSERT_EQ(table.size() % kAlignment, 0u);
    ASSERT_LT(table.size() - end, kAlignment);
    std::vector<int> rows(table.size());
    for (std::size_t cell = 0; cell < sizes.size(); ++cell) {
      for (std::uint32_t row = table.begin(cell); row < table.end(cell); ++row) ++rows[row];
    }
    table.for_gaps([&](std::uint32_t number) { ++rows[number]; });
    ASSERT_EQ(rows, std::vector<int>(rows.size(), 1));
    for (std::size_t c = 0; c < shape.crossing_colors; ++c) {
      ASSERT_EQ(table.crossing_boundary(0, c), table.begin(table.crossing(0, c)));
      const std::uint32_t last = table.end(table.crossing(shape.parts - 1, c));
      const std::size_t slices = shape.parts * RowTable::kSlices;
      ASSERT_EQ(table.crossing_boundary(slices, c), last);
      for (std::size_t slice = 1; slice < slices; ++slice) {
        const std::uint32_t boundary = table.crossing_boundary(slice, c);
        ASSERT_GE(boundary, table.crossing_boundary(slice - 1, c));
        ASSERT_TRUE(boundary % kAlignment == 0 || boundary == last);
      }
    }
  }
}

}  // namespace
}  // namespace jfpx
