/// Search among few spheres in one launch of one thread block cluster.
#include "src/base/cuda/cuda_try.hpp"
#include "src/sphere_collider/cuda/fused_search.hpp"
#include "src/sphere_collider/cuda/quantized_filter.cuh"
#include "src/sphere_collider/cuda/search.cuh"

#include <cub/block/block_scan.cuh>

#include <cooperative_groups.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

namespace cg = cooperative_groups;

constexpr unsigned kBlocks = 16;  // largest cluster that Hopper supports
constexpr unsigned kThreads = 512;
constexpr unsigned kWarps = kThreads / 32;
constexpr unsigned kMaxTiles = kFusedSpheres / 32;  // of 32 rows each
static_assert(kMaxTiles == 2 * kBlocks && kFusedSpheres == 2 * kThreads);
[[maybe_unused]] constexpr unsigned kRowsOfWarp = 64 / kWarps;

using RowSums = cub::BlockScan<std::uint32_t, kThreads, cub::BLOCK_SCAN_WARP_SCANS>;

// Functions and constants are [[maybe_unused]]: clusters require Hopper, so the kernel is empty in
// code for older devices.

/// Shared memory of a block.
struct FusedStorage {
  SphereInstance spheres[kFusedSpheres];
  QuantizedRecord rows[kFusedSpheres], columns[kFusedSpheres];
  QuantizationStorage quantization;
  std::uint32_t words[64][kMaxTiles + 1];  // bit matrix of the 2 x 32 rows of this block
  std::uint32_t counts[kFusedSpheres];     // contacts of each row, gathered from all blocks
  std::uint32_t offsets[kFusedSpheres];    // contacts before each row
  RowSums::TempStorage sums;
  std::uint32_t valid_before[kWarps];  // ~(lowest index of an invalid sphere), 0 if there is none
};

/// The two rows of tiles that a block tests: a long row from the start and a short row from the
/// end, so that blocks have equal work if n is kFusedSpheres. of_row(k) is the number of tiles of
/// row k on and right of the diagonal.
struct TilesOfBlock {
  unsigned tiles, rows[2];
  __device__ TilesOfBlock(std::uint32_t n, unsigned block)
      : tiles((n + 31) / 32), rows{block, kMaxTiles - 1 - block} {}
  __device__ unsigned of_row(unsigned k) const { return rows[k] < tiles ? tiles - rows[k] : 0; }
};

/// Sets `offsets` to the exclusive scan of `counts`. Call from all threads of the block.
/// @return the sum of all counts.
[[maybe_unused]] __device__ std::uint32_t scan_rows(FusedStorage& s) {
  constexpr unsigned kPerThread = kFusedSpheres / kThreads;
  std::uint32_t values[kPerThread], total = 0;
  for (unsigned k = 0; k < kPerThread; ++k) values[k] = s.counts[kPerThread * threadIdx.x + k];
  RowSums(s.sums).ExclusiveSum(values, values, total);
  for (unsigned k = 0; k < kPerThread; ++k) s.offsets[kPerThread * threadIdx.x + k] = values[k];
  __syncthreads();
  return total;
}

/// Loads and quantizes all spheres. Call from all threads of the block.
[[maybe_unused]] __device__ void load_spheres(const FusedArgs& args, unsigned tiles,
                                              FusedStorage& s) {
  SphereInstance mine[2];
  unsigned valid_before = 0;
  for (unsigned k = 0; k < 2; ++k) {
    const std::uint32_t i = min(k * kThreads + threadIdx.x, args.input.n - 1);
    mine[k] = load_sphere(args.input, i);
    if (!is_valid(mine[k])) valid_before = max(valid_before, ~i);
  }
  valid_before = warp_max(valid_before);
  if (lane_id() == 0) s.valid_before[threadIdx.x / 32] = valid_before;
  const Quantization quantization = quantization_of_block(mine[0], mine[1], s.quantization);
  for (unsigned k = 0; k < 2; ++k) {
    const unsigned i = k * kThreads + threadIdx.x;
    s.counts[i] = 0;
    if (i >= 32 * tiles) continue;
    s.spheres[i] = mine[k];
    const QuantizedSphere on = quantized(quantization, mine[k]);
    s.rows[i] = record_of(row_terms(on));
    s.columns[column_slot(i)] = record_of(column_terms(on));
  }
}

/// Fills the words of the rows of this block with the columns that may touch.
[[maybe_unused]] __device__ void fill_words(const TilesOfBlock& mine, FusedStorage& s) {
  const unsigned first = mine.of_row(0), all = first + mine.of_row(1);
  for (unsigned t = threadIdx.x / 32; t < all; t += kWarps) {
    const unsigned k = t < first ? 0 : 1, row = mine.rows[k];
    const unsigned column = row + (k == 0 ? t : t - first);
    put_bytes(
        overlap_bytes(load_fragment(s.rows + 32 * row), load_fragment(s.columns + 32 * column)),
        &s.words[32 * k][column], kMaxTiles + 1);
  }
}

__global__ void __launch_bounds__(kThreads) fused_search(FusedArgs args) {
#if __CUDA_ARCH__ >= 900
  extern __shared__ __align__(alignof(FusedStorage)) unsigned char raw[];
  FusedStorage& s = *reinterpret_cast<FusedStorage*>(raw);
  const cg::cluster_group cluster = cg::this_cluster();
  const std::uint32_t n = args.input.n;
  const unsigned warp = threadIdx.x / 32;
  const bool one = cluster.block_rank() == 0 && threadIdx.x == 0;
  if (n == 0) {
    if (one) write_count(args.output, 0, kNoSphere, true);
    return;
  }

  const TilesOfBlock tiles(n, cluster.block_rank());
  load_spheres(args, tiles.tiles, s);
  cluster.sync();  // remote shared memory may be written only after all blocks have started
  fill_words(tiles, s);
  __syncthreads();

  // Each warp tests kRowsOfWarp rows of the bit matrix. Lane w keeps word w of each row.
  const auto row = [&](unsigned k) {
    const unsigned local = k * kWarps + warp;
    return 32 * tiles.rows[local / 32] + local % 32;
  };
  unsigned words[kRowsOfWarp] = {};
#pragma unroll
  for (unsigned k = 0; k < kRowsOfWarp; ++k) {
    const std::uint32_t a = row(k);
    if (a >= n) continue;
    if (lane_id() >= a / 32 && lane_id() < tiles.tiles) {
      words[k] = s.words[k * kWarps + warp][lane_id()] & pair_bits(a, 32 * lane_id(), n);
      words[k] = exactly_touching(words[k], s.spheres[a], s.spheres + 32 * lane_id());
    }
    const unsigned count = warp_sum(static_cast<unsigned>(__popc(words[k])));
    if (lane_id() < kBlocks) *cluster.map_shared_rank(&s.counts[a], lane_id()) = count;
  }
  cluster.sync();

  const std::uint32_t total = scan_rows(s);
  const bool complete = total <= args.output.capacity;
  const std::uint32_t invalid = first_invalid(warp_max(s.valid_before[lane_id() % kWarps]));
  if (one) write_count(args.output, total, invalid, complete);
  if (!complete || invalid != kNoSphere) return;
  SearchOutput known = args.output;
  known.rows.length = total;
#pragma unroll
  for (unsigned k = 0; k < kRowsOfWarp; ++k) {
    const std::uint32_t a = row(k);
    if (a >= n) continue;
    emit_row(s.offsets[a], 0, words[k], [&](unsigned long long at, std::uint32_t b) {
      write_contact(known, at, a, b, s.spheres[a], s.spheres[b]);
    });
  }
#else
  static_cast<void>(args);
#endif
}

/// Allows shared memory and a cluster size above the portable limits.
void allow_resources() {
  JFPX_CUDA_TRY(cudaFuncSetAttribute(fused_search, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                     static_cast<int>(sizeof(FusedStorage))));
  JFPX_CUDA_TRY(
      cudaFuncSetAttribute(fused_search, cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
}

struct Launch {
  Launch() {
    cluster.id = cudaLaunchAttributeClusterDimension;
    cluster.val.clusterDim.x = kBlocks;
    cluster.val.clusterDim.y = 1;
    cluster.val.clusterDim.z = 1;
    config.gridDim = kBlocks;
    config.blockDim = kThreads;
    config.dynamicSmemBytes = sizeof(FusedStorage);
    config.attrs = &cluster;
    config.numAttrs = 1;
  }
  Launch(const Launch&) = delete;
  Launch& operator=(const Launch&) = delete;
  cudaLaunchAttribute cluster{};
  cudaLaunchConfig_t config{};
};

}  // namespace

bool fused_search_supported() {
  if (!has_hopper_code()) return false;
  allow_resources();
  const Launch launch;
  int max_cluster_size = 0;
  JFPX_CUDA_TRY(
      cudaOccupancyMaxPotentialClusterSize(&max_cluster_size, fused_search, &launch.config));
  return max_cluster_size >= static_cast<int>(kBlocks);
}

void launch_fused_search(const FusedArgs& args, cudaStream_t stream) {
  allow_resources();
  Launch launch;
  launch.config.stream = stream;
  JFPX_CUDA_TRY(cudaLaunchKernelEx(&launch.config, fused_search, args));
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
