/// Validation of the input of find_nearest(), and a search of the tree for each query.
#include <jfpx/error.hpp>
#include <jfpx/nearest.hpp>

#include "src/sphere_collider/cpu/point_tree.hpp"
#include "src/sphere_collider/periodic_input.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// [m], largest coordinate: squares of distances are finite in double, and distances in Real.
constexpr double kLargestCoordinate = sizeof(Real) == 4 ? 9e37 : 1e150;

void check_points(std::span<const Vec3> points, const PeriodicCell* cell, const std::string& name,
                  const char* names) {
  if (points.size() > cpu::PointTree::kNone) {
    throw InvalidArgument(std::string("number of ") + names + " is " +
                          std::to_string(points.size()) + "; it must be less than 2^32");
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Real x = points[i][k];
      const bool repeats = cell != nullptr && cell->repeats[static_cast<std::size_t>(k)];
      const char* range = nullptr;
      if (!is_finite(x)) {
        range = "finite";
      } else if (std::abs(static_cast<double>(x)) > kLargestCoordinate) {
        range = sizeof(Real) == 4 ? "at most 9e37" : "at most 1e150";
      } else if (repeats && !detail::is_reducible(x, cell->lengths[k])) {
        range = "within 2^20 periodic lengths";
      }
      if (range == nullptr) continue;
      throw InvalidArgument(name + " " + std::to_string(i) + ": " + "xyz"[k] + " is " +
                            detail::to_text(x) + "; it must be " + range);
    }
  }
}

/// @param queries null: the points themselves, each without itself
NearestPoints find_rows(std::span<const Vec3> points, const std::span<const Vec3>* queries,
                        std::size_t k, const NearestOptions& options) {
  const PeriodicCell* const cell = options.cell ? &*options.cell : nullptr;
  if (cell != nullptr) detail::check_cell(*cell, 0, "");
  check_points(points, cell, "point", "points");
  if (queries != nullptr) check_points(*queries, cell, "query", "queries");
  const std::size_t candidates =
      queries == nullptr && !points.empty() ? points.size() - 1 : points.size();
  if (k > candidates) {
    throw InvalidArgument("k is " + std::to_string(k) + "; it must be at most the number of " +
                          (queries == nullptr ? "other points, " : "points, ") +
                          std::to_string(candidates));
  }
  const std::size_t rows = queries == nullptr ? points.size() : queries->size();
  if (k > 0 && rows > std::numeric_limits<std::ptrdiff_t>::max() / sizeof(ImageShift) / k) {
    throw std::bad_alloc();
  }
  ThreadPool pool(options.threads);
  NearestPoints found{k, {}, {}, {}};
  resize_interruptible(&found.indices, rows * k);
  resize_interruptible(&found.distances, rows * k);
  if (cell != nullptr) resize_interruptible(&found.shifts, rows * k);
  if (rows == 0 || k == 0) return found;
  const cpu::PeriodicMetric metric(cell);
  const cpu::PointTree tree(points, metric, pool);
  // Interrupts end a search between two chunks.
  const std::size_t of_chunk = std::max<std::size_t>(1, 128 / (1 + k / 128));
  run_interruptible(pool, (rows + of_chunk - 1) / of_chunk, [&](std::size_t chunk) {
    cpu::NearestList list(k);
    const std::size_t end = std::min(rows, (chunk + 1) * of_chunk);
    for (std::size_t i = chunk * of_chunk; i < end; ++i) {
      const std::size_t row = queries == nullptr ? tree.index(i) : i;
      const Vec3& query = queries == nullptr ? points[row] : (*queries)[row];
      list.clear();
      tree.search(query,
                  queries == nullptr ? static_cast<std::uint32_t>(row) : cpu::PointTree::kNone,
                  &list);
      std::size_t at = row * k;
      for (const cpu::NearestList::Item& item : list.sorted()) {
        found.indices[at] = item.index;
        found.distances[at] = static_cast<Real>(square_root(item.square));
        if (cell != nullptr) metric.square(query, points[item.index], &found.shifts[at]);
        ++at;
      }
    }
  });
  return found;
}

}  // namespace

NearestPoints find_nearest(std::span<const Vec3> points, std::size_t k,
                           const NearestOptions& options) {
  return find_rows(points, nullptr, k, options);
}

NearestPoints find_nearest(std::span<const Vec3> points, std::span<const Vec3> queries,
                           std::size_t k, const NearestOptions& options) {
  return find_rows(points, &queries, k, options);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
