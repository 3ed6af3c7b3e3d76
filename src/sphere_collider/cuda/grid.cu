/// Large N: spheres in the cells of a hierarchy of grids, sorted by counting; only neighbouring
/// cells are looked at. No world bounds, no cell size to choose, any mix of radii. A launch a
/// phase, each with as many threads as it can have.
#include "src/sphere_collider/cuda/grid_build.cuh"
#include "src/sphere_collider/cuda/grid_emit.cuh"
#include "src/sphere_collider/cuda/grid_launch.hpp"
#include "src/sphere_collider/cuda/grid_neighbours.cuh"
#include "src/sphere_collider/cuda/grid_search.cuh"
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
  clear(args.coarse->counts, sizeof(args.coarse->counts));
  clear(args.bin_sums, bins_of(args.n) * sizeof(*args.bin_sums));
  measure(args, storage);
}

constexpr unsigned kPlanThreads = 1024;

/// The last block makes the plan.
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
  __shared__ unsigned long long warp_sums[kCountThreads / 32];
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  if (!plan.single) clear_counts(args);
  count_coarse(args, plan, counts, warp_sums);
}

template <bool kLarge>
__global__ void __launch_bounds__(TileStorage<kLarge>::kThreads, 1) part_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  __shared__ unsigned long long warp_sums[TileStorage<kLarge>::kThreads / 32];
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  part(args, plan, *reinterpret_cast<TileStorage<kLarge>*>(dynamic_storage), warp_sums);
}

/// Blocks of 512 threads on a multiprocessor: as its shared memory has it. Turing has less.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
constexpr unsigned kSortBlocks = 2;
#else
constexpr unsigned kSortBlocks = sizeof(Real) == 4 ? 3 : 2;
#endif

template <unsigned kThreads>
__global__ void __launch_bounds__(kThreads, kThreads == 512 ? kSortBlocks : 1)
    sort_phase(GridArgs args, SortRoom room) {
  wait_for_previous_kernel();
  __shared__ GridPlan plan;
  __shared__ unsigned long long warp_sums[kThreads / 32];
  if (!is_valid_input(args)) return;
  copy_plan(args, plan);
  SortStorage storage = sort_storage(dynamic_storage, room, warp_sums);
  sort_coarse(args, plan, room, storage);
}

/// Blocks of a search that a multiprocessor is to hold. Turing's have 1024 threads.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
constexpr unsigned kSearchBlocks = sizeof(Real) == 4 ? 4 : 3;
#else
constexpr unsigned kSearchBlocks = sizeof(Real) == 4 ? 5 : 3;
#endif

__global__ void __launch_bounds__(kGridThreads, kSearchBlocks)
    neighbour_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ NeighbourStorage storage[kGridWarps];
  if (!is_valid_input(args) || !args.plan->single) return;
  NeighbourSearcher(args, output, storage[threadIdx.x / 32])
      .run(blockIdx.x * kGridThreads + threadIdx.x);
}

/// Where cells are hashed, a block needs more of the cache.
template <bool kDense>
constexpr unsigned kLevelBlocks = kDense ? kSearchBlocks : std::min(kSearchBlocks, 4u);

template <bool kDense>
__global__ void __launch_bounds__(kGridThreads, kLevelBlocks<kDense>) search_phase(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ SearchStorage<kDense> storage;
  __shared__ GridPlan plan;
  if (!is_valid_input(args) || args.plan->single || args.plan->dense != kDense) return;
  copy_plan(args, plan);
  Searcher<kDense>(args, plan, storage).run();
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

/// All the threads of a multiprocessor, which on Turing are half as many.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
constexpr unsigned kCopyBlocks = 4;
#else
constexpr unsigned kCopyBlocks = 8;
#endif

__global__ void __launch_bounds__(kGridThreads, kCopyBlocks)
    copy_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ CopyStorage storage;
  if (!is_valid_input(args) || !args.plan->single || !is_complete(args, output)) return;
  copy_bin(args, output, storage);
}

__global__ void __launch_bounds__(kGridThreads) emit_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ EmitStorage storage;
  if (!is_valid_input(args) || args.plan->single || !is_complete(args, output)) return;
  emit(args, output, storage);
}

__device__ bool has_crowded(const GridArgs& args, const SearchOutput& output) {
  return args.state->overflow != 0 && is_valid_input(args) && is_complete(args, output);
}
__global__ void __launch_bounds__(kGridThreads) list_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  if (!has_crowded(args, output)) return;
  if (args.plan->single) {
    list_crowded(args);
  } else {
    place_overflow(args);
  }
}
__global__ void __launch_bounds__(kGridThreads) crowded_phase(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ CrowdedStorage storage;
  if (has_crowded(args, output)) emit_crowded(args, output, storage);
}

/// Launches a kernel with more shared memory than a block may have by default. `most` is the same
/// for all launches on a device: the limit is the kernel's, and another thread may be about to
/// launch it.
template <typename... Parameters, typename... Arguments>
void launch_large(std::size_t most, std::size_t bytes, void (*kernel)(Parameters...),
                  unsigned blocks, unsigned threads, cudaStream_t stream,
                  const Arguments&... arguments) {
  JFPX_CUDA_TRY(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                     static_cast<int>(most)));
  launch_sharing(bytes, kernel, blocks, 1, threads, stream, arguments...);
}

constexpr unsigned kFewBlocks = 132 * 4, kCrowdedBlocks = 132 * 6, kManyBlocks = kMaxGridBlocks;

template <bool kLarge>
void launch_part(const GridArgs& args, std::size_t most, cudaStream_t stream) {
  using Tile = TileStorage<kLarge>;
  launch_large(most, sizeof(Tile), part_phase<kLarge>, (args.n - 1) / Tile::kSpheres + 1,
               Tile::kThreads, stream, args);
}

/// `shared_bytes` is what a block can have.
void launch_sort(const GridArgs& args, std::size_t shared_bytes, cudaStream_t stream) {
  constexpr unsigned kCountBlocks = 132;
  constexpr std::size_t kOthers = 2048;  // bytes of shared memory that are taken otherwise
  const std::size_t most = shared_bytes - kOthers;
  launch(coarse_phase, kCountBlocks, 1, kCountThreads, stream, args);
  if (sizeof(TileStorage<true>) <= most) {
    launch_part<true>(args, most, stream);
  } else {
    launch_part<false>(args, most, stream);
  }
  // Evenly spread, a coarse bucket has between n / kCoarseBuckets spheres and twice as many. If
  // they don't fit, they are not brought into shared memory, and there is more of it for buckets.
  constexpr std::uint32_t kMaxBuckets = 8192, kMaxSpheres = (1 << 16) - 4;
  const std::uint32_t buckets = args.table_size / args.coarse_buckets,
                      spheres = args.n / args.coarse_buckets;
  SortRoom room{std::clamp(buckets, 4u, kMaxBuckets), 0};
  const auto fitting = static_cast<std::uint32_t>((most - room.bytes()) / SortRoom{0, 1}.bytes());
  if (spheres <= fitting) {
    room.spheres = std::min({fitting, 4 * spheres, kMaxSpheres}) / 4 * 4;
  } else {
    room.buckets = std::min(buckets, static_cast<std::uint32_t>(most / sizeof(std::uint32_t)));
    room.buckets = room.buckets / 4 * 4;
  }
  if (spheres > 2048) {
    launch_large(most, room.bytes(), sort_phase<1024>, args.coarse_buckets, 1024, stream, args,
                 room);
  } else {
    launch_large(most, room.bytes(), sort_phase<512>, args.coarse_buckets, 512, stream, args, room);
  }
}

void launch_phases(const GridArgs& args, const SearchOutput& output, cudaStream_t stream) {
  const auto run = [&](auto kernel, unsigned blocks, const auto&... arguments) {
    launch(kernel, blocks, 1, kGridThreads, stream, arguments...);
  };
  int device = 0, shared_bytes = 0;
  JFPX_CUDA_TRY(cudaGetDevice(&device));
  JFPX_CUDA_TRY(
      cudaDeviceGetAttribute(&shared_bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  const auto chunks = static_cast<unsigned>((std::uint64_t{args.n} - 1) / kGridThreads + 1);
  JFPX_CUDA_TRY(cudaMemsetAsync(args.state, 0, sizeof(SearchState), stream));
  run(measure_phase, kFewBlocks, args);
  launch(plan_phase, kLastLevel + 1, 1, kPlanThreads, stream, args);
  launch_sort(args, static_cast<std::size_t>(shared_bytes), stream);
  run(neighbour_phase, chunks, args, output);
  run(search_phase<true>, std::min(chunks, 132 * kLevelBlocks<true>), args);
  run(search_phase<false>, std::min(chunks, 132 * kLevelBlocks<false>), args);
  run(sum_phase, kManyBlocks, args, output);
  run(copy_phase, chunks, args, output);
  run(emit_phase, kManyBlocks, args, output);
  run(list_phase, kFewBlocks, args, output);
  run(crowded_phase, kCrowdedBlocks, args, output);
}

/// Up to here all phases are one launch (measured on an H200: bench/results).
constexpr std::uint32_t kMaxInOneLaunch = 1 << 18;

/// Coarse buckets are made for about so many spheres each: fewer buckets take fewer atomics, and
/// smaller ones more blocks to sort them.
constexpr std::uint32_t kSpheresOfCoarse = 1024, kFewestCoarse = 256;

constexpr std::size_t rounded(std::size_t bytes) { return (bytes + 255) / 256 * 256; }

}  // namespace

std::size_t grid_plan_bytes() { return sizeof(GridPlan); }

std::size_t grid_scratch_bytes(std::size_t n, std::size_t capacity) {
  const std::size_t slots = kDirectSlots * std::min<std::size_t>(n, kMaxDirect);
  const std::size_t cells = rounded(slots * sizeof(SphereInstance)) + slots * sizeof(std::uint32_t);
  const std::size_t parted = rounded(n * sizeof(SphereInstance)) + n * sizeof(std::uint32_t);
  const std::size_t partners = n * kSlots * sizeof(std::uint32_t);
  const std::size_t staged = std::min(n * kStaged, capacity) * sizeof(SphereContact);
  return std::max({cells, parted, partners, staged}) + 256;
}

void use_grid_scratch(GridArgs& args, unsigned char* scratch) {
  args.partners = reinterpret_cast<std::uint32_t*>(scratch);
  args.stage = reinterpret_cast<SphereContact*>(scratch);
  args.parted = reinterpret_cast<SphereInstance*>(scratch);
  args.parted_ids =
      reinterpret_cast<std::uint32_t*>(scratch + rounded(args.n * sizeof(SphereInstance)));
  if (args.n > kMaxDirect) return;
  args.slots = args.parted;
  args.slot_ids = reinterpret_cast<std::uint32_t*>(
      scratch + rounded(std::size_t{kDirectSlots} * args.n * sizeof(SphereInstance)));
}

void launch_grid_search(const GridArgs& args, const SearchOutput& output, unsigned most_blocks,
                        cudaStream_t stream) {
  if (args.n <= kMaxInOneLaunch) {
    launch_in_one(args, output, most_blocks, stream);
  } else {
    GridArgs phased = args;
    phased.coarse_buckets =
        std::clamp(std::bit_ceil(args.n / kSpheresOfCoarse), kFewestCoarse, kCoarseBuckets);
    launch_phases(phased, output, stream);
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
