/// Search phase for spheres of any radii: tests the spheres in neighboring cells of all levels.
#pragma once

#include "src/sphere_collider/cuda/grid.cuh"
#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kRowsAtOnce = 5;  // rows that a thread looks up together
inline constexpr unsigned kHeld = 8;        // candidates that a thread holds

/// Keys and levels of the rows of cells that were searched, because a hashed bucket may also hold
/// spheres of other rows.
struct HeldRows {
  std::uint32_t range_keys[kRowsAtOnce][kGridThreads];
  std::uint32_t keys[kHeld][kGridThreads];
  std::int32_t levels[kHeld][kGridThreads];
};
struct NoRows {};
template <bool kDense>
struct SearchStorage {
  uint2 ranges[kRowsAtOnce][kGridThreads];  // candidates of a row
  std::uint32_t held[kHeld][kGridThreads];  // positions of candidates that may touch
  std::uint32_t next_work_item;             // for a warp of the block
  std::conditional_t<kDense, NoRows, HeldRows> rows;
};

/// Warps process the spheres in the order of the table. GridArgs::lanes threads share a sphere, and
/// each searches every `lanes`-th row of cells. The search covers the level of the sphere and all
/// wider levels on which it can have a neighbor. On its own level, a pair is found from the sphere
/// whose cell is first in the order of z, y, x or, in one cell, from the lower position.
template <bool kDense, bool kPeriodic>
class Searcher {
 public:
  __device__ Searcher(const GridArgs& args, const GridPlan& plan, SearchStorage<kDense>& storage)
      : args_(args), plan_(plan), storage_(storage) {}

  __device__ void run() {
    const std::uint32_t spheres_of_warp = 32 / args_.lanes;
    const std::uint32_t chunks = (args_.input.n - 1) / spheres_of_warp + 1;
    // The warps of a block process adjacent chunks at any time, so that they share cache lines.
    if (threadIdx.x == 0) storage_.next_work_item = kGridWarps;
    __syncthreads();
    std::uint32_t work_item = threadIdx.x / 32;
    while (true) {
      const std::uint32_t chunk =
          (work_item / kGridWarps * gridDim.x + blockIdx.x) * kGridWarps + work_item % kGridWarps;
      if (chunk >= chunks) break;
      search(chunk * spheres_of_warp + lane_id() / args_.lanes, lane_id() % args_.lanes);
      if (lane_id() == 0) work_item = atomicAdd(&storage_.next_work_item, 1u);
      work_item = __shfl_sync(kFullWarp, work_item, 0);
    }
    const auto found = warp_sum(static_cast<unsigned long long>(found_));
    if (lane_id() == 0 && found != 0) atomicAdd(&args_.state->contacts, found);
  }

 private:
  /// Call from all lanes of a warp together, because they test held candidates 32 at a time.
  __device__ void search(std::uint32_t position, unsigned lane) {
    position_ = position;
    bool searching = position < args_.input.n;
    if (searching) {
      self_ = load_sorted(args_.table.sorted + position);
      cell_ = grid_cell_of(self_, plan_.scale);
      levels_ = args_.state->levels & static_cast<std::uint32_t>((1ull << max(cell_.level, 0)) - 1);
      widest_far_ = kDense ? cell_.level : widest_far_level(self_, plan_.scale);
      enter_level(cell_.level, lane);
    }
    while (__any_sync(kFullWarp, searching)) {
      ranges_ = 0;
      if (searching) collect_ranges();
      filter_candidates();
      if (searching && z_ > z1_) searching = leave_level(lane);
    }
    accept_held();
  }

  __device__ void enter_level(int level, unsigned lane) {
    const Real half = half_cell_of(plan_.scale.half_0, level);
    const Real inverse = inverse_width(half);
    const Real search_radius = search_radius_of(self_.radius, half);
    const auto low = [&](Real x, Real scale) { return cell_of(moved(x, -search_radius), scale); };
    const auto high = [&](Real x, Real scale) { return cell_of(moved(x, search_radius), scale); };
    level_ = level;
    error_bound_ = error_bound_of(self_.radius + half);
    doubt_ = doubt_of<kPeriodic>(args_.input.periodic, error_bound_, self_.radius + half);
    const Real inverse_x = inverse_x_of(inverse, plan_.scale);
    x0_ = low(self_.centre.x, inverse_x), x1_ = high(self_.centre.x, inverse_x);
    y0_ = low(self_.centre.y, inverse), y1_ = high(self_.centre.y, inverse);
    z_ = low(self_.centre.z, inverse), z1_ = high(self_.centre.z, inverse);
    if (kDense) {
      const LevelBox& box = plan_.boxes[level];
      x0_ = max(x0_, box.x0), x1_ = min(x1_, box.x0 + (box.nx - 1));
      y0_ = max(y0_, box.y0), y1_ = min(y1_, box.y0 + (box.ny - 1));
      z_ = max(z_, box.z0), z1_ = min(z1_, box.z0 + (box.nz - 1));
    }
    const bool own = level == cell_.level;
    y_ = own ? cell_.y : y0_;
    z_ = own ? cell_.z : z_;
    if constexpr (kDense) {
      const LevelBox& box = plan_.boxes[level];
      row_ = row_of_box(box, y_, z_);
      next_row_ = static_cast<std::uint32_t>(box.nx);
      next_slice_ = next_row_ * static_cast<std::uint32_t>(box.ny - (y1_ - y0_));
    }
    own_row_is_next_ = own && lane == 0;
    skip_rows(lane);
  }

  __device__ void skip_rows(unsigned count) {
    for (unsigned k = 0; k < count; ++k) {
      const bool last = y_ == y1_;
      if constexpr (kDense) row_ += last ? next_slice_ : next_row_;
      z_ += last ? 1 : 0;
      y_ = last ? y0_ : y_ + 1;
    }
  }

  /// Continues with the next wider level that can have a neighbor, if any.
  __device__ bool leave_level(unsigned lane) {
    int next = level_ - 1;
    if (next < widest_far_) {
      if (levels_ == 0) return false;
      next = 31 - __clz(static_cast<int>(levels_));
    }
    if (next >= 0) levels_ &= ~(1u << next);
    enter_level(next, lane);
    return true;
  }

  /// Looks up the next rows of the level. A row that wraps around to the start of the table
  /// continues with candidates from n on, which denote positions from 0 on. Candidates are less
  /// than 2 n and fit into 32 bits, because DeviceSphereCollider accepts at most 2^31 spheres.
  __device__ void collect_ranges() {
    uint2 ranges[kRowsAtOnce];
    std::uint32_t keys[kRowsAtOnce];
#pragma unroll
    for (unsigned k = 0; k < kRowsAtOnce; ++k) {
      ranges[k] = {0, 0};
      if (z_ > z1_) continue;
      const std::uint32_t key = kDense ? row_ : row_of(y_, z_, level_);
      const std::int32_t x0 = own_row_is_next_ ? cell_.x : x0_;
      const std::uint32_t first = (key + static_cast<std::uint32_t>(x0)) & plan_.mask<kDense>();
      std::uint32_t past = first + static_cast<std::uint32_t>(x1_ - x0) + 1;
      std::uint32_t wrapped = 0;
      if (!kDense && past > plan_.buckets) past -= plan_.buckets, wrapped = args_.input.n;
      ranges[k] = {own_row_is_next_ ? position_ + 1 : args_.table.starts[first],
                   args_.table.starts[past] + wrapped};
      keys[k] = key;
      own_row_is_next_ = false;
      skip_rows(args_.lanes);
    }
#pragma unroll
    for (unsigned k = 0; k < kRowsAtOnce; ++k) {
      if (ranges[k].x >= ranges[k].y) continue;
      storage_.ranges[ranges_][threadIdx.x] = ranges[k];
      if constexpr (!kDense) storage_.rows.range_keys[ranges_][threadIdx.x] = keys[k];
      ++ranges_;
    }
  }

  /// Position of candidate `at`.
  __device__ std::uint32_t position_of(std::uint32_t at) const {
    return kDense || at < args_.input.n ? at : at - args_.input.n;
  }

  /// Tests the candidates of each lane, two in a step, and holds those that may touch.
  __device__ void filter_candidates() {
    std::uint32_t at = 0, end = 0, key = 0;
    unsigned next = 0;
    while (true) {
      if (at >= end && next < ranges_) {
        const uint2 range = storage_.ranges[next][threadIdx.x];
        at = range.x, end = range.y;
        if constexpr (!kDense) key = storage_.rows.range_keys[next][threadIdx.x];
        ++next;
      }
      if (!__any_sync(kFullWarp, at < end)) return;
      if (at < end) {
        const std::uint32_t first = position_of(at), second = position_of(min(at + 1, end - 1));
        const Real to_first = excess(self_, load_sorted(args_.table.sorted + first));
        const Real to_second = excess(self_, load_sorted(args_.table.sorted + second));
        if (!(to_first > error_bound_)) hold(first, key, to_first);
        if (second != first && !(to_second > error_bound_)) hold(second, key, to_second);
        at += 2;
      }
      if (__any_sync(kFullWarp, held_ > kHeld - 2)) accept_held();
    }
  }

  __device__ void hold(std::uint32_t other, std::uint32_t key, Real its_excess) {
    uncertain_ = uncertain_ || !(its_excess < -doubt_);
    storage_.held[held_][threadIdx.x] = other;
    if constexpr (!kDense) {
      storage_.rows.keys[held_][threadIdx.x] = key;
      storage_.rows.levels[held_][threadIdx.x] = level_;
    }
    ++held_;
  }

  /// Accepts the held candidates that are in the searched row. Call from all lanes together, which
  /// share the work: candidate i of the warp belongs to the first lane with sum > i. Spheres of
  /// other rows in a hashed bucket are rejected; the search of their own row finds them if it is
  /// within the search radius. A touching sphere of the row is in one of the searched cells, and
  /// all of these are different buckets, so that it is found exactly once.
  __device__ void accept_held() {
    const unsigned sum = warp_inclusive_sum(held_);
    const unsigned all = __shfl_sync(kFullWarp, sum, 31);
    const bool uncertain = __any_sync(kFullWarp, uncertain_);
    __syncwarp();
    for (unsigned first = 0; first < all; first += 32) {
      const unsigned i = first + lane_id();
      const unsigned owner = owner_of(i, sum);
      const unsigned owners_sum = __shfl_sync(kFullWarp, sum, owner);
      const unsigned owners_held = __shfl_sync(kFullWarp, held_, owner);
      const std::uint32_t position = __shfl_sync(kFullWarp, position_, owner);
      if (i >= all) continue;
      const unsigned slot = i - (owners_sum - owners_held);
      const unsigned thread = threadIdx.x - lane_id() + owner;
      const std::uint32_t other = storage_.held[slot][thread];
      if (uncertain && !kPeriodic &&
          !touch(load_sorted(args_.table.sorted + position),
                 load_sorted(args_.table.sorted + other))) {
        continue;
      }
      accept(position, other, slot, thread, uncertain);
    }
    __syncwarp();
    held_ = 0;
    uncertain_ = false;
  }

  __device__ void accept(std::uint32_t position, std::uint32_t other_position, unsigned slot,
                         unsigned thread, [[maybe_unused]] bool uncertain) {
    const std::uint32_t id = args_.table.ids[position], other_id = args_.table.ids[other_position];
    if constexpr (!kDense) {
      const SphereInstance other = load_sorted(args_.table.sorted + other_position);
      const std::uint32_t key = storage_.rows.keys[slot][thread];
      if (!is_in_row(other, key, storage_.rows.levels[slot][thread])) return;
    }
    const bool first = id < other_id;
    const std::uint32_t at_a = first ? position : other_position,
                        a = index_of<kPeriodic>(args_.input, first ? id : other_id),
                        b = index_of<kPeriodic>(args_.input, first ? other_id : id);
    if constexpr (kPeriodic) {
      // A sphere and an image of a lower one are found as that one and an image of the sphere.
      if (is_image(first ? id : other_id) || a == b) return;
      const std::uint32_t at_b = first ? other_position : position;
      if (uncertain && !touch_exactly<true>(args_.input, a, load_sorted(args_.table.sorted + at_a),
                                            b, load_sorted(args_.table.sorted + at_b))) {
        return;
      }
    }
    ++found_;
    add_pair(at_a, a, b);
  }

  __device__ bool is_in_row(const SphereInstance& sphere, std::uint32_t key, int level) const {
    const GridCell cell = grid_cell_of(sphere, plan_.scale);
    return cell.level == level && row_of(cell.y, cell.z, cell.level) == key;
  }

  /// Appends b to row a, whose sphere is at `position`.
  __device__ void add_pair(std::uint32_t position, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t rank = count_up(position);
    if (rank < kSlots) {
      args_.scratch.neighbors[std::size_t{position} * kSlots + rank] = b;
      return;
    }
    const unsigned active = __activemask();
    const int leader = __ffs(static_cast<int>(active)) - 1;
    unsigned long long at = 0;
    if (static_cast<int>(lane_id()) == leader) {
      at = atomicAdd(&args_.state->overflow, static_cast<unsigned>(__popc(active)));
    }
    at = __shfl_sync(active, at, leader) + static_cast<unsigned>(__popc(active & lanes_below()));
    if (at < args_.rows.capacity) args_.rows.overflow[at] = {a, b, rank};
  }

  /// One atomic for all lanes with the same sphere a, because a large sphere can have a million
  /// pairs.
  __device__ std::uint32_t count_up(std::uint32_t position) {
    const unsigned peers = __match_any_sync(__activemask(), position);
    const int leader = __ffs(static_cast<int>(peers)) - 1;
    std::uint32_t rank = 0;
    if (static_cast<int>(lane_id()) == leader) {
      rank = atomicAdd(&args_.rows.counts[position], static_cast<unsigned>(__popc(peers)));
    }
    return __shfl_sync(peers, rank, leader) + static_cast<unsigned>(__popc(peers & lanes_below()));
  }

  const GridArgs& args_;
  const GridPlan& plan_;
  SearchStorage<kDense>& storage_;
  std::uint32_t found_ = 0;  // pairs that this thread added
  // The sphere whose neighbors are searched.
  std::uint32_t position_ = 0;
  SphereInstance self_;
  GridCell cell_{};
  std::uint32_t levels_ = 0;  // wider levels that remain to be searched
  int widest_far_ = 0;
  // The searched level, its cells within the search radius, and its next row.
  int level_ = 0;
  Real error_bound_ = 0;  // of excess() on this level
  Real doubt_ = 0;        // see doubt_of()
  std::int32_t x0_ = 0, x1_ = 0, y0_ = 0, y1_ = 0, z1_ = 0, y_ = 0, z_ = 0;
  std::uint32_t row_ = 0, next_row_ = 0, next_slice_ = 0;  // buckets in a dense table
  bool own_row_is_next_ = false;
  unsigned ranges_ = 0;     // non-empty rows that were looked up
  unsigned held_ = 0;       // candidates held
  bool uncertain_ = false;  // whether one of them may not touch
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
