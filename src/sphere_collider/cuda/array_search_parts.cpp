/// Searches on arrays in device memory among parts of the spheres, in periodic cells, and in both
/// orders.
#include "src/sphere_collider/cuda/array_search.hpp"
#include "src/sphere_collider/cuda/scan.hpp"
#include "src/sphere_collider/cuda/systems.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template <class Item>
std::uint64_t ArraySearch::search_periodic(std::size_t n, const PeriodicCell& cell) {
  const std::size_t all = n + periodic.count_images(spheres.data(), n, cell);
  reserve(all, 0);
  periodic.append_images(spheres.data());
  const std::uint64_t found = search_and_wait(all, &items<Item>().derived, counts.data() + 1);
  return keep_nearest<Item>(found);
}

/// Reserves what search_systems() needs, and copies the offsets.
void ArraySearch::reserve_systems(std::size_t n, std::span<const std::uint64_t> from) {
  reserve_spheres(n);
  row_counts.reserve_geometric(pool, stream.get(), n + 1, "numbers of contacts");
  row_sums.reserve_geometric(pool, stream.get(), n + 1, "sums of numbers of contacts");
  scratch.reserve_geometric(pool, stream.get(), scan_scratch_bytes(n + 1), "scratch of a scan");
  state.reserve_geometric(pool, stream.get(), 1, "states of searches");
  offsets.reserve_geometric(pool, stream.get(), from.size(), "offsets of systems");
  systems = static_cast<std::uint32_t>(from.size() - 1);
  JFPX_CUDA_TRY(cudaMemcpyAsync(offsets.data(), from.data(), from.size_bytes(),
                                cudaMemcpyHostToDevice, stream.get()));
}

template <class Item>
void ArraySearch::search_systems(std::size_t n, const DeviceBuffer<Item>& out, ContactCount* count,
                                 const unsigned long long* image_begins) {
  JFPX_CUDA_TRY(cudaMemsetAsync(state.data(), 0, sizeof(SearchState), stream.get()));
  const SystemsArgs args{.spheres = spheres.data(),
                         .n = static_cast<std::uint32_t>(n),
                         .offsets = offsets.data(),
                         .systems = systems,
                         .image_begins = image_begins,
                         .counts = row_counts.data(),
                         .sums = row_sums.data(),
                         .state = state.data()};
  launch_count_in_systems(args, stream.get());
  exclusive_scan(row_counts.data(), row_sums.data(), n + 1, scratch.data(),
                 scan_scratch_bytes(n + 1), stream.get());
  launch_emit_in_systems(args, to_output(out, count), stream.get());
}

template <class Item>
std::uint64_t ArraySearch::search_periodic_systems(std::span<const std::uint64_t> from,
                                                   std::span<const PeriodicCell> cells) {
  const std::size_t n = from.back();
  const std::size_t images = periodic.count_images(spheres.data(), cells, from, offsets.data());
  reserve_spheres(n + images);
  periodic.append_images(spheres.data());
  DeviceBuffer<Item>& out = items<Item>().derived;
  ContactCount* const count = counts.data() + 1;
  return keep_nearest<Item>(repeat_until_complete(
      [&](bool) { search_systems(n, out, count, periodic.image_begins()); }, &out, count));
}

/// Makes the pairs of nearest images of those among spheres and images in `derived`.
template <class Item>
std::uint64_t ArraySearch::keep_nearest(std::uint64_t found) {
  Items<Item>& list = items<Item>();
  periodic.keep_nearest(list.derived.data(), found, &list.found, counts.data());
  wait();
  is_periodic = true;
  return count_of(0);
}

template <class Item>
std::uint64_t ArraySearch::select_between(std::uint64_t found, std::uint32_t boundary) {
  const std::size_t bytes = select_scratch_bytes<Item>(found);
  scratch.reserve_geometric(pool, stream.get(), bytes, "scratch memory of a selection");
  Items<Item>& list = items<Item>();
  list.derived.reserve_geometric(pool, stream.get(), found, "selected contacts");
  launch_select_between(list.found.data(), found, boundary, list.derived.data(), counts.data() + 1,
                        scratch.data(), bytes, stream.get());
  wait();
  is_derived = true;
  return count_of(1);
}

template <class Item>
std::uint64_t ArraySearch::list_both_orders(std::uint64_t found, Stream user) {
  follow(user);
  const std::size_t bytes = sort_scratch_bytes(found);
  scratch.reserve_geometric(pool, stream.get(), bytes, "scratch memory of a sort");
  keys.reserve_geometric(pool, stream.get(), 2 * found, "keys of a sort");
  indices.reserve_geometric(pool, stream.get(), 2 * found, "values of a sort");
  Items<Item>& list = items<Item>();
  list.derived.reserve_geometric(pool, stream.get(), 2 * found, "contacts in both orders");
  launch_both_orders(list.found.data(), found, list.derived.data(), counts.data() + 1,
                     {.b = keys.data(),
                      .sorted_b = keys.data() + found,
                      .index = indices.data(),
                      .sorted_index = indices.data() + found,
                      .sort = scratch.data(),
                      .sort_bytes = bytes},
                     stream.get());
  is_derived = true;
  precede(user);
  return keep(2 * found);
}

#define JFPX_INSTANTIATE(Item)                                                                     \
  template std::uint64_t ArraySearch::search_periodic<Item>(std::size_t, const PeriodicCell&);     \
  template void ArraySearch::search_systems(std::size_t, const DeviceBuffer<Item>&, ContactCount*, \
                                            const unsigned long long*);                            \
  template std::uint64_t ArraySearch::search_periodic_systems<Item>(                               \
      std::span<const std::uint64_t>, std::span<const PeriodicCell>);                              \
  template std::uint64_t ArraySearch::select_between<Item>(std::uint64_t, std::uint32_t);          \
  template std::uint64_t ArraySearch::list_both_orders<Item>(std::uint64_t, Stream);
JFPX_INSTANTIATE(SpherePair)
JFPX_INSTANTIATE(SphereContact)
#undef JFPX_INSTANTIATE

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
