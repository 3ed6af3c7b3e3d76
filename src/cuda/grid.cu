/// Large N: spheres in the cells of a hierarchy of grids, by counting sort; only neighbouring cells
/// are looked at. No world bounds, no cell size to choose, any mix of radii.
#include "src/cuda/grid_build.cuh"
#include "src/cuda/grid_emit.cuh"
#include "src/cuda/grid_search.cuh"

#include <algorithm>
#include <cooperative_groups.h>

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

namespace cg = cooperative_groups;

// --- all phases in one launch: up to some 10^5 spheres, where launches would take most of the time

constexpr unsigned kBlocksPerMultiprocessor = sizeof(Real) == 4 ? 4 : 3;

union PhaseStorage {
  BuildStorage build;
  SearchStorage<true> dense_search;
  SearchStorage<false> search;
  EmitStorage emit;
  CrowdedStorage crowded;
};

__global__ void __launch_bounds__(kGridThreads, kBlocksPerMultiprocessor)
    grid_search(const __grid_constant__ GridArgs args,
                const __grid_constant__ SearchOutput output) {
  __shared__ PhaseStorage storage;
  __shared__ GridPlan plan;
  const cg::grid_group grid = cg::this_grid();
  const bool one = blockIdx.x == 0 && threadIdx.x == 0;

  measure(args, storage.build);
  grid.sync();
  if (args.state->valid_before != 0) {
    if (one) write_count(output, 0, first_invalid(args.state), false);
    return;
  }
  if (needs_sample(*args.state)) {
    sample_cells(args, storage.build);
    grid.sync();
  }
  make_plan(args, plan);
  assign(args, plan);
  grid.sync();
  sum_table(args, plan, storage.build);
  grid.sync();
  scan_table(args, plan, storage.build);
  grid.sync();
  scatter(args, true);
  grid.sync();
  if (plan.dense) {
    Searcher<true>(args, plan, storage.dense_search).run();
  } else {
    Searcher<false>(args, plan, storage.search).run();
  }
  grid.sync();
  const bool complete = is_complete(args, output);
  if (one) write_count(output, args.state->contacts, kNoSphere, complete);
  if (!complete) return;
  sum_counts(args, storage.emit);
  grid.sync();
  emit(args, output, storage.emit);
  if (args.state->overflow == 0) return;
  grid.sync();
  place_overflow(args);
  grid.sync();
  emit_crowded(args, output, storage.crowded);
}

void launch_cooperative(const GridArgs& args, const SearchOutput& output, unsigned most_blocks,
                        cudaStream_t stream) {
  GridArgs shared_out = args;
  // While there are threads to spare, several share a sphere: half the device is enough.
  const std::uint64_t threads = std::uint64_t{most_blocks} * kGridThreads / 2;
  while (shared_out.lanes < 8 && 2 * shared_out.lanes * std::uint64_t{args.n} <= threads) {
    shared_out.lanes *= 2;
  }
  const std::uint64_t wanted = (shared_out.lanes * std::uint64_t{args.n} - 1) / kGridThreads + 1;
  cudaLaunchAttribute cooperative{};
  cooperative.id = cudaLaunchAttributeCooperative;
  cooperative.val.cooperative = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = static_cast<unsigned>(std::min<std::uint64_t>(wanted, most_blocks));
  config.blockDim = kGridThreads;
  config.stream = stream;
  config.attrs = &cooperative;
  config.numAttrs = 1;
  JFPX_CUDA_TRY(cudaLaunchKernelEx(&config, grid_search, shared_out, output));
}

// --- a launch a phase: more spheres, each phase with as many threads as it can have

template <auto kPhase>
__global__ void __launch_bounds__(kGridThreads) build_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ BuildStorage storage;
  kPhase(args, storage);
}

__device__ bool is_valid_input(const GridArgs& args) { return args.state->valid_before == 0; }

__device__ void sample_phase(const GridArgs& args, BuildStorage& s) {
  if (is_valid_input(args) && needs_sample(*args.state)) sample_cells(args, s);
}

/// By one block.
__global__ void __launch_bounds__(kGridThreads) plan_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  if (!is_valid_input(args)) return;
  make_plan(args, plan);
  if (threadIdx.x == 0) *args.plan = plan;
}

template <auto kPhase>
__global__ void __launch_bounds__(kGridThreads) planned_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  __shared__ BuildStorage storage;
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  kPhase(args, plan, storage);
}

__device__ void assign_phase(const GridArgs& args, const GridPlan& plan, BuildStorage&) {
  assign(args, plan);
}

template <auto kPhase>
__global__ void __launch_bounds__(kGridThreads) sort_phase(GridArgs args) {
  wait_for_previous_kernel();
  if (is_valid_input(args)) kPhase(args);
}
__device__ void scatter_ids(const GridArgs& args) { scatter(args, false); }

constexpr unsigned kSearchBlocks = sizeof(Real) == 4 ? 5 : 3;  // of a multiprocessor

template <bool kDense>
__global__ void __launch_bounds__(kGridThreads, kSearchBlocks) search_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ SearchStorage<kDense> storage;
  __shared__ GridPlan plan;
  if (!is_valid_input(args) || args.plan->dense != kDense) return;
  copy_plan(args, plan);
  Searcher<kDense>(args, plan, storage).run();
}

__global__ void __launch_bounds__(kGridThreads) sum_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ EmitStorage storage;
  const bool complete = is_valid_input(args) && is_complete(args, output);
  if (blockIdx.x == 0 && threadIdx.x == 0) {
    write_count(output, args.state->contacts, first_invalid(args.state), complete);
  }
  if (complete) sum_counts(args, storage);
}

__global__ void __launch_bounds__(kGridThreads) emit_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ EmitStorage storage;
  if (is_valid_input(args) && is_complete(args, output)) emit(args, output, storage);
}

__device__ bool has_crowded(const GridArgs& args, const SearchOutput& output) {
  return args.state->overflow != 0 && is_valid_input(args) && is_complete(args, output);
}
__global__ void __launch_bounds__(kGridThreads) overflow_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  if (has_crowded(args, output)) place_overflow(args);
}
__global__ void __launch_bounds__(kGridThreads) crowded_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ CrowdedStorage storage;
  if (has_crowded(args, output)) emit_crowded(args, output, storage);
}

void launch_phases(const GridArgs& args, const SearchOutput& output, cudaStream_t stream) {
  constexpr unsigned kFew = 132 * 4, kMany = kMostGridBlocks;
  const auto run = [&](auto kernel, unsigned blocks, const auto&... arguments) {
    launch(kernel, blocks, 1, kGridThreads, stream, arguments...);
  };
  const auto chunks = static_cast<unsigned>((std::uint64_t{args.n} - 1) / kGridThreads + 1);
  run(build_phase<measure>, kFew, args);
  run(build_phase<sample_phase>, kLastLevel + 1, args);
  run(plan_phase, 1, args);
  run(planned_phase<assign_phase>, kFew, args);
  run(planned_phase<sum_table>, kFew, args);
  run(planned_phase<scan_table>, kFew, args);
  run(sort_phase<scatter_ids>, kMany, args);
  run(sort_phase<gather>, kMany, args);
  run(search_phase<true>, chunks, args);
  run(search_phase<false>, chunks, args);
  run(sum_phase, kMany, args, output);
  run(emit_phase, kMany, args, output);
  run(overflow_phase, kFew, args, output);
  run(crowded_phase, kFew, args, output);
}

/// Up to here all phases are one launch (measured on an H200: bench/results).
constexpr std::uint32_t kMostCooperative = 1 << 18;

}  // namespace

unsigned most_grid_blocks(int device) {
  int per_multiprocessor = 0, multiprocessors = 0;
  JFPX_CUDA_TRY(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per_multiprocessor, grid_search,
                                                              kGridThreads, 0));
  JFPX_CUDA_TRY(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  return std::min(static_cast<unsigned>(per_multiprocessor * multiprocessors), kMostGridBlocks);
}

std::size_t grid_plan_bytes() { return sizeof(GridPlan); }

void launch_grid_search(const GridArgs& args, const SearchOutput& output, unsigned most_blocks,
                        cudaStream_t stream) {
  if (args.n <= kMostCooperative) {
    launch_cooperative(args, output, most_blocks, stream);
  } else {
    launch_phases(args, output, stream);
  }
}

}  // namespace jfpx::inline JFPX_ABI::cuda
