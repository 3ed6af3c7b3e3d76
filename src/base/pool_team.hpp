/// The threads of a pool as a team, like the threads of a cooperative launch on a device.
#pragma once

#include "src/base/parallel_for.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Runs the same loops as a team of threads on a device.
class PoolTeam {
 public:
  /// @param pool outlives the object; null: the calling thread
  explicit PoolTeam(ThreadPool* pool) : pool_(pool) {}

  /// Calls f(i) for all i < n, in any order, and waits.
  template <class F>
  void for_each(std::uint32_t n, const F& f) const {
    parallel_for(pool_, n, chunk_size(n, 32, 256), [&](std::size_t first, std::size_t last) {
      for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) f(i);
    });
  }
  /// Same as for_each(); on a device, it does not wait.
  template <class F>
  void for_each_nowait(std::uint32_t n, const F& f) const {
    for_each(n, f);
  }

 private:
  ThreadPool* pool_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
