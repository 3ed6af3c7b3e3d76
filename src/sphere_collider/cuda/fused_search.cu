/// Small N: the whole search in one launch, by one cluster of thread blocks.
#include "src/base/cuda/cuda_try.hpp"
#include "src/sphere_collider/cuda/lattice.cuh"
#include "src/sphere_collider/cuda/tiles.cuh"

#include <cooperative_groups.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

namespace cg = cooperative_groups;

constexpr unsigned kBlocks = 16;  // the largest cluster that Hopper can have
constexpr unsigned kThreads = 512;
constexpr unsigned kWarps = kThreads / 32;
constexpr unsigned kMaxTiles = kFusedSpheres / 32;  // of 32 rows each
static_assert(kMaxTiles == 2 * kBlocks && kFusedSpheres == 2 * kThreads);
[[maybe_unused]] constexpr unsigned kRowsOfWarp = 64 / kWarps;

// [[maybe_unused]]: clusters exist from Hopper on, so the code for older devices has an empty
// kernel.
struct FusedStorage {
  SphereInstance spheres[kFusedSpheres];
  LatticeRecord rows[kFusedSpheres], columns[kFusedSpheres];
  LatticeStorage lattice;
  std::uint32_t words[64][kMaxTiles + 1];  // of the two rows of tiles of this block
  std::uint32_t counts[kFusedSpheres];     // contacts of each row, gathered from all blocks
  std::uint32_t offsets[kFusedSpheres];    // contacts before each row
  std::uint32_t warp_sums[kWarps];
  std::uint32_t valid_before[kWarps];  // ~(lowest index of an invalid sphere), 0 if there is none
};

/// The two rows of tiles of a block: the first ones are long, the last ones short.
struct TilesOfBlock {
  unsigned tiles, rows[2];
  __device__ TilesOfBlock(std::uint32_t n, unsigned block)
      : tiles((n + 31) / 32), rows{block, kMaxTiles - 1 - block} {}
  __device__ unsigned of_row(unsigned k) const { return rows[k] < tiles ? tiles - rows[k] : 0; }
};

/// offsets becomes the exclusive scan of counts; returns the total. All threads of the block.
[[maybe_unused]] __device__ std::uint32_t scan_rows(FusedStorage& s) {
  constexpr unsigned kPerThread = kFusedSpheres / kThreads;
  std::uint32_t sum = 0;
  for (unsigned k = 0; k < kPerThread; ++k) sum += s.counts[kPerThread * threadIdx.x + k];
  std::uint32_t inclusive = sum;
  for (unsigned d = 1; d < 32; d *= 2) {
    const std::uint32_t below = __shfl_up_sync(kFullWarp, inclusive, d);
    if (lane_id() >= d) inclusive += below;
  }
  if (lane_id() == 31) s.warp_sums[threadIdx.x / 32] = inclusive;
  __syncthreads();
  std::uint32_t before = inclusive - sum, total = 0;
  for (unsigned w = 0; w < kThreads / 32; ++w) {
    if (w < threadIdx.x / 32) before += s.warp_sums[w];
    total += s.warp_sums[w];
  }
  for (unsigned k = 0; k < kPerThread; ++k) {
    s.offsets[kPerThread * threadIdx.x + k] = before;
    before += s.counts[kPerThread * threadIdx.x + k];
  }
  __syncthreads();
  return total;
}

/// Loads all spheres, and brings them onto a lattice. All threads of the block.
[[maybe_unused]] __device__ void load_spheres(const FusedArgs& args, unsigned tiles,
                                              FusedStorage& s) {
  SphereInstance mine[2];
  unsigned valid_before = 0;
  for (unsigned k = 0; k < 2; ++k) {
    const std::uint32_t i = min(k * kThreads + threadIdx.x, args.n - 1);
    mine[k] = load_sphere(args.spheres + i);
    if (!is_valid(mine[k])) valid_before = max(valid_before, ~i);
  }
  valid_before = warp_max(valid_before);
  if (lane_id() == 0) s.valid_before[threadIdx.x / 32] = valid_before;
  const Lattice lattice = lattice_of_block(mine[0], mine[1], s.lattice);
  for (unsigned k = 0; k < 2; ++k) {
    const unsigned i = k * kThreads + threadIdx.x;
    s.counts[i] = 0;
    if (i >= 32 * tiles) continue;
    s.spheres[i] = mine[k];
    const LatticeSphere on = on_lattice(lattice, mine[k]);
    s.rows[i] = record_of(row_terms(on));
    s.columns[place_of_column(i)] = record_of(column_terms(on));
  }
}

/// Fills the words of the block's rows: which columns they may touch.
[[maybe_unused]] __device__ void fill_words(const TilesOfBlock& mine, FusedStorage& s) {
  const unsigned first = mine.of_row(0), all = first + mine.of_row(1);
  for (unsigned t = threadIdx.x / 32; t < all; t += kWarps) {
    const unsigned k = t < first ? 0 : 1, row = mine.rows[k];
    const unsigned column = row + (k == 0 ? t : t - first);
    put_bytes(
        lattice_bytes(load_fragment(s.rows + 32 * row), load_fragment(s.columns + 32 * column)),
        &s.words[32 * k][column], kMaxTiles + 1);
  }
}

__global__ void __launch_bounds__(kThreads) fused_search(FusedArgs args) {
#if __CUDA_ARCH__ >= 900
  extern __shared__ __align__(alignof(FusedStorage)) unsigned char raw[];
  FusedStorage& s = *reinterpret_cast<FusedStorage*>(raw);
  const cg::cluster_group cluster = cg::this_cluster();
  const std::uint32_t n = args.n;
  const unsigned warp = threadIdx.x / 32;
  const bool one = cluster.block_rank() == 0 && threadIdx.x == 0;
  if (n == 0) {
    if (one) write_count(args.output, 0, kNoSphere, true);
    return;
  }

  const TilesOfBlock tiles(n, cluster.block_rank());
  load_spheres(args, tiles.tiles, s);
  cluster.sync();  // nobody writes into a block that has not started
  fill_words(tiles, s);
  __syncthreads();

  // A warp has rows of both rows of tiles. Lane w keeps word w of a row.
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
    const unsigned count = warp_reduce(static_cast<unsigned>(__popc(words[k])),
                                       [](unsigned p, unsigned q) { return p + q; });
    if (lane_id() < kBlocks) *cluster.map_shared_rank(&s.counts[a], lane_id()) = count;
  }
  cluster.sync();

  const std::uint32_t total = scan_rows(s);
  const bool complete = total <= args.output.capacity;
  const std::uint32_t invalid = first_invalid(warp_max(s.valid_before[lane_id() % kWarps]));
  if (one) write_count(args.output, total, invalid, complete);
  if (!complete || invalid != kNoSphere) return;
#pragma unroll
  for (unsigned k = 0; k < kRowsOfWarp; ++k) {
    const std::uint32_t a = row(k);
    if (a >= n) continue;
    emit_row(args.output, s.offsets[a], a, s.spheres[a], 0, words[k],
             [&](std::uint32_t b) { return s.spheres[b]; });
  }
#else
  static_cast<void>(args);
#endif
}

/// Shared memory and cluster size beyond what every device grants.
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
  int most_blocks = 0;
  JFPX_CUDA_TRY(cudaOccupancyMaxPotentialClusterSize(&most_blocks, fused_search, &launch.config));
  return most_blocks >= static_cast<int>(kBlocks);
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
