/// Searches whose input and output are in device memory.
#include <jfpx/cuda/sphere_collider.hpp>

#include "src/sphere_collider/cuda/device_search.hpp"
#include "src/sphere_collider/cuda/pair_list.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

struct DeviceSphereCollider::Impl {
  Impl(Stream stream_of_user, int device, SphereAlgorithm algorithm)
      : stream(stream_of_user), search(stream, device, algorithm) {}
  void find(const SphereInstance* d_spheres, std::size_t n, const SearchOutput& output) {
    search.require_reserved(n);
    search.find({.spheres = d_spheres, .n = static_cast<std::uint32_t>(n)}, output, stream);
  }

  cudaStream_t stream;
  DeviceSearch search;
};

DeviceSphereCollider::DeviceSphereCollider(Stream stream, int device, SphereAlgorithm algorithm)
    : impl_(std::make_unique<Impl>(stream, device, algorithm)) {}
DeviceSphereCollider::~DeviceSphereCollider() {
  if (impl_ == nullptr) return;
  try {
    const DeviceGuard guard(impl_->search.device());  // stream 0 belongs to the current device
    impl_.reset();
  } catch (const DeviceError&) {
    impl_.reset();  // the device is lost
  }
}
DeviceSphereCollider::DeviceSphereCollider(DeviceSphereCollider&&) noexcept = default;
DeviceSphereCollider& DeviceSphereCollider::operator=(DeviceSphereCollider&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

void DeviceSphereCollider::reserve(std::size_t spheres, std::size_t contacts) {
  impl_->search.reserve(spheres, contacts);
}

void DeviceSphereCollider::find_contacts(const SphereInstance* d_spheres, std::size_t n,
                                         SphereContact* d_contacts, std::size_t capacity,
                                         ContactCount* d_count) {
  impl_->find(d_spheres, n, {.contacts = d_contacts, .capacity = capacity, .count = d_count});
}

void DeviceSphereCollider::find_pairs(const SphereInstance* d_spheres, std::size_t n,
                                      SpherePair* d_pairs, std::size_t capacity,
                                      ContactCount* d_count) {
  impl_->find(d_spheres, n, {.pairs = d_pairs, .capacity = capacity, .count = d_count});
}

void DeviceSphereCollider::test_pairs(const SphereInstance* d_spheres, const SpherePair* d_pairs,
                                      std::size_t m, PairResult* d_results) {
  const DeviceGuard guard(impl_->search.device());
  launch_test_pairs(d_spheres, d_pairs, m, d_results, impl_->stream);
}

SphereAlgorithm DeviceSphereCollider::algorithm_for(std::size_t n) const noexcept {
  return impl_->search.uses_grid(n) ? SphereAlgorithm::grid : SphereAlgorithm::all_pairs;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
