/// Vector instruction sets of the CPU backend.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Widest vector instructions that may be used. A level that the processor does not support is
/// lowered to the widest supported one. Results do not depend on the level. `sse2` and `neon` are
/// the same level: the vectors of 128 bits that every x86-64 or ARM64 processor supports.
enum class SimdLevel : std::uint8_t { automatic, scalar, sse2, avx2, avx512, neon = sse2 };

}  // namespace JFPX_ABI
}  // namespace jfpx
