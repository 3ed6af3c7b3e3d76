/// Asks whether a CUDA device can be used.
#pragma once

#include <jfpx/backend.hpp>

namespace jfpx::inline JFPX_ABI::cuda {

/// Never throws for a missing or unusable device; leaves no sticky CUDA error behind.
BackendStatus probe(int device = 0);

}  // namespace jfpx::inline JFPX_ABI::cuda
