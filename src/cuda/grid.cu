/// Large N, first half: spheres in the cells of a hashed hierarchy of grids, by counting sort; only
/// neighbouring cells are looked at. No world bounds, no cell size to choose, any mix of radii.
#include "src/cuda/grid.cuh"
#include "src/cuda/sphere_filter.hpp"

#include <algorithm>

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

constexpr unsigned kThreads = 256;
constexpr unsigned kSearchThreads = 128;
constexpr unsigned kRanges = 6;  // candidate ranges that a thread collects before it tests
constexpr unsigned kQueue = 96;  // candidates past the filter that a warp keeps

__global__ void __launch_bounds__(kThreads) measure(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ unsigned long long largest;
  if (threadIdx.x == 0) largest = 0;
  __syncthreads();
  const std::uint32_t stride = gridDim.x * kThreads;
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x;
  for (std::uint64_t i = first; i <= args.table_size; i += stride) args.table[i] = 0;
  for (std::uint64_t i = first; i <= args.n; i += stride) args.counts[i] = 0;
  Real half = 0;
  for (std::uint64_t i = first; i < args.n; i += stride) {
    const SphereInstance s = load_sphere(args.spheres + i);
    if (is_valid(s)) {
      const Real need = half_cell_for_radius(s.radius);
      half = half > need ? half : need;
    } else {
      report_invalid(args.state, static_cast<std::uint32_t>(i));
    }
  }
  for (unsigned d = 16; d != 0; d /= 2) {
    const Real other = __shfl_down_sync(kFullWarp, half, d);
    half = half > other ? half : other;
  }
  if (lane_id() == 0) atomicMax(&largest, bits_of(half));
  __syncthreads();
  if (threadIdx.x == 0) atomicMax(&args.state->largest_half, largest);
}

__global__ void __launch_bounds__(kThreads) assign(GridArgs args) {
  wait_for_previous_kernel();
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (args.state->valid_before != 0) return;
  unsigned level_bit = 0;
  if (i < args.n) {
    const SphereInstance s = load_sphere(args.spheres + i);
    const GridCell cell = grid_cell_of(s, half_0_of(args.state));
    const std::uint32_t key = row_of(cell.y, cell.z, cell.level);
    const std::uint32_t bucket = (key + static_cast<std::uint32_t>(cell.x)) & (args.table_size - 1);
    args.places[i] = {bucket, atomicAdd(&args.table[bucket], 1u)};
    if (!is_far(s)) level_bit = 1u << cell.level;
  }
  const unsigned levels = warp_reduce(level_bit, [](unsigned p, unsigned q) { return p | q; });
  const auto known = *static_cast<volatile std::uint32_t*>(&args.state->levels);
  if (lane_id() == 0 && (levels & ~known) != 0) atomicOr(&args.state->levels, levels);
}

__global__ void __launch_bounds__(kThreads) scatter(GridArgs args) {
  wait_for_previous_kernel();
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (args.state->valid_before != 0 || i >= args.n) return;
  const uint2 place = args.places[i];
  const std::uint32_t to = args.table[place.x] + place.y;
  args.sorted[to] = load_sphere(args.spheres + i);
  args.ids[to] = static_cast<std::uint32_t>(i);
}

/// Candidates [begin, end) of the row `key`.
struct Range {
  std::uint32_t begin, end, key;
};
/// Candidate `other` of sphere `self` passed the filter while row `key` of `level` was looked for.
struct alignas(16) Hit {
  std::uint32_t self, other, key;
  std::int32_t level;
};
struct SearchStorage {
  Range ranges[kRanges][kSearchThreads];
  Hit queue[kSearchThreads / 32][kQueue];
};

/// A thread a sphere, in the order of the table. It looks at its own level (each pair from the
/// sphere whose cell comes first in the order of z, y, x) and at all wider levels where a partner
/// can be.
class Searcher {
 public:
  __device__ Searcher(const GridArgs& args, SearchStorage& storage, std::uint32_t position)
      : args_(args),
        storage_(storage),
        queue_(storage.queue[threadIdx.x / 32]),
        half_0_(half_0_of(args.state)),
        position_(position),
        searching_(position < args.n) {
    if (!searching_) return;
    self_ = load_sphere(args.sorted + position);
    cell_ = grid_cell_of(self_, half_0_);
    levels_ = args.state->levels & static_cast<std::uint32_t>((1ull << max(cell_.level, 0)) - 1);
    widest_far_ = widest_far_level(self_, half_0_);
    enter_level(cell_.level);
  }

  /// All lanes of a warp together: hits of all are tested 32 at a time.
  __device__ void run() {
    while (__any_sync(kFullWarp, searching_)) {
      if (searching_) collect_ranges();
      filter_candidates();
      if (searching_ && z_ > z1_) searching_ = leave_level();
    }
    accept_hits(queued_);
  }

 private:
  __device__ void enter_level(int level) {
    const Real half = half_cell_of(half_0_, level);
    const Real inverse = inverse_width(half);
    const Real reach = reach_of(self_.radius, half);
    const auto low = [&](Real x) { return cell_of(moved(x, -reach), inverse); };
    const auto high = [&](Real x) { return cell_of(moved(x, reach), inverse); };
    level_ = level;
    x0_ = low(self_.centre.x), x1_ = high(self_.centre.x);
    y0_ = low(self_.centre.y), y1_ = high(self_.centre.y);
    z1_ = high(self_.centre.z);
    const bool own = level == cell_.level;
    y_ = own ? cell_.y : y0_;
    z_ = own ? cell_.z : low(self_.centre.z);
    own_key_is_next_ = own;
  }

  /// Goes on to the next wider level with a possible partner, if there is one.
  __device__ bool leave_level() {
    int next = level_ - 1;
    if (next < widest_far_) {
      if (levels_ == 0) return false;
      next = 31 - __clz(static_cast<int>(levels_));
    }
    if (next >= 0) levels_ &= ~(1u << next);
    enter_level(next);
    return true;
  }

  /// Fills the thread's list with the next rows of the level.
  __device__ void collect_ranges() {
    ranges_ = next_range_ = 0;
    while (z_ <= z1_ && ranges_ + 2 <= kRanges) {
      const std::uint32_t key = row_of(y_, z_, level_);
      const std::int32_t x0 = own_key_is_next_ ? cell_.x : x0_;
      const std::uint32_t first = (key + static_cast<std::uint32_t>(x0)) & (args_.table_size - 1);
      const std::uint32_t past = first + static_cast<std::uint32_t>(x1_ - x0) + 1;
      const std::uint32_t begin = own_key_is_next_ ? position_ + 1 : args_.table[first];
      if (past <= args_.table_size) {
        push({begin, args_.table[past], key});
      } else {  // the row goes on at the start of the table
        push({begin, args_.n, key});
        push({0, args_.table[past - args_.table_size], key});
      }
      own_key_is_next_ = false;
      if (++y_ > y1_) {
        y_ = y0_;
        ++z_;
      }
    }
  }

  __device__ void push(const Range& range) {
    if (range.begin >= range.end) return;
    storage_.ranges[ranges_][threadIdx.x] = range;
    ++ranges_;
  }

  /// Filters the candidates in the lanes' lists, two of each lane at a time.
  __device__ void filter_candidates() {
    std::uint32_t begin = 0, end = 0, key = 0;
    while (true) {
      if (begin >= end && next_range_ < ranges_) {
        const Range& range = storage_.ranges[next_range_++][threadIdx.x];
        begin = range.begin, end = range.end, key = range.key;
      }
      if (!__any_sync(kFullWarp, begin < end)) return;
      bool first = false, second = false;
      if (begin < end) {
        const bool two = begin + 1 < end;
        const SphereInstance one = load_sphere(args_.sorted + begin);
        const SphereInstance other = load_sphere(args_.sorted + (two ? begin + 1 : begin));
        first = may_touch(self_, one);
        second = two && may_touch(self_, other);
      }
      queue(first, begin, key);
      queue(second, begin + 1, key);
      begin += 2;
    }
  }

  __device__ void queue(bool hit, std::uint32_t other, std::uint32_t key) {
    const unsigned hits = __ballot_sync(kFullWarp, hit);
    if (hits == 0) return;
    if (hit) {
      const unsigned place = queued_ + static_cast<unsigned>(__popc(hits & lanes_below()));
      queue_[place] = {position_, other, key, level_};
    }
    queued_ += static_cast<unsigned>(__popc(hits));
    if (queued_ > kQueue - 32) {
      accept_hits(kQueue - 32);
      __syncwarp();
      const bool moves = lane_id() < queued_ - (kQueue - 32);
      if (moves) queue_[lane_id()] = queue_[kQueue - 32 + lane_id()];
      queued_ -= kQueue - 32;
      __syncwarp();
    }
  }

  /// Takes those of the first `count` hits that touch and are in the row that was looked for.
  /// Others are in the same buckets by chance; they have their own turn, or none. A touching sphere
  /// of that row is in one of the cells looked at, and all of these are different buckets: it is
  /// met once.
  __device__ void accept_hits(unsigned count) {
    __syncwarp();
    for (unsigned k = lane_id(); k < count; k += 32) {
      const Hit hit = queue_[k];
      const SphereInstance self = load_sphere(args_.sorted + hit.self);
      const SphereInstance other = load_sphere(args_.sorted + hit.other);
      const std::uint32_t id = args_.ids[hit.self], other_id = args_.ids[hit.other];
      const bool first = id < other_id;
      const GridCell cell = grid_cell_of(other, half_0_);
      if (cell.level == hit.level && row_of(cell.y, cell.z, cell.level) == hit.key &&
          shared::test_sphere_pair(first ? self : other, first ? other : self).touching != 0) {
        add_pair(min(id, other_id), max(id, other_id));
      }
    }
  }

  /// Gives the pair to its sphere a.
  __device__ void add_pair(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t rank = count_up(a);
    if (rank < kSlots) {
      args_.partners[std::size_t{rank} * args_.n + a] = b;
      return;
    }
    const unsigned active = __activemask();
    const int leader = __ffs(static_cast<int>(active)) - 1;
    unsigned long long at = 0;
    if (static_cast<int>(lane_id()) == leader) {
      at = atomicAdd(&args_.state->overflow, static_cast<unsigned>(__popc(active)));
    }
    at = __shfl_sync(active, at, leader) + static_cast<unsigned>(__popc(active & lanes_below()));
    if (at < args_.capacity) args_.overflow[at] = {a, b, rank};
  }

  /// counts[a]++ with one atomic for all lanes of the same a: a huge sphere has a million pairs.
  __device__ std::uint32_t count_up(std::uint32_t a) {
    const unsigned peers = __match_any_sync(__activemask(), a);
    const int leader = __ffs(static_cast<int>(peers)) - 1;
    std::uint32_t rank = 0;
    if (static_cast<int>(lane_id()) == leader) {
      rank = atomicAdd(&args_.counts[a], static_cast<unsigned>(__popc(peers)));
    }
    return __shfl_sync(peers, rank, leader) + static_cast<unsigned>(__popc(peers & lanes_below()));
  }

  const GridArgs& args_;
  SearchStorage& storage_;
  Hit* const queue_;
  const Real half_0_;
  const std::uint32_t position_;
  bool searching_;
  SphereInstance self_;
  GridCell cell_{};
  std::uint32_t levels_ = 0;  // wider levels to visit
  int widest_far_ = 0;
  // The level that is looked at, its cells in reach, and its next row.
  int level_ = 0;
  std::int32_t x0_ = 0, x1_ = 0, y0_ = 0, y1_ = 0, z1_ = 0, y_ = 0, z_ = 0;
  bool own_key_is_next_ = false;
  unsigned ranges_ = 0, next_range_ = 0, queued_ = 0;
};

__global__ void __launch_bounds__(kSearchThreads) search(GridArgs args) {
  wait_for_previous_kernel();
  __shared__ SearchStorage storage;
  if (args.state->valid_before != 0) return;
  Searcher(args, storage, blockIdx.x * kSearchThreads + threadIdx.x).run();
}

unsigned blocks_for(std::size_t n, unsigned threads) {
  return static_cast<unsigned>((n + threads - 1) / threads);
}

}  // namespace

void launch_grid_measure(const GridArgs& args, cudaStream_t stream) {
  constexpr unsigned kMostBlocks = 132 * 8;
  const unsigned blocks = std::min(blocks_for(args.n, kThreads), kMostBlocks);
  launch(measure, blocks, 1, kThreads, stream, args);
}

void launch_grid_assign(const GridArgs& args, cudaStream_t stream) {
  launch(assign, blocks_for(args.n, kThreads), 1, kThreads, stream, args);
}

void launch_grid_scatter(const GridArgs& args, cudaStream_t stream) {
  launch(scatter, blocks_for(args.n, kThreads), 1, kThreads, stream, args);
}

void launch_grid_search(const GridArgs& args, cudaStream_t stream) {
  launch(search, blocks_for(args.n, kSearchThreads), 1, kSearchThreads, stream, args);
}

}  // namespace jfpx::inline JFPX_ABI::cuda
