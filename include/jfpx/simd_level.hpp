/// Vector instruction sets that the CPU backend can use.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Widest vector instructions that may be used. A level that the processor lacks is lowered to the
/// widest one that it has. Results do not depend on it.
enum class SimdLevel : std::uint8_t { automatic, scalar, sse2, avx2, avx512 };

}  // namespace JFPX_ABI
}  // namespace jfpx
