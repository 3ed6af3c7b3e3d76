/// A part of a program that is compiled for this processor, with products and sums fused if it can.
#include "tests/bullet/fused_unit.hpp"

namespace jfpx::inline JFPX_ABI::bullet {

bool fused_unit_can_fuse() {
#ifdef __FMA__
  return true;
#else
  return false;
#endif
}

DispatcherOptions options_of_fused_unit() { return {}; }

}  // namespace jfpx::inline JFPX_ABI::bullet
