/// What the processor is called and which vector instructions it has.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/x86/kernels.hpp"

#include <string>

namespace jfpx::inline JFPX_ABI::x86 {

/// The widest level that this processor and the operating system support.
SimdLevel widest_simd_level() noexcept;
/// `wanted`, lowered to what there is; `automatic` is the widest.
SimdLevel usable_simd_level(SimdLevel wanted) noexcept;
const Kernels& kernels_for(SimdLevel usable) noexcept;
/// E.g. "AMD EPYC 9654 96-Core Processor, AVX-512".
std::string describe_processor();

}  // namespace jfpx::inline JFPX_ABI::x86
