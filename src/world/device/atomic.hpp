/// Atomic operations of device code. On the host they are plain operations: there, one thread runs
/// the programs of a DeviceStep, in tests.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// @returns the value before
JFPX_HD inline std::uint32_t atomic_add(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(at, value);
#else
  const std::uint32_t before = *at;
  *at += value;
  return before;
#endif
}

JFPX_HD inline void atomic_add(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  *at += value;
#endif
}

JFPX_HD inline void atomic_min(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(at, value);
#else
  if (value < *at) *at = value;
#endif
}

JFPX_HD inline void atomic_min(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  if (value < *at) *at = value;
#endif
}

JFPX_HD inline void atomic_or(std::uint64_t* at, std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  atomicOr(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(bits));
#else
  *at |= bits;
#endif
}

/// @returns the value before
JFPX_HD inline std::uint32_t atomic_exchange(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicExch(at, value);
#else
  const std::uint32_t before = *at;
  *at = value;
  return before;
#endif
}

/// Replaces `expected` by `desired`. @returns the value before
JFPX_HD inline std::uint32_t atomic_exchange_if(std::uint32_t* at, std::uint32_t expected,
                                                std::uint32_t desired) {
#if defined(__CUDA_ARCH__)
  return atomicCAS(at, expected, desired);
#else
  const std::uint32_t before = *at;
  if (before == expected) *at = desired;
  return before;
#endif
}

/// A load that observes the writes of other threads during the same loop.
JFPX_HD inline std::uint32_t load_shared(const std::uint32_t* at) {
  return *static_cast<const volatile std::uint32_t*>(at);
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
