/// Parallel, stable LSD radix sort over a range of key bits.
#pragma once

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Sorts in chunks whose bounds depend only on the number of items. The sort is stable, so the
/// permutation does not depend on the number of threads.
class RadixSorter {
 public:
  /// Sorts by the bits [low, low + bits) of key(item), and overwrites both `items` and `spare`.
  /// @param count below 2^32; the size of both arrays
  /// @return the array that holds the result, `items` or `spare`
  /// @throws OutOfMemory
  template <class T, class Key>
  T* sort(ThreadPool& pool, T* items, T* spare, std::size_t count, unsigned low, unsigned bits,
          const Key& key) {
    if (bits == 0) return items;
    const unsigned passes = (bits + kMaxBits - 1) / kMaxBits;
    const unsigned width = (bits + passes - 1) / passes;
    const std::size_t digits = std::size_t{1} << width;
    const std::size_t chunks = std::clamp<std::size_t>(count / kChunk, 1, kMaxChunks);
    offsets_.reserve(chunks << kMaxBits, "counts of a radix sort");
    const auto begin_of = [&](std::size_t chunk) { return count * chunk / chunks; };
    for (unsigned pass = 0; pass < passes; ++pass) {
      const unsigned shift = low + pass * width;
      const auto digit = [&](const T& item) { return (key(item) >> shift) & (digits - 1); };
      pool.run(chunks, [&](std::size_t chunk) {
        std::uint32_t* counts = offsets_.data() + chunk * digits;
        std::fill_n(counts, digits, 0u);
        const std::size_t end = begin_of(chunk + 1);
        for (std::size_t i = begin_of(chunk); i < end; ++i) ++counts[digit(items[i])];
      });
      std::uint32_t sum = 0;
      for (std::size_t d = 0; d < digits; ++d) {
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
          const std::uint32_t n = offsets_[chunk * digits + d];
          offsets_[chunk * digits + d] = sum;
          sum += n;
        }
      }
      pool.run(chunks, [&](std::size_t chunk) {
        std::uint32_t* next = offsets_.data() + chunk * digits;
        const std::size_t end = begin_of(chunk + 1);
        for (std::size_t i = begin_of(chunk); i < end; ++i) {
          spare[next[digit(items[i])]++] = items[i];
        }
      });
      std::swap(items, spare);
    }
    return items;
  }

 private:
  static constexpr unsigned kMaxBits = 11;  ///< bits per digit, limited by the first-level TLB
  static constexpr std::size_t kChunk = 4096;
  static constexpr std::size_t kMaxChunks = 64;

  Buffer<std::uint32_t> offsets_;  ///< for each chunk and digit, the position of its next item
};

}  // namespace JFPX_ABI
}  // namespace jfpx
