/// Sphere collider on a GPU, from host memory to host memory.
#include "src/sphere_collider/cuda/sphere_collider_cuda.hpp"

#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/error.hpp>

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"
#include "src/sphere_collider/cuda/pair_list_search.hpp"
#include "src/sphere_collider/cuda/search.hpp"
#include "src/sphere_collider/cuda/tuning.hpp"
#include "src/sphere_collider/sphere_input.hpp"

#include <algorithm>
#include <nvtx3/nvtx3.hpp>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

void check_pairs(std::span<const SpherePair> pairs, std::size_t n) {
  if (std::any_of(pairs.begin(), pairs.end(), [n](SpherePair p) { return p.a >= n || p.b >= n; })) {
    detail::reject_pair(pairs, n);
  }
}

class SphereColliderCuda final : public SphereCollider {
 public:
  explicit SphereColliderCuda(const SphereColliderOptions& options)
      : device_(options.device),
        stream_(device_),
        pool_(device_),
        searcher_(stream_.get(), device_, options.algorithm) {
    const DeviceGuard guard(device_);
    count_.reserve(1, "contact count");
  }
  ~SphereColliderCuda() override { static_cast<void>(cudaStreamSynchronize(stream_.get())); }

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override;
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override;
  TransferredBytes transferred() const noexcept override { return pair_list_.transferred(); }

  Backend backend() const noexcept override { return Backend::cuda; }
  SphereAlgorithm algorithm() const noexcept override { return algorithm_; }

 private:
  void upload(std::span<const SphereInstance> spheres);
  /// Leaves the contacts in contacts_on_host_ if `mapped`, otherwise on the device.
  /// @return the number of contacts.
  std::size_t search(std::span<const SphereInstance> spheres, bool mapped);
  /// If the allocation of a larger buffer fails, the buffer is unchanged.
  void reserve_geometric(std::size_t spheres, std::size_t contacts, bool mapped);
  void wait() { JFPX_CUDA_TRY(cudaStreamSynchronize(stream_.get())); }

  int device_;
  OwnedStream stream_;
  MemoryPool pool_;
  DeviceSphereCollider searcher_;
  std::size_t spheres_reserved_ = 0, contacts_reserved_ = 0;
  DeviceBuffer<SphereInstance> spheres_;
  DeviceBuffer<SphereContact> contacts_;
  PinnedBuffer<ContactCount> count_;
  PinnedBuffer<SphereContact> contacts_on_host_;
  PairListSearch pair_list_;
  SphereAlgorithm algorithm_ = SphereAlgorithm::automatic;
};

void SphereColliderCuda::upload(std::span<const SphereInstance> spheres) {
  spheres_.reserve_geometric(pool_, stream_.get(), spheres.size(), "spheres");
  JFPX_CUDA_TRY(cudaMemcpyAsync(spheres_.data(), spheres.data(), spheres.size_bytes(),
                                cudaMemcpyHostToDevice, stream_.get()));
}

std::size_t SphereColliderCuda::search(std::span<const SphereInstance> spheres, bool mapped) {
  reserve_geometric(spheres.size(), 4 * spheres.size(), mapped);
  while (true) {
    searcher_.find_contacts(
        spheres_.data(), spheres.size(), mapped ? contacts_on_host_.data() : contacts_.data(),
        mapped ? contacts_on_host_.capacity() : contacts_.capacity(), count_.data());
    wait();
    const ContactCount& count = *count_.data();
    if (count.first_invalid != kNoSphere) detail::reject_sphere(spheres);
    if (count.complete != 0) return count.contacts;
    reserve_geometric(spheres.size(), count.contacts, mapped);
  }
}

void SphereColliderCuda::reserve_geometric(std::size_t spheres, std::size_t contacts, bool mapped) {
  if (spheres > spheres_reserved_ || contacts > contacts_reserved_) {
    const std::size_t more_spheres = geometric_capacity(spheres_reserved_, spheres, kMaxSpheres);
    const std::size_t more_contacts = geometric_capacity(contacts_reserved_, contacts);
    searcher_.reserve(more_spheres, more_contacts);
    spheres_reserved_ = more_spheres;
    contacts_reserved_ = more_contacts;
  }
  if (mapped) {
    contacts_on_host_.reserve_geometric(contacts, "contacts on the host");
  } else {
    contacts_.reserve_geometric(pool_, stream_.get(), contacts, "contacts");
  }
}

ContactSpan SphereColliderCuda::find_contacts(std::span<const SphereInstance> spheres) {
  const nvtx3::scoped_range range("jfpx find_contacts");
  detail::check_count(spheres);
  algorithm_ = searcher_.algorithm_for(spheres.size());
  if (spheres.empty()) return {};
  const DeviceGuard guard(device_);
  upload(spheres);
  const bool mapped = spheres.size() <= kMaxMappedSpheres;
  const std::size_t found = search(spheres, mapped);
  if (!mapped && found > 0) {
    contacts_on_host_.reserve_geometric(found, "contacts on the host");
    JFPX_CUDA_TRY(cudaMemcpyAsync(contacts_on_host_.data(), contacts_.data(),
                                  found * sizeof(SphereContact), cudaMemcpyDeviceToHost,
                                  stream_.get()));
    wait();
  }
  return {contacts_on_host_.data(), found};
}

std::span<const PairContact> SphereColliderCuda::find_touching(
    std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  const nvtx3::scoped_range range("jfpx find_touching");
  detail::check_count(pairs);
  check_pairs(pairs, spheres.size());
  const DeviceGuard guard(device_);
  return pair_list_.find(pool_, stream_.get(), spheres, pairs);
}

}  // namespace

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options) {
  const BackendStatus status = probe(options.device);
  if (!status.usable) throw BackendUnavailable("cuda: " + status.reason);
  return std::make_unique<SphereColliderCuda>(options);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
