/// The program's three ways to run: in a window, without one, and without drawing at all.
#pragma once

#include "examples/viewer/options.hpp"

namespace jfpx::inline JFPX_ABI::view {

class Show;
class Timing;

/// [s] between two numbered pictures.
inline constexpr double kRecordedFrame = 1.0 / 60.0;

/// @return the exit status. @throws what loading, engines, OpenGL and files throw.
int run_app(const ViewOptions& options);
/// The same, in a window until it is closed.
int run_interactive(const ViewOptions& options);

/// What is written and printed at the end of a run.
void finish(const Show& show, const Timing& timing, const ViewOptions& options);

}  // namespace jfpx::inline JFPX_ABI::view
