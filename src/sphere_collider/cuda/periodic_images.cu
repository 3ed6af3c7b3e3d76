/// Reduction to a periodic cell, images, and the selection of the nearest images.
#include "src/base/cuda/launch.cuh"
#include "src/sphere_collider/cuda/item_list.cuh"
#include "src/sphere_collider/cuda/periodic_images.hpp"
#include "src/sphere_collider/cuda/search.cuh"
#include "src/sphere_collider/cuda/systems.hpp"

#include <bit>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// Positive numbers are ordered as their bits.
using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, unsigned long long>;

__device__ const PeriodicCell& cell_of(const PeriodicArgs& args, std::size_t i) {
  if (args.systems == 0) return args.cell;
  return args.cells[system_of(args.offsets, args.systems, static_cast<std::uint32_t>(i))];
}

__global__ void __launch_bounds__(kListThreads)
    reduce(PeriodicArgs args, const SphereInstance* spheres) {
  wait_for_previous_kernel();
  Real largest = 0;
  std::uint32_t has_bad = 0;
  for (std::size_t i = first_element(); i < args.n; i += element_stride()) {
    SphereInstance sphere = load_sphere(spheres + i);
    args.given[i].sphere = sphere;
    const PeriodicCell& cell = cell_of(args, i);
    if (is_valid(sphere) && detail::fits(cell, sphere.radius) &&
        detail::is_reducible(sphere.centre, cell)) {
      sphere = detail::reduced(sphere, cell, &args.given[i].displacement);
      largest = max(largest, sphere.radius);
    } else {
      has_bad = 1;
    }
    args.reduced[i] = sphere;
  }
  largest = warp_max(largest);
  has_bad = warp_max(has_bad);
  if (lane_id() != 0) return;
  atomicMax(&args.state->largest_radius, std::bit_cast<Bits>(largest));
  if (has_bad != 0) args.state->has_bad = 1;
}

/// The images of reduced sphere i that may touch a sphere in the cell.
__device__ std::uint32_t near_images(const PeriodicArgs& args, std::size_t i,
                                     const SphereInstance& sphere) {
  const auto radius = std::bit_cast<Real>(static_cast<Bits>(args.state->largest_radius));
  return detail::near_images(sphere.centre, cell_of(args, i), 2 * radius);
}

__global__ void __launch_bounds__(kListThreads) count_images(PeriodicArgs args) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < args.n; i += element_stride()) {
    const std::uint32_t codes = near_images(args, i, load_sphere(args.reduced + i));
    args.counts[i] = static_cast<std::uint32_t>(__popc(codes));
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) args.counts[args.n] = 0;
}

__global__ void __launch_bounds__(kListThreads)
    append_images(PeriodicArgs args, SphereInstance* spheres) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < args.n; i += element_stride()) {
    const SphereInstance sphere = load_sphere(args.reduced + i);
    spheres[i] = sphere;
    unsigned long long at = args.begins[i];
    for (std::uint32_t codes = near_images(args, i, sphere); codes != 0; codes &= codes - 1, ++at) {
      const auto code = static_cast<std::uint32_t>(__ffs(static_cast<int>(codes)) - 1);
      args.images[at] = {static_cast<std::uint32_t>(i), code};
      spheres[args.n + at] = detail::image_of(sphere, detail::shift_of(code), cell_of(args, i));
    }
  }
}

/// items_before(items, n, a, b), for items of row `a` near `begin`, which is not greater.
template <class Item>
__device__ std::size_t items_before_from(const Item* items, std::size_t begin, std::size_t n,
                                         std::uint64_t a, std::uint64_t b) {
  std::size_t low = begin, step = 1;
  const auto is_before = [&](std::size_t i) {
    return items[i].a < a || (items[i].a == a && items[i].b < b);
  };
  while (low + step <= n && is_before(low + step - 1)) {
    low += step;
    step *= 2;
  }
  const std::size_t high = low + step - 1 < n ? low + step - 1 : n;
  return low + items_before(items + low, high - low, a, b);
}

/// The sphere b of an item of row a, or the sphere that b is an image of, and the code of its
/// shift.
__device__ PeriodicImage image_at(const PeriodicArgs& args, std::uint32_t b) {
  return b < args.n ? PeriodicImage{b, detail::kNoShift} : args.images[b - args.n];
}

/// The shift between the given centres of two spheres whose reduced ones have a shift.
__device__ ImageShift shift_between(const ImageShift& displacement_a,
                                    const ImageShift& displacement_b, std::uint32_t code) {
  ImageShift shift = detail::shift_of(code);
  for (std::size_t k = 0; k < 3; ++k) shift[k] += displacement_a[k] - displacement_b[k];
  return shift;
}

/// The exact test of a pair whose reduced spheres or images touch.
template <class Item>
__device__ PairResult touch_of(const PeriodicArgs& args, const Item& item) {
  const PeriodicImage image = image_at(args, item.b);
  const DisplacedSphere &a = args.given[item.a], &b = args.given[image.sphere];
  return detail::touch_at(load_sphere(&a.sphere), load_sphere(&b.sphere),
                          shift_between(a.displacement, b.displacement, image.code),
                          cell_of(args, item.a));
}

template <class Item>
__device__ bool is_kept(const PeriodicArgs& args, Item* items, std::size_t n, std::size_t i) {
  const std::uint32_t a = items[i].a;
  if (a >= args.n) return false;
  const PeriodicImage b = image_at(args, items[i].b);
  if (b.sphere <= a) return false;  // an image of a touches the sphere with the higher index
  const PairResult found = touch_of(args, items[i]);
  if (found.touching == 0) return false;
  if constexpr (std::is_same_v<Item, SphereContact>) {
    items[i].normal = found.normal;
    items[i].distance = found.distance;
  }
  // Unless another image of b with a lower shift touches.
  if (b.code > detail::kNoShift) {
    const std::size_t j = items_before(items, n, a, b.sphere);  // j <= i
    if (items[j].a == a && items[j].b == b.sphere && touch_of(args, items[j]).touching != 0) {
      return false;
    }
  }
  const std::uint64_t first = args.n + args.begins[b.sphere];
  const std::uint64_t last = args.n + args.begins[b.sphere + 1];
  std::size_t j = i;
  if (items[i].b < args.n) {
    j = items_before_from(items, i, n, a, first);
  } else {
    while (j > 0 && items[j - 1].a == a && items[j - 1].b >= first) --j;
  }
  for (; j < n && items[j].a == a && items[j].b < last; ++j) {
    if (args.images[items[j].b - args.n].code >= b.code) break;
    if (touch_of(args, items[j]).touching != 0) return false;
  }
  return true;
}

template <class Item>
__global__ void __launch_bounds__(kListThreads)
    mark_kept(PeriodicArgs args, Item* items, std::size_t n, std::uint32_t* kept) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    kept[i] = is_kept(args, items, n, i) ? 1 : 0;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) kept[n] = 0;
}

/// A row has its spheres, sorted, then its images, sorted by their spheres: each kept item comes
/// after those before it in its own part and after those of lower spheres in the other part.
template <class Item>
__global__ void __launch_bounds__(kListThreads)
    place_kept(PeriodicArgs args, const Item* items, std::size_t n, const std::uint32_t* kept,
               const unsigned long long* places, Item* out, ImageShift* shifts,
               ContactCount* count) {
  wait_for_previous_kernel();
  if (blockIdx.x == 0 && threadIdx.x == 0) *count = {places[n], kNoSphere, 1};
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    if (kept[i] == 0) continue;
    Item item = items[i];
    const PeriodicImage image = image_at(args, item.b);
    std::size_t images, other;  // first image of the row; first item of the other part beyond b
    if (item.b < args.n) {
      images = items_before_from(items, i, n, item.a, args.n);
      other = items_before_from(items, images, n, item.a, args.n + args.begins[item.b]);
    } else {
      item.b = image.sphere;
      other = items_before(items, n, item.a, item.b);
      images = items_before_from(items, other, n, item.a, args.n);
    }
    const unsigned long long at = places[i] + places[other] - places[images];
    out[at] = item;
    shifts[at] =
        shift_between(args.given[item.a].displacement, args.given[item.b].displacement, image.code);
  }
}

template <class Item>
__global__ void __launch_bounds__(kListThreads)
    write_shifts(FoundItems<Item> found, FoundItems<Item> half, const ImageShift* half_shifts,
                 std::int32_t* shifts, std::size_t capacity) {
  wait_for_previous_kernel();
  const std::size_t n = found.n < capacity ? found.n : capacity;
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    const std::uint32_t a = found.items[i].a, b = found.items[i].b;
    const std::size_t j = items_before(half.items, half.n, min(a, b), max(a, b));
    const std::int32_t sign = a < b ? 1 : -1;
    for (std::size_t k = 0; k < 3; ++k) shifts[3 * i + k] = sign * half_shifts[j][k];
  }
}

}  // namespace

void launch_reduce(const PeriodicArgs& args, const SphereInstance* spheres, cudaStream_t stream) {
  launch(reduce, list_blocks(args.n), 1, kListThreads, stream, args, spheres);
}

void launch_count_images(const PeriodicArgs& args, cudaStream_t stream) {
  launch(count_images, list_blocks(args.n), 1, kListThreads, stream, args);
}

void launch_append_images(const PeriodicArgs& args, SphereInstance* spheres, cudaStream_t stream) {
  launch(append_images, list_blocks(args.n), 1, kListThreads, stream, args, spheres);
}

template <class Item>
void launch_mark_kept(const PeriodicArgs& args, Item* items, std::size_t n, std::uint32_t* kept,
                      cudaStream_t stream) {
  launch(mark_kept<Item>, list_blocks(n), 1, kListThreads, stream, args, items, n, kept);
}

template <class Item>
void launch_place_kept(const PeriodicArgs& args, const Item* items, std::size_t n,
                       const std::uint32_t* kept, const unsigned long long* places, Item* out,
                       ImageShift* shifts, ContactCount* count, cudaStream_t stream) {
  launch(place_kept<Item>, list_blocks(n), 1, kListThreads, stream, args, items, n, kept, places,
         out, shifts, count);
}

template <class Item>
void launch_write_shifts(const FoundItems<Item>& found, const FoundItems<Item>& half,
                         const ImageShift* half_shifts, std::int32_t* shifts, std::size_t capacity,
                         cudaStream_t stream) {
  if (capacity == 0) return;
  launch(write_shifts<Item>, list_blocks(capacity), 1, kListThreads, stream, found, half,
         half_shifts, shifts, capacity);
}

#define JFPX_INSTANTIATE(Item)                                                            \
  template void launch_mark_kept(const PeriodicArgs&, Item*, std::size_t, std::uint32_t*, \
                                 cudaStream_t);                                           \
  template void launch_place_kept(const PeriodicArgs&, const Item*, std::size_t,          \
                                  const std::uint32_t*, const unsigned long long*, Item*, \
                                  ImageShift*, ContactCount*, cudaStream_t);              \
  template void launch_write_shifts(const FoundItems<Item>&, const FoundItems<Item>&,     \
                                    const ImageShift*, std::int32_t*, std::size_t, cudaStream_t);
JFPX_INSTANTIATE(SpherePair)
JFPX_INSTANTIATE(SphereContact)
#undef JFPX_INSTANTIATE

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
