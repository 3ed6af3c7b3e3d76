/// Windows with more pixels than units, as on high-density screens: sizes in units are unchanged
/// and the resolution is higher.
#include "src/viewer/image.hpp"
#include "src/viewer/scene_viewer.hpp"
#include "tests/viewer/row_of_balls.hpp"
#include "tests/viewer/user.hpp"
#include "tests/viewer/window_fixture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace jfpx {
namespace {

using namespace view;
using test::kRowSize;

constexpr double kDensities[] = {1, 1.5, 2};  // pixels per unit

class DenseScreen : public test::WindowTest {
 protected:
  ViewOptions row() const { return test::row_of_balls(folder.file("row.json")); }
  static const SceneViewer& scene(test::User& user) {
    return dynamic_cast<const SceneViewer&>(user.viewer());
  }
};

TEST_F(DenseScreen, AClickOnTheProjectedCentrePicksTheBody) {
  for (const double density : kDensities) {
    test::User user(row(), density);
    user.viewer().paused = true;
    ASSERT_EQ(user.window().pixel_width(), std::lround(kRowSize.width * density));
    for (const std::uint32_t k : {2u, 0u, 3u, 1u}) {
      const auto at = project(scene(user).view(), scene(user).player().shown().states[k].position,
                              kRowSize.width, kRowSize.height);
      user.click_at(at->x, at->y);
      EXPECT_EQ(scene(user).picked(), k) << density;
    }
  }
}

TEST_F(DenseScreen, WidgetsKeepTheirPositionsAndReactToClicks) {
  std::map<std::string, PanelLog::Widget> expected;
  for (const double density : kDensities) {
    test::User user(row(), density);
    user.viewer().paused = true;
    user.frame();
    if (density == 1) expected = user.panel().widgets;
    EXPECT_GT(expected.size(), 15u);
    for (const auto& [label, widget] : expected) {
      ASSERT_TRUE(user.sees(label)) << label;
      const PanelLog::Widget& now = user.panel().widgets.at(label);
      EXPECT_NEAR(now.left, widget.left, 2) << label << density;
      EXPECT_NEAR(now.top, widget.top, 2) << label << density;
      EXPECT_NEAR(now.right, widget.right, 2) << label << density;
      EXPECT_NEAR(now.bottom, widget.bottom, 2) << label << density;
    }
    user.click("Step");
    EXPECT_EQ(user.viewer().steps(), 1u) << density;
    user.drag_in("speed", 0.5, 1);
    EXPECT_EQ(user.viewer().speed, 4) << density;
    user.click("cpu");
    EXPECT_EQ(scene(user).player().choice().backend, Backend::cpu) << density;
  }
}

/// Mean difference at the centres of the units.
double difference(const Image& coarse, const Image& fine) {
  double sum = 0;
  for (int y = 0; y < coarse.height; ++y) {
    for (int x = 0; x < coarse.width; ++x) {
      const std::uint8_t* a = coarse.at(x, y);
      const std::uint8_t* b = fine.at((2 * x + 1) * fine.width / (2 * coarse.width),
                                      (2 * y + 1) * fine.height / (2 * coarse.height));
      for (int i = 0; i < 3; ++i) sum += std::abs(int{a[i]} - int{b[i]});
    }
  }
  return sum / static_cast<double>(coarse.rgb.size());
}

TEST_F(DenseScreen, ThePictureHasAllPixelsAndLooksTheSame) {
  Image coarse;
  for (const double density : kDensities) {
    ViewOptions options = row();
    options.contacts = options.forces = true;  // lines have a width in units
    test::User user(options, density);
    user.click("Step");
    user.click_at(790, 630);
    user.click("Picture");
    user.frame();
    const Image image = read_png("jfpx-view-1.png");
    std::filesystem::remove("jfpx-view-1.png");
    ASSERT_EQ(image.width, std::lround(kRowSize.width * density));
    ASSERT_EQ(image.height, std::lround(kRowSize.height * density));
    if (density == 1) coarse = image;
    EXPECT_LT(difference(coarse, image), 2) << density;
  }
}

}  // namespace
}  // namespace jfpx
