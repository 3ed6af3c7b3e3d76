/// Searches on arrays in device memory among parts of the spheres, in periodic cells, and in both
/// orders.
#include "src/sphere_collider/cuda/array_search.hpp"
#include "src/sphere_collider/cuda/scan.hpp"
#include "src/sphere_collider/cuda/systems.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

void ArraySearch::reserve_grid(std::size_t n, Stream user) {
  if (collider.fits(n, true)) return;
  const std::size_t with_slack = std::min(n + n / 8, kMaxSpheres);
  allocate_for(user, [&] { collider.reserve(with_slack, 0, true); });
}

/// Begins a search in a periodic cell on the stream of the user: enqueues the spheres and images,
/// repeatedly until there is room for all images. A search in one launch takes their number from
/// the device; others wait for it.
SphereInput ArraySearch::prepare_periodic(const SphereArrays& first, const SphereArrays& second,
                                          const PeriodicCell& cell, Stream user) {
  const std::size_t n = first.count + second.count;
  while (true) {
    if (n > spheres.capacity() || !periodic.fits(n)) {
      allocate_for(user, [&] {
        reserve_spheres(n);
        periodic.reserve(n);
      });
    }
    const std::size_t limit = n + periodic.capacity_for(n);
    const bool is_one_launch = searches_in_phases == 0 && is_in_one_launch(limit);
    if (is_one_launch) reserve_grid(limit, user);
    precede(user);
    periodic.enqueue(first, second, spheres.data(), cell, user);
    if (is_one_launch) return periodic.input_on_device();
    if (!has_all_images(cell, user)) continue;
    const SphereInput input = periodic.input();
    reserve_grid(input.n, user);
    return input;
  }
}

/// Waits, and returns whether there was room for all images. Throws InvalidArgument if the spheres
/// or the cell are invalid.
bool ArraySearch::has_all_images(const PeriodicCell& cell, Stream user) {
  const PeriodicSearch::Images images = periodic.wait(user);
  const std::size_t n = periodic.number_of_spheres();
  if (!images.is_valid) {
    check_periodic(spheres.data(), n, cell, user);
    throw InvalidArgument("a sphere was invalid, and is not any more: another stream writes them");
  }
  check_number_of_spheres(n + images.count);
  return images.is_complete;
}

/// Calls search(input), and again if it needs more images or several launches.
template <class Search>
std::uint64_t ArraySearch::search_in_cell(const SphereArrays& first, const SphereArrays* second,
                                          const PeriodicCell& cell, Stream user,
                                          const Search& search) {
  begin(first, second);
  const SphereArrays none{}, &others = second != nullptr ? *second : none;
  check_number_of_spheres(first.count + others.count);
  if (first.count + others.count == 0) detail::check_in_cell(cell, {});
  std::optional<std::uint64_t> found;
  while (!found.has_value()) {
    const SphereInput input = prepare_periodic(first, others, cell, user);
    found = search(input);
    if (!input.periodic.is_one_launch) {
      if (searches_in_phases > 0) --searches_in_phases;
    } else if (has_all_images(cell, user) && !found.has_value()) {
      constexpr unsigned kUntilNextTrial = 16;
      searches_in_phases = kUntilNextTrial;
      found = search(periodic.input());
    }
  }
  in_cells = periodic.spheres();
  is_periodic = true;
  return *found;
}

template <class Index>
std::uint64_t ArraySearch::find_periodic_pairs(const SphereArrays& from, const PeriodicCell& cell,
                                               Index* to, std::int32_t* shifts,
                                               std::size_t capacity, Stream user) {
  const std::uint64_t found =
      search_in_cell(from, nullptr, cell, user, [&](const SphereInput& input) {
        const IndexRows output{.indices = to,
                               .is_wide = sizeof(Index) == 8,
                               .shifts = shifts,
                               .points = periodic.spheres().points};
        return search_to_rows(input, output, capacity, user);
      });
  if (found > capacity) return found;
  launch_write_shifts(in_cells, PairRows<Index>{to, found}, shifts, found, user);
  return found;
}

/// Finds pairs among spheres and images. Contacts are then made from the given spheres.
template <class Item>
std::uint64_t ArraySearch::find_periodic(const SphereArrays& first, const SphereArrays* second,
                                         const PeriodicCell& cell, Stream user) {
  const std::uint64_t found = search_in_cell(
      first, second, cell, user,
      [&](const SphereInput& input) { return search_to(input, &pairs.found, user); });
  if constexpr (std::is_same_v<Item, SphereContact>) {
    kind = ArrayResult::contacts;
    if (found > contacts.found.capacity()) {
      allocate_for(
          user, [&] { contacts.found.reserve_geometric(pool, stream.get(), found, "contacts"); });
    }
    launch_make_contacts(in_cells, pairs.found.data(), found, contacts.found.data(), user);
  }
  return keep(found);
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
void ArraySearch::search_systems(std::size_t n, const DeviceBuffer<Item>& out) {
  JFPX_CUDA_TRY(cudaMemsetAsync(state.data(), 0, sizeof(SearchState), stream.get()));
  const SystemsArgs args{.spheres = spheres.data(),
                         .n = static_cast<std::uint32_t>(n),
                         .offsets = offsets.data(),
                         .systems = systems,
                         .cells = in_cells.cells,
                         .counts = row_counts.data(),
                         .sums = row_sums.data(),
                         .state = state.data()};
  launch_count_in_systems(args, stream.get());
  exclusive_scan(row_counts.data(), row_sums.data(), n + 1, scratch.data(),
                 scan_scratch_bytes(n + 1), stream.get());
  launch_emit_in_systems(args, to_output(out, counts.data()), stream.get());
}

/// Searches in systems whose spheres are packed.
/// @param own_cells one for each system, or none
template <class Item>
std::uint64_t ArraySearch::find_in_systems(std::span<const std::uint64_t> from,
                                           std::span<const PeriodicCell> own_cells) {
  const std::size_t n = from.back();
  in_cells = {};
  if (!own_cells.empty()) {
    periodic_cells.reserve_geometric(pool, stream.get(), own_cells.size(), "periodic cells");
    JFPX_CUDA_TRY(cudaMemcpyAsync(periodic_cells.data(), own_cells.data(), own_cells.size_bytes(),
                                  cudaMemcpyHostToDevice, stream.get()));
    in_cells = {.spheres = spheres.data(),
                .cells = periodic_cells.data(),
                .offsets = offsets.data(),
                .systems = systems};
    const bool fit = std::all_of(own_cells.begin(), own_cells.end(), [](const PeriodicCell& cell) {
      return detail::fits(cell, 0);  // also those of empty systems
    });
    if (!fit) check_periodic(spheres.data(), own_cells, from, stream.get());
  }
  DeviceBuffer<Item>& out = items<Item>().found;
  while (true) {
    search_systems(n, out);
    wait();
    const ContactCount& count = *counts.data();
    if (count.first_invalid != kNoSphere) {
      if (!own_cells.empty()) check_periodic(spheres.data(), own_cells, from, stream.get());
      reject(count.first_invalid, stream.get());
    }
    if (count.complete != 0) return keep(count.contacts);
    out.reserve_geometric(pool, stream.get(), count.contacts, "contacts");
  }
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

#define JFPX_INSTANTIATE(Item)                                                              \
  template std::uint64_t ArraySearch::find_periodic<Item>(                                  \
      const SphereArrays&, const SphereArrays*, const PeriodicCell&, Stream);               \
  template std::uint64_t ArraySearch::find_in_systems<Item>(std::span<const std::uint64_t>, \
                                                            std::span<const PeriodicCell>); \
  template std::uint64_t ArraySearch::select_between<Item>(std::uint64_t, std::uint32_t);   \
  template std::uint64_t ArraySearch::list_both_orders<Item>(std::uint64_t, Stream);
JFPX_INSTANTIATE(SpherePair)
JFPX_INSTANTIATE(SphereContact)
#undef JFPX_INSTANTIATE
template std::uint64_t ArraySearch::find_periodic_pairs(const SphereArrays&, const PeriodicCell&,
                                                        std::int32_t*, std::int32_t*, std::size_t,
                                                        Stream);
template std::uint64_t ArraySearch::find_periodic_pairs(const SphereArrays&, const PeriodicCell&,
                                                        std::int64_t*, std::int32_t*, std::size_t,
                                                        Stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
