/// Detection of the processor: cpuid on x86-64, the main ID register on ARM64.
#include "src/base/cpu.hpp"

#include <algorithm>
#include <cstring>

#if defined(__x86_64__)
#include <cpuid.h>
#else
#include <fstream>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

#if defined(__x86_64__)
/// The brand string (AMD64 manual vol. 3, E.4.3: leaves 0x80000002 to 0x80000004).
std::string brand() {
  unsigned words[12] = {};
  if (static_cast<unsigned>(__get_cpuid_max(0x80000000u, nullptr)) < 0x80000004u) return "x86-64";
  for (unsigned i = 0; i < 3; ++i) {
    __get_cpuid(0x80000002u + i, &words[4 * i], &words[4 * i + 1], &words[4 * i + 2],
                &words[4 * i + 3]);
  }
  char text[sizeof words + 1] = {};
  std::memcpy(text, words, sizeof words);
  const std::string name = text;
  const auto first = name.find_first_not_of(' ');
  if (first == std::string::npos) return "x86-64";
  return name.substr(first, name.find_last_not_of(' ') + 1 - first);
}
#else
/// Implementer, variant, part and revision (Arm ARM, MIDR_EL1), which Linux shows in sysfs.
std::string brand() {
  std::ifstream file("/sys/devices/system/cpu/cpu0/regs/identification/midr_el1");
  std::string midr;
  return file >> midr ? "ARM64 " + midr : "ARM64";
}
#endif

const char* name_of(SimdLevel level) {
  switch (level) {
    case SimdLevel::avx512:
      return "AVX-512";
    case SimdLevel::avx2:
      return "AVX2";
#if defined(__x86_64__)
    case SimdLevel::sse2:
      return "SSE2";
#else
    case SimdLevel::neon:
      return "NEON";
#endif
    default:
      return "scalar";
  }
}

}  // namespace

SimdLevel widest_simd_level() noexcept {
#if defined(__x86_64__)
  // __builtin_cpu_supports() also checks that the operating system saves the wide registers.
  __builtin_cpu_init();
  if (__builtin_cpu_supports("popcnt") && __builtin_cpu_supports("avx2")) {
    const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    return wide ? SimdLevel::avx512 : SimdLevel::avx2;
  }
  return SimdLevel::sse2;
#else
  return SimdLevel::neon;
#endif
}

SimdLevel usable_simd_level(SimdLevel wanted) noexcept {
  const SimdLevel widest = widest_simd_level();
  return wanted == SimdLevel::automatic ? widest : std::min(wanted, widest);
}

std::string describe_processor() { return brand() + ", " + name_of(widest_simd_level()); }

}  // namespace JFPX_ABI
}  // namespace jfpx
