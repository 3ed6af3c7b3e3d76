/// Test of all pairs in tiles (thesis 4.5.2). The spheres of the rows and columns of a tile are in
/// shared memory, quantized relative to their common bounds. The result is a bit matrix, from which
/// contacts are written in canonical order.
#include "src/sphere_collider/cuda/all_pairs.hpp"
#include "src/sphere_collider/cuda/quantized_filter.cuh"
#include "src/sphere_collider/cuda/search.cuh"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

constexpr unsigned kThreads = kTile;  // one per row
constexpr unsigned kEmitThreads = 256;

/// Tiles of a band. Row r of tiles has `tiles - r` tiles on and right of the diagonal. The first
/// row of a band is paired with its last row, the second with the second to last, and so on. Each
/// such pair has width() tiles, so the tiles fill a rectangular grid of blocks.
struct TileGrid {
  std::uint32_t tiles, first, rows;
  __host__ __device__ std::uint32_t width() const { return 2 * (tiles - first) - rows + 1; }
  __host__ __device__ std::uint32_t height() const { return (rows + 1) / 2; }
};

__host__ __device__ TileGrid tile_grid(const AllPairsArgs& args) {
  return {(args.n + kTile - 1) / kTile, args.first_row / kTile, (args.rows + kTile - 1) / kTile};
}

struct TileStorage {
  SphereInstance columns[kTile];
  QuantizedRecord row_records[kTile], column_records[kTile];
  std::uint32_t words[kTile][kWordsPerTile + 1];
  QuantizationStorage quantization;
};

/// Fills the words of the 32 rows of a warp with the columns of the tile that may touch.
__device__ void fill_words(TileStorage& s) {
  const unsigned first_row = threadIdx.x - lane_id();
  const QuantizedFragment rows = load_fragment(s.row_records + first_row);
  for (unsigned w = 0; w < kWordsPerTile; ++w) {
    const QuantizedFragment columns = load_fragment(s.column_records + 32 * w);
    put_bytes(overlap_bytes(rows, columns), &s.words[first_row][w], kWordsPerTile + 1);
  }
  __syncwarp();
}

__global__ void __launch_bounds__(kThreads) all_pairs(AllPairsArgs args) {
  wait_for_previous_kernel();
  __shared__ TileStorage s;
  const TileGrid grid = tile_grid(args);
  std::uint32_t tile_row = grid.first + blockIdx.y;
  std::uint32_t tile_column = tile_row + blockIdx.x;
  if (tile_column >= grid.tiles) {
    const std::uint32_t mirrored = grid.rows - 1 - blockIdx.y;
    if (mirrored == blockIdx.y) return;  // the middle row of an odd band has no partner
    tile_row = grid.first + mirrored;
    tile_column = tile_column - grid.tiles + tile_row;
  }
  const std::uint32_t last = args.n - 1;
  const std::uint32_t a = tile_row * kTile + threadIdx.x, first_b = tile_column * kTile;

  const SphereInstance row = load_sphere(args.spheres + min(a, last));
  const SphereInstance column = load_sphere(args.spheres + min(first_b + threadIdx.x, last));
  if (tile_row == tile_column && a <= last && !is_valid(row)) report_invalid(args.state, a);
  s.columns[threadIdx.x] = column;
  const Quantization quantization = quantization_of_block(row, column, s.quantization);
  s.row_records[threadIdx.x] = record_of(row_terms(quantized(quantization, row)));
  s.column_records[column_slot(threadIdx.x)] =
      record_of(column_terms(quantized(quantization, column)));
  __syncthreads();
  fill_words(s);

  std::uint32_t count = 0;
  for (unsigned w = 0; w < kWordsPerTile; ++w) {
    std::uint32_t word = s.words[threadIdx.x][w] & pair_bits(a, first_b + 32 * w, args.n);
    if (word != 0) word = exactly_touching(word, row, s.columns + 32 * w);
    s.words[threadIdx.x][w] = word;
    count += static_cast<unsigned>(__popc(word));
  }
  if (args.count && count != 0 && a <= last) atomicAdd(&args.counts[a], count);
  __syncthreads();

  // The words of a row in this tile are one 32-byte sector of the matrix.
  const std::uint32_t stride = mask_stride(args.n);
  for (unsigned i = threadIdx.x; i < kTile * kWordsPerTile; i += kThreads) {
    const unsigned local = i / kWordsPerTile, w = i % kWordsPerTile;
    const std::size_t band_row = std::size_t{tile_row - grid.first} * kTile + local;
    args.masks[band_row * stride + tile_column * kWordsPerTile + w] = s.words[local][w];
  }
}

/// Each warp writes the contacts of one row.
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
  SearchOutput known = args.output;
  known.rows.length = total;
  const std::uint32_t a = args.first_row + row;
  unsigned long long at = args.offsets[a];
  const unsigned long long end = args.offsets[a + 1];
  const std::uint32_t stride = mask_stride(args.n);
  const std::uint32_t* words = args.masks + std::size_t{row} * stride;
  const SphereInstance sphere = load_sphere(args.spheres + a);
  for (std::uint32_t w = a / kTile * kWordsPerTile; at != end; w += 32) {
    const std::uint32_t word = w + lane_id() < stride ? words[w + lane_id()] : 0;
    at = emit_row(at, w, word, [&](unsigned long long to, std::uint32_t b) {
      write_contact(known, to, a, b, sphere, load_sphere(args.spheres + b));
    });
  }
}

}  // namespace

void launch_all_pairs(const AllPairsArgs& args, cudaStream_t stream) {
  const TileGrid grid = tile_grid(args);
  launch(all_pairs, grid.width(), grid.height(), kThreads, stream, args);
}

void launch_mask_emit(const MaskEmitArgs& args, cudaStream_t stream) {
  constexpr unsigned kRowsPerBlock = kEmitThreads / 32;
  // At least one block, which also writes the count.
  const unsigned blocks = args.rows / kRowsPerBlock + (args.rows % kRowsPerBlock != 0 ? 1 : 0);
  launch(mask_emit, std::max(blocks, 1u), 1, kEmitThreads, stream, args);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
