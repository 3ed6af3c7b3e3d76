/// Name and vector instruction sets of the processor.
#pragma once

#include <jfpx/simd_level.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// The widest level that this processor and the operating system support.
SimdLevel widest_simd_level() noexcept;
/// `wanted`, or the widest supported level if that is narrower or `wanted` is `automatic`.
SimdLevel usable_simd_level(SimdLevel wanted) noexcept;
/// Name and widest instruction set, for example "AMD EPYC 9654 96-Core Processor, AVX-512".
std::string describe_processor();

}  // namespace JFPX_ABI
}  // namespace jfpx
