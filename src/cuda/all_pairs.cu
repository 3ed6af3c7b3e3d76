/// All pairs by tiles (thesis 4.5.2): spheres of a tile's columns in shared memory, those of its
/// rows in registers. The outcome is a bit matrix, from which contacts come out in canonical order.
#include "src/cuda/sphere_filter.hpp"
#include "src/cuda/tiles.cuh"

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kRows = kTile / kThreads;  // rows of a thread
constexpr unsigned kEmitThreads = 256;

/// Row r of tiles has tiles - r tiles on and right of the diagonal. A band's first row of tiles is
/// paired with its last, the second with the last but one, and so on: all pairs have `width` tiles.
struct TileGrid {
  std::uint32_t tiles, first, rows;
  __host__ __device__ std::uint32_t width() const { return 2 * (tiles - first) - rows + 1; }
  __host__ __device__ std::uint32_t height() const { return (rows + 1) / 2; }
};

__host__ __device__ TileGrid tile_grid(const AllPairsArgs& args) {
  return {(args.n + kTile - 1) / kTile, args.first_row / kTile, (args.rows + kTile - 1) / kTile};
}

/// Clears the bits of `word` whose spheres do not touch `a`.
__device__ std::uint32_t exactly_touching(std::uint32_t word, const SphereInstance& a,
                                          const SphereInstance* b) {
  for (std::uint32_t left = word; left != 0; left &= left - 1) {
    const int k = __ffs(static_cast<int>(left)) - 1;
    if (shared::test_sphere_pair(a, b[k]).touching == 0) word &= ~(1u << k);
  }
  return word;
}

/// The bits of word `first_b / 32` of row `a` that stand for pairs: a < b < n.
__device__ std::uint32_t pair_bits(std::uint32_t a, std::uint32_t first_b, std::uint32_t n) {
  std::uint32_t bits = n <= first_b ? 0 : n - first_b >= 32 ? ~0u : (1u << (n - first_b)) - 1;
  if (a >= first_b) bits &= a - first_b >= 31 ? 0 : ~0u << (a - first_b + 1);
  return bits;
}

__global__ void __launch_bounds__(kThreads) all_pairs(AllPairsArgs args) {
  wait_for_previous_kernel();
  __shared__ SphereInstance columns[kTile];
  __shared__ std::uint32_t words[kTile][kWordsPerTile + 1];
  const TileGrid grid = tile_grid(args);
  std::uint32_t tile_row = grid.first + blockIdx.y;
  std::uint32_t tile_column = tile_row + blockIdx.x;
  if (tile_column >= grid.tiles) {
    const std::uint32_t mirrored = grid.rows - 1 - blockIdx.y;
    if (mirrored == blockIdx.y) return;  // the middle row of an odd band has no partner
    tile_row = grid.first + mirrored;
    tile_column = tile_column - grid.tiles + tile_row;
  }
  const std::uint32_t first_b = tile_column * kTile;
  const std::uint32_t last = args.n - 1;

  SphereInstance row[kRows];
  std::uint32_t count[kRows] = {};
  for (unsigned r = 0; r < kRows; ++r) {
    const std::uint32_t a = tile_row * kTile + r * kThreads + threadIdx.x;
    const std::uint32_t b = first_b + r * kThreads + threadIdx.x;
    row[r] = load_sphere(args.spheres + min(a, last));
    columns[r * kThreads + threadIdx.x] = load_sphere(args.spheres + min(b, last));
    if (tile_row == tile_column && a <= last && !is_valid(row[r])) report_invalid(args.state, a);
  }
  __syncthreads();

  for (unsigned w = 0; w < kWordsPerTile; ++w) {
    std::uint32_t word[kRows] = {};
#pragma unroll
    for (unsigned k = 0; k < 32; ++k) {
      const SphereInstance b = columns[32 * w + k];
#pragma unroll
      for (unsigned r = 0; r < kRows; ++r) {
        if (may_touch(row[r], b)) word[r] |= 1u << k;
      }
    }
#pragma unroll
    for (unsigned r = 0; r < kRows; ++r) {
      const unsigned local = r * kThreads + threadIdx.x;
      word[r] &= pair_bits(tile_row * kTile + local, first_b + 32 * w, args.n);
      if (word[r] != 0) word[r] = exactly_touching(word[r], row[r], columns + 32 * w);
      words[local][w] = word[r];
      count[r] += static_cast<unsigned>(__popc(word[r]));
    }
  }
  if (args.count) {
    for (unsigned r = 0; r < kRows; ++r) {
      const std::uint32_t a = tile_row * kTile + r * kThreads + threadIdx.x;
      if (count[r] != 0 && a <= last) atomicAdd(&args.counts[a], count[r]);
    }
  }
  __syncthreads();

  // A row's words of this tile are one 32-byte sector of the matrix.
  const std::uint32_t stride = mask_stride(args.n);
  for (unsigned i = threadIdx.x; i < kTile * kWordsPerTile; i += kThreads) {
    const unsigned local = i / kWordsPerTile, w = i % kWordsPerTile;
    const std::size_t band_row = std::size_t{tile_row - grid.first} * kTile + local;
    args.masks[band_row * stride + tile_column * kWordsPerTile + w] = words[local][w];
  }
}

/// A warp a row.
__global__ void __launch_bounds__(kEmitThreads) mask_emit(MaskEmitArgs args) {
  wait_for_previous_kernel();
  const std::uint32_t row = (blockIdx.x * kEmitThreads + threadIdx.x) / 32;
  const unsigned long long total = args.offsets[args.n];
  const std::uint32_t invalid = first_invalid(args.state);
  const bool complete = total <= args.output.capacity;
  if (args.first_row == 0 && row == 0 && lane_id() == 0) {
    write_count(args.output, total, invalid, complete);
  }
  if (row >= args.rows || !complete || invalid != kNoSphere) return;
  const std::uint32_t a = args.first_row + row;
  unsigned long long at = args.offsets[a];
  const unsigned long long end = args.offsets[a + 1];
  const std::uint32_t stride = mask_stride(args.n);
  const std::uint32_t* words = args.masks + std::size_t{row} * stride;
  const SphereInstance sphere = load_sphere(args.spheres + a);
  for (std::uint32_t w = a / kTile * kWordsPerTile; at != end; w += 32) {
    const std::uint32_t word = w + lane_id() < stride ? words[w + lane_id()] : 0;
    at = emit_row(args.output, at, a, sphere, w, word,
                  [&](std::uint32_t b) { return load_sphere(args.spheres + b); });
  }
}

}  // namespace

void launch_all_pairs(const AllPairsArgs& args, cudaStream_t stream) {
  const TileGrid grid = tile_grid(args);
  launch(all_pairs, grid.width(), grid.height(), kThreads, stream, args);
}

void launch_mask_emit(const MaskEmitArgs& args, cudaStream_t stream) {
  constexpr unsigned kRowsPerBlock = kEmitThreads / 32;
  launch(mask_emit, (args.rows + kRowsPerBlock - 1) / kRowsPerBlock, 1, kEmitThreads, stream, args);
}

}  // namespace jfpx::inline JFPX_ABI::cuda
