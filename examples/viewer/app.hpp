/// The program's three ways to run: in a window, without one, and without drawing at all.
#pragma once

#include "examples/viewer/options.hpp"

namespace jfpx::inline JFPX_ABI::view {

/// @return the exit status. @throws what loading, engines, OpenGL and files throw.
int run_app(const ViewOptions& options);

}  // namespace jfpx::inline JFPX_ABI::view
