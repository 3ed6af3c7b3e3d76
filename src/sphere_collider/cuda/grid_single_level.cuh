/// Search phase for spheres of similar radius. Each thread finds all neighbors b > a of one sphere,
/// so that threads share no list, and computes the contacts while both spheres are in the cache.
/// Contacts are staged in the order of positions until their indices in the output are known.
#pragma once

#include "src/sphere_collider/cuda/grid_search.cuh"
#include "src/sphere_collider/cuda/grid_staging.cuh"
#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kAtOnce = 2;  // candidates that a thread tests in a step
static_assert(kAtOnce <= kReadBeyond);
inline constexpr std::uint32_t kMaxKept = 18;  // neighbors that a thread keeps
static_assert(kMaxKept <= kMaxStaged);
inline constexpr unsigned kColumn = kMaxKept + kAtOnce;  // candidates that a thread holds
inline constexpr unsigned kRowsHeld = 5;  // rows whose candidates a thread tests together
inline constexpr unsigned kRanked = 8;    // neighbors that are sorted in registers

/// Level 0 of a grid with one level, copied from the plan.
struct SingleLevel {
  __device__ explicit SingleLevel(const GridPlan& plan)
      : box(plan.boxes[0]),
        half(plan.scale.half_0),
        inverse_x(plan.scale.inverse_x),
        inverse_yz(plan.inverse_yz) {}
  LevelBox box;
  Real half, inverse_x, inverse_yz;
};

/// Consecutive cells along an axis, with both ends.
struct AxisRange {
  std::int32_t low, high;
};
/// Those of the `count` cells from `first` on that are within `distance` of x.
__device__ inline AxisRange cells_within(Real distance, Real x, Real inverse_width,
                                         std::int32_t first, std::int32_t count) {
  return {max(cell_of(moved(x, -distance), inverse_width), first),
          min(cell_of(moved(x, distance), inverse_width), first + (count - 1))};
}

/// The cells that can contain neighbors of a sphere.
struct CellRange {
  AxisRange x, y, z;
};
__device__ inline CellRange neighbor_cells(const SingleLevel& level, const SphereInstance& s) {
  const Real distance = search_radius_of(s.radius, level.half);
  const LevelBox& box = level.box;
  return {cells_within(distance, s.centre.x, level.inverse_x, box.x0, box.nx),
          cells_within(distance, s.centre.y, level.inverse_yz, box.y0, box.ny),
          cells_within(distance, s.centre.z, level.inverse_yz, box.z0, box.nz)};
}

/// Iterates over the rows of a range of cells.
class Rows {
 public:
  __device__ Rows(const LevelBox& box, const CellRange& near)
      : cells_(static_cast<std::uint32_t>(near.x.high - near.x.low + 1)),
        rows_y_(near.y.high - near.y.low + 1),
        left_(rows_y_ * (near.z.high - near.z.low + 1)),
        left_y_(rows_y_) {
    first_ = row_of_box(box, near.y.low, near.z.low) + static_cast<std::uint32_t>(near.x.low);
    next_y_ = static_cast<std::uint32_t>(box.nx);
    next_z_ = static_cast<std::uint32_t>((box.ny - rows_y_ + 1) * box.nx);
  }
  __device__ std::int32_t left() const { return left_; }
  /// The positions of the spheres in the next row.
  __device__ uint2 peek(const std::uint32_t* table) const {
    return {table[first_], table[first_ + cells_]};
  }
  /// The same, and continues; empty after the last row.
  __device__ uint2 next(const std::uint32_t* table) {
    if (left_ <= 0) return {0, 0};
    const uint2 positions = peek(table);
    skip();
    return positions;
  }
  __device__ void skip() {
    --left_;
    const bool last = --left_y_ == 0;
    first_ += last ? next_z_ : next_y_;
    left_y_ = last ? rows_y_ : left_y_;
  }

 private:
  std::uint32_t cells_, first_, next_y_, next_z_;
  std::int32_t rows_y_, left_, left_y_;
};

/// Shared memory of a warp. Lane l uses the elements l, l + 32, l + 64, ... of `held` and `ranges`,
/// its column.
struct SingleLevelStorage {
  std::uint32_t held[kColumn * 32];  // positions of neighbors
  union {
    uint2 ranges[kRowsHeld * 32];  // candidates of a row
    alignas(8) unsigned char staged[32 * sizeof(SphereContact)];
  };
};

template <bool kPeriodic>
class SingleLevelSearcher {
 public:
  __device__ SingleLevelSearcher(const GridArgs& args, const SearchOutput& output,
                                 const GridPlan& plan, SingleLevelStorage& storage)
      : args_(args),
        plan_(plan),
        staging_(staging_output(args, output)),
        s_(storage),
        top_(&held(0)) {}

  /// Call from all lanes of a warp, for consecutive positions.
  __device__ void run(std::uint32_t position) {
    const bool exists = position < args_.input.n;
    position_ = exists ? position : 0;
    const SingleLevel level(plan_);
    CellRange near{{0, 0}, {0, -1}, {0, -1}};
    if (exists) id_ = args_.table.ids[position];
    last_id_ = last_id_of<kPeriodic>(args_.input, id_);
    const bool searching = exists && !(kPeriodic && is_image(id_));
    if (searching) {
      self_ = load_sorted(args_.table.sorted + position);
      near = neighbor_cells(level, self_);
    }
    error_bound_ = error_bound_of(2 * level.half);
    doubt_ = doubt_of<kPeriodic>(args_.input.periodic, error_bound_, 2 * level.half);
    Rows rows(level.box, near);
    while (__any_sync(kFullWarp, rows.left() > 0)) {
      uint2 ranges[kRowsHeld];
#pragma unroll
      for (unsigned k = 0; k < kRowsHeld; ++k) ranges[k] = rows.next(args_.table.starts);
      uint2* past = &s_.ranges[lane_id()];
      unsigned steps = 0;
#pragma unroll
      for (unsigned k = 0; k < kRowsHeld; ++k) {
        *past = ranges[k];
        past += ranges[k].x < ranges[k].y ? 32 : 0;
        steps += (ranges[k].y - ranges[k].x + kAtOnce - 1) / kAtOnce;
      }
      test_candidates(past, warp_max(steps));
    }
    keep_neighbors();
    if (kPeriodic && is_doubtful_) {
      if (searching) list_row_again(args_, position_);
      kept_ = not_kept_ = 0;
    }
    // Contacts of a long row are not staged.
    if (not_kept_ != 0) not_kept_ += kept_, kept_ = 0;
    sort_neighbors();
    write_to_staging_buffer(searching && !is_doubtful_);
  }

 private:
  /// Tests the spheres in the ranges before `past_ranges`, kAtOnce of a range in a step, and holds
  /// spheres that may touch.
  __device__ void test_candidates(const uint2* past_ranges, unsigned steps) {
    const uint2* next = &s_.ranges[lane_id()];
    std::uint32_t* const full = &held(kMaxKept);
    std::uint32_t at = 0, past = 0;
    for (; steps != 0; --steps) {
      if (at >= past && next < past_ranges) {
        const uint2 range = *next;
        at = range.x, past = range.y;
        next += 32;
      }
      SphereInstance others[kAtOnce];  // the array has spare elements at the end
#pragma unroll
      for (unsigned k = 0; k < kAtOnce; ++k) others[k] = load_sorted(args_.table.sorted + at + k);
#pragma unroll
      for (unsigned k = 0; k < kAtOnce; ++k) {
        const Real e = excess(self_, others[k]);
        if (at + k < past && !(e > error_bound_)) {
          *top_ = at + k;
          top_ += 32;
          largest_excess_ = ::fmax(largest_excess_, e);
        }
      }
      at = min(at + kAtOnce, past);
      if (__any_sync(kFullWarp, top_ > full)) keep_neighbors();
    }
  }

  /// Keeps those held spheres that touch and have a larger index; only counts them beyond kMaxKept.
  __device__ void keep_neighbors() {
    const bool is_certain = largest_excess_ < -doubt_;
    if (kPeriodic && !is_certain) is_doubtful_ = true;
    const bool uncertain = !kPeriodic && __any_sync(kFullWarp, !is_certain);
    std::uint32_t* to = &held(kept_);
    for (const std::uint32_t* from = to; from < top_; from += 32) {
      const std::uint32_t position = *from;
      if (id_at(position) <= last_id_) continue;
      if (uncertain && !touch(self_, load_sorted(args_.table.sorted + position))) continue;
      *to = position;
      to += 32;
      ++kept_;
    }
    if (kept_ > kMaxKept) not_kept_ += kept_, kept_ = 0;
    top_ = &held(kept_);
    largest_excess_ = -std::numeric_limits<Real>::infinity();
    __syncwarp();
  }
  __device__ std::uint32_t& held(unsigned k) { return s_.held[32 * k + lane_id()]; }
  __device__ std::uint32_t id_at(std::uint32_t position) const { return args_.table.ids[position]; }

  /// Sorts the first kRanked neighbors by rank (number of smaller neighbors). Inserts further
  /// neighbors, which are rare.
  __device__ void sort_neighbors() {
    std::uint32_t positions[kRanked], ids[kRanked];
    unsigned ranks[kRanked] = {};
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) {
      positions[k] = k < kept_ ? held(k) : 0;
    }
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) ids[k] = k < kept_ ? id_at(positions[k]) : ~0u;
#pragma unroll
    for (unsigned k = 1; k < kRanked; ++k) {
#pragma unroll
      for (unsigned j = 0; j < k; ++j) {
        if (ids[k] < ids[j]) {
          ++ranks[j];
        } else {
          ++ranks[k];
        }
      }
    }
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) {
      if (k < kept_) held(ranks[k]) = positions[k];
    }
    for (unsigned k = kRanked; k < kept_; ++k) {
      const std::uint32_t position = held(k), id = id_at(position);
      unsigned to = k;
      for (; to > 0 && id_at(held(to - 1)) > id; --to) {
        held(to) = held(to - 1);
      }
      held(to) = position;
    }
  }

  __device__ void write_to_staging_buffer(bool searching) {
    const unsigned sum = warp_inclusive_sum(kept_);
    const unsigned all = __shfl_sync(kFullWarp, sum, 31);
    unsigned long long index = 0;
    if (lane_id() == 0) index = atomicAdd(&args_.state->contacts, all);
    index = __shfl_sync(kFullWarp, index, 0);
    const std::uint32_t row = index_of<kPeriodic>(args_.input, id_);
    if (searching) {
      args_.rows.offsets[row] = staged_list(index + sum - kept_, kept_).bits;
      atomicAdd(&args_.rows.bin_sums[row / kBin],
                static_cast<unsigned long long>(kept_ + not_kept_));
    }
    if (not_kept_ != 0) record_long_row(args_, row, position_, not_kept_);
    if (index + all <= args_.rows.capacity) write(index, sum, all);
  }

  /// Contact i of the warp belongs to the first lane with sum > i.
  __device__ void write(unsigned long long index, unsigned sum, unsigned all) {
    const unsigned start = sum - kept_;
    const std::uint32_t first_position = __shfl_sync(kFullWarp, position_, 0);
    __syncwarp();
    for (unsigned first = 0; first < all; first += 32) {
      const unsigned i = first + lane_id();
      const unsigned owner = owner_of(i, sum);
      const unsigned slot = i - __shfl_sync(kFullWarp, start, owner);
      const std::uint32_t a = __shfl_sync(kFullWarp, id_, owner);
      if (i < all) {
        const std::uint32_t position = s_.held[32 * slot + owner];
        const std::uint32_t b = id_at(position);
        const SphereInstance self = load_sorted(args_.table.sorted + first_position + owner);
        write_or_stage(staging_, index + i, a, b, self, load_sorted(args_.table.sorted + position),
                       s_.staged);
      }
      if (staging_.contacts != nullptr) {
        write_staged(s_.staged, min(32u, all - first), staging_.contacts + index + first);
      }
    }
    __syncwarp();
  }

  const GridArgs& args_;
  const GridPlan& plan_;
  SearchOutput staging_;
  SingleLevelStorage& s_;
  std::uint32_t position_ = 0, id_ = 0;
  std::uint32_t last_id_ = 0;  // last_id_of() id_
  SphereInstance self_;
  Real error_bound_ = 0;                                          // of excess()
  Real doubt_ = 0;                                                // see doubt_of()
  Real largest_excess_ = -std::numeric_limits<Real>::infinity();  // of the spheres held
  std::uint32_t* top_;                                            // slot of the next sphere to hold
  unsigned kept_ = 0;           // neighbors b > a at the start of the column
  std::uint32_t not_kept_ = 0;  // neighbors that were only counted, because the row is long
  bool is_doubtful_ = false;    // of a search in a periodic cell
};

/// A warp finds the neighbors b > a of the sphere a at a position, and writes the ids of up to
/// `capacity` of them in any order.
/// @tparam kLoads of candidates in flight per lane
/// @return the number of neighbors
template <bool kPeriodic, unsigned kLoads>
__device__ std::uint32_t list_neighbors(const GridArgs& args, const SingleLevel& level,
                                        std::uint32_t position, std::uint32_t* neighbors,
                                        std::uint32_t capacity = ~0u) {
  const SphereInstance self = load_sorted(args.table.sorted + position);
  const std::uint32_t id = args.table.ids[position],
                      last_id = last_id_of<kPeriodic>(args.input, id);
  const Real bound = error_bound_of(2 * level.half),
             doubt = doubt_of<kPeriodic>(args.input.periodic, bound, 2 * level.half);
  Rows rows(level.box, neighbor_cells(level, self));
  std::uint32_t count = 0;
  while (rows.left() > 0) {
    Rows at_mine = rows;  // the row of this lane
    bool has_row = false;
    for (unsigned k = 0; k < 32 && rows.left() > 0; ++k) {
      if (k == lane_id()) at_mine = rows, has_row = true;
      rows.skip();
    }
    uint2 mine{0, 0};
    if (has_row) mine = at_mine.peek(args.table.starts);
    const std::uint32_t sum = warp_inclusive_sum(mine.y - mine.x);
    const std::uint32_t candidates = __shfl_sync(kFullWarp, sum, 31);
    for (std::uint32_t first = 0; first < candidates; first += 32 * kLoads) {
      SphereInstance others[kLoads];
      std::uint32_t ids[kLoads];
#pragma unroll
      for (unsigned j = 0; j < kLoads; ++j) {
        const std::uint32_t i = first + 32 * j + lane_id();
        const unsigned owner = owner_of(i, sum);
        const std::uint32_t past = __shfl_sync(kFullWarp, mine.y, owner);
        const std::uint32_t k = past - (__shfl_sync(kFullWarp, sum, owner) - i);
        others[j] = load_sorted(args.table.sorted + (i < candidates ? k : position));
        ids[j] = i < candidates ? args.table.ids[k] : id;
      }
#pragma unroll
      for (unsigned j = 0; j < kLoads; ++j) {
        const Real e = excess(self, others[j]);
        bool is_neighbor = !(e > bound) && ids[j] > last_id;
        if (is_neighbor && !(e < -doubt)) {
          is_neighbor =
              touch_exactly<kPeriodic>(args.input, index_of<kPeriodic>(args.input, id), self,
                                       index_of<kPeriodic>(args.input, ids[j]), others[j]);
        }
        const unsigned found = __ballot_sync(kFullWarp, is_neighbor);
        const std::uint32_t at = count + static_cast<std::uint32_t>(__popc(found & lanes_below()));
        if (is_neighbor && at < capacity) neighbors[at] = ids[j];
        count += static_cast<std::uint32_t>(__popc(found));
      }
    }
  }
  return count;
}

/// A warp sorts a row of up to 32 * kOfLane neighbors by rank (number of smaller neighbors).
template <unsigned kOfLane>
__device__ void sort_by_rank(std::uint32_t* row, std::uint32_t length) {
  std::uint32_t ids[kOfLane], ranks[kOfLane] = {};
#pragma unroll
  for (unsigned k = 0; k < kOfLane; ++k) {
    const unsigned i = 32 * k + lane_id();
    ids[k] = i < length ? row[i] : ~0u;
  }
  for (std::uint32_t i = 0; i < length; ++i) {
    const std::uint32_t id = row[i];
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) ranks[k] += id < ids[k] ? 1 : 0;
  }
  __syncwarp();
#pragma unroll
  for (unsigned k = 0; k < kOfLane; ++k) {
    if (32 * k + lane_id() < length) row[ranks[k]] = ids[k];
  }
  __syncwarp();
}
/// A warp sorts a row of up to kMaxStaged neighbors.
__device__ inline void sort_row_of_warp(std::uint32_t* row, std::uint32_t length) {
  if (length <= 64) {
    sort_by_rank<2>(row, length);
  } else {
    sort_by_rank<(kMaxStaged + 31) / 32>(row, length);
  }
}

/// Shared memory of a warp.
struct RowStorage {
  std::uint32_t row[kMaxStaged];
};

/// Stages the rows of list_row_again(): a warp for each.
template <bool kPeriodic, unsigned kLoads>
__device__ void stage_rows_again(const GridArgs& args, const SearchOutput& output,
                                 const GridPlan& plan, RowStorage& s) {
  const SingleLevel level(plan);
  const SearchOutput staging = staging_output(args, output);
  const std::uint32_t rows = args.state->rows_again;
  for (std::uint32_t k = blockIdx.x * kGridWarps + threadIdx.x / 32; k < rows;
       k += gridDim.x * kGridWarps) {
    const std::uint32_t position = args.table.ranks[k],
                        a = index_of<kPeriodic>(args.input, args.table.ids[position]);
    const std::uint32_t length = list_neighbors<kPeriodic, kLoads>(args, level, position, s.row,
                                                                   kMaxStaged),
                        staged = length <= kMaxStaged ? length : 0;
    unsigned long long index = 0;
    if (lane_id() == 0) {
      index = atomicAdd(&args.state->contacts, static_cast<unsigned long long>(staged));
      record_row(args, a, position, length, index);
    }
    index = __shfl_sync(kFullWarp, index, 0);
    __syncwarp();
    if (index + staged > args.rows.capacity) continue;
    sort_row_of_warp(s.row, staged);
    const SphereInstance self = load_sorted(args.table.sorted + position);
    for (std::uint32_t i = lane_id(); i < staged; i += 32) {
      const std::uint32_t b = s.row[i];
      if (kPeriodic || staging.contacts == nullptr) {
        staging.neighbors[index + i] = b;
      } else {
        write_contact(staging, index + i, a, b, self, load_sphere(args.input, b));
      }
    }
    __syncwarp();
  }
}

/// Writes the neighbors of all rows that were not staged to Rows::long_row_neighbors.
template <bool kPeriodic, unsigned kLoads>
__device__ void list_long_rows(const GridArgs& args, const GridPlan& plan) {
  const SingleLevel level(plan);
  const std::uint32_t long_rows = args.state->long_rows,
                      all = long_rows + args.state->very_long_rows;
  for (std::uint32_t k = blockIdx.x * kGridWarps + threadIdx.x / 32; k < all;
       k += gridDim.x * kGridWarps) {
    const std::uint32_t a =
        k < long_rows ? args.rows.long_rows[k] : args.rows.very_long_rows[k - long_rows];
    std::uint32_t* const neighbors = args.rows.long_row_neighbors + args.rows.offsets[a];
    const std::uint32_t length =
        list_neighbors<kPeriodic, kLoads>(args, level, args.table.positions[a], neighbors);
    if constexpr (kPeriodic) {
      __syncwarp();
      for (std::uint32_t i = lane_id(); i < length; i += 32) {
        neighbors[i] = index_of<true>(args.input, neighbors[i]);
      }
    }
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
