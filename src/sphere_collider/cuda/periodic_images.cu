/// Reduction to a periodic cell, images, and the shifts and contacts of pairs.
#include "src/base/cuda/launch.cuh"
#include "src/sphere_collider/cuda/grid_build.cuh"
#include "src/sphere_collider/cuda/item_list.cuh"
#include "src/sphere_collider/cuda/periodic_images.hpp"
#include "src/sphere_collider/cuda/periodic_pairs.cuh"
#include "src/sphere_collider/cuda/systems.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

constexpr unsigned kListWarps = kListThreads / 32;
static_assert(kListThreads == kGridThreads, "prepare() uses BlockSums and is_last_block()");
/// Up to this number of elements, threads process one at a time, because there are more threads
/// than elements.
constexpr std::size_t kFewForBatches = 1 << 18;

__device__ SphereInstance load_given(const PeriodicArgs& args, std::size_t i) {
  const bool is_first = i < args.first.count;
  return load_from(is_first ? args.first : args.second, is_first ? i : i - args.first.count);
}

/// Finds the largest radius, unless all have the same.
__global__ void __launch_bounds__(kListThreads)
    measure_radii(const __grid_constant__ PeriodicArgs args) {
  wait_for_previous_kernel();
  Real largest = 0;
  for (std::size_t i = first_element(); i < args.n; i += element_stride()) {
    largest = max(largest, load_given(args, i).radius);
  }
  largest = warp_max(largest);
  if (lane_id() == 0) atomicMax(&args.state->largest_radius, bits_of(largest));
}

__device__ CellPoint::Cells packed(const ImageShift& cells) {
  constexpr std::int32_t kBias = 1 << (CellPoint::kBits - 1);
  CellPoint::Cells result = 0;
  bool fits = true;
  for (std::size_t k = 3; k-- > 0;) {
    fits = fits && cells[k] >= -kBias && cells[k] < kBias;
    result = result << CellPoint::kBits | static_cast<std::uint32_t>(cells[k] + kBias);
  }
  return fits ? result : CellPoint::kFarCells;
}
/// The id of a sphere, or without the lowest bit that of its image.
/// @param cells by which the reduced sphere is displaced
__device__ std::uint32_t id_of(const PeriodicArgs& args, std::size_t i, const ImageShift& shift,
                               const ImageShift& cells) {
  const auto index = static_cast<std::uint32_t>(i) << args.index_bit;
  return has_shift_code(cells) && args.index_bit > 1 ? index | shift_code(shift, cells) << 1
                                                     : index;
}

/// @tparam kOfThread spheres of a thread whose loads and stores overlap
template <unsigned kOfThread>
__global__ void __launch_bounds__(kListThreads)
    prepare(const __grid_constant__ PeriodicArgs args, Real largest_radius) {
  wait_for_previous_kernel();
  PeriodicState& state = *args.state;
  if (largest_radius == 0) {
    largest_radius = std::bit_cast<Real>(static_cast<RealBits>(state.largest_radius));
  }
  __shared__ BlockSums::TempStorage sums;
  __shared__ unsigned long long images_before;
  const Real reach = 2 * detail::reduced_radius(largest_radius, args.errors);
  bool has_bad = false, has_no_code = false;
  for (std::size_t first = kOfThread * (first_element() - threadIdx.x); first < args.n;
       first += kOfThread * element_stride()) {
    const auto index = [&](unsigned k) { return first + k * kListThreads + threadIdx.x; };
    SphereInstance spheres[kOfThread];
    std::uint32_t codes[kOfThread], count = 0;
    ImageShift cells[kOfThread] = {};
#pragma unroll
    for (unsigned k = 0; k < kOfThread; ++k) {
      spheres[k] = load_given(args, index(k) < args.n ? index(k) : 0);
    }
#pragma unroll
    for (unsigned k = 0; k < kOfThread; ++k) {
      codes[k] = 0;
      if (index(k) >= args.n) continue;
      SphereInstance& sphere = spheres[k];
      args.given[index(k)] = sphere;
      CellPoint point{sphere.centre, 0};
      if (is_valid_in(args.cell, sphere)) {
        sphere = detail::reduced(sphere, args.cell, args.errors, &cells[k]);
        point.cells = packed(cells[k]);
        codes[k] = detail::near_images(sphere.centre, args.cell, reach);
        if (!has_shift_code(cells[k])) has_no_code = true;
      } else {
        has_bad = true;
      }
      args.points[index(k)] = point;
      args.reduced[index(k)] = sphere;
      args.ids[index(k)] = id_of(args, index(k), {}, cells[k]);
      count += static_cast<std::uint32_t>(__popc(codes[k]));
    }
    // One atomic for a block: those on one address are serialized.
    unsigned long long all = 0, at = block_exclusive_sum(count, sums, all);
    if (threadIdx.x == 0 && all != 0) images_before = atomicAdd(&state.images, all);
    __syncthreads();
    at += images_before;
#pragma unroll
    for (unsigned k = 0; k < kOfThread; ++k) {
      for (; codes[k] != 0 && at < args.capacity; codes[k] &= codes[k] - 1, ++at) {
        const auto code = static_cast<std::uint32_t>(__ffs(static_cast<int>(codes[k])) - 1);
        const ImageShift shift = detail::shift_of(code);
        args.ids[args.n + at] = id_of(args, index(k), shift, cells[k]) | 1;
        args.reduced[args.n + at] = detail::image_of(spheres[k], shift, args.cell);
      }
    }
  }
  if (__any_sync(kFullWarp, has_bad) && lane_id() == 0) state.has_bad = 1;
  if (__any_sync(kFullWarp, has_no_code) && lane_id() == 0) state.has_no_code = 1;
  if (!is_last_block(state.blocks_passed) || threadIdx.x != 0) return;
  const unsigned long long images = __ldcg(&state.images);
  const bool valid = __ldcg(&state.has_bad) == 0, complete = images <= args.capacity;
  bool may_touch_twice = false;
  for (int k = 0; k < 3; ++k) {
    may_touch_twice = may_touch_twice || (args.cell.repeats[static_cast<std::size_t>(k)] &&
                                          detail::may_touch_twice(reach, args.cell.lengths[k]));
  }
  const bool ready = valid && complete;
  *args.known = {
      .given = args.given,
      .cell = args.cell,
      .n = ready ? args.n + static_cast<std::uint32_t>(images) : 0,
      .may_touch_twice = may_touch_twice,
      .has_shift_codes = args.index_bit > 1 && __ldcg(&state.has_no_code) == 0 && !may_touch_twice,
      .shifts_are_written = false};
  state = {};
  write_signal(args.signal, images, valid, complete);
}

__device__ const PeriodicCell& cell_of_sphere(const SpheresInCells& in, std::size_t i) {
  if (in.systems == 0) return in.cell;
  return in.cells[system_of(in.offsets, in.systems, static_cast<std::uint32_t>(i))];
}

/// The shift of spheres a < b that touch.
__device__ ImageShift shift_of_pair(const SpheresInCells& in, std::uint32_t a, std::uint32_t b) {
  return detail::shift_of_touching(load_sphere(in.spheres + a), load_sphere(in.spheres + b),
                                   cell_of_sphere(in, a));
}

__global__ void __launch_bounds__(kListThreads)
    make_contacts(const __grid_constant__ SpheresInCells in, const SpherePair* pairs, std::size_t n,
                  SphereContact* contacts) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    const SpherePair pair = pairs[i];
    const PairResult touch =
        detail::touch_at(load_sphere(in.spheres + pair.a), load_sphere(in.spheres + pair.b),
                         shift_of_pair(in, pair.a, pair.b), cell_of_sphere(in, pair.a));
    contacts[i] = {pair.a, pair.b, touch.normal, touch.distance};
  }
}

template <class Item>
__device__ SpherePair pair_at(const FoundItems<Item>& found, std::size_t i) {
  return {found.items[i].a, found.items[i].b};
}
template <class Index>
__device__ SpherePair pair_at(const PairRows<Index>& rows, std::size_t i) {
  return {static_cast<std::uint32_t>(rows.indices[i]),
          static_cast<std::uint32_t>(rows.indices[rows.n + i])};
}

template <class Pairs, unsigned kOfThread>
__global__ void __launch_bounds__(kListThreads)
    write_shifts(const __grid_constant__ SpheresInCells in, Pairs found, std::int32_t* shifts,
                 std::size_t capacity) {
  wait_for_previous_kernel();
  if (in.known != nullptr && in.known->shifts_are_written) return;
  __shared__ std::int32_t staged[kListWarps][3 * 32 * kOfThread];
  std::int32_t* const mine = staged[threadIdx.x / 32];
  const std::size_t n = found.n < capacity ? found.n : capacity;
  const bool is_general = in.known == nullptr || in.known->may_touch_twice;
  for (std::size_t first = kOfThread * (first_element() - lane_id()); first < n;
       first += kOfThread * element_stride()) {
    const auto pair = [&](unsigned k) {
      const std::size_t i = first + 32 * k + lane_id();
      return pair_at(found, i < n ? i : n - 1);
    };
    const auto put = [&](unsigned k, const ImageShift& shift, std::int32_t sign) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        mine[3 * (32 * k + lane_id()) + axis] = sign * shift[axis];
      }
    };
    if (is_general) {
#pragma unroll 1
      for (unsigned k = 0; k < kOfThread; ++k) {
        const auto [a, b] = pair(k);
        put(k, shift_of_pair(in, min(a, b), max(a, b)), a < b ? 1 : -1);
      }
    } else {
      SpherePair pairs[kOfThread];
#pragma unroll
      for (unsigned k = 0; k < kOfThread; ++k) pairs[k] = pair(k);
      CellPoint points[kOfThread][2];
#pragma unroll
      for (unsigned k = 0; k < kOfThread; ++k) {
        points[k][0] = load_point(in.points + pairs[k].a);
        points[k][1] = load_point(in.points + pairs[k].b);
      }
#pragma unroll
      for (unsigned k = 0; k < kOfThread; ++k) {
        put(k, shift_of_points(points[k][0], points[k][1], in.cell), 1);
      }
    }
    __syncwarp();
    // A warp writes whole memory sectors.
#pragma unroll
    for (unsigned k = 0; k < 3 * kOfThread; ++k) {
      const std::size_t to = 3 * first + 32 * k + lane_id();
      if (to < 3 * n) __stcs(shifts + to, mine[32 * k + lane_id()]);
    }
    __syncwarp();
  }
}

}  // namespace

void launch_prepare(const PeriodicArgs& args, cudaStream_t stream) {
  const bool is_known = args.first.radii == nullptr && args.second.count == 0;
  const Real largest = is_known ? args.first.radius : Real(0);
  if (!is_known) launch(measure_radii, list_blocks(args.n), 1, kListThreads, stream, args);
  if (args.n <= kFewForBatches) {
    launch(prepare<1>, list_blocks(args.n), 1, kListThreads, stream, args, largest);
  } else {
    launch(prepare<kBatch>, list_blocks(args.n / kBatch), 1, kListThreads, stream, args, largest);
  }
}

void launch_make_contacts(const SpheresInCells& in, const SpherePair* pairs, std::size_t n,
                          SphereContact* contacts, cudaStream_t stream) {
  if (n == 0) return;
  launch(make_contacts, list_blocks(n), 1, kListThreads, stream, in, pairs, n, contacts);
}

template <class Pairs>
void launch_write_shifts(const SpheresInCells& in, const Pairs& found, std::int32_t* shifts,
                         std::size_t capacity, cudaStream_t stream) {
  if (capacity == 0) return;
  if (capacity <= kFewForBatches) {
    launch(write_shifts<Pairs, 1>, list_blocks(capacity), 1, kListThreads, stream, in, found,
           shifts, capacity);
  } else {
    launch(write_shifts<Pairs, kBatch>, list_blocks(capacity / kBatch), 1, kListThreads, stream, in,
           found, shifts, capacity);
  }
}

#define JFPX_INSTANTIATE(Pairs)                                                         \
  template void launch_write_shifts(const SpheresInCells&, const Pairs&, std::int32_t*, \
                                    std::size_t, cudaStream_t);
JFPX_INSTANTIATE(FoundItems<SpherePair>)
JFPX_INSTANTIATE(FoundItems<SphereContact>)
JFPX_INSTANTIATE(PairRows<std::int32_t>)
JFPX_INSTANTIATE(PairRows<std::int64_t>)
#undef JFPX_INSTANTIATE

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
