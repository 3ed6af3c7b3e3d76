/// Limits, thresholds and launch configurations of the searches on a GPU. All were measured on an
/// H100 or H200 (bench/results). None of them changes a result.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

// Selection of an algorithm, by the number of spheres.

/// Up to this number, one cluster of blocks performs the whole search.
inline constexpr std::uint32_t kFusedSpheres = 1024;
/// Up to this number, the test of all pairs is faster than the grid.
inline constexpr std::size_t kMaxForAllPairs = 4500;
/// Up to this number, the grid does not sort the spheres.
inline constexpr std::uint32_t kMaxDirect = 24'000;
/// Up to this number, the grid is built and searched in one launch.
inline constexpr std::uint32_t kMaxInOneLaunch = 1 << 18;
/// Up to this number, kernels write the contacts directly into mapped host memory, which saves a
/// copy and a synchronization.
inline constexpr std::size_t kMaxMappedSpheres = 20'000;

// The test of all pairs.

/// Edge of the square tiles of pairs that a thread block tests.
inline constexpr std::uint32_t kTile = 256;
/// Largest size of the bit matrix of all pairs. Larger searches process bands of rows, in two
/// passes: one counts the contacts, one writes them.
inline constexpr std::size_t kMaskBytes = std::size_t{256} << 20;

// Lists of given pairs.

/// Number of pairs that a block tests.
inline constexpr std::size_t kTouchingPerBlock = 2048;

// The grid.

inline constexpr unsigned kGridThreads = 256;  ///< of a block
/// Total number of slots in the cells of the search without sorting, divided by the number of
/// spheres. With 12, a cell of 10,000 uniform points and their images, of which it has 0.65, had 7
/// slots, which was too few in one of six searches.
inline constexpr std::uint32_t kDirectSlots = 16;
/// Largest number of coarse buckets of a search in several launches.
inline constexpr unsigned kCoarseBuckets = 2048;
/// Intended mean number of spheres of a coarse bucket, and smallest limit of the number of coarse
/// buckets. Fewer buckets need fewer atomics; more buckets are sorted by more blocks.
inline constexpr std::uint32_t kSpheresOfCoarse = 1024, kFewestCoarse = 256;
/// Expected number of pairs of the first rows from which the search without sorting is not tried,
/// divided by the largest number of pairs of a block.
inline constexpr double kDirectFill = 0.75;
/// Number of spheres from which the levels of the grid are chosen.
inline constexpr std::uint32_t kSamples = 4096;
/// Number of spheres per cell from which a warp searches for several spheres together.
inline constexpr Real kCrowded = 3;
/// The same from which cells are as wide in x as in y and z, and the spheres of a cell are sorted.
inline constexpr Real kVeryCrowded = 15;
/// Number of neighbor slots per sphere; further neighbors are appended to a list for all spheres.
inline constexpr std::uint32_t kSlots = 16;
/// Largest number of contacts of a row in the staging buffer. No contact of a longer row is staged.
inline constexpr std::uint32_t kMaxStaged = 128;
/// Longest row that one warp sorts. Longer rows are sorted by many blocks.
inline constexpr std::uint32_t kMaxLongRow = 1024;
/// The single-level search counts contacts in bins of this number of consecutive rows. A block
/// copies a bin, or a part of it, to the output.
inline constexpr std::uint32_t kBin = 256;
/// Number of copies of a block in a search in one launch, if bins can be divided into enough parts,
/// and largest number of parts of a bin.
inline constexpr unsigned kCopiesOfBlock = 2, kMaxParts = 8;
/// Number of consecutive bins whose counts are summed before the copy.
inline constexpr std::uint32_t kBinsOfSum = 64;

// Resident blocks per multiprocessor for which the kernels of the grid are compiled.

#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
/// Blocks of 512 threads of the sort, limited by shared memory, which is smaller on Turing.
inline constexpr unsigned kSortBlocks = 2;
/// Of the searches. A multiprocessor of Turing has 1024 threads, that is, four blocks.
inline constexpr unsigned kSearchBlocks = sizeof(Real) == 4 ? 4 : 3;
/// Of the copy, which uses all threads.
template <bool kPeriodic>
inline constexpr unsigned kCopyBlocks = 4;
#else
inline constexpr unsigned kSortBlocks = sizeof(Real) == 4 ? 3 : 2;
inline constexpr unsigned kSearchBlocks = sizeof(Real) == 4 ? 5 : 3;
/// The writes of more blocks reach the memory in a worse order.
template <bool kPeriodic>
inline constexpr unsigned kCopyBlocks = kPeriodic ? 4 : 5;
#endif
/// Registers for the loads of several candidates are worth more than a fifth block.
inline constexpr unsigned kCrowdedBlocks = std::min(kSearchBlocks, 4u);
/// Of a search on several levels. Fewer blocks search hashed cells, because each needs more of the
/// L1 cache.
template <bool kDense>
inline constexpr unsigned kLevelBlocks = kDense ? kSearchBlocks : std::min(kSearchBlocks, 4u);
/// Of the search in one launch.
inline constexpr unsigned kOneLaunchBlocks = sizeof(Real) == 4 ? 4 : 3;

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
