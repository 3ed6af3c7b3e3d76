/// The sweep over classes of radii; see the header for the idea.
#include "src/x86/cell_sweep.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>
#include <utility>

namespace jfpx::inline JFPX_ABI::x86 {
namespace {

/// Radii are binned by exponent and the two highest bits of the mantissa.
using RealBits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
constexpr int kBinShift = std::numeric_limits<Real>::digits - 1 - 2;
constexpr std::size_t kBins = std::size_t{1} << (sizeof(Real) * 8 - 1 - kBinShift);
/// A class spans a factor of four, less up to a quarter octave: wider ones test more in vain,
/// narrower ones sort more often.
constexpr std::size_t kBinsPerClass = 8;
constexpr Real kOneClass = 2;  ///< largest/smallest radius up to which no histogram is made

constexpr Real kLargest = std::numeric_limits<Real>::max();

/// Up to so many targets are tested against everyone, without cells.
constexpr std::size_t kFewTargets = 32;

std::uint64_t to_unsigned(std::int64_t v) { return static_cast<std::uint64_t>(v); }

std::size_t bin_of(Real radius) {
  return static_cast<std::size_t>(std::bit_cast<RealBits>(radius) >> kBinShift);
}

std::size_t queries_per_chunk(std::size_t queries) {
  return std::max<std::size_t>(2048, (queries + 1023) / 1024);
}

/// Rows around a query's own cell: all nine, or, where a pair must not be found from both sides,
/// the own one and the four with higher numbers.
int make_rows(const CellGrid& grid, bool self, std::array<CellRow, 9>* rows) {
  int count = 0;
  if (self) (*rows)[static_cast<std::size_t>(count++)] = {0, 0};
  for (std::int64_t dz = -1; dz <= 1; ++dz) {
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      if (self && (dz < 0 || (dz == 0 && dy <= 0))) continue;
      (*rows)[static_cast<std::size_t>(count++)] = {dz * grid.slab() + dy * grid.row() - 1, 0};
    }
  }
  return count;
}

}  // namespace

void CellSweep::find_pairs(std::span<const SphereInstance> spheres, const Kernels& kernels,
                           ThreadPool& pool, PairChunks* pairs) {
  classify(spheres);
  const std::uint32_t* order = classes_.size() > 1 ? order_.data() : nullptr;
  const auto part = [&](std::size_t from, std::size_t to) {
    return SphereSubset{spheres, order != nullptr ? order + from : nullptr, to - from};
  };
  std::size_t begin = 0;
  for (std::size_t k = 0; k < classes_.size(); ++k) {
    const std::size_t end = classes_[k].end;
    const SphereSubset targets = part(begin, end);
    // Where the sum of two radii can overflow, everything touches: the claim of CellAxis fails.
    const bool by_cell = targets.count > kFewTargets && classes_[k].largest < kLargest / 8;
    const Real reach = enlarged_radius(classes_[k].largest);
    if (by_cell) grid_.fit(targets, 2 * reach);
    place(targets, by_cell, pool, &targets_);
    search(kernels, targets_, by_cell, pool, pairs);
    if (k + 1 < classes_.size()) {
      if (by_cell) {  // smaller spheres reach less far: sorted anew, fewer targets are near
        grid_.fit(targets, reach + enlarged_radius(classes_[k + 1].largest));
        place(targets, by_cell, pool, &targets_);
      }
      place(part(end, spheres.size()), by_cell, pool, &queries_);
      search(kernels, queries_, by_cell, pool, pairs);
    }
    begin = end;
  }
}

/// Fills classes_ from the largest radii to the smallest, and order_.
void CellSweep::classify(std::span<const SphereInstance> spheres) {
  Real smallest = kLargest;
  Real largest = 0;
  for (const SphereInstance& s : spheres) {
    smallest = std::min(smallest, s.radius);
    largest = std::max(largest, s.radius);
  }
  classes_.clear();
  if (largest <= smallest * kOneClass) {
    classes_.push_back({spheres.size(), largest});
    return;
  }
  std::array<std::uint16_t, kBins> class_of_bin{};
  std::array<std::uint32_t, kBins / kBinsPerClass + 1> counts{};
  for (const SphereInstance& s : spheres) class_of_bin[bin_of(s.radius)] = 1;
  // Greedy: a class begins at the largest bin that is left.
  std::size_t lowest_bin = kBins;
  for (std::size_t bin = kBins; bin-- > 0;) {
    if (class_of_bin[bin] == 0) continue;
    if (bin < lowest_bin) {
      classes_.push_back({0, 0});
      lowest_bin = bin >= kBinsPerClass - 1 ? bin - (kBinsPerClass - 1) : 0;
    }
    class_of_bin[bin] = static_cast<std::uint16_t>(classes_.size() - 1);
  }
  for (const SphereInstance& s : spheres) {
    const std::size_t c = class_of_bin[bin_of(s.radius)];
    ++counts[c];
    classes_[c].largest = std::max(classes_[c].largest, s.radius);
  }
  std::uint32_t sum = 0;
  for (std::size_t c = 0; c < classes_.size(); ++c) {
    sum += std::exchange(counts[c], sum);
    classes_[c].end = sum;
  }
  order_.reserve(spheres.size(), "indices of spheres");
  for (std::uint32_t i = 0; i < spheres.size(); ++i) {
    order_[counts[class_of_bin[bin_of(spheres[i].radius)]]++] = i;
  }
}

/// Fills a table with a subset; in order of cells, without the spheres that no target is near.
void CellSweep::place(const SphereSubset& subset, bool by_cell, ThreadPool& pool,
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
    place_by_cell(
        subset, cell_bits, index_bits, pool, &items_, table,
        [&](std::uint64_t cell, std::uint32_t i) { return (cell << index_bits) | i; },
        [](std::uint64_t item) { return item; },
        [&](std::uint64_t item) { return item & ((std::uint64_t{1} << index_bits) - 1); });
  } else {
    place_by_cell(
        subset, cell_bits, 0, pool, &wide_items_, table,
        [](std::uint64_t cell, std::uint32_t i) {
          return WideItem{cell, i};
        },
        [](const WideItem& item) { return item.cell; },
        [](const WideItem& item) { return item.index; });
  }
}

/// Items hold a cell, in bits [low_bit, low_bit + cell_bits) of key(item), and an index.
template <class Item, class Pack, class Key, class Index>
void CellSweep::place_by_cell(const SphereSubset& subset, unsigned cell_bits, unsigned low_bit,
                              ThreadPool& pool, ItemBuffers<Item>* buffers, SphereTable* table,
                              const Pack& pack, const Key& key, const Index& index) {
  const std::uint64_t nowhere = to_unsigned(grid_.cells());  // behind all cells
  Item* items = buffers->items.reserve(subset.count, "cells of spheres");
  Item* spare = buffers->spare.reserve(subset.count, "cells of spheres");
  constexpr std::size_t kChunk = 8192;
  pool.run((subset.count + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    const std::size_t end = std::min(subset.count, (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
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

void CellSweep::search(const Kernels& kernels, const SphereTable& queries, bool by_cell,
                       ThreadPool& pool, PairChunks* pairs) {
  const bool self = &queries == &targets_;
  const std::size_t step = queries_per_chunk(queries.count());
  const std::size_t chunks = (queries.count() + step - 1) / step;
  const std::size_t first_chunk = pairs->add(chunks);
  pool.run(chunks, [&](std::size_t chunk) {
    PairSearch s{queries.columns(), targets_.columns(), self, 0, 0, nullptr};
    s.first = static_cast<std::uint32_t>(chunk * step);
    s.last = static_cast<std::uint32_t>(std::min<std::size_t>(s.first + step, queries.count()));
    std::array<CellRow, 9> rows{};
    int row_count = 0;
    if (by_cell) {
      row_count = make_rows(grid_, self, &rows);
      const std::int64_t* const cells = s.targets.cell;
      for (CellRow& row : rows) {
        const std::int64_t low = s.queries.cell[s.first] + row.offset;
        row.cursor = static_cast<std::uint32_t>(
            std::lower_bound(cells, cells + s.targets.count, low) - cells);
      }
    }
    pairs->fill(first_chunk + chunk, [&](PairSink* sink) {
      s.sink = sink;
      if (by_cell) {
        kernels.search_rows(s, rows.data(), row_count);
      } else {
        kernels.search_all(s);
      }
    });
  });
}

}  // namespace jfpx::inline JFPX_ABI::x86
