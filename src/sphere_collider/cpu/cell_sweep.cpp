/// The sweep over classes of radii; the header describes the algorithm.
#include "src/sphere_collider/cpu/cell_sweep.hpp"

#include "src/base/interrupt.hpp"
#include "src/base/parallel_for.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Radii are binned by the exponent and the two highest bits of the mantissa: four bins per octave.
using RealBits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
constexpr int kBinShift = std::numeric_limits<Real>::digits - 1 - 2;
constexpr std::size_t kBins = std::size_t{1} << (sizeof(Real) * 8 - 1 - kBinShift);

/// Number of bins of a class. Wide classes need fewer sorts, but a wide class of small spheres with
/// one large sphere has many spheres per cell. Such classes are narrowed.
constexpr std::size_t kWidest = 16;
constexpr std::size_t kNarrowest = 4;
/// A class is narrowed if the average number of other targets in the cell of a sphere exceeds this.
constexpr double kDense = 8;
/// Above this average number of other queries in the cell of a query, the search by cells is used.
/// A call takes 14 % less time with it if the number is 2.4, and nearly twice the time if it is
/// 0.7.
constexpr double kCrowded = 2;
constexpr Real kOneBin =
    Real(1.5);  ///< maximum ratio of largest to smallest radius for a single bin

constexpr Real kLargest = std::numeric_limits<Real>::max();

/// Up to this number of targets, all pairs are tested, without cells.
constexpr std::size_t kFewTargets = 32;
constexpr std::size_t kSpheresPerChunk = 8192;

std::uint64_t to_unsigned(std::int64_t v) { return static_cast<std::uint64_t>(v); }

std::size_t bin_of(Real radius) {
  return static_cast<std::size_t>(std::bit_cast<RealBits>(radius) >> kBinShift);
}

std::size_t queries_per_chunk(std::size_t queries) {
  return std::max<std::size_t>(256, (queries + 1023) / 1024);
}

/// Computes the rows around the cell of a query: all nine or, if `half`, only its own row and the
/// four rows with higher numbers, so that each pair is found once.
int make_rows(const CellGrid& grid, bool half, std::array<CellRow, kRows>* rows) {
  int count = 0;
  if (half) (*rows)[static_cast<std::size_t>(count++)] = {0, 0};
  for (std::int64_t dz = -1; dz <= 1; ++dz) {
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      if (half && (dz < 0 || (dz == 0 && dy <= 0))) continue;
      (*rows)[static_cast<std::size_t>(count++)] = {dz * grid.slab() + dy * grid.row() - 1, 0};
    }
  }
  return count;
}

}  // namespace

PairOrder CellSweep::find_pairs(std::span<const SphereInstance> spheres, const Kernels& kernels,
                                ThreadPool& pool, PairChunks* pairs) {
  sort_by_radius(spheres, pool);
  const std::uint32_t* order = bins_.size() > 1 ? order_.data() : nullptr;
  const auto part = [&](std::size_t from, std::size_t to) {
    return SphereSubset{spheres, order != nullptr ? order + from : nullptr, to - from};
  };
  std::size_t begin = 0;
  for (std::size_t first = 0; first < bins_.size();) {
    const Real largest = bins_[first].largest;
    const Real extended = extended_radius(largest);
    bool by_cell = false;
    std::size_t next = first;
    SphereSubset targets{};
    for (std::size_t width = kWidest;; width /= 2, next = first) {
      while (next < bins_.size() && bins_[next].bin + width > bins_[first].bin) ++next;
      targets = part(begin, bins_[next - 1].end);
      // If the sum of two radii can overflow, the claim of CellAxis does not hold.
      by_cell = targets.count > kFewTargets && largest < kLargest / 8;
      if (by_cell) grid_.fit(targets, 2 * extended, pool);
      fill_table(targets, by_cell, pool, &targets_);
      if (!by_cell || width == kNarrowest || next == first + 1 ||
          others_per_cell(targets_, pool) <= kDense)
        break;
    }
    const PairOrder found = search(kernels, targets_, by_cell, pool, pairs);
    if (targets.count == spheres.size()) return found;
    begin += targets.count;
    if (next < bins_.size()) {
      if (by_cell) {  // smaller spheres allow smaller cells with fewer targets
        grid_.fit(targets, extended + extended_radius(bins_[next].largest), pool);
        fill_table(targets, by_cell, pool, &targets_);
      }
      fill_table(part(begin, spheres.size()), by_cell, pool, &queries_);
      search(kernels, queries_, by_cell, pool, pairs);
    }
    first = next;
  }
  return PairOrder::none;
}

/// Fills bins_ from the largest radii to the smallest, and order_.
void CellSweep::sort_by_radius(std::span<const SphereInstance> spheres, ThreadPool& pool) {
  struct Radii {
    Real smallest = kLargest, largest = 0;
  };
  const auto [smallest, largest] = parallel_reduce(
      &pool, spheres.size(), kSpheresPerChunk, Radii(),
      [&](std::size_t first, std::size_t last) {
        Radii radii;
        for (const SphereInstance& s : spheres.subspan(first, last - first)) {
          radii.smallest = std::min(radii.smallest, s.radius);
          radii.largest = std::max(radii.largest, s.radius);
        }
        return radii;
      },
      [](const Radii& a, const Radii& b) {
        return Radii{std::min(a.smallest, b.smallest), std::max(a.largest, b.largest)};
      });
  bins_.clear();
  if (largest <= smallest * kOneBin) {
    bins_.push_back({0, spheres.size(), largest});
    return;
  }
  std::uint32_t* next = bin_ends_.reserve(kBins, "bins of radii");
  std::fill_n(next, kBins, 0u);
  for (const SphereInstance& s : spheres) ++next[bin_of(s.radius)];
  std::uint32_t sum = 0;
  for (std::size_t bin = kBins; bin-- > 0;) {
    const std::uint32_t count = std::exchange(next[bin], sum);
    sum += count;
    if (count > 0) bins_.push_back({bin, sum, 0});
  }
  order_.reserve(spheres.size(), "indices of spheres");
  for (std::uint32_t i = 0; i < spheres.size(); ++i) order_[next[bin_of(spheres[i].radius)]++] = i;
  std::size_t begin = 0;
  for (RadiusBin& bin : bins_) {
    for (; begin < bin.end; ++begin) {
      bin.largest = std::max(bin.largest, spheres[order_[begin]].radius);
    }
  }
}

/// Average number of other spheres in the cell of a sphere.
double CellSweep::others_per_cell(const SphereTable& table, ThreadPool& pool) {
  const std::int64_t* cell = table.columns().cell;
  const auto pairs_of = [&](std::size_t first, std::size_t last) {
    // Previous spheres in the cell. Cells are sorted.
    auto in_cell = to_unsigned(cell + first - std::lower_bound(cell, cell + first, cell[first]));
    std::uint64_t pairs = in_cell;
    for (std::size_t i = first + 1; i < last; ++i) {
      const std::uint64_t same = cell[i] == cell[i - 1] ? 1 : 0;
      in_cell = (in_cell + 1) & (0 - same);  // branch-free: a branch would be unpredictable
      pairs += in_cell;
    }
    return pairs;
  };
  const std::uint64_t pairs = parallel_reduce(&pool, table.count(), kSpheresPerChunk,
                                              std::uint64_t{0}, pairs_of, std::plus<>());
  return 2.0 * static_cast<double>(pairs) / std::max(table.count(), 1u);
}

/// Fills a table with a subset. If `by_cell`, the table is sorted by cell and omits spheres that
/// are not near any target.
void CellSweep::fill_table(const SphereSubset& subset, bool by_cell, ThreadPool& pool,
                           SphereTable* table) {
  if (!by_cell) {
    table->fill(
        pool, subset.spheres, subset.count, [&](std::size_t i) { return subset.id(i); },
        [](std::size_t) { return std::int64_t{0}; });
    return;
  }
  const auto cell_bits = static_cast<unsigned>(std::bit_width(to_unsigned(grid_.cells())));
  const auto index_bits = static_cast<unsigned>(std::bit_width(subset.count));
  if (cell_bits + index_bits <= 64) {
    fill_by_cell(
        subset, cell_bits, index_bits, pool, &items_, table,
        [&](std::uint64_t cell, std::uint32_t i) { return (cell << index_bits) | i; },
        [](std::uint64_t item) { return item; },
        [&](std::uint64_t item) { return item & ((std::uint64_t{1} << index_bits) - 1); });
  } else {
    fill_by_cell(
        subset, cell_bits, 0, pool, &wide_items_, table,
        [](std::uint64_t cell, std::uint32_t i) {
          return WideItem{cell, i};
        },
        [](const WideItem& item) { return item.cell; },
        [](const WideItem& item) { return item.index; });
  }
}

/// Items consist of a cell, in bits [low_bit, low_bit + cell_bits) of key(item), and an index.
template <class Item, class Pack, class Key, class Index>
void CellSweep::fill_by_cell(const SphereSubset& subset, unsigned cell_bits, unsigned low_bit,
                             ThreadPool& pool, ItemBuffers<Item>* buffers, SphereTable* table,
                             const Pack& pack, const Key& key, const Index& index) {
  const std::uint64_t nowhere = to_unsigned(grid_.cells());  // greater than all cells
  Item* items = buffers->items.reserve(subset.count, "cells of spheres");
  Item* spare = buffers->spare.reserve(subset.count, "cells of spheres");
  parallel_for(&pool, subset.count, chunk_size(subset.count, 128, 2048),
               [&](std::size_t first, std::size_t last) {
                 for (std::size_t i = first; i < last; ++i) {
                   const std::int64_t cell = grid_.cell(subset[i].centre);
                   items[i] = pack(cell == CellGrid::kNowhere ? nowhere : to_unsigned(cell),
                                   static_cast<std::uint32_t>(i));
                 }
               });
  items = sorter_.sort(pool, items, spare, subset.count, low_bit, cell_bits, key);
  const auto cell_of = [&](const Item& item) { return key(item) >> low_bit; };
  const Item* end = std::partition_point(
      items, items + subset.count, [&](const Item& item) { return cell_of(item) != nowhere; });
  table->fill(
      pool, subset.spheres, static_cast<std::size_t>(end - items),
      [&](std::size_t i) { return subset.id(static_cast<std::size_t>(index(items[i]))); },
      [&](std::size_t i) { return static_cast<std::int64_t>(cell_of(items[i])); });
}

PairOrder CellSweep::search(const Kernels& kernels, const SphereTable& queries, bool by_cell,
                            ThreadPool& pool, PairChunks* pairs) {
  const bool self = &queries == &targets_;
  const bool crowded = by_cell && others_per_cell(queries, pool) > kCrowded;
  const std::size_t step = queries_per_chunk(queries.count());
  const std::size_t chunks = (queries.count() + step - 1) / step;
  const std::size_t first_chunk = pairs->add(chunks);
  run_interruptible(pool, chunks, [&](std::size_t chunk) {
    PairSearch s{queries.columns(), targets_.columns(), self, 0, 0, nullptr};
    s.first = static_cast<std::uint32_t>(chunk * step);
    s.last = static_cast<std::uint32_t>(std::min<std::size_t>(s.first + step, queries.count()));
    std::array<CellRow, kRows> rows{};
    int row_count = 0;
    if (by_cell) {
      row_count = make_rows(grid_, self && !crowded, &rows);
      const std::int64_t* const cells = s.targets.cell;
      for (CellRow& row : rows) {
        const std::int64_t low = s.queries.cell[s.first] + row.offset;
        row.cursor = static_cast<std::uint32_t>(
            std::lower_bound(cells, cells + s.targets.count, low) - cells);
      }
    }
    pairs->fill(first_chunk + chunk, [&](PairSink* sink) {
      s.sink = sink;
      if (crowded) {
        kernels.search_cells(s, rows.data());
      } else if (by_cell) {
        kernels.search_rows(s, rows.data(), row_count);
      } else {
        kernels.search_all(s);
      }
    });
  });
  return self && crowded ? PairOrder::by_lower_sphere : PairOrder::none;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
