/// Cells of memory by which the threads of a device hand over the velocities of bodies.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

inline constexpr int kCellNumbers = sizeof(Real) == 4 ? 3 : 1;

/// Numbers, and the sequence number of the change that has produced them: a thread that finds the
/// sequence number that it waits for has also received the numbers, without a fence.
struct alignas(16) Cell {
  Real numbers[kCellNumbers];
  std::uint32_t sequence;
};
static_assert(sizeof(Cell) == 16);

/// Loads a cell atomically. On a device, from the L2 cache, which all multiprocessors share.
JFPX_HD inline Cell load_cell(const Cell* at) {
#if defined(__CUDA_ARCH__)
  union {
    unsigned long long words[2];
    Cell cell;
  } u;
  asm volatile("{ .reg .b128 t; ld.relaxed.gpu.global.b128 t, [%2]; mov.b128 {%0, %1}, t; }"
               : "=l"(u.words[0]), "=l"(u.words[1])
               : "l"(at));
  return u.cell;
#else
  return *at;
#endif
}

/// Stores a cell atomically, as load_cell().
JFPX_HD inline void store_cell(Cell* at, const Cell& cell) {
#if defined(__CUDA_ARCH__)
  union {
    unsigned long long words[2];
    Cell cell;
  } u;
  u.words[1] = 0;
  u.cell = cell;
  asm volatile("{ .reg .b128 t; mov.b128 t, {%1, %2}; st.relaxed.gpu.global.b128 [%0], t; }"
               :
               : "l"(at), "l"(u.words[0]), "l"(u.words[1]));
#else
  *at = cell;
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
