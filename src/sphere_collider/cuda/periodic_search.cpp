/// The stages of a search in a periodic cell.
#include "src/sphere_collider/cuda/periodic_search.hpp"

#include "src/sphere_collider/cuda/scan.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

void PeriodicSearch::enqueue_scan(const std::uint32_t* values, unsigned long long* sums,
                                  std::size_t n) {
  const std::size_t bytes = scan_scratch_bytes(n);
  scratch_.reserve_geometric(pool_, stream_, bytes, "scratch of a scan");
  exclusive_scan(values, sums, n, scratch_.data(), bytes, stream_);
}

bool PeriodicSearch::count(const SphereInstance* spheres, std::size_t n) {
  given_.reserve_geometric(pool_, stream_, n, "spheres");
  reduced_.reserve_geometric(pool_, stream_, n, "reduced spheres");
  counts_.reserve_geometric(pool_, stream_, n + 1, "numbers of images");
  begins_.reserve_geometric(pool_, stream_, n + 1, "sums of numbers of images");
  state_.reserve(pool_, stream_, 1, "states of searches");
  totals_.reserve(1, "numbers of images");
  args_.n = static_cast<std::uint32_t>(n);
  args_.given = given_.data();
  args_.reduced = reduced_.data();
  args_.counts = counts_.data();
  args_.begins = begins_.data();
  args_.state = state_.data();
  JFPX_CUDA_TRY(cudaMemsetAsync(state_.data(), 0, sizeof(PeriodicState), stream_));
  launch_reduce(args_, spheres, stream_);
  launch_count_images(args_, stream_);
  enqueue_scan(counts_.data(), begins_.data(), n + 1);
  Totals& totals = *totals_.data();
  JFPX_CUDA_TRY(cudaMemcpyAsync(&totals.state, state_.data(), sizeof totals.state,
                                cudaMemcpyDeviceToHost, stream_));
  JFPX_CUDA_TRY(cudaMemcpyAsync(&totals.images, begins_.data() + n, sizeof totals.images,
                                cudaMemcpyDeviceToHost, stream_));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream_));
  return totals.state.has_bad != 0;
}

std::size_t PeriodicSearch::reserve_images() {
  images_.reserve_geometric(pool_, stream_, totals_.data()->images, "images");
  args_.images = images_.data();
  return totals_.data()->images;
}

std::vector<SphereInstance> PeriodicSearch::download(const SphereInstance* spheres,
                                                     std::size_t n) const {
  std::vector<SphereInstance> copy(n);
  JFPX_CUDA_TRY(
      cudaMemcpyAsync(copy.data(), spheres, n * sizeof copy[0], cudaMemcpyDeviceToHost, stream_));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream_));
  return copy;
}

std::size_t PeriodicSearch::count_images(const SphereInstance* spheres, std::size_t n,
                                         const PeriodicCell& cell) {
  args_ = {};
  args_.cell = cell;
  if (count(spheres, n)) {
    const std::vector<SphereInstance> copy = download(spheres, n);
    detail::check_spheres(copy);
    detail::check_in_cell(cell, copy);
  }
  detail::check_in_cell(cell, {});  // if there are no spheres
  return reserve_images();
}

std::size_t PeriodicSearch::count_images(const SphereInstance* spheres,
                                         std::span<const PeriodicCell> cells,
                                         std::span<const std::uint64_t> offsets,
                                         const std::uint64_t* device_offsets) {
  cells_.reserve_geometric(pool_, stream_, cells.size(), "periodic cells");
  JFPX_CUDA_TRY(cudaMemcpyAsync(cells_.data(), cells.data(), cells.size_bytes(),
                                cudaMemcpyHostToDevice, stream_));
  args_ = {};
  args_.cells = cells_.data();
  args_.offsets = device_offsets;
  args_.systems = static_cast<std::uint32_t>(cells.size());
  const std::size_t n = offsets.back();
  const bool has_bad =
      count(spheres, n) || !std::all_of(cells.begin(), cells.end(), [](auto& cell) {
        return detail::fits(cell, 0);  // also those of empty systems
      });
  if (has_bad) {
    const std::vector<SphereInstance> copy = download(spheres, n);
    detail::check_spheres(copy);
    detail::check_in_cells(cells, copy, offsets);
  }
  return reserve_images();
}

void PeriodicSearch::append_images(SphereInstance* spheres) {
  launch_append_images(args_, spheres, stream_);
}

template <class Item>
void PeriodicSearch::keep_nearest(Item* items, std::size_t found, DeviceBuffer<Item>* out,
                                  ContactCount* count) {
  kept_.reserve_geometric(pool_, stream_, found + 1, "marks of contacts");
  places_.reserve_geometric(pool_, stream_, found + 1, "places of contacts");
  out->reserve_geometric(pool_, stream_, found, "contacts");
  shifts_.reserve_geometric(pool_, stream_, found, "shifts");
  launch_mark_kept(args_, items, found, kept_.data(), stream_);
  enqueue_scan(kept_.data(), places_.data(), found + 1);
  launch_place_kept(args_, items, found, kept_.data(), places_.data(), out->data(), shifts_.data(),
                    count, stream_);
}
template void PeriodicSearch::keep_nearest(SpherePair*, std::size_t, DeviceBuffer<SpherePair>*,
                                           ContactCount*);
template void PeriodicSearch::keep_nearest(SphereContact*, std::size_t,
                                           DeviceBuffer<SphereContact>*, ContactCount*);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
