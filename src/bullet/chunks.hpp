/// Loops in chunks of a fixed size, which the threads of a pool share.
#pragma once

#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The chunk size of a loop over `count` elements. Fewer than `shared` elements are one chunk,
/// because waking threads would take longer than the loop.
inline std::size_t chunk_size(std::size_t count, std::size_t chunk, std::size_t shared) {
  return count < shared ? shared : chunk;
}
inline std::size_t chunks_of(std::size_t count, std::size_t chunk) {
  return (count + chunk - 1) / chunk;
}

/// Calls work(first, last) for consecutive ranges of at most `chunk` elements of [0, count).
template <class Work>
void in_chunks(ThreadPool& pool, std::size_t count, std::size_t chunk, const Work& work) {
  pool.run(chunks_of(count, chunk),
           [&](std::size_t i) { work(i * chunk, std::min(count, (i + 1) * chunk)); });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
