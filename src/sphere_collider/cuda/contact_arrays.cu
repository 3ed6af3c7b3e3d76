/// Conversions between the arrays of other libraries and those of the searches.
#include "src/base/cuda/launch.cuh"
#include "src/sphere_collider/cuda/contact_arrays.hpp"
#include "src/sphere_collider/cuda/item_list.cuh"

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_select.cuh>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// The number of items that may be read: none unless the search was complete.
template <class Item>
__device__ std::size_t items_of(const FoundItems<Item>& found, std::size_t capacity) {
  std::size_t n = found.n;
  if (found.count != nullptr) n = found.count->complete != 0 ? found.count->contacts : 0;
  return n < capacity ? n : capacity;
}

__global__ void __launch_bounds__(kListThreads) pack(SphereArrays arrays, SphereInstance* spheres) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < arrays.count; i += element_stride()) {
    const auto row = static_cast<std::ptrdiff_t>(i);
    const Real* const p = arrays.positions + row * arrays.row_stride;
    const Real radius =
        arrays.radii == nullptr ? arrays.radius : arrays.radii[row * arrays.radius_stride];
    spheres[i] = {{p[0], p[arrays.column_stride], p[2 * arrays.column_stride]}, radius};
  }
}

template <class Item, class Index>
__global__ void __launch_bounds__(kListThreads)
    write_pairs(FoundItems<Item> found, Index* a, Index* b, std::size_t capacity) {
  wait_for_previous_kernel();
  const std::size_t n = items_of(found, capacity);
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    a[i] = static_cast<Index>(found.items[i].a);
    b[i] = static_cast<Index>(found.items[i].b - found.b_offset);
  }
}

__global__ void __launch_bounds__(kListThreads)
    write_contacts(FoundItems<SphereContact> found, Real* normals, Real* distances,
                   std::size_t capacity) {
  wait_for_previous_kernel();
  const std::size_t n = items_of(found, capacity);
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    const SphereContact contact = found.items[i];
    normals[3 * i] = contact.normal.x;
    normals[3 * i + 1] = contact.normal.y;
    normals[3 * i + 2] = contact.normal.z;
    distances[i] = contact.distance;
  }
}

template <class Item>
__global__ void __launch_bounds__(kListThreads)
    write_offsets(FoundItems<Item> found, std::int64_t* offsets, std::size_t rows) {
  wait_for_previous_kernel();
  const std::size_t n = items_of(found, ~std::size_t{0});
  for (std::size_t i = first_element(); i <= rows; i += element_stride()) {
    offsets[i] = static_cast<std::int64_t>(items_before(found.items, n, i));
  }
}

__global__ void write_count(const ContactCount* count, std::int64_t* out) {
  wait_for_previous_kernel();
  out[0] = static_cast<std::int64_t>(count->contacts);
  out[1] = count->complete;
}

template <class Item>
struct IsBetween {
  std::uint32_t boundary;
  __host__ __device__ bool operator()(const Item& item) const {
    return item.a < boundary && item.b >= boundary;
  }
};

__global__ void complete_count(ContactCount* count) {
  wait_for_previous_kernel();
  count->first_invalid = kNoSphere;
  count->complete = 1;
}

template <class Item>
cudaError_t select(void* scratch, std::size_t& bytes, const Item* items, Item* selected,
                   std::uint64_t* count, std::size_t n, std::uint32_t boundary,
                   cudaStream_t stream) {
  static_cast<void>(cudaGetLastError());  // CUB returns errors of earlier calls, too
  return cub::DeviceSelect::If(scratch, bytes, items, selected, count, static_cast<std::int64_t>(n),
                               IsBetween<Item>{boundary}, stream);
}

/// Stable, so that equal keys stay in the order of the items.
cudaError_t sort(void* scratch, std::size_t& bytes, const std::uint32_t* keys,
                 std::uint32_t* sorted_keys, const unsigned long long* values,
                 unsigned long long* sorted_values, std::size_t n, cudaStream_t stream) {
  static_cast<void>(cudaGetLastError());
  return cub::DeviceRadixSort::SortPairs(scratch, bytes, keys, sorted_keys, values, sorted_values,
                                         static_cast<std::int64_t>(n), 0, 32, stream);
}

template <class Item>
__global__ void __launch_bounds__(kListThreads)
    copy_keys(const Item* items, std::size_t n, BothOrdersScratch scratch) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    scratch.b[i] = items[i].b;
    scratch.index[i] = i;
  }
}

__device__ SpherePair opposite(const SpherePair& pair) { return {pair.b, pair.a}; }
__device__ SphereContact opposite(const SphereContact& c) {
  return {c.b, c.a, -c.normal, c.distance};
}

/// Row r has the opposites of the items (a, r), sorted by a, then the items (r, b).
template <class Item>
__global__ void __launch_bounds__(kListThreads)
    merge_orders(const Item* items, std::size_t n, Item* both, ContactCount* count,
                 BothOrdersScratch scratch) {
  wait_for_previous_kernel();
  for (std::size_t i = first_element(); i < n; i += element_stride()) {
    // The opposite number i follows all items of lower rows.
    const std::uint32_t b = scratch.sorted_b[i];
    both[i + items_before(items, n, b)] = opposite(items[scratch.sorted_index[i]]);
    // Item i follows the opposites of its own row and of all lower rows.
    const Item item = items[i];
    std::size_t low = 0, high = n;
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (scratch.sorted_b[middle] <= item.a) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    both[i + low] = item;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *count = {2 * n, kNoSphere, 1};
}

}  // namespace

void launch_pack(const SphereArrays& arrays, SphereInstance* spheres, cudaStream_t stream) {
  if (arrays.count == 0) return;
  launch(pack, list_blocks(arrays.count), 1, kListThreads, stream, arrays, spheres);
}

template <class Item, class Index>
void launch_write_pairs(const FoundItems<Item>& found, Index* a, Index* b, std::size_t capacity,
                        cudaStream_t stream) {
  if (capacity == 0) return;
  launch(write_pairs<Item, Index>, list_blocks(capacity), 1, kListThreads, stream, found, a, b,
         capacity);
}

void launch_write_contacts(const FoundItems<SphereContact>& found, Real* normals, Real* distances,
                           std::size_t capacity, cudaStream_t stream) {
  if (capacity == 0) return;
  launch(write_contacts, list_blocks(capacity), 1, kListThreads, stream, found, normals, distances,
         capacity);
}

template <class Item>
void launch_write_offsets(const FoundItems<Item>& found, std::int64_t* offsets, std::size_t rows,
                          cudaStream_t stream) {
  launch(write_offsets<Item>, list_blocks(rows + 1), 1, kListThreads, stream, found, offsets, rows);
}

void launch_write_count(const ContactCount* count, std::int64_t* out, cudaStream_t stream) {
  launch(write_count, 1, 1, 1, stream, count, out);
}

template <class Item>
std::size_t select_scratch_bytes(std::size_t n) {
  std::size_t bytes = 0;
  JFPX_CUDA_TRY(select<Item>(nullptr, bytes, nullptr, nullptr, nullptr, n, 0, nullptr));
  return bytes;
}

std::size_t sort_scratch_bytes(std::size_t n) {
  std::size_t bytes = 0;
  JFPX_CUDA_TRY(sort(nullptr, bytes, nullptr, nullptr, nullptr, nullptr, n, nullptr));
  return bytes;
}

template <class Item>
void launch_select_between(const Item* items, std::size_t n, std::uint32_t boundary, Item* selected,
                           ContactCount* count, void* scratch, std::size_t scratch_bytes,
                           cudaStream_t stream) {
  JFPX_CUDA_TRY(
      select(scratch, scratch_bytes, items, selected, &count->contacts, n, boundary, stream));
  launch(complete_count, 1, 1, 1, stream, count);
}

template <class Item>
void launch_both_orders(const Item* items, std::size_t n, Item* both, ContactCount* count,
                        const BothOrdersScratch& scratch, cudaStream_t stream) {
  const unsigned blocks = list_blocks(n);
  launch(copy_keys<Item>, blocks, 1, kListThreads, stream, items, n, scratch);
  std::size_t bytes = scratch.sort_bytes;
  JFPX_CUDA_TRY(sort(scratch.sort, bytes, scratch.b, scratch.sorted_b, scratch.index,
                     scratch.sorted_index, n, stream));
  launch(merge_orders<Item>, blocks, 1, kListThreads, stream, items, n, both, count, scratch);
}

#define JFPX_INSTANTIATE(Item)                                                            \
  template void launch_write_pairs(const FoundItems<Item>&, std::int32_t*, std::int32_t*, \
                                   std::size_t, cudaStream_t);                            \
  template void launch_write_pairs(const FoundItems<Item>&, std::int64_t*, std::int64_t*, \
                                   std::size_t, cudaStream_t);                            \
  template void launch_write_offsets(const FoundItems<Item>&, std::int64_t*, std::size_t, \
                                     cudaStream_t);                                       \
  template std::size_t select_scratch_bytes<Item>(std::size_t);                           \
  template void launch_select_between(const Item*, std::size_t, std::uint32_t, Item*,     \
                                      ContactCount*, void*, std::size_t, cudaStream_t);   \
  template void launch_both_orders(const Item*, std::size_t, Item*, ContactCount*,        \
                                   const BothOrdersScratch&, cudaStream_t);
JFPX_INSTANTIATE(SpherePair)
JFPX_INSTANTIATE(SphereContact)
#undef JFPX_INSTANTIATE

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
