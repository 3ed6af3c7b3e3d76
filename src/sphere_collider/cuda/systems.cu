/// Search within systems: a warp tests a sphere against the later ones of its system, in order,
/// once to count and once to write.
#include "src/sphere_collider/cuda/periodic_pairs.cuh"
#include "src/sphere_collider/cuda/search.cuh"
#include "src/sphere_collider/cuda/systems.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

constexpr unsigned kThreads = 256;
constexpr unsigned kMaxBlocks = 1u << 16;  ///< warps loop over the spheres beyond

unsigned blocks_for(std::uint32_t n) {
  constexpr unsigned kWarps = kThreads / 32;
  return std::clamp(n / kWarps + 1, 1u, kMaxBlocks);
}

__device__ std::uint32_t first_sphere() { return (blockIdx.x * kThreads + threadIdx.x) / 32; }
__device__ std::uint32_t sphere_stride() { return gridDim.x * (kThreads / 32); }

/// Calls visit(touching lanes, b, result of the test) for each vector of the later spheres of the
/// system of `a`, whether or not this lane has one.
template <typename Visit>
__device__ void visit_later(const SystemsArgs& args, std::uint32_t a, const SphereInstance& sa,
                            std::uint32_t system, Visit visit) {
  const auto end = static_cast<std::uint32_t>(args.offsets[system + 1]);
  for (std::uint32_t first = a + 1; first < end; first += 32) {
    const std::uint32_t b = first + lane_id();
    PairResult found{};
    if (b < end) {
      const SphereInstance sb = load_sphere(args.spheres + b);
      found = args.cells != nullptr ? detail::touch_in_cell(sa, sb, args.cells[system]).pair
                                    : detail::test_sphere_pair(sa, sb);
    }
    visit(__ballot_sync(kFullWarp, found.touching != 0), b, found);
  }
}

__device__ bool is_valid_in_system(const SystemsArgs& args, const SphereInstance& s,
                                   std::uint32_t system) {
  return args.cells != nullptr ? is_valid_in(args.cells[system], s) : is_valid(s);
}

__global__ void __launch_bounds__(kThreads) count_in_systems(SystemsArgs args) {
  wait_for_previous_kernel();
  if (blockIdx.x == 0 && threadIdx.x == 0) args.counts[args.n] = 0;
  for (std::uint32_t a = first_sphere(); a < args.n; a += sphere_stride()) {
    const SphereInstance sa = load_sphere(args.spheres + a);
    const std::uint32_t system = system_of(args.offsets, args.systems, a);
    std::uint32_t count = 0;
    visit_later(args, a, sa, system, [&](unsigned touching, std::uint32_t, const PairResult&) {
      count += static_cast<unsigned>(__popc(touching));
    });
    if (lane_id() != 0) continue;
    args.counts[a] = count;
    if (!is_valid_in_system(args, sa, system)) report_invalid(args.state, a);
  }
}

__global__ void __launch_bounds__(kThreads) emit_in_systems(SystemsArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  const unsigned long long total = args.sums[args.n];
  const std::uint32_t invalid = first_invalid(args.state);
  const bool complete = total <= output.capacity;
  if (blockIdx.x == 0 && threadIdx.x == 0) write_count(output, total, invalid, complete);
  if (!complete || invalid != kNoSphere) return;
  for (std::uint32_t a = first_sphere(); a < args.n; a += sphere_stride()) {
    unsigned long long at = args.sums[a];
    if (at == args.sums[a + 1]) continue;
    const SphereInstance sa = load_sphere(args.spheres + a);
    const auto write = [&](unsigned touching, std::uint32_t b, const PairResult& found) {
      if ((touching >> lane_id() & 1u) != 0) {
        const auto rank = static_cast<unsigned>(__popc(touching & lanes_below()));
        write_contact(output, at + rank, a, b, found);
      }
      at += static_cast<unsigned>(__popc(touching));
    };
    visit_later(args, a, sa, system_of(args.offsets, args.systems, a), write);
  }
}

}  // namespace

void launch_count_in_systems(const SystemsArgs& args, cudaStream_t stream) {
  launch(count_in_systems, blocks_for(args.n), 1, kThreads, stream, args);
}

void launch_emit_in_systems(const SystemsArgs& args, const SearchOutput& output,
                            cudaStream_t stream) {
  launch(emit_in_systems, blocks_for(args.n), 1, kThreads, stream, args, output);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
