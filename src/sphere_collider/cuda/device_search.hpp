/// Selects the kernels of a search on the device and owns their memory.
#pragma once

#include "src/base/cuda/device_buffer.hpp"
#include "src/sphere_collider/cuda/fused_search.hpp"
#include "src/sphere_collider/cuda/grid.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Returns the device; checks it before the first call of CUDA.
/// @throws BackendUnavailable with the reason
int usable_device(int device);

/// Searches among spheres in device memory. Memory is allocated and freed in the order of the
/// stream of the constructor; the caller orders that stream and the streams of the searches.
class DeviceSearch {
 public:
  /// @throws BackendUnavailable with the reason if the device cannot be used, DeviceError
  DeviceSearch(cudaStream_t stream, int device, SphereAlgorithm algorithm);

  /// See DeviceSphereCollider::reserve().
  /// @param needs_grid also for searches in a periodic cell, which always use the grid
  void reserve(std::size_t n, std::size_t contacts, bool needs_grid = false);
  /// Whether memory is reserved for a search among n spheres.
  bool fits(std::size_t n, bool needs_grid = false) const {
    return n <= spheres_reserved_ && (!needs_grid || has_grid_);
  }
  /// @throws InvalidArgument unless fits(n)
  void require_reserved(std::size_t n) const;
  /// Whether a search among n spheres is one launch. Only such a search accepts an input of arrays.
  bool is_one_launch(std::size_t n) const;
  bool uses_grid(std::size_t n) const;

  /// Enqueues a search; see DeviceSphereCollider::find_contacts().
  /// @pre fits(), with the grid if the input is periodic
  void find(const SphereInput& input, const SearchOutput& output, cudaStream_t stream);

  int device() const { return device_; }

 private:
  void reserve_spheres(std::size_t n, bool with_grid);
  void find_among_all_pairs(const SphereInput& input, const SearchOutput& output,
                            cudaStream_t stream);
  void find_in_grid(const SphereInput& input, const SearchOutput& output, cudaStream_t stream);
  SearchState* state() const { return reinterpret_cast<SearchState*>(counters_.data()); }
  std::uint32_t* counts() const;

  int device_;
  cudaStream_t stream_;
  SphereAlgorithm algorithm_;
  MemoryPool pool_;
  bool has_fused_ = false;
  bool has_grid_ = false;  // memory of the grid is reserved
  GridLimits limits_{};
  std::size_t spheres_reserved_ = 0, contacts_requested_ = 0, contacts_reserved_ = 0;

  DeviceBuffer<std::uint32_t> counters_;  // SearchState, then the number of contacts of each sphere
  DeviceBuffer<unsigned long long> offsets_;
  DeviceBuffer<unsigned char> scan_scratch_;
  DeviceBuffer<std::uint32_t> masks_;

  DeviceBuffer<std::uint32_t> table_;
  DeviceBuffer<unsigned long long> block_sums_;
  DeviceBuffer<std::uint32_t> positions_, ranks_;
  DeviceBuffer<unsigned char> plan_;
  DeviceBuffer<SphereInstance> sorted_;
  DeviceBuffer<std::uint32_t> ids_;
  DeviceBuffer<AlternatingStates> states_;
  DeviceBuffer<CoarseBuckets> coarse_;
  DeviceBuffer<unsigned char> scratch_;

  DeviceBuffer<OverflowPair> overflow_;
  DeviceBuffer<std::uint32_t> long_rows_, very_long_rows_, long_row_neighbors_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
