/// Options of jfpx-view, and the parser of its command line.
#pragma once

#include "src/tool/run_options.hpp"
#include "src/viewer/colouring.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/run.hpp"

#include <optional>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

struct Size {
  int width = 1280, height = 720;
};

struct ViewOptions {
  tool::RunOptions run;  ///< selects the scene
  EngineChoice choice;
  bool side_by_side = false;
  bool headless = false;
  std::optional<std::uint64_t> frames;  ///< number of steps
  std::string screenshot;               ///< PNG file of the last picture
  std::string pictures;                 ///< folder of numbered PNG files
  std::string recording;                ///< file of the states of all steps
  Size size;
  Quality quality = kMediumQuality;
  Colouring colouring = Colouring::bodies;
  bool contacts = false;  ///< draw contacts
  bool forces = false;    ///< draw forces
  bool panel = false;     ///< show the panel in headless pictures
  bool render = true;     ///< "rendering on / off" of the thesis
  bool fullscreen = false;
  bool paused = false;  ///< start paused
  std::string input;    ///< input script of a demo
  std::optional<Vec3> eye, target;
  bool precision_is_given = false;  ///< --precision, which overrides that of a recording
};

/// Parses the arguments after the name of the program; prints the help, the version or an error
/// message.
/// @return the exit status if the program must end, otherwise nothing
std::optional<int> parse_command_line(std::vector<std::string> arguments, ViewOptions& options);
/// Checks combinations of options. @throws InvalidArgument
void check(const ViewOptions& options);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
