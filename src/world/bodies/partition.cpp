/// Renewal of the partition on the CPU; see the header.
#include "src/world/bodies/partition.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"

#include <algorithm>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr std::size_t kBodiesPerChunk = 8192;

}  // namespace

void Partition::reserve(const BodyStore& bodies) {
  if (bodies.has_blocks()) reserve_geometric(&entries_, bodies.movable_count());
}

/// Sorts runs in parallel, and merges them in place, with temporary memory if there is some.
void Partition::sort(ThreadPool* pool) noexcept {
  const std::size_t count = entries_.size();
  const auto at = [this](std::size_t i) {
    return entries_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  parallel_for(pool, count, kBodiesPerChunk,
               [&](std::size_t first, std::size_t last) { std::sort(at(first), at(last)); });
  if (pool == nullptr) return;
  for (std::size_t run = kBodiesPerChunk; run < count; run *= 2) {
    parallel_for(pool, count, 2 * run, [&](std::size_t first, std::size_t last) {
      if (first + run < last) std::inplace_merge(at(first), at(first + run), at(last));
    });
  }
}

void Partition::update(BodyStore* store, std::uint64_t steps, ThreadPool* pool) noexcept {
  if (!store->has_blocks()) return;
  MotionArrays& moving = store->moving;
  const std::span<const std::uint32_t> mobile = store->mobile();
  struct Counts {
    std::uint32_t awake = 0, without_place = 0;
    partition::Magnitude largest = 0;
  };
  const Counts counts = parallel_reduce(
      pool, mobile.size(), kBodiesPerChunk, Counts{},
      [&](std::size_t first, std::size_t last) {
        Counts c;
        for (const std::uint32_t i : mobile.subspan(first, last - first)) {
          if (!store->movable(i)) continue;
          c.awake += moving.awake[i];
          c.without_place += moving.place[i] == soft_step::kNoPlace ? 1 : 0;
          c.largest = std::max(c.largest, partition::magnitude_of(moving.position[i]));
        }
        return c;
      },
      [](const Counts& x, const Counts& y) {
        return Counts{x.awake + y.awake, x.without_place + y.without_place,
                      std::max(x.largest, y.largest)};
      });
  if (counts.awake == 0 ||
      !partition::is_due(steps, store->movable_count(), counts.without_place)) {
    return;
  }
  const partition::Grid grid(counts.largest);
  entries_.clear();
  for (const std::uint32_t i : mobile) {
    if (store->movable(i)) entries_.push_back({grid.code(moving.position[i]), i});
  }
  sort(pool);
  parallel_for(pool, entries_.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      moving.place[entries_[k].body] = static_cast<std::uint32_t>(k);
    }
  });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
