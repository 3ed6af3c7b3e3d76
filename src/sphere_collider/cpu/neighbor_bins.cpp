/// Sizes and numbers of the bins, and the sort.
#include "src/sphere_collider/cpu/neighbor_bins.hpp"

#include <jfpx/error.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

constexpr double kEpsilonOfDouble = std::numeric_limits<double>::epsilon();
/// Points of a bin where the cutoff is wide enough to be divided.
constexpr double kPointsOfBin = 4;
constexpr double kFinestDivision = 3;
/// So few points of a periodic system are not divided: a loop over the images of each is faster.
constexpr std::size_t kFewPoints = 32;
/// Cubes per point from which gaps are looked for.
constexpr double kSparse = 16;
constexpr double kMostImages = 1 << 30;

double largest_component(const Vector& v) {
  return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
}

}  // namespace

NeighborBins::NeighborBins(const Lattice& lattice, std::span<const Vec3> points, double reach,
                           std::size_t first) {
  std::vector<Vector> placed;
  place(lattice, points, first, &placed);
  if (points.empty()) return;  // no result reads what follows
  remove_gaps(lattice, placed, reach);
  divide(points.size(), reach);
  find_images(lattice);
  sort(lattice, placed);
}

void NeighborBins::place(const Lattice& lattice, std::span<const Vec3> points, std::size_t first,
                         std::vector<Vector>* placed) {
  resize_interruptible(placed, points.size());
  const bool periodic = lattice.repeats(0) || lattice.repeats(1) || lattice.repeats(2);
  double largest = 0;
  Vector low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for_each_interruptible(points.size(), [&](std::size_t i) {
    Vector& p = (*placed)[i];
    ImageShift shift{};
    if (!periodic) {
      p = to_vector(points[i]);
    } else if (!lattice.wrap(points[i], &p, &shift)) {
      throw InvalidArgument("point " + std::to_string(first + i) +
                            " is too far from the origin; it must be within 2^22 cells");
    }
    if (shift != ImageShift{} && wraps_.empty()) wraps_.resize(points.size());
    if (!wraps_.empty()) wraps_[i] = shift;
    largest = std::max(largest, largest_component(p));
    for (std::size_t k = 0; k < 3; ++k) {
      if (lattice.repeats(k)) continue;
      const double at = lattice.coordinate(k, p);
      low[k] = std::min(low[k], at);
      high[k] = std::max(high[k], at);
    }
  });
  for (std::size_t k = 0; k < 3; ++k) {
    Axis& axis = axes_[k];
    const Vector& inverse = lattice.inverse(k);
    axis.repeats = lattice.repeats(k);
    axis.height = 1 / std::sqrt(dot(inverse, inverse));
    axis.slack = 64 * kEpsilonOfDouble * (largest / axis.height + 1);
    if (!axis.repeats && !points.empty()) {
      axis.low = low[k];
      axis.range = std::max(high[k] - low[k], std::numeric_limits<double>::min());
    }
    if (axis.repeats && axis.slack > 0x1p-6) {
      throw InvalidArgument(
          "points are too far apart along an axis that does not repeat; they must be within 2^40 "
          "heights of the cell");
    }
  }
  error_ = 8 * kEpsilonOfDouble * largest;
}

double NeighborBins::Axis::removed_before(double coordinate) const {
  const auto after = std::upper_bound(
      gaps.begin(), gaps.end(), coordinate,
      [](double x, const std::pair<double, double>& gap) { return x < gap.first; });
  return after == gaps.begin() ? 0 : std::prev(after)->second;
}

double NeighborBins::cubes(double reach) const {
  double cubes = 1;
  for (const Axis& axis : axes_) cubes *= std::max(axis.range * axis.height / reach, 1.0);
  return cubes;
}

void NeighborBins::remove_gaps(const Lattice& lattice, const std::vector<Vector>& placed,
                               double reach) {
  if (cubes(reach) < kSparse * static_cast<double>(placed.size())) return;
  std::vector<double> coordinates(placed.size());
  for (std::size_t k = 0; k < 3; ++k) {
    Axis& axis = axes_[k];
    if (axis.repeats) continue;
    for (std::size_t i = 0; i < placed.size(); ++i) {
      coordinates[i] = lattice.coordinate(k, placed[i]);
    }
    std::sort(coordinates.begin(), coordinates.end());
    const double kept = 2 * (reach / axis.height + axis.slack);
    double removed = 0;
    for (std::size_t i = 1; i < coordinates.size(); ++i) {
      const double gap = coordinates[i] - coordinates[i - 1];
      if (gap > 2 * kept) axis.gaps.push_back({coordinates[i], removed += gap - kept});
    }
    axis.range -= removed;
    poll_interrupt();
  }
}

void NeighborBins::divide(std::size_t points, double reach) {
  const auto number = static_cast<double>(points);
  const bool is_divided =
      points > kFewPoints || !(axes_[0].repeats || axes_[1].repeats || axes_[2].repeats);
  const double fine = std::cbrt(number / cubes(reach) / kPointsOfBin);
  double width = reach / std::clamp(std::nearbyint(fine), 1.0, kFinestDivision) * (1 + 1e-6);
  for (double bins = 2 * number + 65; bins > 2 * number + 64; width *= 1.2) {
    bins = 1;
    for (Axis& axis : axes_) {
      const double most = is_divided ? std::min(kMostBinsOfAxis, axis.range / axis.slack / 16) : 1;
      const double count = std::clamp(std::floor(axis.range * axis.height / width), 1.0, most);
      axis.count = static_cast<std::int64_t>(std::max(count, 1.0));
      bins *= static_cast<double>(axis.count);
    }
  }
  for (Axis& axis : axes_) {
    const auto count = static_cast<double>(axis.count);
    axis.bins_per_unit = count / axis.range;
    const double most = (reach / axis.height + 2 * axis.slack) * (1 + 1e-9);
    const double stencil = most * axis.bins_per_unit + 1;
    if (!axis.repeats) {
      axis.stencil = static_cast<std::int64_t>(std::min(stencil, count - 1));
      continue;
    }
    axis.reach = most;
    if (!(stencil < static_cast<double>(Lattice::kMostShifts))) {
      throw InvalidArgument("the cutoff is more than 2^24 heights of the cell");
    }
    axis.stencil = static_cast<std::int64_t>(stencil);
    axis.images = (axis.stencil + axis.count - 1) / axis.count;
    repeats_points_ = repeats_points_ || 2 * axis.stencil >= axis.count;
  }
}

void NeighborBins::find_images(const Lattice& lattice) {
  double images = 1;
  for (const Axis& axis : axes_) images *= static_cast<double>(2 * axis.images + 1);
  if (images > kMostImages) {
    throw InvalidArgument("the cutoff reaches more than 2^30 images of the cell");
  }
  resize_interruptible(&shifts_, static_cast<std::size_t>(images));
  std::array<std::int64_t, 3> shift;
  for (shift[0] = -axes_[0].images; shift[0] <= axes_[0].images; ++shift[0]) {
    for (shift[1] = -axes_[1].images; shift[1] <= axes_[1].images; ++shift[1]) {
      for (shift[2] = -axes_[2].images; shift[2] <= axes_[2].images; ++shift[2]) {
        shifts_[box_index(shift)] = lattice.to_shift(shift);
      }
      poll_interrupt();
    }
  }
  images_ = Columns(shifts_.size());
  double farthest = 0;
  for (std::size_t box = 0; box < shifts_.size(); ++box) {
    const Vector image = lattice.image_vector(Vector{}, Vector{}, shifts_[box]);
    images_.set(box, image, box);
    farthest = std::max(farthest, largest_component(image));
  }
  // They are in order unless the lattice was reduced.
  are_images_sorted_ = std::is_sorted(shifts_.begin(), shifts_.end());
  if (!are_images_sorted_) sort_images();
  home_ = images_.index[box_index({})];
  error_ += 8 * kEpsilonOfDouble * farthest;
}

void NeighborBins::sort_images() {
  std::vector<std::uint32_t> boxes(shifts_.size());
  std::iota(boxes.begin(), boxes.end(), 0u);
  std::sort(boxes.begin(), boxes.end(),
            [&](std::uint32_t a, std::uint32_t b) { return shifts_[a] < shifts_[b]; });
  std::vector<ImageShift> sorted(shifts_.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    images_.index[boxes[i]] = static_cast<std::uint32_t>(i);
    sorted[i] = shifts_[boxes[i]];
  }
  shifts_ = std::move(sorted);
}

void NeighborBins::sort(const Lattice& lattice, const std::vector<Vector>& placed) {
  const std::size_t points = placed.size();
  std::vector<std::uint32_t> bin_of_point(points);
  start_.resize(static_cast<std::size_t>(axes_[0].count * axes_[1].count * axes_[2].count) + 2);
  for_each_interruptible(points, [&](std::size_t i) {
    std::int64_t bin = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bin = bin * axes_[k].count + axes_[k].bin(lattice.coordinate(k, placed[i]));
    }
    bin_of_point[i] = static_cast<std::uint32_t>(bin);
    ++start_[static_cast<std::size_t>(bin) + 2];
  });
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  bin_.resize(points);
  points_ = Columns(points);
  if (is_undivided()) coordinates_.resize(points);
  for_each_interruptible(points, [&](std::size_t i) {
    // Becomes the first position of the next bin.
    const std::uint32_t at = start_[bin_of_point[i] + 1]++;
    points_.set(at, placed[i], i);
    bin_[at] = bin_of_point[i];
    for (std::size_t k = 0; k < 3 && is_undivided(); ++k) {
      if (axes_[k].repeats) coordinates_[i][k] = lattice.coordinate(k, placed[i]);
    }
  });
}

std::uint32_t NeighborBins::find_near(std::size_t point, std::size_t first,
                                      std::uint32_t* nearby) const {
  const Vector p = coordinates_[point];
  const Vector reach{axes_[0].reach, axes_[1].reach, axes_[2].reach};
  std::uint32_t count = 0;
  for (std::size_t i = first; i < coordinates_.size(); ++i) {
    bool is_near = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = std::abs(p[k] - coordinates_[i][k]);  // at most 1, except for rounding
      is_near &= std::min(x, 1 - x) <= reach[k];
    }
    nearby[count] = static_cast<std::uint32_t>(i);
    count += is_near ? 1 : 0;  // without a branch, which would be unpredictable
  }
  return count;
}

void NeighborBins::find_ranges(std::size_t bin, std::vector<BinRange>* ranges) const {
  const auto floor_divided = [](std::int64_t a, std::int64_t b) {
    return a >= 0 ? a / b : -((b - 1 - a) / b);
  };
  ranges->clear();
  const std::int64_t columns = axes_[2].count;
  auto row = static_cast<std::int64_t>(bin) / columns;
  const std::int64_t z = static_cast<std::int64_t>(bin) % columns;
  const std::int64_t y = row % axes_[1].count, x = row / axes_[1].count;
  std::array<std::int64_t, 3> shift{};
  for (std::int64_t i = x - axes_[0].stencil; i <= x + axes_[0].stencil; ++i) {
    shift[0] = floor_divided(i, axes_[0].count);
    if (shift[0] != 0 && !axes_[0].repeats) continue;
    for (std::int64_t j = y - axes_[1].stencil; j <= y + axes_[1].stencil; ++j) {
      shift[1] = floor_divided(j, axes_[1].count);
      if (shift[1] != 0 && !axes_[1].repeats) continue;
      row = (i - shift[0] * axes_[0].count) * axes_[1].count + j - shift[1] * axes_[1].count;
      const std::int64_t first = z - axes_[2].stencil, last = z + axes_[2].stencil;
      for (shift[2] = floor_divided(first, columns); shift[2] * columns <= last; ++shift[2]) {
        if (shift[2] != 0 && !axes_[2].repeats) continue;
        const std::int64_t from = std::max<std::int64_t>(first - shift[2] * columns, 0);
        const std::int64_t to = std::min(last - shift[2] * columns, columns - 1);
        const std::uint32_t begin = start_[static_cast<std::size_t>(row * columns + from)];
        const std::uint32_t end = start_[static_cast<std::size_t>(row * columns + to) + 1];
        if (begin == end) continue;
        ranges->push_back({begin, end, static_cast<std::uint32_t>(box_index(shift))});
      }
    }
  }
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
