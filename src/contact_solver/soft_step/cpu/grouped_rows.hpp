/// Rows of the soft step by group, divided among threads by their bodies.
#pragma once

#include "src/base/buffer.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/row_kinds.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Rows are divided among threads by blocks of this many bodies.
inline constexpr std::uint32_t kBodiesPerBlock = 128;
constexpr std::size_t block_count(std::size_t bodies) {
  return (bodies + kBodiesPerBlock - 1) / kBodiesPerBlock;
}

/// Number of rows by group.
using GroupCounts = std::array<std::uint32_t, kGroups>;

/// Rows of one kind, sorted by group. Within the overflow and each color, rows are sorted by the
/// lower body of their contact and divided at the same blocks of bodies. A thread that processes
/// the same blocks in each group therefore has most of its rows and bodies in its own cache.
///
/// Usage in a step: start(), place() for all rows before kFixedGroup, finish().
/// @param Row one of RowTypes
template <class Row>
class GroupedRows {
 public:
  Buffer<Row> rows;                ///< its first size() elements are used
  Buffer<std::uint32_t> contacts;  ///< by row

  std::uint32_t size() const { return begin_[kGroups]; }
  std::uint32_t begin(std::size_t group) const { return begin_[group]; }
  std::uint32_t end(std::size_t group) const { return begin_[group + 1]; }
  std::uint32_t size(std::size_t group) const { return end(group) - begin(group); }

  /// @param counts by group
  /// @param groups end of the nonempty groups before kFixedGroup
  void start(const GroupCounts& counts, std::size_t groups, std::size_t bodies) {
    begin_[0] = 0;
    for (std::size_t g = 0; g < kGroups; ++g) begin_[g + 1] = begin_[g] + counts[g];
    rows.reserve_geometric(size(), "rows of contacts");
    contacts.reserve_geometric(size(), "rows of contacts");
    blocks_ = begin_[kFixedGroup] == 0 ? 0 : block_count(bodies);
    block_begin_.clear();
    reserve_geometric(&block_begin_, groups * blocks_);
    for (std::size_t g = 0; g < groups; ++g) {
      block_begin_.insert(block_begin_.end(), blocks_, end(g));
    }
  }

  /// Assigns a contact to a row of a group before kFixedGroup. May be called concurrently.
  /// @param body lower body of the contact
  void place(std::size_t group, std::uint32_t row, std::uint32_t contact, std::uint32_t body) {
    contacts[row] = contact;
    std::atomic_ref begin(block_begin_[group * blocks_ + body / kBodiesPerBlock]);
    for (std::uint32_t first = begin.load(std::memory_order_relaxed);
         row < first && !begin.compare_exchange_weak(first, row, std::memory_order_relaxed);) {
    }
  }

  void finish() {
    // A block without rows begins where the next block begins.
    for (std::size_t i = block_begin_.size(); i-- > 0;) {
      if ((i + 1) % blocks_ == 0) continue;  // last block of a group
      block_begin_[i] = std::min(block_begin_[i], block_begin_[i + 1]);
    }
  }

  /// First row of a group before kFixedGroup for the bodies of a block, to within a few rows. For
  /// `block` = block_count(bodies), the end of the group.
  std::uint32_t begin(std::size_t group, std::size_t block) const {
    if (block >= blocks_) return end(group);
    const std::uint32_t row = block_begin_[group * blocks_ + block];
    // Rounded to the longest vector, so that only the last vector of a group is incomplete.
    constexpr std::uint32_t kRowsPerVector = 8;
    return row - (row - begin(group)) % kRowsPerVector;
  }

 private:
  std::array<std::uint32_t, kGroups + 1> begin_{};
  std::size_t blocks_ = 0;  ///< 0: there are no rows before kFixedGroup
  /// By group and block: the first row of the group whose body is in the block or a later one.
  std::vector<std::uint32_t> block_begin_;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
