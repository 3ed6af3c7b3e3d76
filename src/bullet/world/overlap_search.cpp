/// Order of the leaves, blocks, and the search; see the header.
#include "src/bullet/world/overlap_search.hpp"

#include "src/base/prefetch.hpp"
#include "src/base/real_lanes.hpp"
#include "src/base/reserve.hpp"
#include "src/base/spatial_order.hpp"
#include "src/bullet/chunks.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kLeavesPerChunk = 512;
constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

/// Number of sampled leaves that determine the order of the tree, which affects only the speed.
constexpr std::size_t kSample = 256;

Aabb aabb_of(const btDbvtVolume& volume) {
  Aabb bounds;
  for (int i = 0; i < 3; ++i) {
    bounds.lower[i] = volume.Mins()[i];
    bounds.upper[i] = volume.Maxs()[i];
  }
  return bounds;
}

std::size_t first_lane(unsigned lanes) { return static_cast<std::size_t>(std::countr_zero(lanes)); }

}  // namespace

OverlapSearch::Box OverlapSearch::box_of(const btDbvtVolume& volume) {
  Box box;
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = volume.Mins()[i];
    box.upper[i] = volume.Maxs()[i];
  }
  return box;
}

OverlapSearch::Box OverlapSearch::merged(const Box& a, const Box& b) {
  Box box;
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = std::min(a.lower[i], b.lower[i]);
    box.upper[i] = std::max(a.upper[i], b.upper[i]);
  }
  return box;
}

OverlapSearch::Box OverlapSearch::bounds_of(const Block& block) {
  Box box;
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = *std::min_element(block.lower[i].begin(), block.lower[i].end());
    box.upper[i] = *std::max_element(block.upper[i].begin(), block.upper[i].end());
  }
  return box;
}

OverlapSearch::Block OverlapSearch::empty_block() {
  Block block;
  for (int i = 0; i < 3; ++i) {
    block.lower[i].fill(kInfinity);
    block.upper[i].fill(-kInfinity);
  }
  return block;
}

void OverlapSearch::set(Block* block, std::size_t lane, const Box& box) {
  for (int i = 0; i < 3; ++i) {
    block->lower[i][lane] = box.lower[i];
    block->upper[i][lane] = box.upper[i];
  }
}

bool OverlapSearch::overlap(const Box& a, const Box& b) {
  bool result = true;
  for (int i = 0; i < 3; ++i) result &= a.lower[i] <= b.upper[i] && a.upper[i] >= b.lower[i];
  return result;
}

// With intrinsics, because compilers do not vectorize a loop that computes a bit mask.
unsigned OverlapSearch::test(const Block& block, const Box& box) {
  using namespace cpu;
  unsigned mask = 0;
  for (std::size_t lane = 0; lane < kWidth; lane += kRealLanes) {
    const auto overlap_along = [&](std::size_t i) {
      return both(less_equal(load_lanes(&block.lower[i][lane]), set_lanes(box.upper[i])),
                  less_equal(set_lanes(box.lower[i]), load_lanes(&block.upper[i][lane])));
    };
    const LaneMask hit = both(both(overlap_along(0), overlap_along(1)), overlap_along(2));
    mask |= bits(hit) << lane;
  }
  return mask;
}

std::size_t OverlapSearch::run(ThreadPool& pool, std::span<const LeafUpdate> leaves,
                               btHashedOverlappingPairCache& cache) {
  found_.clear();
  if (std::none_of(leaves.begin(), leaves.end(), [](const LeafUpdate& l) { return l.moves; })) {
    return 0;
  }
  count_ = leaves.size();
  sort(pool, leaves);
  pack(pool, leaves);
  const btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  const btAlignedObjectArray<int>& heads = cache.*PairTables::heads;
  const btAlignedObjectArray<int>& next = cache.*PairTables::next;
  // The cache uses its capacity, a power of two, as the size of the table.
  const PairTable table{pairs.size() > 0 ? &pairs[0] : nullptr, &heads[0], &next[0],
                        static_cast<unsigned>(pairs.capacity()) - 1,
                        static_cast<unsigned>(heads.size())};
  const std::size_t leaf_blocks = levels_[1];
  const std::size_t chunks = chunks_of(leaf_blocks, kBlocksPerChunk);
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  in_chunks(pool, leaf_blocks, kBlocksPerChunk, [&](std::size_t first, std::size_t last) {
    search(first, last, table, &chunks_[first / kBlocksPerChunk]);
  });
  collect(chunks, leaves.size());
  std::size_t overlaps = 0;
  for (std::size_t i = 0; i < chunks; ++i) overlaps += chunks_[i].overlaps;
  return overlaps;
}

void OverlapSearch::sort(ThreadPool& pool, std::span<const LeafUpdate> leaves) {
  const SpatialOrder order(leaves.size(), kSample,
                           [&](std::size_t i) { return aabb_of(leaves[i].after); });
  keys_.reserve(count_, "leaves of a tree");
  spare_keys_.reserve(count_, "leaves of a tree");
  in_chunks(pool, count_, kLeavesPerChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      keys_[i] = {order(aabb_of(leaves[i].after)), static_cast<std::uint32_t>(i)};
    }
  });
  sorted_ = sorter_.sort(pool, keys_.data(), spare_keys_.data(), count_, 0, 32,
                         [](const Key& key) { return key.code; });
}

void OverlapSearch::pack(ThreadPool& pool, std::span<const LeafUpdate> leaves) {
  levels_.assign(1, 0);
  for (std::size_t size = count_; size > 1 || levels_.size() == 1;) {
    size = (size + kWidth - 1) / kWidth;
    levels_.push_back(levels_.back() + size);
  }
  leaves_.reserve(count_, "leaves of a tree");
  blocks_.reserve(levels_.back(), "blocks of a tree");
  bounds_.reserve(levels_[1], "blocks of a tree");
  const Block empty = empty_block();
  in_chunks(pool, levels_[1], kLeavesPerChunk / kWidth, [&](std::size_t first, std::size_t last) {
    for (std::size_t b = first; b < last; ++b) {
      Block& block = blocks_[b];
      block = empty;
      for (std::size_t i = b * kWidth; i < std::min(count_, (b + 1) * kWidth); ++i) {
        constexpr std::size_t kAhead = 8;
        if (i + kAhead < count_) prefetch(&leaves[sorted_[i + kAhead].index]);
        const LeafUpdate& from = leaves[sorted_[i].index];
        leaves_[i] = {box_of(from.before), box_of(from.after),     from.proxy,
                      sorted_[i].index,    from.proxy->m_uniqueId, from.moves};
        set(&block, i % kWidth, merged(leaves_[i].before, leaves_[i].after));
      }
      bounds_[b] = bounds_of(block);
    }
  });
  for (std::size_t level = 1; level + 1 < levels_.size(); ++level) {
    const std::size_t children = levels_[level] - levels_[level - 1];
    const std::size_t size = levels_[level + 1] - levels_[level];
    in_chunks(pool, size, kLeavesPerChunk / kWidth, [&](std::size_t first, std::size_t last) {
      for (std::size_t b = first; b < last; ++b) {
        Block& block = blocks_[levels_[level] + b];
        block = empty;
        for (std::size_t i = b * kWidth; i < std::min(children, (b + 1) * kWidth); ++i) {
          set(&block, i % kWidth,
              level == 1 ? bounds_[i] : bounds_of(blocks_[levels_[level - 1] + i]));
        }
      }
    });
  }
}

/// Searches for the moving leaves of some blocks. The leaves of a block are neighbours, so one
/// search of the tree serves all of them.
void OverlapSearch::search(std::size_t first_block, std::size_t last_block, const PairTable& table,
                           Chunk* chunk) {
  chunk->found.clear();
  chunk->overlaps = 0;
  for (std::size_t b = first_block; b < last_block; ++b) {
    Box bounds{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    bool any = false;
    const std::size_t first = b * kWidth, last = std::min(count_, first + kWidth);
    for (std::size_t i = first; i < last; ++i) {
      if (!leaves_[i].moves) continue;
      any = true;
      bounds = merged(bounds, leaves_[i].after);
    }
    if (!any) continue;
    find_candidates(bounds, chunk);
    chunk->hits.clear();
    for (std::size_t i = first; i < last; ++i) {
      if (leaves_[i].moves) find_hits(i, chunk);
    }
    look_up(table, chunk);
  }
}

/// Lists the blocks of leaves whose bounds overlap the box.
void OverlapSearch::find_candidates(const Box& box, Chunk* chunk) const {
  chunk->candidates.clear();
  chunk->stack.clear();
  const auto root = static_cast<std::uint32_t>(levels_.back() - 1);
  (root < levels_[1] ? chunk->candidates : chunk->stack).push_back(root);
  while (!chunk->stack.empty()) {
    const std::size_t block = chunk->stack.back();
    chunk->stack.pop_back();
    std::size_t level = 1;
    while (block >= levels_[level + 1]) ++level;
    const std::size_t first_child = levels_[level - 1] + (block - levels_[level]) * kWidth;
    for (unsigned hits = test(blocks_[block], box); hits != 0; hits &= hits - 1) {
      const std::size_t child = first_child + first_lane(hits);
      if (child >= levels_[level]) break;
      (level == 1 ? chunk->candidates : chunk->stack).push_back(static_cast<std::uint32_t>(child));
    }
  }
  const std::size_t count = chunk->candidates.size();
  chunk->bounds.assign((count + kWidth - 1) / kWidth, empty_block());
  for (std::size_t i = 0; i < count; ++i) {
    set(&chunk->bounds[i / kWidth], i % kWidth, bounds_[chunk->candidates[i]]);
  }
}

/// Adds the leaves that a moving leaf overlaps at its turn.
void OverlapSearch::find_hits(std::size_t moving, Chunk* chunk) const {
  const Box& box = leaves_[moving].after;
  for (std::size_t b = 0; b < chunk->bounds.size(); ++b) {
    for (unsigned blocks = test(chunk->bounds[b], box); blocks != 0; blocks &= blocks - 1) {
      const std::size_t candidate = b * kWidth + first_lane(blocks);
      if (candidate >= chunk->candidates.size()) break;
      const std::size_t block = chunk->candidates[candidate];
      for (unsigned lanes = test(blocks_[block], box); lanes != 0; lanes &= lanes - 1) {
        const std::size_t other = block * kWidth + first_lane(lanes);
        if (other != moving && other < count_) add_hit(leaves_[moving], leaves_[other], chunk);
      }
    }
  }
}

void OverlapSearch::add_hit(const Leaf& moving, const Leaf& other, Chunk* chunk) {
  const bool earlier = other.index < moving.index;
  if (!overlap(earlier ? other.after : other.before, moving.after)) return;
  ++chunk->overlaps;
  // The other leaf has already found this pair at its own turn.
  if (earlier && other.moves && overlap(moving.before, other.after)) return;
  const bool swapped = other.id < moving.id;
  const Leaf &a = swapped ? other : moving, &b = swapped ? moving : other;
  chunk->hits.push_back({moving.index, swapped, a.proxy, b.proxy, nullptr, a.id, b.id, 0});
}

/// Keeps the hits that are not in the pair cache. Three passes overlap the cache misses of
/// different pairs.
void OverlapSearch::look_up(const PairTable& table, Chunk* chunk) {
  for (Hit& hit : chunk->hits) {
    const unsigned at = pair_hash(hit.id_a, hit.id_b) & table.mask;
    if (at < table.size) prefetch(hit.slot = table.heads + at);
  }
  for (Hit& hit : chunk->hits) {
    hit.index = hit.slot == nullptr ? BT_NULL_PAIR : *hit.slot;
    if (hit.index == BT_NULL_PAIR) continue;
    prefetch(table.pairs + hit.index);
    prefetch(table.next + hit.index);
  }
  for (const Hit& hit : chunk->hits) {
    int index = hit.index;
    while (index != BT_NULL_PAIR &&
           (table.pairs[index].m_pProxy0 != hit.a || table.pairs[index].m_pProxy1 != hit.b)) {
      index = table.next[index];
    }
    if (index != BT_NULL_PAIR) continue;
    const btBroadphaseProxy &a = *hit.a, &b = *hit.b;
    if ((a.m_collisionFilterGroup & b.m_collisionFilterMask) == 0 ||
        (b.m_collisionFilterGroup & a.m_collisionFilterMask) == 0) {
      continue;
    }
    chunk->found.push_back({hit.turn, hit.swapped ? hit.a : hit.b});
  }
}

/// Sorts the results by turn.
void OverlapSearch::collect(std::size_t chunks, std::size_t leaves) {
  assign_geometric(&turns_, leaves, 0);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < chunks; ++i) {
    for (const NewOverlap& overlap : chunks_[i].found) ++turns_[overlap.turn];
  }
  for (std::uint32_t& turn : turns_) sum += std::exchange(turn, sum);
  resize_geometric(&found_, sum);
  for (std::size_t i = 0; i < chunks; ++i) {
    for (const NewOverlap& overlap : chunks_[i].found) found_[turns_[overlap.turn]++] = overlap;
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
