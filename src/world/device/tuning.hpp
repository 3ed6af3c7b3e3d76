/// Launch configurations of the programs of a step on a device, measured on an H100 or H200
/// (bench/results). None of them changes a result.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {
namespace tuning {

inline constexpr unsigned kThreads = 256;  ///< of a block
/// Number of blocks of a cluster, whose barriers are faster than those of a grid. Launches of up to
/// twice as many blocks are reduced to one cluster. More than 8 blocks are not portable, and Hopper
/// supports 16.
inline constexpr unsigned kClusterBlocks = 16;

/// Threads launched for each item of a program whose items diverge, up to one block per
/// multiprocessor: GridTeam::for_each_divergent() then gives each warp few items.
inline constexpr std::size_t kThreadsPerItem = 8;

// Resident blocks per multiprocessor for which the programs are compiled.
inline constexpr unsigned kForce = 2, kBounds = 3, kSphere = 6, kShape = 3, kMatch = 6,
                          kPrepare = 3, kPrepareStage = 4, kPlaceStage = 5,
                          kInnerStage = sizeof(Real) == 4 ? 4 : 3,
                          kSolve = sizeof(Real) == 4 ? 2 : 1, kCommit = 3, kEdit = 3, kMerge = 3;
inline constexpr unsigned kMost = 6;  ///< the largest of these numbers

}  // namespace tuning
}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
