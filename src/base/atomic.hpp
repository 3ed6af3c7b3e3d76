/// Relaxed atomic operations for code that runs on threads of the host and of devices. Those of
/// devices are atomic with respect to all devices, because several devices may share a step.
#pragma once

#include <jfpx/config.hpp>

#include <atomic>
#include <cstdint>
#include <functional>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {

/// @returns the value before
JFPX_HD inline std::uint32_t atomic_add(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd_system(at, value);
#else
  return std::atomic_ref(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}

JFPX_HD inline void atomic_add(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd_system(reinterpret_cast<unsigned long long*>(at),
                   static_cast<unsigned long long>(value));
#else
  std::atomic_ref(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}

#if !defined(__CUDA_ARCH__)
namespace detail {
/// Replaces an item by a value that precedes it.
template <class T, class Precedes>
void replace_on_host(T* at, T value, const Precedes& precedes) {
  const std::atomic_ref shared(*at);
  T before = shared.load(std::memory_order_relaxed);
  while (precedes(value, before) &&
         !shared.compare_exchange_weak(before, value, std::memory_order_relaxed)) {
  }
}
}  // namespace detail
#endif

JFPX_HD inline void atomic_min(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin_system(at, value);
#else
  detail::replace_on_host(at, value, std::less<>());
#endif
}

JFPX_HD inline void atomic_min(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin_system(reinterpret_cast<unsigned long long*>(at),
                   static_cast<unsigned long long>(value));
#else
  detail::replace_on_host(at, value, std::less<>());
#endif
}

JFPX_HD inline void atomic_max(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMax_system(at, value);
#else
  detail::replace_on_host(at, value, std::greater<>());
#endif
}

JFPX_HD inline void atomic_max(std::uint64_t* at, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicMax_system(reinterpret_cast<unsigned long long*>(at),
                   static_cast<unsigned long long>(value));
#else
  detail::replace_on_host(at, value, std::greater<>());
#endif
}

JFPX_HD inline void atomic_or(std::uint64_t* at, std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  atomicOr_system(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(bits));
#else
  std::atomic_ref(*at).fetch_or(bits, std::memory_order_relaxed);
#endif
}

/// Appends items to a list whose size is in the memory of any device. The active threads of a warp,
/// all of which must append to the same list, share one atomic operation.
/// @returns the number of the first item
JFPX_HD inline std::uint32_t append(std::uint32_t* size, std::uint32_t count) {
#if defined(__CUDA_ARCH__)
  const unsigned lanes = __activemask();
  const int lane = static_cast<int>(threadIdx.x % 32), first = __ffs(static_cast<int>(lanes)) - 1;
  std::uint32_t before = 0, all = 0;
  for (unsigned left = lanes; left != 0; left &= left - 1) {
    const int other = __ffs(static_cast<int>(left)) - 1;
    const std::uint32_t of_other = __shfl_sync(lanes, count, other);
    if (other < lane) before += of_other;
    all += of_other;
  }
  const std::uint32_t at = lane == first ? atomic_add(size, all) : 0;
  return __shfl_sync(lanes, at, first) + before;
#else
  return atomic_add(size, count);
#endif
}
/// Appends an item.
JFPX_HD inline std::uint32_t append(std::uint32_t* size) {
#if defined(__CUDA_ARCH__)
  const unsigned lanes = __activemask(), lane = threadIdx.x % 32;
  const int first = __ffs(static_cast<int>(lanes)) - 1;
  const std::uint32_t at = static_cast<int>(lane) == first
                               ? atomic_add(size, static_cast<std::uint32_t>(__popc(lanes)))
                               : 0;
  return __shfl_sync(lanes, at, first) +
         static_cast<std::uint32_t>(__popc(lanes & ((1u << lane) - 1)));
#else
  return atomic_add(size, 1);
#endif
}

/// Appends an item to one of two lists: append(is_of_second ? second_size : first_size) for threads
/// of a warp that append to different ones.
JFPX_HD inline std::uint32_t append_to_one(std::uint32_t* first_size, std::uint32_t* second_size,
                                           bool is_of_second) {
  std::uint32_t* const size = is_of_second ? second_size : first_size;
#if defined(__CUDA_ARCH__)
  const unsigned active = __activemask(), lane = threadIdx.x % 32;
  const unsigned of_second = __ballot_sync(active, is_of_second);
  const unsigned lanes = is_of_second ? of_second : active & ~of_second;
  const int first = __ffs(static_cast<int>(lanes)) - 1;
  const std::uint32_t at = static_cast<int>(lane) == first
                               ? atomic_add(size, static_cast<std::uint32_t>(__popc(lanes)))
                               : 0;
  return __shfl_sync(active, at, first) +
         static_cast<std::uint32_t>(__popc(lanes & ((1u << lane) - 1)));
#else
  return atomic_add(size, 1);
#endif
}

/// @returns the value before
JFPX_HD inline std::uint32_t atomic_exchange(std::uint32_t* at, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicExch_system(at, value);
#else
  return std::atomic_ref(*at).exchange(value, std::memory_order_relaxed);
#endif
}

/// Replaces `expected` by `desired`. @returns the value before
JFPX_HD inline std::uint32_t atomic_exchange_if(std::uint32_t* at, std::uint32_t expected,
                                                std::uint32_t desired) {
#if defined(__CUDA_ARCH__)
  return atomicCAS_system(at, expected, desired);
#else
  std::atomic_ref(*at).compare_exchange_strong(expected, desired, std::memory_order_relaxed);
  return expected;
#endif
}

/// Loads an item that other threads write during the same loop.
template <class T>
JFPX_HD T load_shared(const T* at) {
#if defined(__CUDA_ARCH__)
  return *static_cast<const volatile T*>(at);
#else
  return std::atomic_ref(*const_cast<T*>(at)).load(std::memory_order_relaxed);
#endif
}

/// Stores an item that other threads read or write during the same loop.
template <class T>
JFPX_HD void store_shared(T* at, std::type_identity_t<T> value) {
#if defined(__CUDA_ARCH__)
  *static_cast<volatile T*>(at) = value;
#else
  std::atomic_ref(*at).store(value, std::memory_order_relaxed);
#endif
}

/// Raises an item to a value. Cheaper than atomic_max() if most values are not above the item.
template <class T>
JFPX_HD void raise(T* at, std::type_identity_t<T> value) {
  if (load_shared(at) < value) atomic_max(at, value);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
