/// Shared code of benchmarks that draw: a context without a window, and its absence.
#pragma once

#include <jfpx/error.hpp>

#include "bench/world/samples.hpp"
#include "src/viewer/window.hpp"

#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {

/// True for software rendering.
inline bool draws_in_software(const view::Window& window) {
  return window.driver().find("llvmpipe") != std::string::npos;
}

/// The main() of the benchmarks that `register_all` registers. Its argument is nullptr without
/// OpenGL. Screen::description() adds the size of the pictures and the driver to the results.
template <class Screen>
int run_with_screen(int argc, char** argv, void (*register_all)(Screen*)) {
  std::unique_ptr<Screen> screen;
  try {
    screen = std::make_unique<Screen>();
    benchmark::AddCustomContext("pictures", screen->description());
  } catch (const BackendUnavailable& error) {
    benchmark::AddCustomContext("pictures", std::string("none: ") + error.what());
  }
  register_all(screen.get());
  return run_benchmarks(argc, argv);
}

}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx
