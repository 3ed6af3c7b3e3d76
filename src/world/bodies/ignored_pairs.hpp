/// Set of pairs of bodies that do not collide.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Pairs of BodyId::index, without an order within a pair. A sorted array: a query takes
/// logarithmic time, a change linear time.
class IgnoredPairs {
 public:
  /// Replaces all pairs; takes O(n log n) time. @throws std::bad_alloc
  void assign(std::span<const BodyPair> pairs);
  /// Has no effect if the pair is in the set. @throws std::bad_alloc; the set is then unchanged
  void insert(const BodyPair& pair);
  /// Has no effect if the pair is not in the set.
  void erase(const BodyPair& pair) noexcept;
  /// Erases all pairs of a body.
  void erase_body(std::uint32_t body) noexcept;
  JFPX_API bool contains(const BodyPair& pair) const noexcept;
  bool empty() const noexcept { return keys_.empty(); }
  /// By pair: the lower index in the upper half, the higher one in the lower half; sorted.
  std::span<const std::uint64_t> keys() const noexcept { return keys_; }

 private:
  std::vector<std::uint64_t> keys_;  ///< without duplicates
};

}  // namespace JFPX_ABI
}  // namespace jfpx
