#include "src/base/page_layout.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
namespace {

using Parts = std::vector<std::uint32_t>;

TEST(PageLayout, APageHasThePartOfItsMiddle) {
  EXPECT_EQ(PageLayout{}.parts_of_pages(1000, 100, {0, 0.5}),
            (Parts{0, 0, 0, 0, 0, 1, 1, 1, 1, 1}));
  // The boundary is in a page.
  EXPECT_EQ(PageLayout{}.parts_of_pages(1000, 250, {0, 0.36}), (Parts{0, 1, 1, 1}));
  EXPECT_EQ(PageLayout{}.parts_of_pages(1000, 250, {0, 0.4}), (Parts{0, 0, 1, 1}));
  // The last page is not full: its middle is in the array.
  EXPECT_EQ(PageLayout{}.parts_of_pages(300, 250, {0, 0.99}), (Parts{0, 1}));
}

TEST(PageLayout, PartsMayHaveNoItems) {
  EXPECT_EQ(PageLayout{}.parts_of_pages(400, 100, {0, 0, 0.5, 0.5}), (Parts{1, 1, 3, 3}));
  EXPECT_EQ(PageLayout{}.parts_of_pages(400, 100, {0, 2, 2}), (Parts{0, 0, 0, 0}));
}

TEST(PageLayout, EachColumnIsDivided) {
  const PageLayout three{.columns = 3};
  EXPECT_EQ(three.parts_of_pages(1200, 100, {0, 0.25}),
            (Parts{0, 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1}));
  // One column of double width, and two others.
  const PageLayout wide{.columns = 4, .first_width = 2};
  EXPECT_EQ(wide.parts_of_pages(1600, 100, {0, 0.75}),
            (Parts{0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

}  // namespace
}  // namespace jfpx
