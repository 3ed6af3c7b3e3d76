/// State of a search in a periodic cell on the device, around a search among spheres and images.
#pragma once

#include "src/base/cuda/device_buffer.hpp"
#include "src/sphere_collider/cuda/periodic_images.hpp"

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Enqueues its work on one stream. Keeps the shifts of the last search.
class PeriodicSearch {
 public:
  /// Allocates from `pool`; both outlive the object.
  PeriodicSearch(const MemoryPool& pool, cudaStream_t stream) : pool_(pool), stream_(stream) {}

  /// Begins a search among `n` spheres in device memory, and waits for the number of their images,
  /// which is returned.
  /// @throws InvalidArgument as find_periodic_contacts(), OutOfMemory, DeviceError
  std::size_t count_images(const SphereInstance* spheres, std::size_t n, const PeriodicCell& cell);
  /// The same within systems, each of which has a cell.
  /// @param offsets in host memory
  /// @param device_offsets the same in device memory
  std::size_t count_images(const SphereInstance* spheres, std::span<const PeriodicCell> cells,
                           std::span<const std::uint64_t> offsets,
                           const std::uint64_t* device_offsets);
  /// Enqueues the n reduced spheres and the images that were counted.
  void append_images(SphereInstance* spheres);
  /// Enqueues the pairs of nearest images, and their number.
  /// @param items [found] sorted pairs among the reduced spheres and their images; changes
  template <class Item>
  void keep_nearest(Item* items, std::size_t found, DeviceBuffer<Item>* out, ContactCount* count);

  /// [n + 1]: the images of sphere i are from n + image_begins[i] to n + image_begins[i + 1].
  const unsigned long long* image_begins() const noexcept { return begins_.data(); }
  /// Shifts of the items that keep_nearest() has written.
  const ImageShift* shifts() const noexcept { return shifts_.data(); }

 private:
  struct Totals {
    PeriodicState state;
    unsigned long long images;
  };

  void enqueue_scan(const std::uint32_t* values, unsigned long long* sums, std::size_t n);
  /// Counts the images, and waits.
  /// @returns whether a sphere is bad
  bool count(const SphereInstance* spheres, std::size_t n);
  std::size_t reserve_images();
  std::vector<SphereInstance> download(const SphereInstance* spheres, std::size_t n) const;

  const MemoryPool& pool_;
  cudaStream_t stream_;
  PeriodicArgs args_{};
  DeviceBuffer<DisplacedSphere> given_;
  DeviceBuffer<SphereInstance> reduced_;
  DeviceBuffer<PeriodicCell> cells_;
  DeviceBuffer<ImageShift> shifts_;
  DeviceBuffer<std::uint32_t> counts_, kept_;
  DeviceBuffer<unsigned long long> begins_, places_;
  DeviceBuffer<PeriodicImage> images_;
  DeviceBuffer<PeriodicState> state_;
  PinnedBuffer<Totals> totals_;
  DeviceBuffer<unsigned char> scratch_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
