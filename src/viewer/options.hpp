/// The command line of jfpx-view.
#pragma once

#include "src/tool/options.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/run.hpp"
#include "src/viewer/stage.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

struct Size {
  int width = 1280, height = 720;
};

struct ViewOptions {
  tool::RunOptions run;  ///< which scene
  EngineChoice choice;
  bool side_by_side = false;
  bool headless = false;
  std::optional<std::uint64_t> frames;  ///< steps before the last picture
  std::string screenshot;               ///< PNG of the last frame
  std::string record;                   ///< folder for numbered PNGs
  std::string recording;                ///< file for the states of all steps
  Size size;
  Quality quality = kMediumQuality;
  Colouring colouring = Colouring::bodies;
  bool contacts = false;  ///< draw them
  bool forces = false;    ///< likewise
  bool panel = false;     ///< show it in headless pictures
  bool render = true;     ///< the thesis' switch "rendering on / off"
  bool fullscreen = false;
  bool paused = false;  ///< at first
  std::string input;    ///< file with an input script, for a demo
  std::optional<Vec3> eye, target;
};

/// Fills `app` with options that write to `options`, which must outlive it.
void add_view_options(CLI::App& app, ViewOptions& options);
/// Checks what depends on more than one option. @throws InvalidArgument
void check(const ViewOptions& options);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
