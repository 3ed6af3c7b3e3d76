/// Rows of candidates from the bins, exact tests, and their order.
#include "src/sphere_collider/cpu/neighbor_system.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Longer rows are sorted in O(n log n) time.
constexpr std::uint32_t kMostRanked = 384;
/// The relative error of a distance in Real is less than 4 epsilon.
constexpr double kAboveCutoff = 1 + 16 * static_cast<double>(kEpsilon);
constexpr double kBelowCutoff = 1 - 16 * static_cast<double>(kEpsilon);

double square_if_positive(double x) { return x > 0 ? x * x : -1; }

/// Makes scratch->rows at least `more` longer than the rows that are found.
void make_room(std::size_t more, NeighborScratch* scratch) {
  const std::size_t room = scratch->size + more;
  if (scratch->rows.found.size() >= room) return;
  scratch->rows.found.resize(2 * room);
  if (scratch->has_images) scratch->rows.images.resize(2 * room);
}

/// @return how many of the numbers are left
template <class Predicate>
std::uint32_t remove_numbers(std::uint32_t* numbers, std::uint32_t count, const Predicate& goes) {
  return static_cast<std::uint32_t>(std::remove_if(numbers, numbers + count, goes) - numbers);
}

}  // namespace

NeighborSystem::NeighborSystem(const Lattice& lattice, std::span<const Vec3> points,
                               std::size_t first, const NeighborCutoffs& cutoffs,
                               const NeighborOptions& options)
    : options_(options),
      lattice_(lattice),
      points_(points),
      first_(first),
      cutoffs_(cutoffs),
      bins_(lattice, points, static_cast<double>(cutoffs.largest()) * kAboveCutoff, first),
      query_(limits(cutoffs.largest())) {}

NeighborQuery NeighborSystem::limits(Real cutoff) const {
  const double greatest = cutoff, least = options_.least_distance, error = 2 * bins_.error();
  NeighborQuery query{};
  query.outer = square_if_positive(greatest * kAboveCutoff + error);
  query.inner = square_if_positive(greatest * kBelowCutoff - error);
  query.least = least > 0 ? square_if_positive(least * kAboveCutoff + error) : -1;
  query.lowest = square_if_positive(least * kBelowCutoff - error);
  if (cutoffs_.differ()) query.inner = -1;  // no pair is certain
  return query;
}

void NeighborSystem::search(std::size_t begin, std::size_t end, const NeighborKernels& kernels,
                            std::span<std::uint64_t> sizes, NeighborScratch* scratch) const {
  const bool is_undivided = bins_.is_undivided();
  if (is_undivided && options_.both_orders && begin == 0 && end == points_.size()) {
    return search_mirrored(kernels, sizes, scratch);
  }
  std::size_t candidates = 0;
  for (std::size_t at = begin; at < end; ++at) {
    if (at == begin || bins_.bin_of(at) != bins_.bin_of(at - 1)) {
      candidates = kNeighborLanes;
      if (is_undivided) {
        candidates += points_.size() * bins_.number_of_images();
        if (scratch->row.size() < points_.size()) scratch->row.resize(points_.size());
      } else {
        bins_.find_ranges(bins_.bin_of(at), &scratch->ranges);
        for (const BinRange& range : scratch->ranges) candidates += range.end - range.begin;
        for (auto* column : {&scratch->row, &scratch->row_images, &scratch->ranks}) {
          if (column->size() < candidates) column->resize(candidates);
        }
      }
    }
    make_room(candidates, scratch);
    const std::uint32_t size = is_undivided
                                   ? search_images(at, options_.both_orders, kernels, scratch)
                                   : search_row(at, kernels, scratch);
    sizes[first_ + bins_.index(at)] = size;
    scratch->size += size;
  }
}

void NeighborSystem::search_mirrored(const NeighborKernels& kernels, std::span<std::uint64_t> sizes,
                                     NeighborScratch* scratch) const {
  const std::size_t n = points_.size(), first = scratch->size;
  const std::size_t candidates = n * bins_.number_of_images() + kNeighborLanes;
  if (scratch->row.size() < n) scratch->row.resize(n);
  std::vector<std::size_t> once(n), to(n);
  for (std::size_t i = 0; i < n; ++i) {
    make_room(candidates, scratch);
    once[i] = search_images(i, false, kernels, scratch);
    scratch->size += once[i];
  }
  NeighborRows& rows = scratch->rows;
  NeighborRows& half = scratch->half;
  const auto begin = static_cast<std::ptrdiff_t>(first);
  const auto end = static_cast<std::ptrdiff_t>(scratch->size);
  half.found.assign(rows.found.begin() + begin, rows.found.begin() + end);
  half.images.assign(rows.images.begin() + begin, rows.images.begin() + end);
  for (const std::uint32_t other : half.found) ++to[other];
  scratch->size = first;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t size = to[i] + once[i];
    sizes[first_ + i] = size;
    to[i] = scratch->size;
    scratch->size += size;
  }
  make_room(0, scratch);
  // Opposite shifts have opposite numbers, so that images of one point are mirrored backwards.
  const auto last_image = static_cast<std::uint32_t>(bins_.number_of_images() - 1);
  const auto write = [&](std::size_t row, std::uint32_t other, std::uint32_t image) {
    rows.found[to[row]] = other;
    rows.images[to[row]++] = image;
  };
  std::size_t from = 0;
  for (std::size_t i = 0; i < n; from += once[i++]) {
    for (std::size_t k = from + once[i]; k-- > from;) {
      write(half.found[k], static_cast<std::uint32_t>(i), last_image - half.images[k]);
    }
    for (std::size_t k = from; k < from + once[i]; ++k) write(i, half.found[k], half.images[k]);
  }
}

std::uint32_t NeighborSystem::search_images(std::size_t at, bool both_orders,
                                            const NeighborKernels& kernels,
                                            NeighborScratch* scratch) const {
  std::uint32_t* const found = scratch->rows.found.data() + scratch->size;
  std::uint32_t* const images = scratch->rows.images.data() + scratch->size;
  const NeighborColumns points = bins_.points(), all_images = bins_.images();
  const std::uint32_t home = bins_.home();
  NeighborQuery query = cutoffs_.differ() ? limits(cutoffs_.largest_of(first_ + at)) : query_;
  std::uint32_t size = 0;
  std::uint32_t* const nearby = scratch->row.data();
  const std::uint32_t number = bins_.find_near(at, both_orders ? 0 : at, nearby);
  for (std::uint32_t i = 0; i < number; ++i) {
    const std::uint32_t index = static_cast<std::uint32_t>(at), other = nearby[i];
    query.x = points.x[at] - points.x[other];
    query.y = points.y[at] - points.y[other];
    query.z = points.z[at] - points.z[other];
    query.least_index = other == at && !both_orders ? home + 1 : 0;
    bool unsure = false;
    std::uint32_t* const begin = images + size;
    std::uint32_t count = 0;
    bins_.for_each_image_range(at, other, [&](std::uint32_t first, std::uint32_t last) {
      count += kernels.search(all_images, query, first, last, begin + count, &unsure);
    });
    if (count == 0) continue;
    if (!bins_.are_images_sorted()) std::sort(begin, begin + count);
    if (other == at) {
      count = remove_numbers(begin, count, [&](std::uint32_t image) { return image == home; });
    }
    if (unsure) {
      count = remove_numbers(begin, count,
                             [&](std::uint32_t image) { return !has(index, other, image); });
    }
    std::fill_n(found + size, count, other);
    size += count;
  }
  return size;
}

std::uint32_t NeighborSystem::search_row(std::size_t at, const NeighborKernels& kernels,
                                         NeighborScratch* scratch) const {
  const std::uint32_t index = bins_.index(at), home = bins_.home();
  const NeighborColumns points = bins_.points(), images = bins_.images();
  std::uint32_t* const row = scratch->row.data();
  NeighborQuery query = cutoffs_.differ() ? limits(cutoffs_.largest_of(first_ + index)) : query_;
  std::uint32_t size = 0;
  std::uint32_t position = 0, image = 0;  // of the image of the last range
  const auto set_image = [&](std::uint32_t next) {
    position = next;
    image = images.index[next];
    query.x = points.x[at] - images.x[next];
    query.y = points.y[at] - images.y[next];
    query.z = points.z[at] - images.z[next];
    query.least_index = options_.both_orders ? 0 : index + (image > home ? 0u : 1u);
  };
  set_image(0);
  for (const BinRange& range : scratch->ranges) {
    if (range.image != position) set_image(range.image);
    bool unsure = false;
    std::uint32_t* const begin = row + size;
    std::uint32_t count = kernels.search(points, query, range.begin, range.end, begin, &unsure);
    if (options_.both_orders && image == home) {
      count = remove_numbers(begin, count, [&](std::uint32_t other) { return other == index; });
    }
    if (unsure) {
      count = remove_numbers(begin, count,
                             [&](std::uint32_t other) { return !has(index, other, image); });
    }
    if (scratch->has_images) std::fill_n(scratch->row_images.data() + size, count, image);
    size += count;
  }
  sort_row(size, kernels, scratch);
  return size;
}

/// Writes a row by ascending second points and images.
void NeighborSystem::sort_row(std::uint32_t size, const NeighborKernels& kernels,
                              NeighborScratch* scratch) const {
  const bool has_images = scratch->has_images;
  const std::uint32_t* const row = scratch->row.data();
  const std::uint32_t* const images = scratch->row_images.data();
  std::uint32_t* const found = scratch->rows.found.data() + scratch->size;
  std::uint32_t* const found_images =
      has_images ? scratch->rows.images.data() + scratch->size : nullptr;
  if (size <= kMostRanked && !bins_.repeats_points()) {
    std::uint32_t* const ranks = scratch->ranks.data();
    kernels.rank(row, size, ranks);
    for (std::uint32_t k = 0; k < size; ++k) found[ranks[k]] = row[k];
    if (!has_images) return;
    for (std::uint32_t k = 0; k < size; ++k) found_images[ranks[k]] = images[k];
    return;
  }
  scratch->keys.resize(size);
  for (std::uint32_t k = 0; k < size; ++k) {
    scratch->keys[k] = std::uint64_t{row[k]} << 32 | (has_images ? images[k] : 0);
  }
  std::sort(scratch->keys.begin(), scratch->keys.end());
  for (std::uint32_t k = 0; k < size; ++k) {
    found[k] = static_cast<std::uint32_t>(scratch->keys[k] >> 32);
    if (has_images) found_images[k] = static_cast<std::uint32_t>(scratch->keys[k]);
  }
}

ImageShift NeighborSystem::shift(std::uint32_t index, std::uint32_t other,
                                 std::uint32_t image) const {
  ImageShift shift = bins_.shift(image);
  if (bins_.wraps().empty()) return shift;
  for (std::size_t k = 0; k < 3; ++k) {
    shift[k] += bins_.wraps()[other][k] - bins_.wraps()[index][k];
  }
  return shift;
}

std::size_t NeighborSystem::write(std::size_t begin, std::size_t end, const NeighborRows& rows,
                                  std::size_t from, Neighbors* found) const {
  for (std::size_t at = begin; at < end; ++at) {
    const std::uint32_t index = bins_.index(at);
    const std::size_t last = found->offsets[first_ + index + 1];
    for (std::size_t to = found->offsets[first_ + index]; to < last; ++to, ++from) {
      const std::uint32_t other = rows.found[from];
      const std::uint32_t image = rows.images.empty() ? bins_.home() : rows.images[from];
      found->first[to] = static_cast<std::uint32_t>(first_ + index);
      found->second[to] = static_cast<std::uint32_t>(first_ + other);
      if (!found->shifts.empty()) found->shifts[to] = shift(index, other, image);
      if (!options_.distances && !options_.vectors) continue;
      const Vec3 v = vector(index, other, image);
      if (options_.distances) found->distances[to] = length(v);
      if (options_.vectors) found->vectors[to] = v;
    }
  }
  return from;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
