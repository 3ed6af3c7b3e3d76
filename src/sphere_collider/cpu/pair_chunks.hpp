/// Pairs found by the kernels, in one list per chunk of the search.
#pragma once

#include "src/base/buffer.hpp"
#include "src/sphere_collider/cpu/kernels.hpp"

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Order of the pairs of all chunks.
enum class PairOrder : std::uint8_t {
  none,
  by_lower_sphere,  ///< pairs with the same lower sphere are consecutive, in any order
  sorted            ///< by lower, then by higher sphere
};

/// Each chunk has its own buffer, so that threads share no data and the result does not depend on
/// their timing. Buffers are reused by the next search.
class PairChunks {
 public:
  void clear() noexcept { used_ = 0; }
  std::size_t size() const noexcept { return used_; }

  /// Adds empty chunks; returns the index of the first.
  std::size_t add(std::size_t chunks) {
    const std::size_t first = used_;
    if (chunks_.size() < first + chunks) {
      try {
        chunks_.resize(first + chunks);
      } catch (const std::bad_alloc&) {
        throw OutOfMemory("out of memory: " + std::to_string((first + chunks) * sizeof(Chunk)) +
                          " bytes needed for " + std::to_string(first + chunks) +
                          " lists of pairs");
      }
    }
    for (std::size_t i = first; i < first + chunks; ++i) chunks_[i].count = 0;
    used_ = first + chunks;
    return first;
  }

  /// Calls search(sink) and stores the pairs that it appends to the sink in the chunk.
  template <class Search>
  void fill(std::size_t chunk, const Search& search) {
    Filler filler(&chunks_[chunk]);
    search(&filler);
    filler.close();
  }

  /// Returns the pairs of a chunk as (lower index << 32) | higher index.
  std::span<const std::uint64_t> operator[](std::size_t chunk) const {
    return {chunks_[chunk].pairs.data(), chunks_[chunk].count};
  }

 private:
  struct Chunk {
    Buffer<std::uint64_t> pairs;
    std::size_t count = 0;
  };

  struct Filler : PairSink {
    explicit Filler(Chunk* c)
        : PairSink{c->pairs.data(), c->pairs.data() + c->pairs.capacity(), grow_chunk}, chunk(c) {}
    void close() { chunk->count = static_cast<std::size_t>(next - chunk->pairs.data()); }

    static void grow_chunk(PairSink* sink) {
      auto* self = static_cast<Filler*>(sink);
      Buffer<std::uint64_t>& pairs = self->chunk->pairs;
      const auto used = static_cast<std::size_t>(self->next - pairs.data());
      constexpr std::size_t kSmallest = 1024;
      static_assert(kSmallest / 4 >= kRoom);
      pairs.reserve(std::max(kSmallest, pairs.capacity() + pairs.capacity() / 4),
                    "pairs of spheres", used);
      self->next = pairs.data() + used;
      self->end = pairs.data() + pairs.capacity();
    }

    Chunk* chunk;
  };

  std::vector<Chunk> chunks_;
  std::size_t used_ = 0;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
