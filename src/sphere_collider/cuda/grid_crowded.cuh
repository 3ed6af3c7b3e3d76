/// Search phase for crowded spheres of similar radius: a warp searches for the neighbors of a few
/// spheres, which share the loads of the candidates around them.
#pragma once

#include "src/sphere_collider/cuda/grid_single_level.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Number of spheres, the queries, whose neighbors a warp finds together.
inline constexpr unsigned kQueries = 8;

/// Shared memory of a warp.
struct CrowdedStorage {
  alignas(32) unsigned char spheres[kQueries * sizeof(SphereInstance)];
  std::uint32_t ids[kQueries];
  std::uint32_t found[kQueries];                              // number of neighbors
  alignas(16) std::uint32_t neighbors[kQueries][kMaxStaged];  // in the order of discovery
};
static_assert(kMaxStaged % 4 == 0);

/// Finds the neighbors b > a of each sphere a, and stages them as SingleLevelSearcher does.
class CrowdedSearcher {
 public:
  __device__ CrowdedSearcher(const GridArgs& args, const SearchOutput& output, const GridPlan& plan,
                             CrowdedStorage& storage)
      : args_(args),
        staging_(staging_output(args, output)),
        level_(plan),
        error_bound_(error_bound_of(2 * level_.half)),
        s_(storage) {}

  /// Finds the neighbors of the spheres at kQueries consecutive positions, or at the last ones.
  /// Call from all lanes of a warp.
  __device__ void run(std::uint32_t position) {
    const unsigned queries = min(kQueries, args_.input.n - position);
    const bool is_query = lane_id() < queries;
    CellRange near{};
    std::int32_t y = 0, z = 0;
    __syncwarp();
    if (lane_id() < kQueries) {
      // Elements after the last query get no neighbor, because no index is larger than theirs.
      const std::uint32_t at = position + min(lane_id(), queries - 1);
      const SphereInstance self = load_sorted(args_.table.sorted + at);
      near = neighbor_cells(level_, self);
      y = cell_of(self.centre.y, level_.inverse_yz);
      z = cell_of(self.centre.z, level_.inverse_yz);
      sphere(lane_id()) = self;
      s_.ids[lane_id()] = is_query ? args_.table.ids[at] : ~0u;
      s_.found[lane_id()] = 0;
    }
    __syncwarp();
    for (unsigned left = (1u << queries) - 1; left != 0;) {
      // Queries in one row of cells are searched together, because the cells around them overlap.
      const int first = __ffs(static_cast<int>(left)) - 1;
      const std::int32_t first_y = __shfl_sync(kFullWarp, y, first),
                         first_z = __shfl_sync(kFullWarp, z, first);
      const bool is_in = is_query && y == first_y && z == first_z;
      const unsigned together = __ballot_sync(kFullWarp, is_in);
      search(together, united(near, is_in));
      left &= ~together;
    }
    __syncwarp();
    stage(position, queries);
  }

 private:
  __device__ SphereInstance& sphere(unsigned query) {
    return reinterpret_cast<SphereInstance*>(s_.spheres)[query];
  }

  /// The smallest range that contains those of the lanes with `is_in`.
  __device__ static CellRange united(const CellRange& range, bool is_in) {
    using Limits = std::numeric_limits<std::int32_t>;
    const auto lowest = [&](std::int32_t x) { return lowest_of_warp(is_in ? x : Limits::max()); };
    const auto highest = [&](std::int32_t x) { return highest_of_warp(is_in ? x : Limits::min()); };
    return {lowest(range.x0),  highest(range.x1), lowest(range.y0),
            highest(range.y1), lowest(range.z0),  highest(range.z1)};
  }

  /// Tests all spheres in a range of cells against the queries whose bits are set. A lane tests one
  /// sphere at a time.
  __device__ void search(unsigned queries, const CellRange& near) {
    const std::int32_t rows_y = near.y1 - near.y0 + 1, rows = rows_y * (near.z1 - near.z0 + 1);
    for (std::int32_t first_row = 0; first_row < rows; first_row += 32) {
      const auto row = first_row + static_cast<std::int32_t>(lane_id());
      uint2 positions{0, 0};  // of the spheres in the row of this lane
      if (row < rows) {
        const std::uint32_t cells =
            row_of_box(level_.box, near.y0 + row % rows_y, near.z0 + row / rows_y);
        positions = {args_.table.starts[cells + static_cast<std::uint32_t>(near.x0)],
                     args_.table.starts[cells + static_cast<std::uint32_t>(near.x1) + 1]};
      }
      const std::uint32_t sum = warp_inclusive_sum(positions.y - positions.x);
      const std::uint32_t candidates = __shfl_sync(kFullWarp, sum, 31);
      for (std::uint32_t first = 0; first < candidates; first += 32) {
        const std::uint32_t i = first + lane_id();
        const unsigned owner = owner_of(i, sum);
        const std::uint32_t past = __shfl_sync(kFullWarp, positions.y, owner);
        const std::uint32_t before_past = __shfl_sync(kFullWarp, sum, owner) - i;
        const std::uint32_t position = i < candidates ? past - before_past : 0;
        const SphereInstance other = load_sorted(args_.table.sorted + position);
        // Index 0 is a neighbor of no query, because it is not larger than any index.
        test(queries, other, i < candidates ? args_.table.ids[position] : 0);
      }
    }
  }

  /// Adds a sphere to the neighbors of the queries that it touches.
  __device__ void test(unsigned queries, const SphereInstance& other, std::uint32_t id) {
    unsigned touching = 0;
    bool is_uncertain = false;
#pragma unroll
    for (unsigned query = 0; query < kQueries; ++query) {
      const Real e = excess(load_sorted(&sphere(query)), other);
      const bool may_touch = !(e > error_bound_) && id > s_.ids[query];
      is_uncertain = is_uncertain || !(absolute(e) > error_bound_);
      touching |= may_touch ? 1u << query : 0;
    }
    for (touching &= queries; touching != 0; touching &= touching - 1) {
      const auto query = static_cast<unsigned>(__ffs(static_cast<int>(touching)) - 1);
      if (is_uncertain && !touch(load_sorted(&sphere(query)), other)) continue;
      const std::uint32_t at = atomicAdd(&s_.found[query], 1u);
      if (at < kMaxStaged) s_.neighbors[query][at] = id;
    }
  }

  /// Sorts the neighbors of each query by rank, that is, by the number of smaller ones, and writes
  /// them to the staging buffer.
  __device__ void stage(std::uint32_t position, unsigned queries) {
    const std::uint32_t found = lane_id() < queries ? s_.found[lane_id()] : 0,
                        kept = found > kMaxStaged ? 0 : found;
    const std::uint32_t sum = warp_inclusive_sum(kept);
    const std::uint32_t all = __shfl_sync(kFullWarp, sum, 31);
    unsigned long long index = 0;
    if (lane_id() == 0) {
      index = atomicAdd(&args_.state->contacts, static_cast<unsigned long long>(all));
    }
    index = __shfl_sync(kFullWarp, index, 0);
    if (lane_id() < queries) {
      const std::uint32_t id = s_.ids[lane_id()];
      atomicAdd(&args_.rows.bin_sums[id / kBin], static_cast<unsigned long long>(found));
      if (found <= kMaxStaged) {
        args_.rows.offsets[id] = staged_list(index + sum - kept, kept).bits;
      } else {
        args_.rows.offsets[id] = staged_list(found, StagedList::kNotStaged).bits;
        args_.table.positions[id] = position + lane_id();
        atomicAdd(&args_.state->long_row_contacts, static_cast<unsigned long long>(found));
        atomicAdd(&args_.state->overflow, 1ull);
      }
      // The sums below read four neighbors at a time.
      for (std::uint32_t k = kept; k % 4 != 0; ++k) s_.neighbors[lane_id()][k] = ~0u;
    }
    __syncwarp();
    if (index + all > args_.rows.capacity) return;
    for (unsigned query = 0; query < queries; ++query) {
      const std::uint32_t length = __shfl_sync(kFullWarp, kept, query);
      const unsigned long long to = index + __shfl_sync(kFullWarp, sum, query) - length;
      const auto* const neighbors = reinterpret_cast<const uint4*>(s_.neighbors[query]);
      for (std::uint32_t i = lane_id(); i < length; i += 32) {
        const std::uint32_t b = s_.neighbors[query][i];
        std::uint32_t rank = 0;
        for (std::uint32_t k = 0; 4 * k < length; ++k) {
          const uint4 four = neighbors[k];
          rank += (four.x < b ? 1 : 0) + (four.y < b ? 1 : 0) + (four.z < b ? 1 : 0) +
                  (four.w < b ? 1 : 0);
        }
        write_contact(staging_, to + rank, s_.ids[query], b, load_sorted(&sphere(query)),
                      load_sphere(args_.input, b));
      }
    }
  }

  const GridArgs& args_;
  SearchOutput staging_;
  SingleLevel level_;
  Real error_bound_;  // of excess()
  CrowdedStorage& s_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
