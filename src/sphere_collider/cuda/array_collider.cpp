/// Searches on arrays in device memory.
#include <jfpx/cuda/array_collider.hpp>
#include <jfpx/error.hpp>

#include "src/sphere_collider/cuda/array_search.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

struct ArrayCollider::Impl : ArraySearch {
  using ArraySearch::ArraySearch;

  /// @param own_cells none if the systems are not periodic
  std::uint64_t find_in_systems(const SphereArrays& from, std::span<const std::uint64_t> ends,
                                std::span<const PeriodicCell> own_cells, ArrayResult result,
                                bool both_orders, Stream user) {
    const DeviceGuard guard(device);
    follow(user);
    reserve_systems(from.count, ends);
    pack(from);
    return with_item(result, [&]<class Item>(std::type_identity<Item>) {
      const std::uint64_t found = ArraySearch::find_in_systems<Item>(ends, own_cells);
      return both_orders && found > 0 ? list_both_orders<Item>(found, user) : found;
    });
  }
};

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
  return impl_->find_in_systems(spheres, offsets, {}, result, both_orders, stream);
}

std::uint64_t ArrayCollider::find_periodic(const SphereArrays& spheres, const PeriodicCell& cell,
                                           ArrayResult result, bool both_orders, Stream stream) {
  const DeviceGuard guard(impl_->device);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->find_periodic<Item>(spheres, nullptr, cell, stream);
    return both_orders && found > 0 ? impl_->list_both_orders<Item>(found, stream) : found;
  });
}

std::uint64_t ArrayCollider::find_periodic_pairs(const SphereArrays& spheres,
                                                 const PeriodicCell& cell, std::int32_t* indices,
                                                 std::int32_t* shifts, std::size_t capacity,
                                                 Stream stream) {
  const DeviceGuard guard(impl_->device);
  return impl_->find_periodic_pairs(spheres, cell, indices, shifts, capacity, stream);
}

std::uint64_t ArrayCollider::find_periodic_pairs(const SphereArrays& spheres,
                                                 const PeriodicCell& cell, std::int64_t* indices,
                                                 std::int32_t* shifts, std::size_t capacity,
                                                 Stream stream) {
  const DeviceGuard guard(impl_->device);
  return impl_->find_periodic_pairs(spheres, cell, indices, shifts, capacity, stream);
}

std::uint64_t ArrayCollider::find_periodic_in_systems(const SphereArrays& spheres,
                                                      std::span<const std::uint64_t> offsets,
                                                      std::span<const PeriodicCell> cells,
                                                      ArrayResult result, bool both_orders,
                                                      Stream stream) {
  detail::check_offsets(offsets, spheres.count);
  detail::check_number_of_cells(cells.size(), offsets);
  const std::uint64_t found =
      impl_->find_in_systems(spheres, offsets, cells, result, both_orders, stream);
  impl_->is_periodic = true;
  return found;
}

std::uint64_t ArrayCollider::find_periodic_between(const SphereArrays& first,
                                                   const SphereArrays& second,
                                                   const PeriodicCell& cell, ArrayResult result,
                                                   Stream stream) {
  const DeviceGuard guard(impl_->device);
  return with_item(result, [&]<class Item>(std::type_identity<Item>) {
    const std::uint64_t found = impl_->find_periodic<Item>(first, &second, cell, stream);
    if (found == 0) return found;
    impl_->follow(stream);
    return impl_->keep(impl_->select_between<Item>(found, impl_->b_offset));
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
    launch_write_shifts(impl_->in_cells, impl_->result<Item>(), shifts, capacity, stream);
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
