/// OpenGL context shared by the tests of a program.
#pragma once

#include <jfpx/error.hpp>

#include "src/viewer/renderer.hpp"
#include "src/viewer/window.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

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
