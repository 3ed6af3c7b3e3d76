/// Search for the leaves that each moving leaf overlaps at its turn, without Bullet's tree.
#pragma once

#include "src/base/buffer.hpp"
#include "src/base/radix_sort.hpp"
#include "src/base/thread_pool.hpp"
#include "src/bullet/world/leaf_update.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// A pair of overlapping leaves that was not in the pair cache before the update.
struct NewOverlap {
  std::uint32_t turn;  ///< index of the leaf that has moved
  btDbvtProxy* other;
};

/// At the turn of leaf i, the leaves before i have their new volumes, all others their old volumes.
/// Hence the overlaps of leaf i do not depend on the tree, and all turns are searched in parallel.
///
/// The leaves are sorted along a Morton curve and packed into blocks of eight, which are packed
/// into blocks of eight, and so on, as in QueryTree. The volumes of a block contain the old and the
/// new volumes of its leaves.
class OverlapSearch {
 public:
  /// @return the number of overlaps, including those of known pairs
  /// @throws OutOfMemory, std::bad_alloc
  std::size_t run(ThreadPool& pool, std::span<const LeafUpdate> leaves,
                  btHashedOverlappingPairCache& cache);
  /// New overlaps by ascending turn, in unspecified order within a turn.
  std::span<const NewOverlap> found() const { return found_; }

 private:
  static constexpr std::size_t kWidth = 8, kBlocksPerChunk = 8;
  using Lanes = std::array<Real, kWidth>;

  /// Volumes of eight leaves or blocks. Unused lanes overlap nothing.
  struct alignas(64) Block {
    Lanes lower[3], upper[3];
  };
  struct Box {
    Real lower[3], upper[3];
  };
  struct Leaf {
    Box before, after;
    btDbvtProxy* proxy;
    std::uint32_t index;  ///< of the object
    int id;               ///< of the proxy
    bool moves;
  };
  struct Key {
    std::uint32_t code, index;
  };
  struct Hit {
    std::uint32_t turn;
    bool swapped;        ///< `a` is the other leaf
    btDbvtProxy *a, *b;  ///< by ascending id
    const int* slot;     ///< the slot of the pair in the hash table
    int id_a, id_b;
    int index;  ///< index of the first pair to compare with
  };
  /// Scratch memory and results of a chunk.
  struct Chunk {
    std::vector<std::uint32_t> stack, candidates;
    std::vector<Block> bounds;  ///< of the candidates
    std::vector<Hit> hits;
    std::vector<NewOverlap> found;
    std::size_t overlaps;
  };
  /// Bullet's hash table of pairs.
  struct PairTable {
    const btBroadphasePair* pairs;
    const int *heads, *next;
    unsigned mask, size;
  };

  static Box box_of(const btDbvtVolume& volume);
  static Box merged(const Box& a, const Box& b);
  static Block empty_block();
  static Box bounds_of(const Block& block);
  static void set(Block* block, std::size_t lane, const Box& box);
  static bool overlap(const Box& a, const Box& b);
  static unsigned test(const Block& block, const Box& box);  ///< bit mask of the lanes that overlap

  void sort(ThreadPool& pool, std::span<const LeafUpdate> leaves);
  void pack(ThreadPool& pool, std::span<const LeafUpdate> leaves);
  void search(std::size_t first_block, std::size_t last_block, const PairTable& table,
              Chunk* chunk);
  void find_candidates(const Box& box, Chunk* chunk) const;
  void find_hits(std::size_t moving, Chunk* chunk) const;
  static void add_hit(const Leaf& moving, const Leaf& other, Chunk* chunk);
  static void look_up(const PairTable& table, Chunk* chunk);
  void collect(std::size_t chunks, std::size_t leaves);

  RadixSorter sorter_;
  Buffer<Key> keys_, spare_keys_;
  const Key* sorted_ = nullptr;
  Buffer<Leaf> leaves_;              ///< along the curve
  Buffer<Block> blocks_;             ///< all levels, from the leaves to the root
  Buffer<Box> bounds_;               ///< of the blocks of leaves
  std::vector<std::size_t> levels_;  ///< first block of each level, and the number of all blocks
  std::size_t count_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> turns_;  ///< by turn: position of its first new overlap
  std::vector<NewOverlap> found_;
};

/// Copy of the private hash function of btHashedOverlappingPairCache. A different function would
/// give the same results, but Bullet would search for every pair.
inline unsigned pair_hash(int id0, int id1) {
  unsigned key = static_cast<unsigned>(id0) | (static_cast<unsigned>(id1) << 16);
  key += ~(key << 15);
  key ^= key >> 10;
  key += key << 3;
  key ^= key >> 6;
  key += ~(key << 11);
  key ^= key >> 16;
  return key;
}

/// Pointers to the protected tables of a pair cache.
struct PairTables : btHashedOverlappingPairCache {
  static constexpr auto heads = &PairTables::m_hashTable;
  static constexpr auto next = &PairTables::m_next;
  static constexpr auto ghosts = &PairTables::m_ghostPairCallback;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
