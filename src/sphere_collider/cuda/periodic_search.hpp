/// Memory of a search in a periodic cell on the device, which is one among spheres and images.
#pragma once

#include "src/base/cuda/device_buffer.hpp"
#include "src/sphere_collider/cuda/periodic_images.hpp"
#include "src/sphere_collider/cuda/search_signal.hpp"

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Memory is allocated and freed in the order of the stream of the constructor; the caller orders
/// that stream and those of the searches.
class PeriodicSearch {
 public:
  /// Allocates from `pool`; both outlive the object.
  PeriodicSearch(const MemoryPool& pool, cudaStream_t stream) : pool_(pool), stream_(stream) {}

  /// Number of images of n spheres for which the next search has room: about as many as in the last
  /// one, or as are usual.
  std::uint32_t capacity_for(std::size_t n) const;
  /// Whether memory is reserved for n spheres and the capacity.
  bool fits(std::size_t n) const;
  void reserve(std::size_t n);
  /// Enqueues the given and the reduced spheres, the images, and the signal of their number.
  /// @param given [first.count + second.count] in device memory
  /// @pre fits()
  void enqueue(const SphereArrays& first, const SphereArrays& second, SphereInstance* given,
               const PeriodicCell& cell, cudaStream_t stream);
  /// The spheres, and all images for which there is room. Their number is known on the device.
  SphereInput input_on_device() const;
  /// Number of images, and whether there was room for all.
  struct Images {
    std::uint64_t count;
    bool is_valid, is_complete;
  };
  /// Waits for the signal. The number of images becomes the expected one.
  Images wait(cudaStream_t stream);
  /// The spheres and images after wait().
  SphereInput input() const;
  std::size_t number_of_spheres() const { return args_.n; }
  /// The spheres for the output.
  SpheresInCells spheres() const;

 private:
  const MemoryPool& pool_;
  cudaStream_t stream_;
  PeriodicArgs args_{};
  bool is_cleared_ = false;  // the state
  std::uint64_t expected_images_ = 0;
  SearchSignal signal_;
  DeviceBuffer<SphereInstance> reduced_;
  DeviceBuffer<CellPoint> points_;
  DeviceBuffer<std::uint32_t> ids_;
  DeviceBuffer<PeriodicState> state_;
  DeviceBuffer<PeriodicSpheres> known_;
};

/// Checks spheres that a search has found to be invalid, as the functions on the host do.
/// @param spheres [n] in device memory
/// @throws InvalidArgument if one is
void check_periodic(const SphereInstance* spheres, std::size_t n, const PeriodicCell& cell,
                    cudaStream_t stream);
void check_periodic(const SphereInstance* spheres, std::span<const PeriodicCell> cells,
                    std::span<const std::uint64_t> offsets, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
