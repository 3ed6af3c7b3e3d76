/// One OpenGL context for all tests of a program, or the reason why there is none.
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

/// Tests that draw derive from this; they are skipped, with the reason, where OpenGL is missing.
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
    view::Canvas canvas(width, height);
    renderer.draw(drawing, view, {0, 0, width, height}, canvas.framebuffer());
    return canvas.read();
  }

 private:
  inline static std::unique_ptr<view::Window> window_;
  inline static std::string reason_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
