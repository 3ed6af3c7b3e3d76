/// Memory of a search in a periodic cell on the device.
#include "src/sphere_collider/cuda/periodic_search.hpp"

#include "src/sphere_collider/periodic_input.hpp"

#include <algorithm>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

std::vector<SphereInstance> download(const SphereInstance* spheres, std::size_t n,
                                     cudaStream_t stream) {
  std::vector<SphereInstance> copy(n);
  JFPX_CUDA_TRY(
      cudaMemcpyAsync(copy.data(), spheres, n * sizeof copy[0], cudaMemcpyDeviceToHost, stream));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream));
  return copy;
}

}  // namespace

std::uint32_t PeriodicSearch::capacity_for(std::size_t n) const {
  constexpr std::uint64_t kMostOfSphere = detail::kShifts - 1;
  const std::uint64_t usual = n / 4 + 1024, expected = expected_images_ + expected_images_ / 8 + 64;
  const std::uint64_t most = std::min<std::uint64_t>(kMostOfSphere * n, kMaxSpheres - n);
  return static_cast<std::uint32_t>(std::min(std::max(usual, expected), most));
}

bool PeriodicSearch::fits(std::size_t n) const {
  const std::size_t images = capacity_for(n);
  return state_.capacity() != 0 && n + images <= reduced_.capacity() && n <= points_.capacity() &&
         n + images <= ids_.capacity();
}

void PeriodicSearch::reserve(std::size_t n) {
  const std::size_t images = capacity_for(n);
  reduced_.reserve_geometric(pool_, stream_, n + images, "reduced spheres and images");
  points_.reserve_geometric(pool_, stream_, n, "centres");
  ids_.reserve_geometric(pool_, stream_, n + images, "ids of spheres and images");
  known_.reserve(pool_, stream_, 1, "cells");
  if (state_.reserve(pool_, stream_, 1, "states of searches")) is_cleared_ = false;
}

void PeriodicSearch::enqueue(const SphereArrays& first, const SphereArrays& second,
                             SphereInstance* given, const PeriodicCell& cell, cudaStream_t stream) {
  const std::size_t n = first.count + second.count;
  signal_.clear();
  args_ = {.cell = cell,
           .errors = detail::errors_in(cell),
           .first = first,
           .second = second,
           .n = static_cast<std::uint32_t>(n),
           .given = given,
           .reduced = reduced_.data(),
           .points = points_.data(),
           .ids = ids_.data(),
           .index_bit = n <= kMaxWithShifts ? 1 + kShiftBits : 1,
           .capacity = capacity_for(n),
           .known = known_.data(),
           .state = state_.data(),
           .signal = signal_.word()};
  if (!is_cleared_) {  // at the start, and after a search that has failed
    JFPX_CUDA_TRY(cudaMemsetAsync(state_.data(), 0, sizeof(PeriodicState), stream));
  }
  is_cleared_ = false;
  launch_prepare(args_, stream);
  is_cleared_ = true;
}

PeriodicSearch::Images PeriodicSearch::wait(cudaStream_t stream) {
  const unsigned long long word = signal_.wait(stream);
  const Images images{word >> kSignalBits, (word & kSignalIsValid) != 0,
                      (word & kSignalIsComplete) != 0};
  if (images.is_valid) expected_images_ = images.count;
  return images;
}

SphereInput PeriodicSearch::input_on_device() const {
  // Where the sum of the radii of reduced spheres exceeds their distance by `least`, apart from
  // roundings, the given spheres touch: see doubt_of().
  const Real least = 2 * args_.errors.margin + args_.errors.distance + detail::kShortest;
  return {.spheres = reduced_.data(),
          .n = args_.n + args_.capacity,
          .periodic = {.known = known_.data(),
                       .is_one_launch = true,
                       .spheres = args_.n,
                       .ids = ids_.data(),
                       .index_bit = args_.index_bit,
                       .slack = Real(2.1) * least,
                       .relative_slack = 40 * kEpsilon}};
}

SphereInput PeriodicSearch::input() const {
  SphereInput result = input_on_device();
  result.n = args_.n + static_cast<std::uint32_t>(expected_images_);
  result.periodic.is_one_launch = false;
  return result;
}

SpheresInCells PeriodicSearch::spheres() const {
  return {
      .spheres = args_.given, .cell = args_.cell, .points = points_.data(), .known = known_.data()};
}

void check_periodic(const SphereInstance* spheres, std::size_t n, const PeriodicCell& cell,
                    cudaStream_t stream) {
  const std::vector<SphereInstance> copy = download(spheres, n, stream);
  detail::check_spheres(copy);
  detail::check_in_cell(cell, copy);
}

void check_periodic(const SphereInstance* spheres, std::span<const PeriodicCell> cells,
                    std::span<const std::uint64_t> offsets, cudaStream_t stream) {
  const std::vector<SphereInstance> copy = download(spheres, offsets.back(), stream);
  detail::check_spheres(copy);
  detail::check_in_cells(cells, copy, offsets);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
