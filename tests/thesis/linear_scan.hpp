/// The linear scan of the thesis: the reference for the tournament tree.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Has the interface and the results of IndexedPriorityQueue, in O(n).
class LinearScan {
 public:
  void assign(std::span<const Real> keys) { keys_.assign(keys.begin(), keys.end()); }
  std::uint32_t top() const {
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < keys_.size(); ++i) {
      if (keys_[i] > keys_[best]) best = i;
    }
    return best;
  }
  Real key(std::uint32_t number) const { return keys_[number]; }
  void update(std::uint32_t number, Real key) { keys_[number] = key; }

 private:
  std::vector<Real> keys_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
