/// The three modes of the program: in a window, headless, and without rendering.
#pragma once

#include "src/viewer/options.hpp"

#include <exception>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class Viewer;
class Timing;

/// Time between two numbered pictures [s].
inline constexpr double kRecordedFrame = 1.0 / 60.0;

/// Runs the program in the mode that the options select. @return the exit status
/// @throws exceptions of scene loading, engines, OpenGL and files
int run_app(const ViewOptions& options);
/// Runs the program in a window until the window is closed. @return the exit status
int run_interactive(const ViewOptions& options);

/// Completes the recording and prints the summary, also after a failure to write a picture.
/// @throws `failure`, or else the error of the recording
void finish(Viewer& viewer, const Timing& timing, const ViewOptions& options,
            std::exception_ptr failure = nullptr);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
