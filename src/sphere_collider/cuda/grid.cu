/// Grid search in several launches. A counting sort puts the spheres into the cells of a hierarchy
/// of grids, and each sphere is tested against the spheres of neighboring cells. Neither world
/// bounds nor a cell size are configured, and radii may differ by any factor. Each phase is a
/// launch with its own number of threads.
#include "src/sphere_collider/cuda/grid_build.cuh"
#include "src/sphere_collider/cuda/grid_crowded.cuh"
#include "src/sphere_collider/cuda/grid_emit.cuh"
#include "src/sphere_collider/cuda/grid_one_launch.hpp"
#include "src/sphere_collider/cuda/grid_search.cuh"
#include "src/sphere_collider/cuda/grid_single_level.cuh"
#include "src/sphere_collider/cuda/grid_sort.cuh"

#include <algorithm>
#include <bit>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// Dynamic shared memory of a block.
extern __shared__ __align__(32) unsigned char dynamic_storage[];

__device__ bool is_valid_input(const GridArgs& args) { return args.state->valid_before == 0; }

__global__ void __launch_bounds__(kGridThreads) measure_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ BuildStorage storage;
  clear(args.table.coarse->counts, sizeof(args.table.coarse->counts));
  clear(args.rows.bin_sums, bins_of(args) * sizeof(*args.rows.bin_sums));
  measure(args, storage);
}

constexpr unsigned kPlanThreads = 1024;

/// Samples the cells. The last block to finish computes the plan.
__global__ void __launch_bounds__(kPlanThreads) plan_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ BuildStorage storage;
  __shared__ GridPlan plan;
  if (!is_valid_input(args)) return;
  if (needs_sample(*args.state)) sample_cells(args, storage);
  if (!is_last_block(args.state->blocks_sampled)) return;
  make_plan(args, plan);
  if (threadIdx.x == 0) *args.plan = plan;
}

__global__ void __launch_bounds__(kCountThreads) coarse_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  __shared__ std::uint32_t counts[kCoarseBuckets];
  __shared__ CountSumStorage<kCountThreads> sums;
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  if (!plan.single) clear_counts(args);
  count_coarse(args, plan, counts, sums);
}

template <bool kLarge>
__global__ void __launch_bounds__(TileStorage<kLarge>::kThreads, 1)
    partition_phase(GridArgs args, unsigned size) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  __shared__ CountSumStorage<TileStorage<kLarge>::kThreads> sums;
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  partition(args, plan, size, *reinterpret_cast<TileStorage<kLarge>*>(dynamic_storage), sums);
}

template <unsigned kThreads>
__global__ void __launch_bounds__(kThreads, kThreads == 512 ? kSortBlocks : 1)
    sort_phase(GridArgs args, SortCapacity capacity) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  __shared__ CountSumStorage<kThreads> sums;
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  sort_coarse<kThreads>(args, plan, capacity, sort_storage(dynamic_storage, capacity), sums);
}

/// Searches on a single level, or prepares the search of crowded spheres.
template <bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads, kSearchBlocks)
    single_level_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ SingleLevelStorage storage[kGridWarps];
  if (!is_valid_input(args) || !args.plan->single) return;
  if (args.plan->ordered) order_cells(args, *args.plan);
  if (args.plan->crowded) return;
  SingleLevelSearcher<kPeriodic>(args, output, *args.plan, storage[threadIdx.x / 32])
      .run(blockIdx.x * kGridThreads + threadIdx.x);
}

template <bool kPeriodic, bool kOrdered>
__device__ void search_crowded(const GridArgs& args, const SearchOutput& output,
                               CrowdedStorage& storage) {
  using Searcher = CrowdedSearcher<kPeriodic, kOrdered>;
  Searcher searcher(args, output, *args.plan, storage);
  const std::uint32_t position = blockIdx.x * kGridThreads + threadIdx.x - lane_id();
  for (std::uint32_t k = 0; k < 32; k += Searcher::kQueries) {
    if (position + k < args.input.n) searcher.run(position + k);
  }
}

template <bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads, kCrowdedBlocks)
    crowded_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ CrowdedStorage storage[kGridWarps];
  if (!is_valid_input(args) || !args.plan->crowded) return;
  if (args.plan->ordered) {
    search_crowded<kPeriodic, true>(args, output, storage[threadIdx.x / 32]);
  } else {
    search_crowded<kPeriodic, false>(args, output, storage[threadIdx.x / 32]);
  }
}

/// Searches on several levels. After a search on a single level, the kernel for hashed cells stages
/// the rows that are left.
template <bool kDense, bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads, kLevelBlocks<kDense>)
    search_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  union Storage {
    SearchStorage<kDense> search;
    RowStorage rows[kGridWarps];
  };
  __shared__ Storage storage;
  __shared__ GridPlan plan;
  if (!is_valid_input(args)) return;
  if (args.plan->single) {
    if constexpr (!kDense) {
      stage_rows_again<kPeriodic, 2>(args, output, *args.plan, storage.rows[threadIdx.x / 32]);
    }
    return;
  }
  if (args.plan->dense != kDense) return;
  copy_plan(args, plan);
  Searcher<kDense, kPeriodic>(args, plan, storage.search).run();
}

__global__ void __launch_bounds__(kGridThreads) sum_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ EmitStorage storage;
  const bool complete = is_valid_input(args) && is_complete(args, output);
  if (blockIdx.x == 0 && threadIdx.x == 0) {
    write_count(output, contacts_found(*args.state), first_invalid(args.state), complete);
  }
  if (!complete) return;
  if (args.plan->single) {
    sum_bins(args);
  } else {
    sum_counts(args, storage);
  }
}

template <bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads, kCopyBlocks<kPeriodic>)
    copy_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ CopyStorage storage;
  if (!is_valid_input(args) || !args.plan->single || !is_complete(args, output)) return;
  if (blockIdx.x == 0 && threadIdx.x == 0 && writes_shifts<kPeriodic>(args, output)) {
    args.input.periodic.known->shifts_are_written = true;
  }
  const unsigned long long before = contacts_before(args, blockIdx.x, storage);
  copy_bin<kPeriodic>(args, with_row_length(args, output), blockIdx.x, before, storage);
  __syncthreads();
  if (args.state->overflow != 0) defer_long_rows(args, blockIdx.x, before, storage);
}

__global__ void __launch_bounds__(kGridThreads) emit_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ EmitStorage storage;
  if (!is_valid_input(args) || args.plan->single || !is_complete(args, output)) return;
  emit(args, with_row_length(args, output), storage);
}

__device__ bool has_long_rows(const GridArgs& args, const SearchOutput& output) {
  return args.state->overflow != 0 && is_valid_input(args) && is_complete(args, output);
}
template <bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads) list_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  if (!has_long_rows(args, output)) return;
  if (args.plan->single) {
    list_long_rows<kPeriodic, 4>(args, *args.plan);
  } else {
    place_overflow(args);
  }
}
template <bool kPeriodic>
__global__ void __launch_bounds__(kGridThreads) long_row_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ LongRowStorage storage;
  if (has_long_rows(args, output)) {
    emit_long_rows<kPeriodic>(args, with_row_length(args, output), storage);
  }
}

/// Launches a kernel with more shared memory than the default limit of a block. The limit is an
/// attribute of the kernel that other threads may set at the same time, so `max_bytes` must be the
/// same for all launches on a device.
template <typename... Parameters, typename... Arguments>
void launch_large(std::size_t max_bytes, std::size_t bytes, void (*kernel)(Parameters...),
                  unsigned blocks, unsigned threads, cudaStream_t stream,
                  const Arguments&... arguments) {
  JFPX_CUDA_TRY(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                     static_cast<int>(max_bytes)));
  launch_sharing(bytes, kernel, blocks, 1, threads, stream, arguments...);
}

/// A multiprocessor runs one block at a time: all get the same number of tiles, of equal size.
template <bool kLarge>
void launch_partition(const GridArgs& args, std::size_t max_bytes, unsigned multiprocessors,
                      cudaStream_t stream) {
  using Tile = TileStorage<kLarge>;
  const unsigned fewest = (args.input.n - 1) / Tile::kSpheres + 1,
                 most = (fewest - 1) / multiprocessors * multiprocessors + multiprocessors,
                 size = fewest <= multiprocessors ? Tile::kSpheres : (args.input.n - 1) / most + 1;
  launch_large(max_bytes, sizeof(Tile), partition_phase<kLarge>, (args.input.n - 1) / size + 1,
               Tile::kThreads, stream, args, size);
}

void launch_sort(const GridArgs& args, const GridLimits& limits, cudaStream_t stream) {
  constexpr std::size_t kOthers = 2048;  // bytes of static shared memory, at most
  const std::size_t max_bytes = limits.shared_bytes - kOthers;
  launch(coarse_phase, limits.multiprocessors, 1, kCountThreads, stream, args);
  if (sizeof(TileStorage<true>) <= max_bytes) {
    launch_partition<true>(args, max_bytes, limits.multiprocessors, stream);
  } else {
    launch_partition<false>(args, max_bytes, limits.multiprocessors, stream);
  }
  // If the spheres are distributed evenly, a coarse bucket has n / coarse_buckets to twice as many
  // spheres. If n / coarse_buckets spheres do not fit into shared memory, none are copied there,
  // which leaves more shared memory for buckets.
  constexpr std::uint32_t kMaxBuckets = 8192, kMaxSpheres = (1 << 16) - 4;
  const std::uint32_t buckets = args.table.size / args.table.coarse_buckets,
                      spheres = args.input.n / args.table.coarse_buckets;
  SortCapacity capacity{std::clamp(buckets, 4u, kMaxBuckets), 0};
  const auto fitting =
      static_cast<std::uint32_t>((max_bytes - capacity.bytes()) / SortCapacity{0, 1}.bytes());
  if (spheres <= fitting) {
    capacity.spheres = std::min({fitting, 4 * spheres, kMaxSpheres}) / 4 * 4;
  } else {
    capacity.buckets =
        std::min(buckets, static_cast<std::uint32_t>(max_bytes / sizeof(std::uint32_t)));
    capacity.buckets = capacity.buckets / 4 * 4;
  }
  if (spheres > 2048) {
    launch_large(max_bytes, capacity.bytes(), sort_phase<1024>, args.table.coarse_buckets, 1024,
                 stream, args, capacity);
  } else {
    launch_large(max_bytes, capacity.bytes(), sort_phase<512>, args.table.coarse_buckets, 512,
                 stream, args, capacity);
  }
}

template <bool kPeriodic>
void launch_phases(const GridArgs& args, const SearchOutput& output, const GridLimits& limits,
                   cudaStream_t stream) {
  const auto run = [&](auto kernel, unsigned blocks, const auto&... arguments) {
    launch(kernel, blocks, 1, kGridThreads, stream, arguments...);
  };
  const unsigned multiprocessors = limits.multiprocessors, few_blocks = 4 * multiprocessors,
                 many_blocks = limits.max_blocks();
  const auto chunks_of = [](std::uint32_t n) {
    return static_cast<unsigned>((std::uint64_t{n} - 1) / kGridThreads + 1);
  };
  const unsigned chunks = chunks_of(args.input.n);
  JFPX_CUDA_TRY(cudaMemsetAsync(args.state, 0, sizeof(SearchState), stream));
  run(measure_phase, few_blocks, args);
  launch(plan_phase, kLastLevel + 1, 1, kPlanThreads, stream, args);
  launch_sort(args, limits, stream);
  run(single_level_phase<kPeriodic>, chunks, args, output);
  run(crowded_phase<kPeriodic>, chunks, args, output);
  run(search_phase<true, kPeriodic>, std::min(chunks, multiprocessors * kLevelBlocks<true>), args,
      output);
  run(search_phase<false, kPeriodic>, std::min(chunks, multiprocessors * kLevelBlocks<false>), args,
      output);
  run(sum_phase, many_blocks, args, output);
  run(copy_phase<kPeriodic>, chunks_of(args.input.rows()), args, output);
  run(emit_phase, many_blocks, args, output);
  run(list_phase<kPeriodic>, few_blocks, args, output);
  run(long_row_phase<kPeriodic>, 6 * multiprocessors, args, output);
}

constexpr std::size_t rounded(std::size_t bytes) { return (bytes + 255) / 256 * 256; }

}  // namespace

std::size_t grid_plan_bytes() { return sizeof(GridPlan); }

std::size_t grid_scratch_bytes(std::size_t n, std::size_t capacity) {
  const std::size_t slots = kDirectSlots * std::min<std::size_t>(n, kMaxDirect);
  const std::size_t cells = rounded(slots * sizeof(SphereInstance)) + slots * sizeof(std::uint32_t);
  const std::size_t partitioned = rounded(n * sizeof(SphereInstance)) + n * sizeof(std::uint32_t);
  const std::size_t neighbors = n * kSlots * sizeof(std::uint32_t);
  const std::size_t staged = std::min(n * kMaxStaged, capacity) * sizeof(SphereContact);
  return std::max({cells, partitioned, neighbors, staged}) + 256;
}

GridArgs::Scratch grid_scratch(std::uint32_t n, unsigned char* memory) {
  GridArgs::Scratch scratch{};
  scratch.neighbors = reinterpret_cast<std::uint32_t*>(memory);
  scratch.staging = reinterpret_cast<SphereContact*>(memory);
  scratch.partitioned = reinterpret_cast<SphereInstance*>(memory);
  scratch.partitioned_ids =
      reinterpret_cast<std::uint32_t*>(memory + rounded(n * sizeof(SphereInstance)));
  if (n > kMaxDirect) return scratch;
  scratch.slots = reinterpret_cast<SphereInstance*>(memory);
  scratch.slot_ids = reinterpret_cast<std::uint32_t*>(
      memory + rounded(std::size_t{kDirectSlots} * n * sizeof(SphereInstance)));
  return scratch;
}

GridLimits grid_limits(int device) {
  int multiprocessors = 0, shared_bytes = 0;
  JFPX_CUDA_TRY(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  JFPX_CUDA_TRY(
      cudaDeviceGetAttribute(&shared_bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  GridLimits limits{};
  limits.multiprocessors = static_cast<unsigned>(multiprocessors);
  limits.resident_blocks = resident_grid_blocks(limits.multiprocessors);
  limits.shared_bytes = static_cast<std::size_t>(shared_bytes);
  return limits;
}

bool is_in_one_launch(std::size_t n) { return n <= kMaxInOneLaunch; }

void launch_grid_search(const GridArgs& args, const SearchOutput& output, const GridLimits& limits,
                        cudaStream_t stream) {
  if (args.input.is_periodic() ? args.input.periodic.is_one_launch
                               : is_in_one_launch(args.input.n)) {
    launch_in_one(args, output, limits.resident_blocks, stream);
  } else {
    GridArgs phased = args;
    phased.table.coarse_buckets =
        std::clamp(std::bit_ceil(args.input.n / kSpheresOfCoarse), kFewestCoarse, kCoarseBuckets);
    if (args.input.is_periodic()) {
      launch_phases<true>(phased, output, limits, stream);
    } else {
      launch_phases<false>(phased, output, limits, stream);
    }
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
