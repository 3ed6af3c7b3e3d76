/// Searches on arrays in device memory: packs them, searches on a stream of its own, and keeps the
/// result for the output.
#include <jfpx/cuda/array_collider.hpp>
#include <jfpx/error.hpp>

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"
#include "src/base/pause.hpp"
#include "src/sphere_collider/cuda/contact_arrays.hpp"
#include "src/sphere_collider/cuda/device_search.hpp"
#include "src/sphere_collider/cuda/periodic_search.hpp"
#include "src/sphere_collider/cuda/scan.hpp"
#include "src/sphere_collider/cuda/systems.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <atomic>
#include <chrono>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// Owner of an event that only orders streams.
class OrderingEvent {
 public:
  explicit OrderingEvent(int device) {
    const DeviceGuard guard(device);
    JFPX_CUDA_TRY(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming));
  }
  ~OrderingEvent() { static_cast<void>(cudaEventDestroy(event_)); }
  OrderingEvent(const OrderingEvent&) = delete;
  OrderingEvent& operator=(const OrderingEvent&) = delete;

  /// Later work of `second` waits for all earlier work of `first`.
  void order(cudaStream_t first, cudaStream_t second) {
    JFPX_CUDA_TRY(cudaEventRecord(event_, first));
    JFPX_CUDA_TRY(cudaStreamWaitEvent(second, event_, 0));
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// Results of one kind: as found, and as selected or in both orders. A search in a periodic cell
/// begins with the pairs among spheres and images in `derived`.
template <class Item>
struct Items {
  DeviceBuffer<Item> found, derived;
};

/// Word of host memory that a kernel stores to while the host polls it.
class Signal {
 public:
  Signal() { word_.reserve(1, "signals"); }
  unsigned long long* word() const { return word_.data(); }
  void clear() { *word_.data() = kNoSignal; }
  /// Waits for the kernel. Polls for a millisecond, as searches are shorter unless `stream` has
  /// earlier work. @throws DeviceError
  unsigned long long wait(cudaStream_t stream) const {
    const std::atomic_ref<unsigned long long> word(*word_.data());
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
    do {
      for (int k = 0; k < 64; ++k) {
        const unsigned long long value = word.load(std::memory_order_acquire);
        if (value != kNoSignal) return value;
        pause();
      }
    } while (std::chrono::steady_clock::now() < end);
    JFPX_CUDA_TRY(cudaStreamSynchronize(stream));
    return word.load(std::memory_order_acquire);
  }

 private:
  PinnedBuffer<unsigned long long> word_;
};

/// Calls run(std::type_identity<Item>) for the items of a kind of result.
template <class Run>
auto with_item(ArrayResult kind, const Run& run) {
  return kind == ArrayResult::pairs ? run(std::type_identity<SpherePair>{})
                                    : run(std::type_identity<SphereContact>{});
}

}  // namespace

struct ArrayCollider::Impl {
  Impl(int device_to_use, SphereAlgorithm algorithm)
      : device(device_to_use),
        stream(checked(device)),
        pool(device),
        collider(stream.get(), device, algorithm),
        event(device),
        periodic(pool, stream.get()) {
    counts.reserve(2, "numbers of contacts");
    counts.data()[0] = counts.data()[1] = {};
  }

  /// @throws BackendUnavailable, with the reason, before the first call of CUDA
  static int checked(int device) {
    const BackendStatus status = probe(device);
    if (!status.usable) throw BackendUnavailable("cuda: " + status.reason);
    return device;
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
  struct Answer {
    std::uint64_t contacts;
    bool is_complete;
  };
  Answer search_and_poll(const SphereInput& input, SearchOutput output, Stream user);
  template <class Item>
  std::uint64_t find(const SphereArrays& from, Stream user);
  template <class Index>
  std::uint64_t find_pairs(const SphereArrays& from, Index* to, std::size_t capacity, Stream user);
  template <class Item>
  void search(std::size_t n, const DeviceBuffer<Item>& out, ContactCount* count);
  template <class Item>
  void search_systems(std::size_t n, const DeviceBuffer<Item>& out, ContactCount* count,
                      const unsigned long long* image_begins = nullptr);
  template <class Item, class Search>
  std::uint64_t repeat_until_complete(const Search& enqueue, DeviceBuffer<Item>* out,
                                      const ContactCount* count);
  template <class Item>
  std::uint64_t search_and_wait(std::size_t n, DeviceBuffer<Item>* out, ContactCount* count) {
    const auto enqueue = [&](bool again) {
      if (again) collider.reserve(n, out->capacity());
      search(n, *out, count);
    };
    return repeat_until_complete(enqueue, out, count);
  }
  template <class Item>
  std::uint64_t search_and_wait(std::size_t n) {
    return search_and_wait(n, &items<Item>().found, counts.data());
  }
  template <class Item>
  std::uint64_t search_periodic(std::size_t n, const PeriodicCell& cell);
  template <class Item>
  std::uint64_t search_periodic_systems(std::span<const std::uint64_t> from,
                                        std::span<const PeriodicCell> cells);
  template <class Item>
  std::uint64_t keep_nearest(std::uint64_t found);
  std::uint64_t count_of(int which) const { return counts.data()[which].contacts; }
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
  Signal signal;
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
  PeriodicSearch periodic;

  // The last search.
  ArrayResult kind = ArrayResult::pairs;
  bool is_derived = false, is_periodic = false;
  std::optional<std::uint64_t> number = 0;  // of contacts, unless it is only on the device
  std::size_t rows = 0;
  std::uint32_t b_offset = 0;
};

void ArrayCollider::Impl::reserve(std::size_t n, std::size_t most_contacts) {
  collider.reserve(n, most_contacts);
  reserve_spheres(n);
}

void ArrayCollider::Impl::reserve_spheres(std::size_t n) {
  check_number_of_spheres(n);
  spheres.reserve_geometric(pool, stream.get(), n, "spheres");
}

/// Orders later work of `stream`, where memory is allocated and freed, after that of the user.
void ArrayCollider::Impl::follow(Stream user) {
  event.order(user, stream.get());
  is_unordered = true;
}

/// Orders later work of the user after that of `stream`.
void ArrayCollider::Impl::precede(Stream user) {
  if (!is_unordered) return;
  event.order(stream.get(), user);
  is_unordered = false;
}

void ArrayCollider::Impl::wait() {
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream.get()));
  is_unordered = false;
}

/// Discards the result of the last search.
void ArrayCollider::Impl::begin(const SphereArrays& first, const SphereArrays* second) {
  is_derived = is_periodic = false;
  number = 0;
  rows = first.count;
  b_offset = second != nullptr ? static_cast<std::uint32_t>(first.count) : 0;
}

/// Begins a search on `stream`.
void ArrayCollider::Impl::pack(const SphereArrays& first, const SphereArrays* second) {
  begin(first, second);
  launch_pack(first, spheres.data(), stream.get());
  if (second != nullptr) launch_pack(*second, spheres.data() + first.count, stream.get());
}

/// Begins a search on the stream of the user, which saves two events and the wait between streams.
SphereInput ArrayCollider::Impl::prepare(const SphereArrays& from, Stream user) {
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
SearchOutput ArrayCollider::Impl::to_output(const DeviceBuffer<Item>& out, ContactCount* count) {
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

/// Searches on the stream of the user, and waits for the number of contacts, but not for them.
ArrayCollider::Impl::Answer ArrayCollider::Impl::search_and_poll(const SphereInput& input,
                                                                 SearchOutput output, Stream user) {
  signal.clear();
  output.signal = signal.word();
  collider.find(input, output, user);
  const unsigned long long answer = signal.wait(user);
  if ((answer & kSignalIsValid) == 0) {
    JFPX_CUDA_TRY(cudaStreamSynchronize(user));
    if (input.spheres == nullptr) launch_pack(input.arrays, spheres.data(), user);
    reject(counts.data()->first_invalid, user);
  }
  return {answer >> kSignalBits, (answer & kSignalIsComplete) != 0};
}

template <class Item>
std::uint64_t ArrayCollider::Impl::find(const SphereArrays& from, Stream user) {
  const SphereInput input = prepare(from, user);
  DeviceBuffer<Item>& out = items<Item>().found;
  while (true) {
    const Answer answer = search_and_poll(input, to_output(out, counts.data()), user);
    if (answer.is_complete) return keep(answer.contacts);
    follow(user);
    out.reserve_geometric(pool, stream.get(), answer.contacts, "contacts");
    collider.reserve(from.count, out.capacity());
    precede(user);
  }
}

template <class Index>
std::uint64_t ArrayCollider::Impl::find_pairs(const SphereArrays& from, Index* to,
                                              std::size_t capacity, Stream user) {
  if (!collider.is_one_launch(from.count)) {
    const std::uint64_t found = find<SpherePair>(from, user);
    if (found <= capacity) {
      launch_write_pairs(result<SpherePair>(), to, to + found, found, user);
    }
    return found;
  }
  const SphereInput input = prepare(from, user);
  kind = ArrayResult::pairs;
  const SearchOutput output{.capacity = capacity,
                            .count = counts.data(),
                            .rows = {.indices = to, .is_wide = sizeof(Index) == 8}};
  while (true) {
    const Answer answer = search_and_poll(input, output, user);
    if (answer.is_complete || answer.contacts > capacity) return answer.contacts;
    follow(user);
    collider.reserve(from.count, answer.contacts);
    precede(user);
  }
}

template <class Item>
void ArrayCollider::Impl::search(std::size_t n, const DeviceBuffer<Item>& out,
                                 ContactCount* count) {
  collider.find({.spheres = spheres.data(), .n = static_cast<std::uint32_t>(n)},
                to_output(out, count), stream.get());
}

template <class Item>
std::uint64_t ArrayCollider::Impl::search_periodic(std::size_t n, const PeriodicCell& cell) {
  const std::size_t all = n + periodic.count_images(spheres.data(), n, cell);
  reserve(all, 0);
  periodic.append_images(spheres.data());
  const std::uint64_t found = search_and_wait(all, &items<Item>().derived, counts.data() + 1);
  return keep_nearest<Item>(found);
}

/// Reserves what search_systems() needs, and copies the offsets.
void ArrayCollider::Impl::reserve_systems(std::size_t n, std::span<const std::uint64_t> from) {
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
void ArrayCollider::Impl::search_systems(std::size_t n, const DeviceBuffer<Item>& out,
                                         ContactCount* count,
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
std::uint64_t ArrayCollider::Impl::search_periodic_systems(std::span<const std::uint64_t> from,
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
std::uint64_t ArrayCollider::Impl::keep_nearest(std::uint64_t found) {
  Items<Item>& list = items<Item>();
  periodic.keep_nearest(list.derived.data(), found, &list.found, counts.data());
  wait();
  is_periodic = true;
  return count_of(0);
}

/// Calls enqueue(again) until there is memory for all contacts. Returns their number.
template <class Item, class Search>
std::uint64_t ArrayCollider::Impl::repeat_until_complete(const Search& enqueue,
                                                         DeviceBuffer<Item>* out,
                                                         const ContactCount* count) {
  for (bool again = false;; again = true) {
    enqueue(again);
    wait();
    if (count->first_invalid != kNoSphere) reject(count->first_invalid, stream.get());
    if (count->complete != 0) return count->contacts;
    out->reserve_geometric(pool, stream.get(), count->contacts, "contacts");
  }
}

/// Throws InvalidArgument that names the packed sphere.
void ArrayCollider::Impl::reject(std::uint32_t invalid, cudaStream_t after) {
  counts.data()[0] = {};
  std::vector<SphereInstance> copy(std::size_t{invalid} + 1);
  JFPX_CUDA_TRY(cudaMemcpyAsync(copy.data(), spheres.data(), copy.size() * sizeof copy[0],
                                cudaMemcpyDeviceToHost, after));
  JFPX_CUDA_TRY(cudaStreamSynchronize(after));
  detail::reject_sphere(copy);
}

template <class Item>
std::uint64_t ArrayCollider::Impl::select_between(std::uint64_t found, std::uint32_t boundary) {
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
std::uint64_t ArrayCollider::Impl::list_both_orders(std::uint64_t found, Stream user) {
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

ArrayCollider::ArrayCollider(int device, SphereAlgorithm algorithm)
    : impl_(std::make_unique<Impl>(device, algorithm)) {}
ArrayCollider::~ArrayCollider() {
  if (impl_ == nullptr) return;
  try {
    const DeviceGuard guard(impl_->device);
    // Streams of the caller may use the memory.
    static_cast<void>(JFPX_CUDA_RESULT(cudaDeviceSynchronize()));
    impl_.reset();
  } catch (const DeviceError&) {
    impl_.reset();  // the device is lost
  }
}
ArrayCollider::ArrayCollider(ArrayCollider&&) noexcept = default;
ArrayCollider& ArrayCollider::operator=(ArrayCollider&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

void ArrayCollider::reserve(std::size_t spheres, std::size_t contacts) {
  const DeviceGuard guard(impl_->device);
  JFPX_CUDA_TRY(cudaDeviceSynchronize());  // a stream of the caller may read what is reallocated
  impl_->reserve(spheres, contacts);
  impl_->pairs.found.reserve(impl_->pool, impl_->stream.get(), contacts, "pairs");
  impl_->contacts.found.reserve(impl_->pool, impl_->stream.get(), contacts, "contacts");
  impl_->wait();
}

std::uint64_t ArrayCollider::find(const SphereArrays& spheres, ArrayResult result, bool both_orders,
                                  Stream stream) {
  const DeviceGuard guard(impl_->device);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->find<Item>(spheres, stream);
    return both_orders && found > 0 ? impl_->list_both_orders<Item>(found, stream) : found;
  });
}

std::uint64_t ArrayCollider::find_pairs(const SphereArrays& spheres, std::int32_t* indices,
                                        std::size_t capacity, Stream stream) {
  const DeviceGuard guard(impl_->device);
  return impl_->find_pairs(spheres, indices, capacity, stream);
}

std::uint64_t ArrayCollider::find_pairs(const SphereArrays& spheres, std::int64_t* indices,
                                        std::size_t capacity, Stream stream) {
  const DeviceGuard guard(impl_->device);
  return impl_->find_pairs(spheres, indices, capacity, stream);
}

std::uint64_t ArrayCollider::find_between(const SphereArrays& first, const SphereArrays& second,
                                          ArrayResult result, Stream stream) {
  const DeviceGuard guard(impl_->device);
  const std::size_t n = first.count + second.count;
  impl_->follow(stream);
  impl_->reserve(n, 0);
  impl_->pack(first, &second);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->search_and_wait<Item>(n);
    return impl_->keep(found == 0 ? found : impl_->select_between<Item>(found, impl_->b_offset));
  });
}

std::uint64_t ArrayCollider::find_in_systems(const SphereArrays& spheres,
                                             std::span<const std::uint64_t> offsets,
                                             ArrayResult result, bool both_orders, Stream stream) {
  detail::check_offsets(offsets, spheres.count);
  const DeviceGuard guard(impl_->device);
  impl_->follow(stream);
  impl_->reserve_systems(spheres.count, offsets);
  impl_->pack(spheres);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    DeviceBuffer<Item>& out = impl_->items<Item>().found;
    ContactCount* const count = impl_->counts.data();
    const std::uint64_t found = impl_->repeat_until_complete(
        [&](bool) { impl_->search_systems(spheres.count, out, count); }, &out, count);
    impl_->keep(found);
    return both_orders && found > 0 ? impl_->list_both_orders<Item>(found, stream) : found;
  });
}

std::uint64_t ArrayCollider::find_periodic(const SphereArrays& spheres, const PeriodicCell& cell,
                                           ArrayResult result, bool both_orders, Stream stream) {
  const DeviceGuard guard(impl_->device);
  impl_->follow(stream);
  impl_->reserve(spheres.count, 0);
  impl_->pack(spheres);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->search_periodic<Item>(spheres.count, cell);
    impl_->keep(found);
    return both_orders && found > 0 ? impl_->list_both_orders<Item>(found, stream) : found;
  });
}

std::uint64_t ArrayCollider::find_periodic_in_systems(const SphereArrays& spheres,
                                                      std::span<const std::uint64_t> offsets,
                                                      std::span<const PeriodicCell> cells,
                                                      ArrayResult result, bool both_orders,
                                                      Stream stream) {
  detail::check_offsets(offsets, spheres.count);
  detail::check_number_of_cells(cells, offsets);
  const DeviceGuard guard(impl_->device);
  impl_->follow(stream);
  impl_->reserve_systems(spheres.count, offsets);
  impl_->pack(spheres);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->search_periodic_systems<Item>(offsets, cells);
    impl_->keep(found);
    return both_orders && found > 0 ? impl_->list_both_orders<Item>(found, stream) : found;
  });
}

std::uint64_t ArrayCollider::find_periodic_between(const SphereArrays& first,
                                                   const SphereArrays& second,
                                                   const PeriodicCell& cell, ArrayResult result,
                                                   Stream stream) {
  const DeviceGuard guard(impl_->device);
  const std::size_t n = first.count + second.count;
  impl_->follow(stream);
  impl_->reserve(n, 0);
  impl_->pack(first, &second);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->search_periodic<Item>(n, cell);
    return impl_->keep(found == 0 ? found : impl_->select_between<Item>(found, impl_->b_offset));
  });
}

void ArrayCollider::enqueue(const SphereArrays& spheres, ArrayResult result, Stream stream) {
  const DeviceGuard guard(impl_->device);
  impl_->collider.require_reserved(spheres.count);
  const SphereInput input = impl_->prepare(spheres, stream);
  with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const DeviceBuffer<Item>& out = impl_->items<Item>().found;
    impl_->collider.find(input, impl_->to_output(out, impl_->counts.data()), stream);
  });
  impl_->number.reset();
}

void ArrayCollider::write_pairs(std::int32_t* a, std::int32_t* b, std::size_t capacity,
                                Stream stream) {
  const DeviceGuard guard(impl_->device);
  with_item(impl_->kind, [&]<class Item>(std::type_identity<Item>) {
    launch_write_pairs(impl_->result<Item>(), a, b, capacity, stream);
  });
}

void ArrayCollider::write_pairs(std::int64_t* a, std::int64_t* b, std::size_t capacity,
                                Stream stream) {
  const DeviceGuard guard(impl_->device);
  with_item(impl_->kind, [&]<class Item>(std::type_identity<Item>) {
    launch_write_pairs(impl_->result<Item>(), a, b, capacity, stream);
  });
}

void ArrayCollider::write_contacts(Real* normals, Real* distances, std::size_t capacity,
                                   Stream stream) {
  if (impl_->kind != ArrayResult::contacts) {
    throw InvalidArgument("the last search was for pairs, which have no normals");
  }
  const DeviceGuard guard(impl_->device);
  launch_write_contacts(impl_->result<SphereContact>(), normals, distances, capacity, stream);
}

void ArrayCollider::write_shifts(std::int32_t* shifts, std::size_t capacity, Stream stream) {
  if (!impl_->is_periodic) {
    throw InvalidArgument("the last search was not in a periodic cell, so it has no shifts");
  }
  const DeviceGuard guard(impl_->device);
  with_item(impl_->kind, [&]<class Item>(std::type_identity<Item>) {
    const FoundItems<Item> half{.items = impl_->items<Item>().found.data(),
                                .n = impl_->count_of(0)};
    launch_write_shifts(impl_->result<Item>(), half, impl_->periodic.shifts(), shifts, capacity,
                        stream);
  });
}

void ArrayCollider::write_offsets(std::int64_t* offsets, Stream stream) {
  const DeviceGuard guard(impl_->device);
  with_item(impl_->kind, [&]<class Item>(std::type_identity<Item>) {
    launch_write_offsets(impl_->result<Item>(), offsets, impl_->rows, stream);
  });
}

void ArrayCollider::write_count(std::int64_t* count, Stream stream) {
  const DeviceGuard guard(impl_->device);
  launch_write_count(impl_->counts.data() + (impl_->is_derived ? 1 : 0), count, stream);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
