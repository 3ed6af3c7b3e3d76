/// The partition of the movable bodies into blocks, which determines the order of rows.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Largest number of movable bodies of a world that is one block: all rows of its movable bodies
/// are inner rows, and the partition is not used. A sweep of blocks has more colors in sequence,
/// which takes longer unless there are many rows of each color. It is part of the definition of the
/// solver, like kBodiesPerBlock.
inline constexpr std::uint32_t kMostBodiesInOneBlock = 1u << 19;

/// Number of places of a block. It is part of the definition of the solver: another number changes
/// all results. Smaller blocks have more rows between blocks; larger blocks exceed the shared
/// memory of GPUs and the caches of processor cores.
inline constexpr std::uint32_t kBodiesPerBlock = 1024;

/// Place of a body without a block: an immovable or kinematic body, a body that was added after the
/// partition was renewed, or any body of a world that never had several blocks.
inline constexpr std::uint32_t kNoPlace = 0xffffffffu;

/// Block of a place.
JFPX_HD constexpr std::uint32_t block_of(std::uint32_t place) { return place / kBodiesPerBlock; }
constexpr std::size_t block_count(std::size_t places) {
  return (places + kBodiesPerBlock - 1) / kBodiesPerBlock;
}

/// Whether the rows of two bodies with these places are inner rows: both bodies are in one block.
/// All other rows of two movable bodies are crossing rows.
/// @param has_blocks whether the world has several blocks
JFPX_HD constexpr bool is_inner(bool has_blocks, std::uint32_t a, std::uint32_t b) {
  return !has_blocks || (a != kNoPlace && block_of(a) == block_of(b));
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
