/// A part of a program that is compiled for a processor with FMA, with products and sums fused.
#include "tests/bullet/fused_unit.hpp"

namespace jfpx::inline JFPX_ABI::bullet {

DispatcherOptions options_of_fused_unit() { return {}; }

}  // namespace jfpx::inline JFPX_ABI::bullet
