/// Validation of the input of find_neighbors(), the search of the systems, and the list in its
/// order.
#include <jfpx/error.hpp>
#include <jfpx/neighbors.hpp>

#include "src/base/cpu.hpp"
#include "src/sphere_collider/cpu/neighbor_cutoffs.hpp"
#include "src/sphere_collider/cpu/neighbor_system.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// [m] largest coordinate: differences and squares of them are finite in Real.
constexpr double kFarthestNeighbor = sizeof(Real) == 4 ? 9e37 : 1e150;
constexpr std::size_t kMostNeighborPoints = std::numeric_limits<std::uint32_t>::max();

void check_neighbor_points(std::span<const Vec3> points) {
  if (points.size() > kMostNeighborPoints) {
    throw InvalidArgument("number of points is " + std::to_string(points.size()) +
                          "; it must be less than 2^32");
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Real x = points[i][k];
      if (std::abs(static_cast<double>(x)) <= kFarthestNeighbor) continue;
      throw InvalidArgument("point " + std::to_string(i) + ": " + "xyz"[k] + " is " +
                            detail::to_text(x) + "; it must be finite and at most " +
                            (sizeof(Real) == 4 ? "9e37" : "1e150"));
    }
  }
}

const NeighborKernels& neighbor_kernels([[maybe_unused]] SimdLevel usable) noexcept {
#if defined(__x86_64__)
  if (usable >= SimdLevel::avx2) return kAvx2NeighborKernels;
#endif
  return kBaselineNeighborKernels;
}

/// Searches the points of all systems in chunks, in the order of the systems and their bins. A
/// chunk may have points of several systems.
class NeighborSearch {
 public:
  /// @param offsets of the systems, valid
  NeighborSearch(std::span<const Vec3> points, std::span<const std::uint64_t> offsets,
                 const NeighborCutoffs& cutoffs, const NeighborOptions& options)
      : points_(points),
        offsets_(offsets),
        options_(options),
        cutoffs_(cutoffs),
        kernels_(neighbor_kernels(usable_simd_level(options.simd))),
        pool_(options.threads),
        systems_(offsets.size() - 1) {}

  /// Adds the only system. @throws InvalidArgument as find_neighbors()
  void add_system() { add(0, Lattice(options_.cell)); }

  /// Adds all systems. @throws InvalidArgument as find_neighbors_in_systems()
  void add_systems(std::span<const TriclinicCell> cells) {
    std::optional<Lattice> common;
    if (cells.empty()) common.emplace(options_.cell);
    const std::size_t of_chunk = 1 + systems_.size() / 256;
    run_interruptible(pool_, (systems_.size() + of_chunk - 1) / of_chunk, [&](std::size_t chunk) {
      const std::size_t end = std::min(systems_.size(), (chunk + 1) * of_chunk);
      for (std::size_t i = chunk * of_chunk; i < end; ++i) {
        try {
          add(i, common ? *common : Lattice(cells[i]));
        } catch (const InvalidArgument& error) {
          throw InvalidArgument("system " + std::to_string(i) + ": " + error.what());
        }
      }
    });
  }

  /// @param has_shifts whether the result has shifts
  Neighbors find(bool has_shifts) {
    const bool has_images = std::any_of(systems_.begin(), systems_.end(),
                                        [](const auto& system) { return system->has_images(); });
    chunks_.resize((points_.size() + kChunk - 1) / kChunk);
    Neighbors found;
    found.offsets.resize(points_.size() + 1);
    run_interruptible(pool_, chunks_.size(), [&](std::size_t chunk) {
      search(chunk, has_images, std::span(found.offsets).subspan(1));
    });
    for (std::size_t i = 0; i < points_.size(); ++i) found.offsets[i + 1] += found.offsets[i];
    const std::size_t pairs = found.offsets.back();
    resize_interruptible(&found.first, pairs);
    resize_interruptible(&found.second, pairs);
    if (has_shifts) resize_interruptible(&found.shifts, pairs);
    if (options_.distances) resize_interruptible(&found.distances, pairs);
    if (options_.vectors) resize_interruptible(&found.vectors, pairs);
    run_interruptible(pool_, chunks_.size(), [&](std::size_t chunk) { write(chunk, &found); });
    return found;
  }

 private:
  static constexpr std::size_t kChunk = 256;  ///< points

  void add(std::size_t i, const Lattice& lattice) {
    const std::uint64_t first = offsets_[i];
    systems_[i] = std::make_unique<const NeighborSystem>(
        lattice, points_.subspan(first, offsets_[i + 1] - first), first, cutoffs_, options_);
  }

  /// Calls body(system, begin, end) for the positions of a chunk, by system.
  template <class Body>
  void for_each_part(std::size_t chunk, const Body& body) const {
    const std::size_t last = std::min(points_.size(), (chunk + 1) * kChunk);
    std::size_t at = chunk * kChunk;
    auto next = std::upper_bound(offsets_.begin(), offsets_.end(), at);
    for (; at < last; ++next) {
      const auto i = static_cast<std::size_t>(next - offsets_.begin()) - 1;
      const std::size_t end = std::min<std::size_t>(last, *next), first = offsets_[i];
      if (at < end) body(*systems_[i], at - first, end - first);
      at = end;
    }
  }

  void search(std::size_t number, bool has_images, std::span<std::uint64_t> sizes) {
    NeighborScratch scratch;
    scratch.has_images = has_images;
    for_each_part(number, [&](const NeighborSystem& system, std::size_t begin, std::size_t end) {
      system.search(begin, end, kernels_, sizes, &scratch);
    });
    NeighborRows& rows = chunks_[number];
    const auto used = static_cast<std::ptrdiff_t>(scratch.size);
    rows.found.assign(scratch.rows.found.begin(), scratch.rows.found.begin() + used);
    if (!has_images) return;
    rows.images.assign(scratch.rows.images.begin(), scratch.rows.images.begin() + used);
  }

  void write(std::size_t number, Neighbors* found) {
    NeighborRows& rows = chunks_[number];
    std::size_t from = 0;
    for_each_part(number, [&](const NeighborSystem& system, std::size_t begin, std::size_t end) {
      from = system.write(begin, end, rows, from, found);
    });
    rows = {};
  }

  std::span<const Vec3> points_;
  std::span<const std::uint64_t> offsets_;
  const NeighborOptions& options_;
  const NeighborCutoffs& cutoffs_;
  const NeighborKernels& kernels_;
  ThreadPool pool_;
  std::vector<std::unique_ptr<const NeighborSystem>> systems_;
  std::vector<NeighborRows> chunks_;
};

}  // namespace
}  // namespace cpu

Neighbors find_neighbors(std::span<const Vec3> points, Real cutoff,
                         const NeighborOptions& options) {
  cpu::check_neighbor_points(points);
  const cpu::NeighborCutoffs cutoffs(points.size(), cutoff, options);
  const std::array<std::uint64_t, 2> offsets{0, points.size()};
  cpu::NeighborSearch search(points, offsets, cutoffs, options);
  search.add_system();
  return search.find(options.cell.has_value());
}

Neighbors find_neighbors_in_systems(std::span<const Vec3> points,
                                    std::span<const std::uint64_t> offsets,
                                    std::span<const TriclinicCell> cells, Real cutoff,
                                    const NeighborOptions& options) {
  detail::check_offsets(offsets, points.size(), "points");
  if (!cells.empty() && options.cell) {
    throw InvalidArgument("there are cells of the systems, and a cell in the options");
  }
  if (!cells.empty()) detail::check_number_of_cells(cells.size(), offsets);
  cpu::check_neighbor_points(points);
  const cpu::NeighborCutoffs cutoffs(points.size(), cutoff, options);
  cpu::NeighborSearch search(points, offsets, cutoffs, options);
  search.add_systems(cells);
  return search.find(!cells.empty() || options.cell);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
