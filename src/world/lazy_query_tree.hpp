/// The tree of the queries, built by the first query after a change of the bodies.
#pragma once

#include "src/world/query_tree.hpp"

#include <atomic>
#include <mutex>

namespace jfpx {
inline namespace JFPX_ABI {

/// Const functions may run concurrently with each other; invalidate() excludes all other calls.
class LazyQueryTree {
 public:
  /// Must be called when a body is added, removed or moved.
  void invalidate() noexcept { current_.store(false, std::memory_order_relaxed); }

  /// The tree of the bodies, until invalidate() is called. Takes a lock only to build the tree.
  /// @throws as QueryTree::build(); the next call then tries again
  const QueryTree& get(const BodyStore& bodies) const {
    if (!current_.load(std::memory_order_acquire)) {
      const std::lock_guard lock(building_);
      if (!current_.load(std::memory_order_relaxed)) {
        tree_.build(bodies);
        current_.store(true, std::memory_order_release);
      }
    }
    return tree_;
  }

 private:
  mutable std::atomic<bool> current_{false};
  mutable std::mutex building_;
  mutable QueryTree tree_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
