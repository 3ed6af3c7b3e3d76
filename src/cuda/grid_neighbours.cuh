/// The search among many spheres of one size or nearly so: a thread a sphere finds all partners
/// after it, so that no list is shared, and contacts are made where both spheres are near in
/// memory. They wait on a stage, in the order of positions, until their places are known.
#pragma once

#include "src/cuda/grid_search.cuh"
#include "src/cuda/grid_stage.cuh"
#include "src/cuda/sphere_filter.hpp"

namespace jfpx::inline JFPX_ABI::cuda {

inline constexpr unsigned kColumn = kSlots + 2;  // candidates that a thread keeps
inline constexpr unsigned kRanked = 8;           // partners that are sorted in registers

/// The cells, all of level 0, in which a sphere can have partners.
struct Neighbourhood {
  std::int32_t x0, x1, y0, y1, z0, z1;
};
__device__ inline Neighbourhood neighbourhood_of(const GridPlan& plan, const SphereInstance& s) {
  const Real reach = reach_of(s.radius, plan.scale.half_0);
  const LevelBox& box = plan.boxes[0];
  const auto low = [&](Real x, Real scale, std::int32_t first) {
    return max(cell_of(moved(x, -reach), scale), first);
  };
  const auto high = [&](Real x, Real scale, std::int32_t first, std::int32_t count) {
    return min(cell_of(moved(x, reach), scale), first + (count - 1));
  };
  return {
      low(s.centre.x, plan.inverse_x, box.x0),  high(s.centre.x, plan.inverse_x, box.x0, box.nx),
      low(s.centre.y, plan.inverse_yz, box.y0), high(s.centre.y, plan.inverse_yz, box.y0, box.ny),
      low(s.centre.z, plan.inverse_yz, box.z0), high(s.centre.z, plan.inverse_yz, box.z0, box.nz)};
}

/// Goes through the rows of cells of a neighbourhood.
class Rows {
 public:
  __device__ Rows(const GridPlan& plan, const Neighbourhood& near)
      : cells_(static_cast<std::uint32_t>(near.x1 - near.x0 + 1)),
        rows_y_(near.y1 - near.y0 + 1),
        left_(rows_y_ * (near.z1 - near.z0 + 1)),
        left_y_(rows_y_) {
    const LevelBox& box = plan.boxes[0];
    first_ = plan.row<true>(near.y0, near.z0, 0) + static_cast<std::uint32_t>(near.x0);
    next_y_ = static_cast<std::uint32_t>(box.nx);
    next_z_ = static_cast<std::uint32_t>((box.ny - rows_y_ + 1) * box.nx);
  }
  __device__ std::int32_t left() const { return left_; }
  /// The positions of the spheres in the next row; none if there is none.
  __device__ uint2 next(const std::uint32_t* table) {
    if (left_ <= 0) return {0, 0};
    const uint2 positions{table[first_], table[first_ + cells_]};
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

struct NeighbourStorage {
  std::uint32_t held[kColumn][kGridThreads];  // positions of partners; a thread has a column
  union {
    uint2 ranges[kRowsAtOnce][kGridThreads];  // candidates of a row
    alignas(8) unsigned char staged[kGridWarps][32 * sizeof(SphereContact)];
  };
  unsigned long long warp_sums[kGridWarps];
  unsigned long long place;  // of the block on the stage
};

class NeighbourSearcher {
 public:
  __device__ NeighbourSearcher(const GridArgs& args, const GridPlan& plan,
                               const SearchOutput& output, NeighbourStorage& storage)
      : args_(args), plan_(plan), stage_(stage_of(args, output)), s_(storage) {}

  /// All threads of a block, for consecutive positions.
  __device__ void run(std::uint32_t position) {
    const bool searching = position < args_.n;
    position_ = searching ? position : 0;
    Neighbourhood near{0, 0, 0, -1, 0, -1};
    if (searching) {
      self_ = load_sorted(args_.sorted + position);
      id_ = args_.ids[position];
      near = neighbourhood_of(plan_, self_);
    }
    Rows rows(plan_, near);
    while (__any_sync(kFullWarp, rows.left() > 0)) {
      uint2 ranges[kRowsAtOnce];
#pragma unroll
      for (unsigned k = 0; k < kRowsAtOnce; ++k) ranges[k] = rows.next(args_.table);
      unsigned count = 0, steps = 0;
#pragma unroll
      for (unsigned k = 0; k < kRowsAtOnce; ++k) {
        s_.ranges[count][threadIdx.x] = ranges[k];
        count += ranges[k].x < ranges[k].y ? 1 : 0;
        steps += (ranges[k].y - ranges[k].x + 1) / 2;
      }
      look_through(count, warp_max(steps));
    }
    keep_partners();
    if (crowded_ != 0) crowded_ += kept_, kept_ = 0;
    sort_partners();
    put_on_stage(searching);
  }

 private:
  /// Holds the spheres that touch, of those in `count` ranges: two of a range in a step.
  __device__ void look_through(unsigned count, unsigned steps) {
    std::uint32_t at = 0, past = 0;
    unsigned next = 0;
    for (; steps != 0; --steps) {
      if (at >= past && next < count) {
        const uint2 range = s_.ranges[next++][threadIdx.x];
        at = range.x, past = range.y;
      }
      // Two spheres after the last one are there to be read.
      const SphereInstance one = load_sorted(args_.sorted + at);
      const SphereInstance other = load_sorted(args_.sorted + at + 1);
      const Closeness to_one = closeness(self_, one), to_other = closeness(self_, other);
      bool is_one = at < past && to_one.near, is_other = at + 1 < past && to_other.near;
      const bool doubt = (is_one && !to_one.sure) || (is_other && !to_other.sure);
      if (__any_sync(kFullWarp, doubt || held_ > kColumn - 2)) {
        keep_partners();
        is_one = is_one && touch(self_, one);
        is_other = is_other && touch(self_, other);
      }
      if (is_one) s_.held[held_][threadIdx.x] = at;
      held_ += is_one ? 1 : 0;
      if (is_other) s_.held[held_][threadIdx.x] = at + 1;
      held_ += is_other ? 1 : 0;
      at = min(at + 2, past);
    }
  }

  /// Of what is held, keeps the spheres that come after this one; if they are too many, only
  /// counts.
  __device__ void keep_partners() {
    const unsigned longest = warp_max(held_);
    for (unsigned k = 0; k < longest; ++k) {
      if (k < kept_ || k >= held_) continue;
      const std::uint32_t position = s_.held[k][threadIdx.x];
      if (args_.ids[position] > id_) s_.held[kept_++][threadIdx.x] = position;
    }
    if (kept_ > kSlots) crowded_ += kept_, kept_ = 0;
    held_ = kept_;
  }

  /// The first kRanked go where as many are smaller; further ones, which are rare, are inserted.
  __device__ void sort_partners() {
    std::uint32_t positions[kRanked], ids[kRanked];
    unsigned ranks[kRanked] = {};
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) {
      positions[k] = k < kept_ ? s_.held[k][threadIdx.x] : 0;
    }
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) ids[k] = k < kept_ ? args_.ids[positions[k]] : ~0u;
#pragma unroll
    for (unsigned k = 1; k < kRanked; ++k) {
#pragma unroll
      for (unsigned j = 0; j < k; ++j) {
        const unsigned less = ids[k] < ids[j] ? 1 : 0;
        ranks[j] += less;
        ranks[k] += 1 - less;
      }
    }
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) {
      if (k < kept_) s_.held[ranks[k]][threadIdx.x] = positions[k];
    }
    for (unsigned k = kRanked; k < kept_; ++k) {
      const std::uint32_t position = s_.held[k][threadIdx.x], id = args_.ids[position];
      unsigned to = k;
      for (; to > 0 && args_.ids[s_.held[to - 1][threadIdx.x]] > id; --to) {
        s_.held[to][threadIdx.x] = s_.held[to - 1][threadIdx.x];
      }
      s_.held[to][threadIdx.x] = position;
    }
  }

  __device__ void put_on_stage(bool searching) {
    unsigned long long total = 0;
    const unsigned long long before = block_exclusive_sum(kept_, s_.warp_sums, total);
    if (threadIdx.x == 0) {
      s_.place = atomicAdd(&args_.state->staged, total);
      atomicAdd(&args_.state->contacts, total);
    }
    __syncthreads();
    const unsigned long long place = s_.place + before;
    if (searching) args_.offsets[id_] = staged_list(place, kept_).bits;
    if (crowded_ != 0) {
      args_.offsets[id_] = staged_list(crowded_, StagedList::kCrowded).bits;
      args_.places[id_] = position_;
      atomicAdd(&args_.state->contacts, static_cast<unsigned long long>(crowded_));
      atomicAdd(&args_.state->overflow, 1ull);
    }
    if (s_.place + total <= args_.capacity) write(__shfl_sync(kFullWarp, place, 0));
  }

  /// Contact i of the warp belongs to the lane with the first sum beyond i.
  __device__ void write(unsigned long long place) {
    unsigned sum = kept_;
    for (unsigned d = 1; d < 32; d *= 2) {
      const unsigned below = __shfl_up_sync(kFullWarp, sum, d);
      if (lane_id() >= d) sum += below;
    }
    const unsigned all = __shfl_sync(kFullWarp, sum, 31), start = sum - kept_;
    unsigned char* const staged = s_.staged[threadIdx.x / 32];
    const std::uint32_t first_position = __shfl_sync(kFullWarp, position_, 0);
    __syncwarp();
    for (unsigned first = 0; first < all; first += 32) {
      const unsigned i = first + lane_id();
      const unsigned owner = owner_of(i, sum);
      const unsigned slot = i - __shfl_sync(kFullWarp, start, owner);
      const std::uint32_t a = __shfl_sync(kFullWarp, id_, owner);
      if (i < all) {
        const unsigned thread = threadIdx.x - lane_id() + owner;
        const std::uint32_t position = s_.held[slot][thread];
        const std::uint32_t b = args_.ids[position];
        const SphereInstance self = load_sorted(args_.sorted + first_position + owner);
        write_or_stage(stage_, place + i, a, b, self, load_sorted(args_.sorted + position), staged);
      }
      if (stage_.contacts != nullptr) {
        write_staged(staged, min(32u, all - first), stage_.contacts + place + first);
      }
    }
  }

  const GridArgs& args_;
  const GridPlan& plan_;
  SearchOutput stage_;
  NeighbourStorage& s_;
  std::uint32_t position_ = 0, id_ = 0;
  SphereInstance self_;
  unsigned held_ = 0, kept_ = 0;  // spheres in the column; those of them that come after this one
  std::uint32_t crowded_ = 0;     // partners that the column had no room for
};

/// A warp looks for the partners of a sphere that has too many for the stage.
__device__ inline void list_partners(const GridArgs& args, const GridPlan& plan, std::uint32_t a) {
  const std::uint32_t position = args.places[a];
  const SphereInstance self = load_sorted(args.sorted + position);
  const Neighbourhood near = neighbourhood_of(plan, self);
  unsigned long long at = args.offsets[a];
  Rows rows(plan, near);
  while (rows.left() > 0) {
    uint2 mine{0, 0};  // a row of each lane
    for (unsigned k = 0; k < 32 && rows.left() > 0; ++k) {
      if (k == lane_id()) {
        mine = rows.next(args.table);
      } else {
        rows.skip();
      }
    }
    std::uint32_t sum = mine.y - mine.x;
    for (unsigned d = 1; d < 32; d *= 2) {
      const unsigned below = __shfl_up_sync(kFullWarp, sum, d);
      if (lane_id() >= d) sum += below;
    }
    const std::uint32_t candidates = __shfl_sync(kFullWarp, sum, 31);
    for (std::uint32_t first = 0; first < candidates; first += 32) {
      const std::uint32_t i = first + lane_id();
      const unsigned owner = owner_of(i, sum);
      const std::uint32_t past = __shfl_sync(kFullWarp, mine.y, owner);
      const std::uint32_t k = past - (__shfl_sync(kFullWarp, sum, owner) - i);
      std::uint32_t b = 0;
      if (i < candidates && touch(self, load_sorted(args.sorted + k))) b = args.ids[k];
      const unsigned found = __ballot_sync(kFullWarp, b > a);
      if (b > a) args.crowded_b[at + static_cast<unsigned>(__popc(found & lanes_below()))] = b;
      at += static_cast<unsigned>(__popc(found));
    }
  }
}

__device__ inline void list_crowded(const GridArgs& args, const GridPlan& plan) {
  const std::uint32_t crowded = args.state->crowded, all = crowded + args.state->giants;
  for (std::uint32_t k = blockIdx.x * kGridWarps + threadIdx.x / 32; k < all;
       k += gridDim.x * kGridWarps) {
    list_partners(args, plan, k < crowded ? args.crowded[k] : args.giants[k - crowded]);
  }
}

}  // namespace jfpx::inline JFPX_ABI::cuda
