/// Relaxed atomic operations for code that runs on threads of the host and of devices.
#pragma once

#include <jfpx/config.hpp>

#include <atomic>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// @returns the value before
JFPX_HD inline std::uint32_t atomic_add(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(at, value);
#else
  return std::atomic_ref(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}

JFPX_HD inline void atomic_add(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  std::atomic_ref(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}

#if !defined(__CUDA_ARCH__)
namespace detail {
template <class T>
void atomic_min_on_host(T* at, T value) {
  const std::atomic_ref shared(*at);
  T before = shared.load(std::memory_order_relaxed);
  while (value < before &&
         !shared.compare_exchange_weak(before, value, std::memory_order_relaxed)) {
  }
}
}  // namespace detail
#endif

JFPX_HD inline void atomic_min(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(at, value);
#else
  detail::atomic_min_on_host(at, value);
#endif
}

JFPX_HD inline void atomic_min(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  detail::atomic_min_on_host(at, value);
#endif
}

JFPX_HD inline void atomic_or(std::uint64_t* at, std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  atomicOr(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(bits));
#else
  std::atomic_ref(*at).fetch_or(bits, std::memory_order_relaxed);
#endif
}

/// @returns the value before
JFPX_HD inline std::uint32_t atomic_exchange(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicExch(at, value);
#else
  return std::atomic_ref(*at).exchange(value, std::memory_order_relaxed);
#endif
}

/// Replaces `expected` by `desired`. @returns the value before
JFPX_HD inline std::uint32_t atomic_exchange_if(std::uint32_t* at, std::uint32_t expected,
                                                std::uint32_t desired) {
#if defined(__CUDA_ARCH__)
  return atomicCAS(at, expected, desired);
#else
  std::atomic_ref(*at).compare_exchange_strong(expected, desired, std::memory_order_relaxed);
  return expected;
#endif
}

/// Loads an item that other threads write during the same loop.
JFPX_HD inline std::uint32_t load_shared(const std::uint32_t* at) {
#if defined(__CUDA_ARCH__)
  return *static_cast<const volatile std::uint32_t*>(at);
#else
  return std::atomic_ref(*const_cast<std::uint32_t*>(at)).load(std::memory_order_relaxed);
#endif
}

/// Stores an item that other threads read or write during the same loop.
JFPX_HD inline void store_shared(std::uint8_t* at, std::uint8_t value) {
#if defined(__CUDA_ARCH__)
  *static_cast<volatile std::uint8_t*>(at) = value;
#else
  std::atomic_ref(*at).store(value, std::memory_order_relaxed);
#endif
}
JFPX_HD inline std::uint8_t load_shared(const std::uint8_t* at) {
#if defined(__CUDA_ARCH__)
  return *static_cast<const volatile std::uint8_t*>(at);
#else
  return std::atomic_ref(*const_cast<std::uint8_t*>(at)).load(std::memory_order_relaxed);
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
