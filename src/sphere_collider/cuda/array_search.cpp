/// Searches on arrays in device memory: the streams, the memory, and a search among all spheres.
#include "src/sphere_collider/cuda/array_search.hpp"

#include <jfpx/error.hpp>

#include "src/base/cuda/probe.hpp"
#include "src/sphere_collider/sphere_input.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

void ArraySearch::reserve(std::size_t n, std::size_t most_contacts) {
  collider.reserve(n, most_contacts);
  reserve_spheres(n);
}

void ArraySearch::reserve_spheres(std::size_t n) {
  check_number_of_spheres(n);
  spheres.reserve_geometric(pool, stream.get(), n, "spheres");
}

/// Orders later work of `stream`, where memory is allocated and freed, after that of the user.
void ArraySearch::follow(Stream user) {
  event.order(user, stream.get());
  is_unordered = true;
}

/// Orders later work of the user after that of `stream`.
void ArraySearch::precede(Stream user) {
  if (!is_unordered) return;
  event.order(stream.get(), user);
  is_unordered = false;
}

void ArraySearch::wait() {
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream.get()));
  is_unordered = false;
}

/// Discards the result of the last search.
void ArraySearch::begin(const SphereArrays& first, const SphereArrays* second) {
  is_derived = is_periodic = false;
  number = 0;
  rows = first.count;
  b_offset = second != nullptr ? static_cast<std::uint32_t>(first.count) : 0;
}

/// Begins a search on `stream`.
void ArraySearch::pack(const SphereArrays& first, const SphereArrays* second) {
  begin(first, second);
  launch_pack(first, spheres.data(), stream.get());
  if (second != nullptr) launch_pack(*second, spheres.data() + first.count, stream.get());
}

/// Begins a search on the stream of the user, which saves two events and the wait between streams.
SphereInput ArraySearch::prepare(const SphereArrays& from, Stream user) {
  begin(from);
  if (!collider.fits(from.count) || from.count > spheres.capacity()) {
    follow(user);
    reserve(from.count, 0);
  }
  precede(user);
  const auto n = static_cast<std::uint32_t>(from.count);
  if (collider.is_one_launch(n)) return {.n = n, .arrays = from};
  launch_pack(from, spheres.data(), user);
  return {.spheres = spheres.data(), .n = n};
}

template <class Item>
SearchOutput ArraySearch::to_output(const DeviceBuffer<Item>& out, ContactCount* count) {
  SearchOutput output{.capacity = out.capacity(), .count = count};
  if constexpr (std::is_same_v<Item, SpherePair>) {
    kind = ArrayResult::pairs;
    output.pairs = out.data();
  } else {
    kind = ArrayResult::contacts;
    output.contacts = out.data();
  }
  return output;
}

/// Searches on the stream of the user, and waits for the number of contacts, but not for the
/// contacts.
ArraySearch::PolledCount ArraySearch::search_and_poll(const SphereInput& input, SearchOutput output,
                                                      Stream user) {
  signal.clear();
  output.signal = signal.word();
  collider.find(input, output, user);
  const unsigned long long word = signal.wait(user);
  if ((word & kSignalIsValid) == 0) {
    if (input.periodic.is_one_launch) return {};
    JFPX_CUDA_TRY(cudaStreamSynchronize(user));
    if (input.spheres == nullptr) launch_pack(input.arrays, spheres.data(), user);
    reject(counts.data()->first_invalid, user);
  }
  return {word >> kSignalBits, true, (word & kSignalIsComplete) != 0};
}

/// Searches until there is memory for all results. Returns their number, or none if a search with
/// PeriodicInput::is_one_launch has refused the spheres.
template <class Item>
std::optional<std::uint64_t> ArraySearch::search_to(const SphereInput& input,
                                                    DeviceBuffer<Item>* out, Stream user) {
  while (true) {
    const PolledCount found = search_and_poll(input, to_output(*out, counts.data()), user);
    if (!found.is_valid) return {};
    if (found.is_complete) return found.contacts;
    allocate_for(user, [&] {
      out->reserve_geometric(pool, stream.get(), found.contacts, "contacts");
      collider.reserve(input.n, out->capacity(), input.is_periodic());
    });
  }
}

/// The same for pairs in arrays with room for `capacity`, which may be exceeded by the number.
std::optional<std::uint64_t> ArraySearch::search_to_rows(const SphereInput& input,
                                                         const IndexRows& to, std::size_t capacity,
                                                         Stream user) {
  kind = ArrayResult::pairs;
  const SearchOutput output{.capacity = capacity, .count = counts.data(), .rows = to};
  while (true) {
    const PolledCount found = search_and_poll(input, output, user);
    if (!found.is_valid) return {};
    if (found.is_complete || found.contacts > capacity) return found.contacts;
    allocate_for(user, [&] { collider.reserve(input.n, found.contacts, input.is_periodic()); });
  }
}

template <class Item>
std::uint64_t ArraySearch::find(const SphereArrays& from, Stream user) {
  const SphereInput input = prepare(from, user);
  return keep(*search_to(input, &items<Item>().found, user));
}

template <class Index>
std::uint64_t ArraySearch::find_pairs(const SphereArrays& from, Index* to, std::size_t capacity,
                                      Stream user) {
  return *search_to_rows(prepare(from, user), {.indices = to, .is_wide = sizeof(Index) == 8},
                         capacity, user);
}

template <class Item>
void ArraySearch::search(std::size_t n, const DeviceBuffer<Item>& out, ContactCount* count) {
  collider.find({.spheres = spheres.data(), .n = static_cast<std::uint32_t>(n)},
                to_output(out, count), stream.get());
}

/// Throws InvalidArgument that names the packed sphere.
void ArraySearch::reject(std::uint32_t invalid, cudaStream_t after) {
  counts.data()[0] = {};
  std::vector<SphereInstance> copy(std::size_t{invalid} + 1);
  JFPX_CUDA_TRY(cudaMemcpyAsync(copy.data(), spheres.data(), copy.size() * sizeof copy[0],
                                cudaMemcpyDeviceToHost, after));
  JFPX_CUDA_TRY(cudaStreamSynchronize(after));
  detail::reject_sphere(copy);
}

#define JFPX_INSTANTIATE(Item)                                                               \
  template SearchOutput ArraySearch::to_output(const DeviceBuffer<Item>&, ContactCount*);    \
  template std::optional<std::uint64_t> ArraySearch::search_to(const SphereInput&,           \
                                                               DeviceBuffer<Item>*, Stream); \
  template std::uint64_t ArraySearch::find<Item>(const SphereArrays&, Stream);               \
  template void ArraySearch::search(std::size_t, const DeviceBuffer<Item>&, ContactCount*);
JFPX_INSTANTIATE(SpherePair)
JFPX_INSTANTIATE(SphereContact)
#undef JFPX_INSTANTIATE
#define JFPX_INSTANTIATE(Index) \
  template std::uint64_t ArraySearch::find_pairs(const SphereArrays&, Index*, std::size_t, Stream);
JFPX_INSTANTIATE(std::int32_t)
JFPX_INSTANTIATE(std::int64_t)
#undef JFPX_INSTANTIATE

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
