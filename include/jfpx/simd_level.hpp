/// Vector instruction sets of the CPU backend.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Widest vector instructions that may be used. An unsupported level selects the widest supported
/// one. Results do not depend on the level. `sse2` and `neon` are the same level: the 128-bit
/// vectors of every x86-64 or ARM64 processor.
enum class SimdLevel : std::uint8_t { automatic, scalar, sse2, avx2, avx512, neon = sse2 };

}  // namespace JFPX_ABI
}  // namespace jfpx
