/// Memory cells through which the threads of a device exchange the velocities of bodies.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

inline constexpr int kCellNumbers = sizeof(Real) == 4 ? 3 : 1;

/// Numbers and the sequence number of the update that wrote them. A thread that reads the expected
/// sequence number has received the numbers in the same load, without a fence.
struct alignas(16) Cell {
  Real numbers[kCellNumbers];
  std::uint32_t sequence;
};
static_assert(sizeof(Cell) == 16);

/// 16 bytes of memory.
struct alignas(16) MemoryCell {
  std::uint32_t words[4];
};

/// Loads 16 bytes atomically. On a device, from the L2 cache, which all multiprocessors share;
/// 128-bit registers require PTX ISA 8.3 (CUDA 12.3).
JFPX_HD inline MemoryCell load_memory_cell(const MemoryCell* at) {
#if defined(__CUDA_ARCH__)
  unsigned long long low, high;
  asm volatile("{ .reg .b128 t; ld.relaxed.gpu.global.b128 t, [%2]; mov.b128 {%0, %1}, t; }"
               : "=l"(low), "=l"(high)
               : "l"(at));
  return {{static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(low >> 32),
           static_cast<std::uint32_t>(high), static_cast<std::uint32_t>(high >> 32)}};
#else
  return *at;
#endif
}

/// Stores 16 bytes atomically; see load_memory_cell().
JFPX_HD inline void store_memory_cell(MemoryCell* at, const MemoryCell& cell) {
#if defined(__CUDA_ARCH__)
  const auto pair = [&](int i) {
    return cell.words[i] | static_cast<unsigned long long>(cell.words[i + 1]) << 32;
  };
  asm volatile("{ .reg .b128 t; mov.b128 t, {%1, %2}; st.relaxed.gpu.global.b128 [%0], t; }"
               :
               : "l"(at), "l"(pair(0)), "l"(pair(2)));
#else
  *at = cell;
#endif
}

JFPX_HD inline Cell load_cell(const Cell* at) {
  union {
    MemoryCell memory;
    Cell cell;
  } u{load_memory_cell(reinterpret_cast<const MemoryCell*>(at))};
  return u.cell;
}

JFPX_HD inline void store_cell(Cell* at, const Cell& cell) {
  union {
    MemoryCell memory;
    Cell cell;
  } u{};
  u.cell = cell;
  store_memory_cell(reinterpret_cast<MemoryCell*>(at), u.memory);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
