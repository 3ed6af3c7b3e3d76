/// Loops over a range in chunks of a fixed size, on a thread pool.
#pragma once

#include "src/base/spin_lock.hpp"
#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <cstddef>
#include <mutex>

namespace jfpx {
inline namespace JFPX_ABI {

/// Chunk size of a loop over `count` items: about 32 chunks, so that the threads divide even short
/// loops, within limits. A thread has the same part of a list in all loops over it.
/// @param least takes about a microsecond
constexpr std::size_t chunk_size(std::size_t count, std::size_t least, std::size_t most) {
  constexpr std::size_t kChunks = 32;
  return std::clamp((count + kChunks - 1) / kChunks, least, most);
}

/// Calls body(first, last) for the chunks of [0, count), from any thread and in any order. All
/// chunks but the last have `chunk` items; they do not depend on the number of threads.
/// @param pool null: one chunk in the calling thread
template <class Body>
void parallel_for(ThreadPool* pool, std::size_t count, std::size_t chunk, const Body& body) {
  if (pool == nullptr) {
    if (count > 0) body(std::size_t{0}, count);
    return;
  }
  pool->run((count + chunk - 1) / chunk,
            [&](std::size_t i) { body(i * chunk, std::min(count, (i + 1) * chunk)); });
}

/// Combines `identity` and the results of body(first, last) for the chunks of [0, count), in any
/// order: combine(x, y) must be associative and commutative for the occurring values. Minima and
/// maxima are, except for the sign of zero; sums of floating-point numbers are not.
/// @param pool null: one chunk in the calling thread
template <class Value, class Body, class Combine>
Value parallel_reduce(ThreadPool* pool, std::size_t count, std::size_t chunk, const Value& identity,
                      const Body& body, const Combine& combine) {
  SpinLock mutex;
  Value result = identity;
  parallel_for(pool, count, chunk, [&](std::size_t first, std::size_t last) {
    const Value value = body(first, last);
    const std::lock_guard lock(mutex);
    result = combine(result, value);
  });
  return result;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
