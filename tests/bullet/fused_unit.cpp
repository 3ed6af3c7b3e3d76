/// A part of a program that is compiled for a processor with FMA, with products and sums fused.
#include "tests/bullet/fused_unit.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

DispatcherOptions options_of_fused_unit() { return {}; }

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
