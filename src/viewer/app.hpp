/// The program's three ways to run: in a window, without one, and without drawing at all.
#pragma once

#include "src/viewer/options.hpp"

#include <exception>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class Show;
class Timing;

/// [s] between two numbered pictures.
inline constexpr double kRecordedFrame = 1.0 / 60.0;

/// @return the exit status. @throws what loading, engines, OpenGL and files throw.
int run_app(const ViewOptions& options);
/// The same, in a window until it is closed.
int run_interactive(const ViewOptions& options);

/// What is completed and printed at the end of a run, whatever could not be written before.
/// @throws `failure`, or why the recording can't be written
void finish(Show& show, const Timing& timing, const ViewOptions& options,
            std::exception_ptr failure = nullptr);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
