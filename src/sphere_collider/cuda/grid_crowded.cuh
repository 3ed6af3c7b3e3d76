/// Search phase for crowded spheres of similar radius: a warp searches for the neighbors of a few
/// spheres, which share the loads of the candidates around them.
#pragma once

#include "src/sphere_collider/cuda/grid_single_level.cuh"
#include "src/sphere_collider/cuda/local_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Number of candidates per warp.
inline constexpr unsigned kCandidates = 128;
inline constexpr unsigned kLoads = kCandidates / 32;  // of a lane
/// Largest number of neighbors that a lane keeps.
inline constexpr unsigned kMaxOfLane = 19;
/// Largest number of cells in y or z around the spheres of one cell c. A search radius is one cell
/// wide. Coordinates have at most kMaxCells cells, so a sum is rounded by at most 1/4 cell, and so
/// is a product of cell_of(). The products of the spheres themselves are between c - 1/4 and c + 1.
/// Those of the ends of the range are between c - 1.75 and c + 2.5, up to 2^-19: their cells are
/// c - 2 to c + 2.
inline constexpr unsigned kMaxRows = 5;

/// Largest number of spheres of a cell that order_cells() sorts.
inline constexpr std::uint32_t kMaxOrdered = 64;

/// Sorts the spheres of each cell by id, but in cells with more than kMaxOrdered spheres. A warp
/// sorts a cell.
__device__ inline void order_cells(const GridArgs& args, const GridPlan& plan) {
  constexpr unsigned kOfLane = kMaxOrdered / 32;
  const unsigned warps = gridDim.x * kGridWarps;
  for (std::uint32_t cell = blockIdx.x * kGridWarps + threadIdx.x / 32; cell < plan.buckets;
       cell += warps) {
    const std::uint32_t first = args.table.starts[cell],
                        count = args.table.starts[cell + 1] - first;
    if (count > kMaxOrdered) continue;
    SphereInstance spheres[kOfLane];
    std::uint32_t ids[kOfLane] = {}, ranks[kOfLane] = {};
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) {
      const std::uint32_t i = 32 * k + lane_id();
      if (i >= count) continue;
      spheres[k] = load_sorted(args.table.sorted + first + i);
      ids[k] = args.table.ids[first + i];
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t id =
          __shfl_sync(kFullWarp, i < 32 ? ids[0] : ids[1], static_cast<int>(i % 32));
#pragma unroll
      for (unsigned k = 0; k < kOfLane; ++k) {  // ids without shift codes can be equal
        ranks[k] += id < ids[k] || (id == ids[k] && i < 32 * k + lane_id()) ? 1 : 0;
      }
    }
    static_assert(kOfLane == 2);
    __syncwarp();  // all lanes have loaded
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) {
      if (32 * k + lane_id() >= count) continue;
      args.table.sorted[first + ranks[k]] = spheres[k];
      args.table.ids[first + ranks[k]] = ids[k];
    }
  }
}

/// The cells of a range, numbered from 0.
class Cells {
 public:
  __device__ Cells(const LevelBox& box, const CellRange& range)
      : first_(row_of_box(box, range.y.low, range.z.low) + static_cast<std::uint32_t>(range.x.low)),
        next_y_(static_cast<std::uint32_t>(box.nx)),
        next_z_(next_y_ * static_cast<std::uint32_t>(box.ny)),
        x_(length(range.x)),
        y_(length(range.y)),
        z_(length(range.z)) {}
  __device__ std::uint32_t count() const { return x_ * y_ * z_; }
  /// The positions in cell `i`: none if there is no such cell.
  __device__ uint2 positions(const std::uint32_t* starts, std::uint32_t i) const {
    if (i >= count()) return {0, 0};
    const std::uint32_t row = i / x_, z = row / y_;
    const std::uint32_t* const start =
        starts + first_ + z * next_z_ + (row - z * y_) * next_y_ + (i - row * x_);
    return {start[0], start[1]};
  }

 private:
  __device__ static std::uint32_t length(const AxisRange& range) {
    return static_cast<std::uint32_t>(range.high - range.low + 1);
  }
  std::uint32_t first_, next_y_, next_z_, x_, y_, z_;
};

/// Shared memory of a warp.
struct CrowdedStorage {
  struct Candidates {
    LocalCandidate spheres[kCandidates];
    std::uint32_t ids[kCandidates];
  };
  union {
    Candidates candidates;
    std::uint32_t rows[32 * kMaxOfLane];  // after the search: the ids of all neighbors
  };
  std::uint32_t found[32 * kMaxOfLane];  // lane l has the elements l, l + 32, l + 64, ...
};

/// Finds the neighbors b > a of each sphere a, and stages them like SingleLevelSearcher.
/// @tparam kOrdered whether order_cells() has sorted the cells. Then a run of candidates is a part
///   of a cell, otherwise a row of cells.
template <bool kPeriodic, bool kOrdered>
class CrowdedSearcher {
 public:
  /// Number of spheres, the queries, whose neighbors a warp finds together.
  static constexpr unsigned kQueries = kOrdered ? 4 : 8;

 private:
  /// Number of consecutive lanes that share the tests of a query.
  static constexpr unsigned kLanesOfQuery = 32 / kQueries;
  static_assert(kLanesOfQuery == 4 || kLanesOfQuery == 8);
  /// Number of tests per lane before it checks whether candidates remain.
  static constexpr unsigned kTestsAtOnce = 32 / kLanesOfQuery;

 public:
  __device__ CrowdedSearcher(const GridArgs& args, const SearchOutput& output, const GridPlan& plan,
                             CrowdedStorage& storage)
      : args_(args), staging_(staging_output(args, output)), plan_(plan), s_(storage) {}

  /// Finds the neighbors of the spheres at kQueries consecutive positions, or fewer at the end.
  /// Call from all lanes of a warp.
  __device__ void run(std::uint32_t position) {
    const unsigned queries = min(kQueries, args_.input.n - position);
    const std::uint32_t at = position + min(query(), queries - 1);
    self_ = load_sorted(args_.table.sorted + at);
    id_ = args_.table.ids[at];
    last_id_ = last_id_of<kPeriodic>(args_.input, id_);
    const bool is_query = query() < queries && !(kPeriodic && is_image(id_));
    found_ = 0;
    is_doubtful_ = false;
    const SingleLevel level(plan_);
    const CellsOfAxis cells = cells_of_axis(level);
    const std::int32_t y = __shfl_sync(kFullWarp, cells.own, 1, kLanesOfQuery),
                       z = __shfl_sync(kFullWarp, cells.own, 2, kLanesOfQuery);
    for (unsigned left = __ballot_sync(kFullWarp, is_query); left != 0;) {
      // Queries in the same row of cells are searched together, because the cells around them
      // overlap.
      const int first = __ffs(static_cast<int>(left)) - 1;
      const std::int32_t first_y = __shfl_sync(kFullWarp, y, first),
                         first_z = __shfl_sync(kFullWarp, z, first);
      const bool is_in = is_query && y == first_y && z == first_z;
      search(level, is_in, first, united(cells.near, is_in));
      left &= ~__ballot_sync(kFullWarp, is_in);
    }
    stage(position, is_query);
  }

 private:
  __device__ static unsigned query() { return lane_id() / kLanesOfQuery; }
  /// Index of this lane among those of its query.
  __device__ static unsigned part() { return lane_id() % kLanesOfQuery; }
  /// Whether the condition holds for a lane of the query of this lane.
  __device__ static bool is_in_query(bool condition) {
    constexpr unsigned kParts = (1u << kLanesOfQuery) - 1;
    const unsigned lanes = __ballot_sync(kFullWarp, condition);
    return (lanes >> (kLanesOfQuery * query()) & kParts) != 0;
  }
  __device__ std::uint32_t& kept_id(unsigned k) { return s_.found[32 * k + lane_id()]; }

  /// The cell of a sphere, and the cells that can contain its neighbors, along one axis.
  struct CellsOfAxis {
    std::int32_t own;
    AxisRange near;
  };
  /// Cells of the query of this lane. The first three lanes of a query compute x, y and z.
  __device__ CellsOfAxis cells_of_axis(const SingleLevel& level) const {
    const LevelBox& box = level.box;
    const bool is_x = part() == 0, is_y = part() == 1;
    const Real centre = is_x   ? self_.centre.x
                        : is_y ? self_.centre.y
                               : self_.centre.z,
               inverse_width = is_x ? level.inverse_x : level.inverse_yz;
    const std::int32_t first = is_x   ? box.x0
                               : is_y ? box.y0
                                      : box.z0,
                       count = is_x   ? box.nx
                               : is_y ? box.ny
                                      : box.nz;
    return {cell_of(centre, inverse_width), cells_within(search_radius_of(self_.radius, level.half),
                                                         centre, inverse_width, first, count)};
  }
  /// The smallest range that contains the ranges of the lanes with `is_in`.
  __device__ static CellRange united(const AxisRange& range, bool is_in) {
    using Limits = std::numeric_limits<std::int32_t>;
    const auto lowest = [&](unsigned axis) {
      return lowest_of_warp(is_in && part() == axis ? range.low : Limits::max());
    };
    const auto highest = [&](unsigned axis) {
      return highest_of_warp(is_in && part() == axis ? range.high : Limits::min());
    };
    return {{lowest(0), highest(0)}, {lowest(1), highest(1)}, {lowest(2), highest(2)}};
  }

  /// Tests the spheres in a range of cells against the queries of the lanes with `is_in`: all, or
  /// in ordered cells those with ids above the lowest query. The origin of local coordinates is the
  /// centre of the query of lane `first`.
  __device__ void search(const SingleLevel& level, bool is_in, int first, const CellRange& near) {
    const Vec3 origin{__shfl_sync(kFullWarp, self_.centre.x, first),
                      __shfl_sync(kFullWarp, self_.centre.y, first),
                      __shfl_sync(kFullWarp, self_.centre.z, first)};
    LocalQuery local = local_query(self_, level.half, origin);
    if constexpr (kPeriodic) {
      local.doubt = doubt_of<true>(args_.input.periodic, local.doubt, self_.radius + level.half);
    }
    if (!is_in) local.limit = -std::numeric_limits<float>::infinity();
    if constexpr (kOrdered) {
      const std::uint32_t lowest = lowest_of_warp(is_in ? last_id_ : ~0u);
      const Cells cells(level.box, near);
      for (std::uint32_t k = 0; k < cells.count(); k += 32) {
        uint2 positions = cells.positions(args_.table.starts, k + lane_id());
        positions.x = first_above(lowest, positions);
        test_runs(positions, local, origin);
      }
    } else {
      const std::int32_t y = near.y.low + static_cast<std::int32_t>(lane_id() % kMaxRows),
                         z = near.z.low + static_cast<std::int32_t>(lane_id() / kMaxRows);
      uint2 positions{0, 0};
      if (y <= near.y.high && z <= near.z.high) {
        const std::uint32_t row = row_of_box(level.box, y, z);
        positions = {args_.table.starts[row + static_cast<std::uint32_t>(near.x.low)],
                     args_.table.starts[row + static_cast<std::uint32_t>(near.x.high) + 1]};
      }
      test_runs(positions, local, origin);
    }
  }

  /// The position in an ordered cell of the first sphere with an id above `lowest`, or the start of
  /// a cell that is not ordered.
  __device__ std::uint32_t first_above(std::uint32_t lowest, const uint2& positions) const {
    const std::uint32_t count = positions.y - positions.x;
    std::uint32_t below = 0;
    if (count <= kMaxOrdered) {
#pragma unroll
      for (std::uint32_t step = kMaxOrdered; step != 0; step /= 2) {
        const std::uint32_t next = below + step;
        if (next <= count && args_.table.ids[positions.x + next - 1] <= lowest) below = next;
      }
    }
    return positions.x + below;
  }

  /// Tests the spheres of the runs of all lanes.
  __device__ void test_runs(const uint2& positions, const LocalQuery& local, const Vec3& origin) {
    const std::uint32_t count = positions.y - positions.x, sum = warp_inclusive_sum(count);
    const std::uint32_t candidates = __shfl_sync(kFullWarp, sum, 31);
    // Candidate i is in the last run that starts at or before i, at position i + shift of that run.
    const std::uint32_t start = count != 0 ? sum - count : ~0u;
    const std::uint32_t shift = without_empty_runs(positions.y - sum, count != 0);
    std::uint32_t runs = 0;  // runs that start before the candidates that are loaded next
    for (std::uint32_t done = 0; done < candidates; done += kCandidates) {
      __syncwarp();
      runs = load_candidates(done, candidates, start, shift, runs, origin);
      __syncwarp();
      test_candidates(min(kCandidates, candidates - done), local);
    }
    __syncwarp();
  }

  /// @return in lane k, the value of the k-th lane whose run is not empty; undefined in other lanes
  __device__ std::uint32_t without_empty_runs(std::uint32_t value, bool has_run) {
    const unsigned lanes = __ballot_sync(kFullWarp, has_run);
    if (has_run) s_.candidates.ids[__popc(lanes & lanes_below())] = value;
    __syncwarp();
    return s_.candidates.ids[lane_id()];
  }

  /// Loads the candidates from `done` on.
  /// @param runs number of runs that start before these candidates
  /// @return the number of runs that start before the following candidates
  __device__ std::uint32_t load_candidates(std::uint32_t done, std::uint32_t candidates,
                                           std::uint32_t start, std::uint32_t shift,
                                           std::uint32_t runs, const Vec3& origin) {
    std::uint32_t ids[kLoads];
    Vec3 centres[kLoads];
#pragma unroll
    for (unsigned k = 0; k < kLoads; ++k) {
      if (done + 32 * k >= candidates) break;
      const std::uint32_t i = done + 32 * k + lane_id(), until_start = start - (done + 32 * k);
      const unsigned starts = union_of_warp(until_start < 32 ? 1u << until_start : 0);
      const unsigned run = runs + static_cast<unsigned>(__popc(starts & lanes_up_to())) - 1;
      runs += static_cast<unsigned>(__popc(starts));
      const std::uint32_t position = i + __shfl_sync(kFullWarp, shift, static_cast<int>(run));
      const std::uint32_t at = i < candidates ? position : 0;
      centres[k] = load_sorted(args_.table.sorted + at).centre;
      ids[k] = args_.table.ids[at];
    }
#pragma unroll
    for (unsigned k = 0; k < kLoads; ++k) {
      if (done + 32 * k >= candidates) break;
      LocalCandidate candidate = local_candidate(centres[k], origin);
      const unsigned slot = 32 * k + lane_id();
      if (done + slot >= candidates) candidate.square = std::numeric_limits<float>::infinity();
      s_.candidates.spheres[slot] = candidate;
      s_.candidates.ids[slot] = ids[k];
    }
    return runs;
  }

  /// Each lane tests every kLanesOfQuery-th of the first `count` candidates, and keeps those that
  /// are neighbors b > a.
  __device__ void test_candidates(unsigned count, const LocalQuery& local) {
    static_assert(kCandidates / kLanesOfQuery <= 32);
    unsigned apart = ~0u, tested = 0;  // the last test has the lowest bit
    // The bits of the smallest depth that is not negative: negative numbers have larger bits.
    unsigned nearest = ~0u;
    do {
#pragma unroll
      for (unsigned k = 0; k < kTestsAtOnce; ++k) {
        const unsigned depth = __float_as_uint(
            local_depth(local, s_.candidates.spheres[kLanesOfQuery * (tested + k) + part()]));
        apart = __funnelshift_l(depth, apart, 1);  // appends the sign
        nearest = min(nearest, depth);
      }
      tested += kTestsAtOnce;
    } while (kLanesOfQuery * tested < count);
    const bool is_certain = nearest > __float_as_uint(local.doubt);
    const unsigned touching = ~apart;
    if constexpr (kPeriodic) {  // all radii are equal
      if (!is_certain) is_doubtful_ = true;
      keep_neighbors(touching, tested, [](std::uint32_t) { return true; });
    } else if (plan_.equal_radii && __all_sync(kFullWarp, is_certain)) {
      keep_neighbors(touching, tested, [](std::uint32_t) { return true; });
    } else {
      keep_neighbors(touching, tested,
                     [&](std::uint32_t id) { return touch(self_, load_sphere(args_.input, id)); });
    }
  }
  template <class Touches>
  __device__ void keep_neighbors(unsigned touching, unsigned tests, const Touches& touches) {
    const std::uint32_t* const last = s_.candidates.ids + kLanesOfQuery * (tests - 1) + part();
    while (touching != 0) {
      const int bit = 31 - __clz(static_cast<int>(touching));
      touching ^= 1u << bit;
      const std::uint32_t id = last[-static_cast<int>(kLanesOfQuery) * bit];
      if (id > last_id_ && touches(id)) {
        if (found_ < kMaxOfLane) kept_id(found_) = id;
        ++found_;
      }
    }
  }

  /// Writes the neighbors of each query in order to the staging buffer.
  __device__ void stage(std::uint32_t position, bool is_query) {
    std::uint32_t length = found_;  // of this and the lower lanes of the query
    for (unsigned d = 1; d < kLanesOfQuery; d *= 2) {
      const std::uint32_t below = __shfl_up_sync(kFullWarp, length, d, kLanesOfQuery);
      if (part() >= d) length += below;
    }
    const std::uint32_t before = length - found_;
    length = __shfl_sync(kFullWarp, length, kLanesOfQuery - 1, kLanesOfQuery);
    const bool is_short = length <= kMaxStaged, is_kept = !is_in_query(found_ > kMaxOfLane);
    const bool is_doubtful = kPeriodic && is_in_query(is_doubtful_);
    const bool is_known = is_query && !is_doubtful && (is_kept || !is_short);
    const bool is_last = part() == kLanesOfQuery - 1;
    const std::uint32_t kept = is_known && is_short ? length : 0;
    const std::uint32_t sum = warp_inclusive_sum(is_last ? kept : 0);
    const std::uint32_t start = is_last ? sum - kept : sum;  // of the row of the query
    if (is_query && !is_known && part() == 0) list_row_again(args_, position + query());
    const std::uint32_t all = __shfl_sync(kFullWarp, sum, 31);
    unsigned long long index = 0;
    if (lane_id() == 0) {
      index = atomicAdd(&args_.state->contacts, static_cast<unsigned long long>(all));
    }
    index = __shfl_sync(kFullWarp, index, 0);
    if (is_last && is_known) {
      record_row(args_, index_of<kPeriodic>(args_.input, id_), position + query(), length,
                 index + start);
    }
    if (index + all > args_.rows.capacity) return;
    std::uint32_t* const row = s_.rows + start;
    if (kept != 0) {
      for (unsigned k = 0; k < found_; ++k) row[before + k] = kept_id(k);
    }
    __syncwarp();
    constexpr unsigned kFew = 8, kMany = 16;  // neighbors of a lane
    const bool needs_many = kept > kFew * kLanesOfQuery;
    if constexpr (kMaxStaged <= kMany * kLanesOfQuery) {
      if (__any_sync(kFullWarp, needs_many)) {
        sort_row<kMany>(row, kept);
      } else {
        sort_row<kFew>(row, kept);
      }
    } else {
      sort_row<kFew>(row, needs_many ? 0 : kept);
      for (unsigned left = __ballot_sync(kFullWarp, needs_many && part() == 0); left != 0;
           left &= left - 1) {
        const int first = __ffs(static_cast<int>(left)) - 1;
        sort_row_of_warp(s_.rows + __shfl_sync(kFullWarp, start, first),
                         __shfl_sync(kFullWarp, kept, first));
      }
    }
    if (staging_.contacts == nullptr) {
      for (std::uint32_t i = lane_id(); i < all; i += 32) {
        staging_.neighbors[index + i] = s_.rows[i];
      }
    } else {
      write_contacts(index + start, row, kept);
    }
    __syncwarp();
  }

  /// Sorts the row of each query: each lane sorts kOfLane neighbors, then the lanes of a query
  /// merge (bitonic; K. Batcher, 1968).
  template <unsigned kOfLane>
  __device__ void sort_row(std::uint32_t* row, std::uint32_t length) {
    std::uint32_t ids[kOfLane];
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) {
      const unsigned i = kLanesOfQuery * k + part();
      ids[k] = i < length ? row[i] : ~0u;
    }
    sort_values(ids);
#pragma unroll
    for (unsigned lanes = 2; lanes <= kLanesOfQuery; lanes *= 2) {
      merge<true>(ids, lanes - 1, lanes / 2);
      for (unsigned distance = lanes / 4; distance != 0; distance /= 2) {
        merge<false>(ids, distance, distance);
      }
      sort_bitonic(ids, kOfLane / 2);
    }
    __syncwarp();
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) {
      const unsigned i = kOfLane * part() + k;
      if (i < length) row[i] = ids[k];
    }
    __syncwarp();
  }
  /// Sorts the values of a lane.
  template <unsigned kOfLane>
  __device__ static void sort_values(std::uint32_t (&ids)[kOfLane]) {
#pragma unroll
    for (unsigned length = 2; length <= kOfLane; length *= 2) {
#pragma unroll
      for (unsigned k = 0; k < kOfLane; ++k) {
        const unsigned other = k ^ (length - 1);
        if (k < other) exchange(ids[k], ids[other]);
      }
      sort_bitonic(ids, length / 4);
    }
  }
  /// Sorts bitonic sequences of 2 * first_distance values.
  template <unsigned kOfLane>
  __device__ static void sort_bitonic(std::uint32_t (&ids)[kOfLane], unsigned first_distance) {
#pragma unroll
    for (unsigned distance = first_distance; distance != 0; distance /= 2) {
#pragma unroll
      for (unsigned k = 0; k < kOfLane; ++k) {
        if ((k & distance) == 0) exchange(ids[k], ids[k + distance]);
      }
    }
  }
  /// Exchanges values with the lane whose number differs by the bits of `other`. Lanes with the bit
  /// `upper` keep the larger values. With kReversed, first values are compared with last values.
  template <bool kReversed, unsigned kOfLane>
  __device__ static void merge(std::uint32_t (&ids)[kOfLane], unsigned other, unsigned upper) {
    std::uint32_t theirs[kOfLane];
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) {
      theirs[k] =
          __shfl_xor_sync(kFullWarp, ids[kReversed ? kOfLane - 1 - k : k], static_cast<int>(other));
    }
    const bool keeps_larger = (lane_id() & upper) != 0;
#pragma unroll
    for (unsigned k = 0; k < kOfLane; ++k) {
      ids[k] = keeps_larger ? max(ids[k], theirs[k]) : min(ids[k], theirs[k]);
    }
  }

  /// Writes the contacts of the sorted row of the query from index `to` on.
  __device__ void write_contacts(unsigned long long to, const std::uint32_t* row,
                                 std::uint32_t length) {
    for (std::uint32_t i = part(); i < length; i += kLanesOfQuery) {
      write_contact(staging_, to + i, id_, row[i], self_, load_sphere(args_.input, row[i]));
    }
  }

  const GridArgs& args_;
  SearchOutput staging_;
  const GridPlan& plan_;
  CrowdedStorage& s_;
  SphereInstance self_;        // of the query of this lane
  std::uint32_t id_ = 0;       // its id
  std::uint32_t last_id_ = 0;  // last_id_of() that
  std::uint32_t found_ = 0;    // neighbors found by this lane
  bool is_doubtful_ = false;   // in a periodic cell: a candidate of this lane needs an exact test
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
