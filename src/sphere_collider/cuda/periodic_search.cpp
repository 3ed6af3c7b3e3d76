/// The stages of a search in a periodic cell.
#include "src/sphere_collider/cuda/periodic_search.hpp"

#include "src/sphere_collider/cuda/scan.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <bit>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

void PeriodicSearch::enqueue_scan(const std::uint32_t* values, unsigned long long* sums,
                                  std::size_t n) {
  const std::size_t bytes = scan_scratch_bytes(n);
  scratch_.reserve_geometric(pool_, stream_, bytes, "scratch of a scan");
  exclusive_scan(values, sums, n, scratch_.data(), bytes, stream_);
}

std::size_t PeriodicSearch::count_images(const SphereInstance* spheres, std::size_t n,
                                         const PeriodicCell& cell) {
  reduced_.reserve_geometric(pool_, stream_, n, "reduced spheres");
  cells_.reserve_geometric(pool_, stream_, n, "periodic cells of spheres");
  counts_.reserve_geometric(pool_, stream_, n + 1, "numbers of images");
  begins_.reserve_geometric(pool_, stream_, n + 1, "sums of numbers of images");
  state_.reserve(pool_, stream_, 1, "states of searches");
  totals_.reserve(1, "numbers of images");
  args_ = {.cell = cell,
           .n = static_cast<std::uint32_t>(n),
           .reduced = reduced_.data(),
           .cells = cells_.data(),
           .counts = counts_.data(),
           .begins = begins_.data(),
           .images = nullptr,
           .state = state_.data()};
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
  check(spheres);
  images_.reserve_geometric(pool_, stream_, totals.images, "images");
  args_.images = images_.data();
  return totals.images;
}

void PeriodicSearch::check(const SphereInstance* spheres) const {
  const PeriodicState& state = totals_.data()->state;
  const auto download = [&](std::size_t first, std::size_t n) {
    std::vector<SphereInstance> copy(n);
    JFPX_CUDA_TRY(cudaMemcpyAsync(copy.data(), spheres + first, n * sizeof copy[0],
                                  cudaMemcpyDeviceToHost, stream_));
    JFPX_CUDA_TRY(cudaStreamSynchronize(stream_));
    return copy;
  };
  if (state.valid_before != 0) detail::reject_sphere(download(0, ~state.valid_before + 1));
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  detail::check_cell(args_.cell, std::bit_cast<Real>(static_cast<Bits>(state.largest_radius)));
  if (state.near_before == 0) return;
  const std::uint32_t far = ~state.near_before;
  detail::reject_far(far, download(far, 1)[0].centre, args_.cell);
}

void PeriodicSearch::append_images(SphereInstance* spheres) {
  launch_append_images(args_, spheres, stream_);
}

template <class Item>
void PeriodicSearch::keep_nearest(const Item* items, std::size_t found, DeviceBuffer<Item>* out,
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
template void PeriodicSearch::keep_nearest(const SpherePair*, std::size_t,
                                           DeviceBuffer<SpherePair>*, ContactCount*);
template void PeriodicSearch::keep_nearest(const SphereContact*, std::size_t,
                                           DeviceBuffer<SphereContact>*, ContactCount*);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
