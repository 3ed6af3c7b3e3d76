/// Grid search in one cooperative launch, for up to some 10^5 spheres, where the overhead of
/// several launches would dominate the time.
#include "src/sphere_collider/cuda/grid_build.cuh"
#include "src/sphere_collider/cuda/grid_crowded.cuh"
#include "src/sphere_collider/cuda/grid_direct.cuh"
#include "src/sphere_collider/cuda/grid_emit.cuh"
#include "src/sphere_collider/cuda/grid_one_launch.hpp"
#include "src/sphere_collider/cuda/grid_search.cuh"

#include <algorithm>
#include <cooperative_groups.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

namespace cg = cooperative_groups;

union PhaseStorage {
  BuildStorage build;
  DirectStorage direct;
  SearchStorage<true> dense_search;
  SearchStorage<false> search;
  EmitStorage emit;
  LongRowStorage long_rows;
  CrowdedStorage crowded[kGridWarps];
  SingleLevelStorage single[kGridWarps];
  RowStorage rows[kGridWarps];
  CopyStorage copy;
};

/// The state of this search. Call before the first grid barrier.
__device__ SearchState* current_state(AlternatingStates& states) {
  return states.states + states.searches % 2;
}
/// Clears the state of the next search. Call from one thread, after the first grid barrier.
__device__ void clear_next_state(AlternatingStates& states) {
  states.states[++states.searches % 2] = {};
}

/// Performs the direct search, if it applies.
/// @return whether it has written the result.
template <bool kPeriodic>
__device__ bool search_without_sorting(const GridArgs& args, const SearchOutput& output,
                                       DirectStorage& storage, const cg::grid_group& grid) {
  const DirectPlan plan = make_direct_plan(args);
  if (plan.cell_slots == 0) return false;
  insert(args, plan);
  grid.sync();
  if (args.state->cell_is_full == 0) {
    find_directly<kPeriodic>(args, plan, storage);
    grid.sync();
    if (args.state->block_is_full == 0) {
      emit_directly(args, output, storage);
      return true;
    }
  }
  clear_table(args);
  grid.sync();
  return false;
}

/// The phases after the sort, for searches that stage rows.
template <bool kPeriodic>
__device__ void search_and_copy(const GridArgs& args, const SearchOutput& output,
                                const GridPlan& plan, PhaseStorage& storage,
                                const cg::grid_group& grid) {
  const unsigned warp = threadIdx.x / 32;
  const std::uint64_t warps = std::uint64_t{kGridWarps} * gridDim.x,
                      first_warp = kGridWarps * blockIdx.x + warp;
  const auto search_crowded = [&]<bool kOrdered>(std::bool_constant<kOrdered>) {
    using Searcher = CrowdedSearcher<kPeriodic, kOrdered>;
    Searcher searcher(args, output, plan, storage.crowded[warp]);
    const std::uint32_t groups = (args.input.n - 1) / Searcher::kQueries + 1;
    for (auto group = static_cast<std::uint32_t>(first_warp); group < groups;) {
      std::uint32_t taken = 0;  // known after the search
      if (kOrdered && lane_id() == 0) taken = atomicAdd(&args.state->groups_taken, 1u);
      searcher.run(Searcher::kQueries * group);
      // The atomics are worth their time only for long searches.
      group =
          static_cast<std::uint32_t>(warps) + (kOrdered ? __shfl_sync(kFullWarp, taken, 0) : group);
    }
  };
  if (plan.ordered) {
    search_crowded(std::bool_constant<true>());
  } else if (plan.crowded) {
    search_crowded(std::bool_constant<false>());
  } else if constexpr (kPeriodic) {
    for (std::uint64_t first = 32 * first_warp; first < args.input.n; first += 32 * warps) {
      SingleLevelSearcher<true>(args, output, plan, storage.single[warp])
          .run(static_cast<std::uint32_t>(first) + lane_id());
    }
  }
  grid.sync();
  if (args.state->rows_again != 0) {
    stage_rows_again<kPeriodic, 1>(args, output, plan, storage.rows[warp]);
    grid.sync();
  }
  const bool complete = is_complete(args, output);
  if (blockIdx.x == 0 && threadIdx.x == 0) {
    write_count(output, contacts_found(*args.state), kNoSphere, complete);
  }
  if (!complete) return;
  const SearchOutput known = with_row_length(args, output);
  if (blockIdx.x == 0 && threadIdx.x == 0 && writes_shifts<kPeriodic>(args, output)) {
    args.input.periodic.known->shifts_are_written = true;
  }
  copy_bins<kPeriodic>(args, known, storage.copy);
  if (args.state->overflow == 0) return;
  grid.sync();
  visit_bins(args, 1, storage.copy,
             [&](std::uint32_t bin, unsigned long long before, const BinPart&) {
               return defer_long_rows(args, bin, before, storage.copy);
             });
  grid.sync();
  list_long_rows<kPeriodic, 1>(args, plan);
  grid.sync();
  emit_long_rows<kPeriodic>(args, known, storage.long_rows);
}

/// The phases after the sort, for searches that count the pairs of each sphere.
__device__ void search_and_emit(const GridArgs& args, const SearchOutput& output,
                                const GridPlan& plan, PhaseStorage& storage,
                                const cg::grid_group& grid) {
  if (plan.dense) {
    Searcher<true, false>(args, plan, storage.dense_search).run();
  } else {
    Searcher<false, false>(args, plan, storage.search).run();
  }
  grid.sync();
  const bool complete = is_complete(args, output);
  if (blockIdx.x == 0 && threadIdx.x == 0) {
    write_count(output, args.state->contacts, kNoSphere, complete);
  }
  if (!complete) return;
  const SearchOutput known = with_row_length(args, output);
  sum_counts(args, storage.emit);
  grid.sync();
  emit(args, known, storage.emit);
  if (args.state->overflow == 0) return;
  grid.sync();
  place_overflow(args);
  grid.sync();
  emit_long_rows<false>(args, known, storage.long_rows);
}

template <bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads, kOneLaunchBlocks)
    grid_search(const __grid_constant__ GridArgs arguments,
                const __grid_constant__ SearchOutput output) {
  __shared__ PhaseStorage storage;
  __shared__ GridPlan plan;
  const cg::grid_group grid = cg::this_grid();
  const bool one = blockIdx.x == 0 && threadIdx.x == 0;
  GridArgs args = arguments;
  if (kPeriodic && args.input.periodic.is_one_launch) args.input.n = args.input.periodic.known->n;
  if (kPeriodic && args.input.n == 0) {
    if (one) write_count(output, 0, 0, false);
    return;
  }
  args.state = current_state(*args.states);

  clear_table(args);
  clear_counts(args);
  clear(args.rows.bin_sums, bins_of(args) * sizeof(*args.rows.bin_sums));
  measure(args, storage.build);
  grid.sync();
  if (one) clear_next_state(*args.states);
  if (args.state->valid_before != 0) {
    if (one) write_count(output, 0, first_invalid(args.state), false);
    return;
  }
  if (needs_sample(*args.state)) {
    sample_cells(args, storage.build);
    grid.sync();
  }
  if (search_without_sorting<kPeriodic>(args, output, storage.direct, grid)) return;
  make_plan(args, plan);
  if (kPeriodic && !plan.single) {  // see PeriodicInput::is_one_launch
    if (one) write_count(output, 0, 0, false);
    return;
  }
  assign(args, plan);
  grid.sync();
  sum_table(args, plan, storage.build);
  grid.sync();
  scan_table(args, plan, storage.build);
  grid.sync();
  scatter(args);
  grid.sync();
  if (plan.ordered) {
    order_cells(args, plan);
    grid.sync();
  }
  if (kPeriodic || plan.crowded) {
    search_and_copy<kPeriodic>(args, output, plan, storage, grid);
  } else {
    search_and_emit(args, output, plan, storage, grid);
  }
}
using Kernel = void(GridArgs, SearchOutput);

}  // namespace

unsigned resident_grid_blocks(unsigned multiprocessors) {
  const auto per_multiprocessor = [](Kernel* kernel) {
    int blocks = 0;
    JFPX_CUDA_TRY(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, kGridThreads, 0));
    return static_cast<unsigned>(blocks);
  };
  return multiprocessors *
         std::min(per_multiprocessor(grid_search<false>), per_multiprocessor(grid_search<true>));
}

void launch_in_one(const GridArgs& args, const SearchOutput& output, unsigned max_blocks,
                   cudaStream_t stream) {
  GridArgs shared_out = args;
  // Up to 8 threads share a sphere, as long as they are no more than half of the resident threads.
  const std::uint64_t threads = std::uint64_t{max_blocks} * kGridThreads / 2;
  while (shared_out.lanes < 8 && 2 * shared_out.lanes * std::uint64_t{args.input.n} <= threads) {
    shared_out.lanes *= 2;
  }
  std::uint64_t wanted = (shared_out.lanes * std::uint64_t{args.input.n} - 1) / kGridThreads + 1;
  if (args.scratch.slots != nullptr) {
    wanted = (std::uint64_t{args.input.n} - 1) / (kGridWarps * kSpheresOfWarp) + 1;
  }
  cudaLaunchAttribute cooperative{};
  cooperative.id = cudaLaunchAttributeCooperative;
  cooperative.val.cooperative = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = static_cast<unsigned>(std::min<std::uint64_t>(wanted, max_blocks));
  config.blockDim = kGridThreads;
  config.stream = stream;
  config.attrs = &cooperative;
  config.numAttrs = 1;
  Kernel* const kernel = args.input.is_periodic() ? grid_search<true> : grid_search<false>;
  JFPX_CUDA_TRY(cudaLaunchKernelEx(&config, kernel, shared_out, output));
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
