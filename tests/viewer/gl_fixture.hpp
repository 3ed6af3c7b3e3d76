/// OpenGL context shared by the tests of a program.
#pragma once

#include <jfpx/error.hpp>

#include "src/viewer/renderer.hpp"
#include "src/viewer/window.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline view::View view_of(const Vec3& eye, const Vec3& target, Real reach) {
  view::Camera camera;
  camera.look_at(eye, target);
  return camera.view(target, reach);
}

inline double mean_difference(const view::Image& a, const view::Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
  return sum / static_cast<double>(a.rgb.size());
}

/// Base of tests that draw. They are skipped with the reason if OpenGL is not available.
class GlTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    try {
      window_ = std::make_unique<view::Window>(view::Window::hidden());
    } catch (const BackendUnavailable& error) {
      reason_ = error.what();
    }
  }
  static void TearDownTestSuite() { window_.reset(); }
  void SetUp() override {
    if (window_ == nullptr) GTEST_SKIP() << reason_;
  }

  static view::Window& window() { return *window_; }

  static view::Image picture(const view::Drawing& drawing, const view::View& view, int width,
                             int height, const view::Quality& quality = view::kLowQuality) {
    view::Renderer renderer(quality);
    view::OffscreenFramebuffer offscreen(width, height);
    renderer.draw(drawing, view, {0, 0, width, height}, offscreen.framebuffer());
    return offscreen.read();
  }

 private:
  inline static std::unique_ptr<view::Window> window_;
  inline static std::string reason_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
