/// Islands: sets of bodies that are connected by contacts.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Disjoint sets of bodies. The label of a set is its lowest index, whatever the order of the
/// unions. Several threads may call unite() and find() concurrently. Owns its buffer, which grows
/// and never shrinks.
class Islands {
 public:
  /// Reserves memory for reset(). @throws std::bad_alloc
  void reserve(std::size_t bodies) { parent_.reserve(bodies); }
  /// Makes every body a set of its own.
  void reset(std::size_t bodies);
  void unite(std::uint32_t a, std::uint32_t b);
  /// Label of the set of a body, once all unions are complete.
  std::uint32_t find(std::uint32_t body);

 private:
  std::vector<std::uint32_t> parent_;  ///< by body: a body of the same set, not a higher one
};

}  // namespace JFPX_ABI
}  // namespace jfpx
