/// Disjoint sets; concurrent unions link the higher of two roots to the lower one (after Jayanti
/// and Tarjan 2016).
#include "src/world/islands.hpp"

#include <atomic>
#include <numeric>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void Islands::reset(std::size_t bodies) {
  parent_.resize(bodies);
  std::iota(parent_.begin(), parent_.end(), 0u);
}

std::uint32_t Islands::find(std::uint32_t body) {
  constexpr auto kRelaxed = std::memory_order_relaxed;
  for (;;) {
    std::uint32_t parent = std::atomic_ref(parent_[body]).load(kRelaxed);
    if (parent == body) return body;
    const std::uint32_t above = std::atomic_ref(parent_[parent]).load(kRelaxed);
    // Path halving. If another thread has changed the parent, this change is not needed.
    if (above != parent) {
      std::atomic_ref(parent_[body]).compare_exchange_strong(parent, above, kRelaxed);
    }
    body = above;
  }
}

void Islands::unite(std::uint32_t a, std::uint32_t b) {
  for (;;) {
    a = find(a);
    b = find(b);
    if (a == b) return;
    if (a > b) std::swap(a, b);
    std::uint32_t root = b;
    if (std::atomic_ref(parent_[b]).compare_exchange_strong(root, a, std::memory_order_relaxed))
      return;
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
