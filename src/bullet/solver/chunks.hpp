/// Loops in chunks of a fixed size, which the threads of a pool share.
#pragma once

#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Calls work(first, last) for consecutive ranges of at most `chunk` elements of [0, count).
template <class Work>
void in_chunks(ThreadPool& pool, std::size_t count, std::size_t chunk, const Work& work) {
  pool.run((count + chunk - 1) / chunk,
           [&](std::size_t i) { work(i * chunk, std::min(count, (i + 1) * chunk)); });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
