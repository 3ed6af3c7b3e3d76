/// Conversions between the arrays of other libraries and those of the searches.
#pragma once

#include <jfpx/cuda/array_collider.hpp>

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Contacts or pairs of a search in device memory.
template <class Item>
struct FoundItems {
  const Item* items = nullptr;
  std::uint64_t n = 0;                  ///< number of items, if `count` is null
  const ContactCount* count = nullptr;  ///< the same, if it is only on the device
  std::uint32_t b_offset = 0;           ///< subtracted from each index b
};

/// Enqueues spheres[i] = {positions of row i, radius of i}.
void launch_pack(const SphereArrays& arrays, SphereInstance* spheres, cudaStream_t stream);

/// Enqueue the output of up to `capacity` items. `Item` is SpherePair or SphereContact, `Index`
/// std::int32_t or std::int64_t.
template <class Item, class Index>
void launch_write_pairs(const FoundItems<Item>& found, Index* a, Index* b, std::size_t capacity,
                        cudaStream_t stream);
void launch_write_contacts(const FoundItems<SphereContact>& found, Real* normals, Real* distances,
                           std::size_t capacity, cudaStream_t stream);
template <class Item>
void launch_write_offsets(const FoundItems<Item>& found, std::int64_t* offsets, std::size_t rows,
                          cudaStream_t stream);
void launch_write_count(const ContactCount* count, std::int64_t* out, cudaStream_t stream);

/// Scratch memory of the two functions below, in bytes, for `n` items.
template <class Item>
std::size_t select_scratch_bytes(std::size_t n);
std::size_t sort_scratch_bytes(std::size_t n);

/// Enqueues the selection of the items with a < boundary <= b, in order, and their count.
template <class Item>
void launch_select_between(const Item* items, std::size_t n, std::uint32_t boundary, Item* selected,
                           ContactCount* count, void* scratch, std::size_t scratch_bytes,
                           cudaStream_t stream);

/// Buffers of launch_both_orders(), for n items.
struct BothOrdersScratch {
  std::uint32_t *b, *sorted_b;               ///< [n]
  unsigned long long *index, *sorted_index;  ///< [n]
  void* sort;                                ///< [sort_bytes]
  std::size_t sort_bytes;
};
/// Enqueues the sorted list of the n items and their opposites: 2 n items, and their count.
template <class Item>
void launch_both_orders(const Item* items, std::size_t n, Item* both, ContactCount* count,
                        const BothOrdersScratch& scratch, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
