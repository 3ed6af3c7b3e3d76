/// Kernels of the row solver. In the sweeps, each thread solves several contacts and waits for
/// their sequence numbers; in the other kernels, each thread processes one contact.
#include "src/base/cuda/launch.cuh"
#include "src/base/cuda/warp.cuh"
#include "src/contact_solver/sequential_impulse/cuda/row_kernels.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

constexpr unsigned kSetUpThreads = 128;
/// Small, so that contacts are spread over all multiprocessors first.
constexpr unsigned kSweepThreads = 64;
constexpr unsigned kWarpsPerBlock = kSweepThreads / 32;
/// Limit of consecutive unsuccessful polls of a warp: some seconds. Only reached by a defect.
constexpr unsigned kMaxPolls = 1u << 23;
/// Contacts that a lane solves serially before further lanes of its warp are used, because
/// divergence within a warp costs more.
constexpr std::size_t kContactsPerLane = 64;

struct DeviceCells {
  static __device__ Cell load(const Cell* at) { return load_cell(at); }
  static __device__ void store(Cell* at, const Cell& cell) { store_cell(at, cell); }
};

/// The largest residuals of the threads of a block.
struct BlockResults {
  unsigned long long* largest;  ///< by iteration, in shared memory
  bool is_broken = false;

  __device__ void raise(std::uint32_t iteration, Real squared) {
    if (squared > 0) {
      atomicMax(largest + iteration, static_cast<unsigned long long>(
                                         __double_as_longlong(static_cast<double>(squared))));
    }
  }
  __device__ void broken() { is_broken = true; }
};

/// The minimum over a warp.
__device__ unsigned warp_min(unsigned value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(kFullWarp, value);
#else
  return warp_reduce(value, [](unsigned a, unsigned b) { return min(a, b); });
#endif
}

/// Runs a worker in every lane. All lanes of a warp poll in the same loop iteration, so that no
/// lane blocks another lane of its own warp.
template <bool kFactors, bool kSplitImpulse>
__device__ void run_workers(const RowSweepArgs& args, unsigned thread, unsigned threads,
                            BlockResults* results) {
  rows::SweepWorker<DeviceCells, kFactors, kSplitImpulse> worker(
      args.group, kSplitImpulse ? args.split_impulse : args.main, thread, threads);
  for (unsigned polls = 0; polls < kMaxPolls; ++polls) {
    const unsigned missing = warp_min(worker.done() ? ~0u : worker.step(results));
    if (missing == ~0u) return;
    if (missing == 0) polls = 0;
  }
  args.results->stuck = 1;
}

/// @param lanes number of lanes that each warp uses, starting with lane 0
template <bool kFactors>
__global__ void __launch_bounds__(kSweepThreads)
    sweep_rows(const __grid_constant__ RowSweepArgs args, unsigned main_blocks, unsigned lanes) {
  extern __shared__ unsigned long long largest[];
  for (unsigned i = threadIdx.x; i < args.iterations; i += kSweepThreads) largest[i] = 0;
  __syncthreads();
  BlockResults results{largest};
  const bool split_impulse = blockIdx.x >= main_blocks;
  const unsigned blocks = split_impulse ? gridDim.x - main_blocks : main_blocks;
  const unsigned block = split_impulse ? blockIdx.x - main_blocks : blockIdx.x;
  const unsigned warp = block * kWarpsPerBlock + threadIdx.x / 32;
  const unsigned thread = lane_id() < lanes ? warp * lanes + lane_id() : ~0u;
  const unsigned threads = blocks * kWarpsPerBlock * lanes;
  if (split_impulse) {
    run_workers<kFactors, true>(args, thread, threads, &results);
  } else {
    run_workers<kFactors, false>(args, thread, threads, &results);
  }
  if (results.is_broken) args.results->broken = 1;
  __syncthreads();
  unsigned long long* const all = args.results->largest() + (split_impulse ? args.iterations : 0);
  for (unsigned i = threadIdx.x; i < args.iterations; i += kSweepThreads) {
    if (largest[i] != 0) atomicMax(all + i, largest[i]);
  }
}

__global__ void __launch_bounds__(kSetUpThreads)
    set_up_rows(const __grid_constant__ RowSweepArgs args) {
  wait_for_previous_kernel();
  const unsigned slot = blockIdx.x * kSetUpThreads + threadIdx.x;
  const bool split_impulse = slot < args.group.main.count && rows::set_up_slot(args.group, slot);
  const unsigned count = static_cast<unsigned>(__popc(__ballot_sync(kFullWarp, split_impulse)));
  if (lane_id() == 0 && count > 0) atomicAdd(&args.results->split_impulses, count);
}

__global__ void __launch_bounds__(kSetUpThreads)
    finish_rows(const __grid_constant__ RowSweepArgs args) {
  wait_for_previous_kernel();
  const unsigned i = blockIdx.x * kSetUpThreads + threadIdx.x;
  bool finite = true;
  if (i < args.group.main.count) finite &= rows::finish_slot(args.group, i);
  if (i < args.group.body_count) finite &= rows::finish_body(args.group, i);
  if (!finite) args.results->broken = 1;
}

unsigned blocks_for(std::size_t count, unsigned threads) {
  return static_cast<unsigned>((count + threads - 1) / threads);
}
std::size_t shared_bytes(std::uint32_t iterations) {
  return iterations * sizeof(unsigned long long);
}

}  // namespace

void launch_row_setup(const RowSweepArgs& args, cudaStream_t stream) {
  const std::size_t bytes = std::size_t{args.group.body_count} * rows::kBodyCells * sizeof(Cell);
  JFPX_CUDA_TRY(cudaMemsetAsync(args.group.main.cells, 0, bytes, stream));
  JFPX_CUDA_TRY(cudaMemsetAsync(args.group.split_impulse.cells, 0, bytes, stream));
  JFPX_CUDA_TRY(cudaMemsetAsync(args.results, 0,
                                SweepResults::bytes(static_cast<int>(args.iterations)), stream));
  launch(set_up_rows, blocks_for(args.group.main.count, kSetUpThreads), 1, kSetUpThreads, stream,
         args);
}

unsigned max_row_blocks(int device) {
  int multiprocessors = 0, min_blocks = 0;
  JFPX_CUDA_TRY(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  for (const auto kernel : {sweep_rows<false>, sweep_rows<true>}) {
    int blocks = 0;
    // Assumes the shared memory of the maximum number of iterations.
    JFPX_CUDA_TRY(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kSweepThreads,
                                                                shared_bytes(1024)));
    min_blocks = min_blocks == 0 ? blocks : std::min(min_blocks, blocks);
  }
  return static_cast<unsigned>(multiprocessors * min_blocks);
}

// If there are more contacts than threads, both programs get a proportional share of the threads.
void launch_row_sweeps(const RowSweepArgs& args, unsigned max_blocks, cudaStream_t stream) {
  const std::size_t main = args.group.main.count;
  const std::size_t split = args.split_impulse.iterations > 0 ? args.group.split_impulse.count : 0;
  const std::size_t warps = std::size_t{max_blocks} * kWarpsPerBlock;
  unsigned lanes = 1;
  while (lanes < 32 && main + split > warps * lanes * kContactsPerLane) lanes *= 2;
  const unsigned per_block = kWarpsPerBlock * lanes;
  unsigned main_blocks = blocks_for(main, per_block);
  unsigned split_impulse_blocks = blocks_for(split, per_block);
  if (main_blocks + split_impulse_blocks > max_blocks) {
    split_impulse_blocks = static_cast<unsigned>(std::size_t{split_impulse_blocks} * max_blocks /
                                                 (main_blocks + split_impulse_blocks));
    if (split > 0) split_impulse_blocks = std::max(split_impulse_blocks, 1u);
    main_blocks = std::min(main_blocks, max_blocks - split_impulse_blocks);
  }
  RowSweepArgs copy = args;
  void* parameters[] = {&copy, &main_blocks, &lanes};
  const auto kernel = args.group.factors != nullptr ? sweep_rows<true> : sweep_rows<false>;
  JFPX_CUDA_TRY(cudaLaunchCooperativeKernel(
      reinterpret_cast<const void*>(kernel), dim3(main_blocks + split_impulse_blocks),
      dim3(kSweepThreads), parameters, shared_bytes(args.iterations), stream));
}

void launch_row_finish(const RowSweepArgs& args, cudaStream_t stream) {
  const std::size_t count = std::max<std::size_t>(args.group.main.count, args.group.body_count);
  launch(finish_rows, blocks_for(count, kSetUpThreads), 1, kSetUpThreads, stream, args);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
