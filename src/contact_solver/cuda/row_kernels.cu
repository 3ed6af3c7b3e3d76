/// Rows of Bullet's impulse solver on the device: one thread a contact, which waits for its turn.
#include "src/base/cuda/launch.cuh"
#include "src/base/cuda/warp.cuh"
#include "src/contact_solver/cuda/row_kernels.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

constexpr unsigned kSetUpThreads = 128;
/// Small, so that few contacts share a multiprocessor while there are more multiprocessors.
constexpr unsigned kSweepThreads = 64;
constexpr unsigned kWarpsABlock = kSweepThreads / 32;
/// Looks in vain after which a walker gives up: some seconds. Only a defect can make it happen.
constexpr unsigned kMaxLooks = 1u << 23;
/// Contacts that a lane takes one after the other before further lanes of its warp are used:
/// lanes of a warp hold each other up, which costs more than that.
constexpr std::size_t kContactsALane = 64;

/// Cells in the cache that all multiprocessors share, each read and written at once.
struct DeviceCells {
  static __device__ rows::Cell load(const rows::Cell* p) {
    union {
      unsigned long long words[2];
      rows::Cell cell;
    } u;
    asm volatile("{ .reg .b128 t; ld.relaxed.gpu.global.b128 t, [%2]; mov.b128 {%0, %1}, t; }"
                 : "=l"(u.words[0]), "=l"(u.words[1])
                 : "l"(p));
    return u.cell;
  }
  static __device__ void store(rows::Cell* p, const rows::Cell& cell) {
    union {
      unsigned long long words[2];
      rows::Cell cell;
    } u;
    u.words[1] = 0;
    u.cell = cell;
    asm volatile("{ .reg .b128 t; mov.b128 t, {%1, %2}; st.relaxed.gpu.global.b128 [%0], t; }"
                 :
                 : "l"(p), "l"(u.words[0]), "l"(u.words[1]));
  }
};

/// The largest residuals that the threads of a block have found.
struct BlockFound {
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

/// The least of a warp.
__device__ unsigned warp_least(unsigned value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(kFullWarp, value);
#else
  return warp_reduce(value, [](unsigned a, unsigned b) { return min(a, b); });
#endif
}

/// All lanes go round together, so that none can wait for another one of its own warp.
template <bool kFactors, bool kPush>
__device__ void walk(const RowSweepArgs& args, unsigned thread, unsigned threads,
                     BlockFound* found) {
  rows::RowWalker<DeviceCells, kFactors, kPush> walker(args.group, kPush ? args.push : args.main,
                                                       thread, threads);
  for (unsigned looks = 0; looks < kMaxLooks; ++looks) {
    const unsigned missing = warp_least(walker.done() ? ~0u : walker.step(found));
    if (missing == ~0u) return;
    if (missing == 0) looks = 0;
  }
  args.findings->stuck = 1;
}

/// @param lanes that each warp uses: the lowest ones
template <bool kFactors>
__global__ void __launch_bounds__(kSweepThreads)
    sweep_rows(const __grid_constant__ RowSweepArgs args, unsigned main_blocks, unsigned lanes) {
  extern __shared__ unsigned long long largest[];
  for (unsigned i = threadIdx.x; i < args.iterations; i += kSweepThreads) largest[i] = 0;
  __syncthreads();
  BlockFound found{largest};
  const bool pushes = blockIdx.x >= main_blocks;
  const unsigned blocks = pushes ? gridDim.x - main_blocks : main_blocks;
  const unsigned block = pushes ? blockIdx.x - main_blocks : blockIdx.x;
  const unsigned warp = block * kWarpsABlock + threadIdx.x / 32;
  const unsigned thread = lane_id() < lanes ? warp * lanes + lane_id() : ~0u;
  const unsigned threads = blocks * kWarpsABlock * lanes;
  if (pushes) {
    walk<kFactors, true>(args, thread, threads, &found);
  } else {
    walk<kFactors, false>(args, thread, threads, &found);
  }
  if (found.is_broken) args.findings->broken = 1;
  __syncthreads();
  unsigned long long* const all = args.findings->largest() + (pushes ? args.iterations : 0);
  for (unsigned i = threadIdx.x; i < args.iterations; i += kSweepThreads) {
    if (largest[i] != 0) atomicMax(all + i, largest[i]);
  }
}

__global__ void __launch_bounds__(kSetUpThreads)
    set_up_rows(const __grid_constant__ RowSweepArgs args) {
  wait_for_previous_kernel();
  const unsigned place = blockIdx.x * kSetUpThreads + threadIdx.x;
  const bool pushes = place < args.group.main.count && rows::set_up_place(args.group, place);
  const unsigned count = static_cast<unsigned>(__popc(__ballot_sync(kFullWarp, pushes)));
  if (lane_id() == 0 && count > 0) atomicAdd(&args.findings->pushing, count);
}

__global__ void __launch_bounds__(kSetUpThreads)
    finish_rows(const __grid_constant__ RowSweepArgs args) {
  wait_for_previous_kernel();
  const unsigned i = blockIdx.x * kSetUpThreads + threadIdx.x;
  bool fine = true;
  if (i < args.group.main.count) fine &= rows::finish_place(args.group, i);
  if (i < args.group.bodies_count) fine &= rows::finish_body(args.group, i);
  if (!fine) args.findings->broken = 1;
}

unsigned blocks_for(std::size_t count, unsigned threads) {
  return static_cast<unsigned>((count + threads - 1) / threads);
}
std::size_t shared_bytes(std::uint32_t iterations) {
  return iterations * sizeof(unsigned long long);
}

}  // namespace

void launch_row_setup(const RowSweepArgs& args, cudaStream_t stream) {
  const std::size_t bytes =
      std::size_t{args.group.bodies_count} * rows::kBodyCells * sizeof(rows::Cell);
  JFPX_CUDA_TRY(cudaMemsetAsync(args.group.main.cells, 0, bytes, stream));
  JFPX_CUDA_TRY(cudaMemsetAsync(args.group.push.cells, 0, bytes, stream));
  JFPX_CUDA_TRY(cudaMemsetAsync(args.findings, 0,
                                RowFindings::bytes(static_cast<int>(args.iterations)), stream));
  launch(set_up_rows, blocks_for(args.group.main.count, kSetUpThreads), 1, kSetUpThreads, stream,
         args);
}

unsigned most_row_blocks(int device) {
  int processors = 0, least = 0;
  JFPX_CUDA_TRY(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
  for (const auto kernel : {sweep_rows<false>, sweep_rows<true>}) {
    int blocks = 0;
    // With room for what the most iterations need.
    JFPX_CUDA_TRY(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kSweepThreads,
                                                                shared_bytes(1024)));
    least = least == 0 ? blocks : std::min(least, blocks);
  }
  return static_cast<unsigned>(processors * least);
}

// If there are more contacts than threads, both programs get their share of the threads.
void launch_row_sweeps(const RowSweepArgs& args, unsigned most_blocks, cudaStream_t stream) {
  const std::size_t main = args.group.main.count;
  const std::size_t push = args.push.iterations > 0 ? args.group.push.count : 0;
  const std::size_t warps = std::size_t{most_blocks} * kWarpsABlock;
  unsigned lanes = 1;
  while (lanes < 32 && main + push > warps * lanes * kContactsALane) lanes *= 2;
  const unsigned per_block = kWarpsABlock * lanes;
  unsigned main_blocks = blocks_for(main, per_block);
  unsigned push_blocks = blocks_for(push, per_block);
  if (main_blocks + push_blocks > most_blocks) {
    push_blocks =
        static_cast<unsigned>(std::size_t{push_blocks} * most_blocks / (main_blocks + push_blocks));
    if (push > 0) push_blocks = std::max(push_blocks, 1u);
    main_blocks = std::min(main_blocks, most_blocks - push_blocks);
  }
  RowSweepArgs copy = args;
  void* parameters[] = {&copy, &main_blocks, &lanes};
  const auto kernel = args.group.factors != nullptr ? sweep_rows<true> : sweep_rows<false>;
  JFPX_CUDA_TRY(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(kernel),
                                            dim3(main_blocks + push_blocks), dim3(kSweepThreads),
                                            parameters, shared_bytes(args.iterations), stream));
}

void launch_row_finish(const RowSweepArgs& args, cudaStream_t stream) {
  const std::size_t count = std::max<std::size_t>(args.group.main.count, args.group.bodies_count);
  launch(finish_rows, blocks_for(count, kSetUpThreads), 1, kSetUpThreads, stream, args);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
