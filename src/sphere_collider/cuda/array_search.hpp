/// Stages of the searches on arrays in device memory, and their memory.
#pragma once

#include <jfpx/cuda/array_collider.hpp>

#include "src/base/cuda/ordering_event.hpp"
#include "src/sphere_collider/cuda/contact_arrays.hpp"
#include "src/sphere_collider/cuda/device_search.hpp"
#include "src/sphere_collider/cuda/periodic_search.hpp"
#include "src/sphere_collider/cuda/search_signal.hpp"

#include <optional>
#include <span>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Results of one kind: as found, and as selected or in both orders.
template <class Item>
struct Items {
  DeviceBuffer<Item> found, derived;
};

/// Calls run(std::type_identity<Item>) for the items of a kind of result.
template <class Run>
auto with_item(ArrayResult kind, const Run& run) {
  return kind == ArrayResult::pairs ? run(std::type_identity<SpherePair>{})
                                    : run(std::type_identity<SphereContact>{});
}

/// Searches on a stream of its own, or on that of the user, which is faster: memory is allocated
/// and freed in the order of the former.
struct ArraySearch {
  ArraySearch(int device_to_use, SphereAlgorithm algorithm)
      : device(usable_device(device_to_use)),
        stream(device),
        pool(device),
        collider(stream.get(), device, algorithm),
        event(device),
        periodic(pool, stream.get()) {
    counts.reserve(2, "numbers of contacts");
    counts.data()[0] = counts.data()[1] = {};
  }

  template <class Item>
  Items<Item>& items() {
    if constexpr (std::is_same_v<Item, SpherePair>) {
      return pairs;
    } else {
      return contacts;
    }
  }
  void reserve(std::size_t n, std::size_t most_contacts);
  void reserve_spheres(std::size_t n);
  void follow(Stream user);
  void precede(Stream user);
  void wait();
  void begin(const SphereArrays& first, const SphereArrays* second = nullptr);
  void pack(const SphereArrays& first, const SphereArrays* second = nullptr);
  SphereInput prepare(const SphereArrays& from, Stream user);
  template <class Item>
  SearchOutput to_output(const DeviceBuffer<Item>& out, ContactCount* count);
  /// Number of contacts of a search, and whether they fit into the output. Not valid if a search
  /// with PeriodicInput::is_one_launch has refused the spheres.
  struct PolledCount {
    std::uint64_t contacts;
    bool is_valid, is_complete;
  };
  PolledCount search_and_poll(const SphereInput& input, SearchOutput output, Stream user);
  template <class Item>
  std::uint64_t find(const SphereArrays& from, Stream user);
  template <class Item>
  std::optional<std::uint64_t> search_to(const SphereInput& input, DeviceBuffer<Item>* out,
                                         Stream user);
  std::optional<std::uint64_t> search_to_rows(const SphereInput& input, const IndexRows& to,
                                              std::size_t capacity, Stream user);
  template <class Index>
  std::uint64_t find_pairs(const SphereArrays& from, Index* to, std::size_t capacity, Stream user);
  template <class Item>
  void search(std::size_t n, const DeviceBuffer<Item>& out, ContactCount* count);
  template <class Item>
  void search_systems(std::size_t n, const DeviceBuffer<Item>& out);
  /// Searches among n packed spheres until there is memory for all contacts. Returns their number.
  template <class Item>
  std::uint64_t search_and_wait(std::size_t n, DeviceBuffer<Item>* out, ContactCount* count) {
    while (true) {
      search(n, *out, count);
      wait();
      if (count->first_invalid != kNoSphere) reject(count->first_invalid, stream.get());
      if (count->complete != 0) return count->contacts;
      out->reserve_geometric(pool, stream.get(), count->contacts, "contacts");
      collider.reserve(n, out->capacity());
    }
  }
  template <class Item>
  std::uint64_t search_and_wait(std::size_t n) {
    return search_and_wait(n, &items<Item>().found, counts.data());
  }
  template <class Item>
  std::uint64_t find_in_systems(std::span<const std::uint64_t> from,
                                std::span<const PeriodicCell> own_cells = {});
  void reserve_grid(std::size_t n, Stream user);
  SphereInput prepare_periodic(const SphereArrays& first, const SphereArrays& second,
                               const PeriodicCell& cell, Stream user);
  bool has_all_images(const PeriodicCell& cell, Stream user);
  template <class Search>
  std::uint64_t search_in_cell(const SphereArrays& first, const SphereArrays* second,
                               const PeriodicCell& cell, Stream user, const Search& search);
  template <class Index>
  std::uint64_t find_periodic_pairs(const SphereArrays& from, const PeriodicCell& cell, Index* to,
                                    std::int32_t* shifts, std::size_t capacity, Stream user);
  template <class Item>
  std::uint64_t find_periodic(const SphereArrays& first, const SphereArrays* second,
                              const PeriodicCell& cell, Stream user);
  std::uint64_t count_of(int which) const { return counts.data()[which].contacts; }
  /// Calls allocate() while the stream of the user waits.
  template <class Allocate>
  void allocate_for(Stream user, const Allocate& allocate) {
    follow(user);
    allocate();
    precede(user);
  }
  std::uint64_t keep(std::uint64_t found) { return number.emplace(found); }
  [[noreturn]] void reject(std::uint32_t invalid, cudaStream_t after);
  template <class Item>
  std::uint64_t select_between(std::uint64_t found, std::uint32_t boundary);
  template <class Item>
  std::uint64_t list_both_orders(std::uint64_t found, Stream user);
  void reserve_systems(std::size_t n, std::span<const std::uint64_t> from);
  template <class Item>
  FoundItems<Item> result() {
    const Items<Item>& list = items<Item>();
    return {.items = is_derived ? list.derived.data() : list.found.data(),
            .n = number.value_or(0),
            .count = number.has_value() ? nullptr : counts.data(),
            .b_offset = b_offset};
  }

  int device;
  OwnedStream stream;
  MemoryPool pool;
  DeviceSearch collider;
  OrderingEvent event;
  DeviceBuffer<SphereInstance> spheres;
  Items<SpherePair> pairs;
  Items<SphereContact> contacts;
  PinnedBuffer<ContactCount> counts;  // of `found` and of `derived`
  SearchSignal signal;
  bool is_unordered = false;  // the stream of the user does not follow all work of `stream`
  DeviceBuffer<unsigned char> scratch;
  DeviceBuffer<std::uint32_t> keys;
  // Of searches in systems.
  DeviceBuffer<std::uint64_t> offsets;
  std::uint32_t systems = 0;
  DeviceBuffer<std::uint32_t> row_counts;
  DeviceBuffer<unsigned long long> row_sums;
  DeviceBuffer<SearchState> state;
  DeviceBuffer<unsigned long long> indices;
  DeviceBuffer<PeriodicCell> periodic_cells;
  PeriodicSearch periodic;

  // The last search.
  ArrayResult kind = ArrayResult::pairs;
  bool is_derived = false, is_periodic = false;
  // Searches in a periodic cell until one launch is tried again, which an earlier one has refused.
  unsigned searches_in_phases = 0;
  SpheresInCells in_cells;
  std::optional<std::uint64_t> number = 0;  // of contacts, unless it is only on the device
  std::size_t rows = 0;
  std::uint32_t b_offset = 0;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
