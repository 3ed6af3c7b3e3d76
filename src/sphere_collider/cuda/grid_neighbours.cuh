/// The search among many spheres of one size or nearly so: a thread a sphere finds all partners
/// after it, so that no list is shared, and contacts are made where both spheres are near in
/// memory. They wait on a stage, in the order of positions, until their places are known.
#pragma once

#include "src/sphere_collider/cuda/grid_search.cuh"
#include "src/sphere_collider/cuda/grid_stage.cuh"
#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kAtOnce = 2;  // candidates that a thread tests in a step
static_assert(kAtOnce <= kReadBeyond);
inline constexpr unsigned kColumn = kStaged + kAtOnce;  // candidates that a thread keeps
inline constexpr unsigned kRowsHeld = 5;  // rows whose candidates a thread tests together
inline constexpr unsigned kRanked = 8;    // partners that are sorted in registers

/// The one level of such a grid.
struct SingleLevel {
  __device__ explicit SingleLevel(const GridPlan& plan)
      : box(plan.boxes[0]),
        half(plan.scale.half_0),
        inverse_x(plan.scale.inverse_x),
        inverse_yz(plan.inverse_yz) {}
  LevelBox box;
  Real half, inverse_x, inverse_yz;
};

/// The cells in which a sphere can have partners.
struct Neighbourhood {
  std::int32_t x0, x1, y0, y1, z0, z1;
};
__device__ inline Neighbourhood neighbourhood_of(const SingleLevel& level,
                                                 const SphereInstance& s) {
  const Real reach = reach_of(s.radius, level.half);
  const LevelBox& box = level.box;
  const auto low = [&](Real x, Real scale, std::int32_t first) {
    return max(cell_of(moved(x, -reach), scale), first);
  };
  const auto high = [&](Real x, Real scale, std::int32_t first, std::int32_t count) {
    return min(cell_of(moved(x, reach), scale), first + (count - 1));
  };
  return {low(s.centre.x, level.inverse_x, box.x0),
          high(s.centre.x, level.inverse_x, box.x0, box.nx),
          low(s.centre.y, level.inverse_yz, box.y0),
          high(s.centre.y, level.inverse_yz, box.y0, box.ny),
          low(s.centre.z, level.inverse_yz, box.z0),
          high(s.centre.z, level.inverse_yz, box.z0, box.nz)};
}

/// Goes through the rows of cells of a neighbourhood.
class Rows {
 public:
  __device__ Rows(const LevelBox& box, const Neighbourhood& near)
      : cells_(static_cast<std::uint32_t>(near.x1 - near.x0 + 1)),
        rows_y_(near.y1 - near.y0 + 1),
        left_(rows_y_ * (near.z1 - near.z0 + 1)),
        left_y_(rows_y_) {
    first_ = row_of_box(box, near.y0, near.z0) + static_cast<std::uint32_t>(near.x0);
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

/// Of a warp. A lane has a column of each array: every 32nd element from its own number on.
struct NeighbourStorage {
  std::uint32_t held[kColumn * 32];  // positions of partners
  union {
    uint2 ranges[kRowsHeld * 32];  // candidates of a row
    alignas(8) unsigned char staged[32 * sizeof(SphereContact)];
  };
};

class NeighbourSearcher {
 public:
  __device__ NeighbourSearcher(const GridArgs& args, const SearchOutput& output,
                               NeighbourStorage& storage)
      : args_(args), stage_(stage_of(args, output)), s_(storage), top_(&held(0)) {}

  /// All lanes of a warp, for consecutive positions.
  __device__ void run(std::uint32_t position) {
    const bool searching = position < args_.n;
    position_ = searching ? position : 0;
    const SingleLevel level(*args_.plan);
    Neighbourhood near{0, 0, 0, -1, 0, -1};
    if (searching) {
      self_ = load_sorted(args_.sorted + position);
      id_ = args_.ids[position];
      near = neighbourhood_of(level, self_);
    }
    doubt_ = doubt_of(2 * level.half);
    Rows rows(level.box, near);
    while (__any_sync(kFullWarp, rows.left() > 0)) {
      uint2 ranges[kRowsHeld];
#pragma unroll
      for (unsigned k = 0; k < kRowsHeld; ++k) ranges[k] = rows.next(args_.table);
      uint2* past = &s_.ranges[lane_id()];
      unsigned steps = 0;
#pragma unroll
      for (unsigned k = 0; k < kRowsHeld; ++k) {
        *past = ranges[k];
        past += ranges[k].x < ranges[k].y ? 32 : 0;
        steps += (ranges[k].y - ranges[k].x + kAtOnce - 1) / kAtOnce;
      }
      look_through(past, warp_max(steps));
    }
    keep_partners();
    if (crowded_ != 0) crowded_ += kept_, kept_ = 0;
    sort_partners();
    put_on_stage(searching);
  }

 private:
  /// Holds the spheres that may touch, of those in the ranges before `past_ranges`: tests kAtOnce
  /// of a range in a step.
  __device__ void look_through(const uint2* past_ranges, unsigned steps) {
    const uint2* next = &s_.ranges[lane_id()];
    std::uint32_t* const full = &held(kStaged);
    std::uint32_t at = 0, past = 0;
    for (; steps != 0; --steps) {
      if (at >= past && next < past_ranges) {
        const uint2 range = *next;
        at = range.x, past = range.y;
        next += 32;
      }
      SphereInstance others[kAtOnce];  // there are some after the last one
#pragma unroll
      for (unsigned k = 0; k < kAtOnce; ++k) others[k] = load_sorted(args_.sorted + at + k);
#pragma unroll
      for (unsigned k = 0; k < kAtOnce; ++k) {
        const Real e = excess(self_, others[k]);
        if (at + k < past && !(e > doubt_)) {
          *top_ = at + k;
          top_ += 32;
          closest_call_ = ::fmax(closest_call_, e);
        }
      }
      at = min(at + kAtOnce, past);
      if (__any_sync(kFullWarp, top_ > full)) keep_partners();
    }
  }

  /// Of what is held, keeps the spheres that touch and come after this one; if they are too many,
  /// only counts.
  __device__ void keep_partners() {
    const bool in_doubt = __any_sync(kFullWarp, !(closest_call_ < -doubt_));
    std::uint32_t* to = &held(kept_);
    for (const std::uint32_t* from = to; from < top_; from += 32) {
      const std::uint32_t position = *from;
      if (args_.ids[position] <= id_) continue;
      if (in_doubt && !touch(self_, load_sorted(args_.sorted + position))) continue;
      *to = position;
      to += 32;
      ++kept_;
    }
    if (kept_ > kStaged) crowded_ += kept_, kept_ = 0;
    top_ = &held(kept_);
    closest_call_ = -std::numeric_limits<Real>::infinity();
    __syncwarp();
  }
  __device__ std::uint32_t& held(unsigned k) { return s_.held[32 * k + lane_id()]; }

  /// The first kRanked go where as many are smaller; further ones, which are rare, are inserted.
  __device__ void sort_partners() {
    std::uint32_t positions[kRanked], ids[kRanked];
    unsigned ranks[kRanked] = {};
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) {
      positions[k] = k < kept_ ? held(k) : 0;
    }
#pragma unroll
    for (unsigned k = 0; k < kRanked; ++k) ids[k] = k < kept_ ? args_.ids[positions[k]] : ~0u;
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
      const std::uint32_t position = held(k), id = args_.ids[position];
      unsigned to = k;
      for (; to > 0 && args_.ids[held(to - 1)] > id; --to) {
        held(to) = held(to - 1);
      }
      held(to) = position;
    }
  }

  __device__ void put_on_stage(bool searching) {
    const unsigned sum = warp_inclusive_sum(kept_);
    const unsigned all = __shfl_sync(kFullWarp, sum, 31);
    unsigned long long place = 0;
    if (lane_id() == 0) place = atomicAdd(&args_.state->contacts, all);
    place = __shfl_sync(kFullWarp, place, 0);
    if (searching) {
      args_.offsets[id_] = staged_list(place + sum - kept_, kept_).bits;
      atomicAdd(&args_.bin_sums[id_ / kBin], static_cast<unsigned long long>(kept_ + crowded_));
    }
    if (crowded_ != 0) {
      args_.offsets[id_] = staged_list(crowded_, StagedList::kCrowded).bits;
      args_.places[id_] = position_;
      atomicAdd(&args_.state->crowded_contacts, static_cast<unsigned long long>(crowded_));
      atomicAdd(&args_.state->overflow, 1ull);
    }
    if (place + all <= args_.capacity) write(place, sum, all);
  }

  /// Contact i of the warp belongs to the lane with the first sum beyond i.
  __device__ void write(unsigned long long place, unsigned sum, unsigned all) {
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
        const std::uint32_t b = args_.ids[position];
        const SphereInstance self = load_sorted(args_.sorted + first_position + owner);
        write_or_stage(stage_, place + i, a, b, self, load_sorted(args_.sorted + position),
                       s_.staged);
      }
      if (stage_.contacts != nullptr) {
        write_staged(s_.staged, min(32u, all - first), stage_.contacts + place + first);
      }
    }
  }

  const GridArgs& args_;
  SearchOutput stage_;
  NeighbourStorage& s_;
  std::uint32_t position_ = 0, id_ = 0;
  SphereInstance self_;
  Real doubt_ = 0;                                              // of excess()
  Real closest_call_ = -std::numeric_limits<Real>::infinity();  // largest excess of what is held
  std::uint32_t* top_;                                          // where the next sphere is held
  unsigned kept_ = 0;          // of those held: partners that come after this one
  std::uint32_t crowded_ = 0;  // partners that the column had no room for
};

/// A warp looks for the partners of a sphere that has too many for the stage.
__device__ inline void list_partners(const GridArgs& args, const SingleLevel& level,
                                     std::uint32_t a) {
  const std::uint32_t position = args.places[a];
  const SphereInstance self = load_sorted(args.sorted + position);
  unsigned long long at = args.offsets[a];
  Rows rows(level.box, neighbourhood_of(level, self));
  while (rows.left() > 0) {
    uint2 mine{0, 0};  // a row of each lane
    for (unsigned k = 0; k < 32 && rows.left() > 0; ++k) {
      if (k == lane_id()) {
        mine = rows.next(args.table);
      } else {
        rows.skip();
      }
    }
    const std::uint32_t sum = warp_inclusive_sum(mine.y - mine.x);
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

__device__ inline void list_crowded(const GridArgs& args) {
  const SingleLevel level(*args.plan);
  const std::uint32_t crowded = args.state->crowded, all = crowded + args.state->giants;
  for (std::uint32_t k = blockIdx.x * kGridWarps + threadIdx.x / 32; k < all;
       k += gridDim.x * kGridWarps) {
    list_partners(args, level, k < crowded ? args.crowded[k] : args.giants[k - crowded]);
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
