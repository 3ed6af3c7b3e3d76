/// The touching pairs of a list, from host memory to host memory.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/cuda/device_mirror.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Keeps spheres and pairs on the device between calls.
class PairListSearch {
 public:
  /// Indices must have been checked. Waits for the stream.
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
  PinnedBuffer<PairContact> touching_;  ///< written by the kernel, touching pairs alone
  PinnedBuffer<unsigned long long> total_;
  TransferredBytes transferred_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
