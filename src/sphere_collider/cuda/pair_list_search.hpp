/// Search for the touching pairs of a list, from host memory to host memory.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/cuda/device_mirror.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Finds touching pairs. Keeps the spheres and pairs in device memory between calls, and uploads
/// only changes.
class PairListSearch {
 public:
  /// Indices must be valid. Synchronizes the stream.
  std::span<const PairContact> find(const MemoryPool& pool, cudaStream_t stream,
                                    std::span<const SphereInstance> spheres,
                                    std::span<const SpherePair> pairs);
  TransferredBytes transferred() const noexcept { return transferred_; }

 private:
  DeviceMirror<SphereInstance> spheres_;
  DeviceMirror<SpherePair> pairs_;
  DeviceBuffer<std::uint32_t> counts_;
  DeviceBuffer<unsigned long long> sums_;
  DeviceBuffer<std::byte> scratch_;
  PinnedBuffer<PairContact> touching_;  ///< mapped: the kernel writes the touching pairs here
  PinnedBuffer<unsigned long long> total_;
  TransferredBytes transferred_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
