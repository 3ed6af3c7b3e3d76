/// A part of a program that is compiled for this processor, with products and sums fused if it can.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>

namespace jfpx::inline JFPX_ABI::bullet {

bool fused_unit_can_fuse();
DispatcherOptions options_of_fused_unit();

}  // namespace jfpx::inline JFPX_ABI::bullet
