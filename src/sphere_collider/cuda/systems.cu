/// Search within systems: a warp tests a sphere against the later ones of its system, in order,
/// once to count and once to write.
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

/// Calls visit(touching lanes, b, sphere b) for each vector of the spheres from `begin` to `end`,
/// whether or not this lane has one.
template <typename Visit>
__device__ void visit_range(const SystemsArgs& args, const SphereInstance& sa, std::uint32_t begin,
                            std::uint32_t end, Visit visit) {
  for (std::uint32_t first = begin; first < end; first += 32) {
    const std::uint32_t b = first + lane_id();
    SphereInstance sb{};
    bool touch = false;
    if (b < end) {
      sb = load_sphere(args.spheres + b);
      touch = detail::test_sphere_pair(sa, sb).touching != 0;
    }
    visit(__ballot_sync(kFullWarp, touch), b, sb);
  }
}

/// The same for the later spheres of the system of `a`, and for their images.
template <typename Visit>
__device__ void visit_later(const SystemsArgs& args, std::uint32_t a, const SphereInstance& sa,
                            Visit visit) {
  const std::uint32_t system = system_of(args.offsets, args.systems, a);
  const auto end = static_cast<std::uint32_t>(args.offsets[system + 1]);
  visit_range(args, sa, a + 1, end, visit);
  if (args.image_begins == nullptr) return;
  visit_range(args, sa, args.n + static_cast<std::uint32_t>(args.image_begins[a + 1]),
              args.n + static_cast<std::uint32_t>(args.image_begins[end]), visit);
}

__global__ void __launch_bounds__(kThreads) count_in_systems(SystemsArgs args) {
  wait_for_previous_kernel();
  if (blockIdx.x == 0 && threadIdx.x == 0) args.counts[args.n] = 0;
  for (std::uint32_t a = first_sphere(); a < args.n; a += sphere_stride()) {
    const SphereInstance sa = load_sphere(args.spheres + a);
    std::uint32_t count = 0;
    visit_later(args, a, sa, [&](unsigned touching, std::uint32_t, const SphereInstance&) {
      count += static_cast<unsigned>(__popc(touching));
    });
    if (lane_id() != 0) continue;
    args.counts[a] = count;
    if (!is_valid(sa)) report_invalid(args.state, a);
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
    visit_later(args, a, sa, [&](unsigned touching, std::uint32_t b, const SphereInstance& sb) {
      if ((touching >> lane_id() & 1u) != 0) {
        const auto rank = static_cast<unsigned>(__popc(touching & lanes_below()));
        write_contact(output, at + rank, a, b, sa, sb);
      }
      at += static_cast<unsigned>(__popc(touching));
    });
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
