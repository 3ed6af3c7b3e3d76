/// A part of a program that is compiled for a processor with FMA, with products and sums fused.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Only where the processor has FMA.
DispatcherOptions options_of_fused_unit();

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
