/// Division of the blocks of a sweep into items of work for threads.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/buffer.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Blocks [first, last).
struct BlockRange {
  std::uint32_t first, last;
  std::uint32_t size() const { return last - first; }
};

/// Blocks that one thread solves as a unit.
struct WorkItem {
  BlockRange blocks;
  std::uint32_t part;   ///< of the bodies; see RowSolver
  std::uint32_t claim;  ///< index of its claim; those of different parts are in different lines
};

/// Number of claims in a cache line.
inline constexpr std::uint32_t kClaimsPerLine = 16;

/// Items [first, last), which may run at the same time, but only after the stage before.
struct WorkStage {
  std::uint32_t first, last;
};

/// The items of a sweep, in the order of the colors. Owns its buffers, which only grow.
class JFPX_API WorkList {
 public:
  /// A color with fewer blocks is not divided, because one thread completes it sooner than several
  /// that wait for each other.
  static constexpr std::uint32_t kSmallColor = 12;

  /// @param ranges the blocks of each color and part: those of part p of color c at index
  ///   c * parts + p. The ranges of a color with at most kSmallColor blocks follow each other.
  /// @throws OutOfMemory
  void build(std::span<const BlockRange> ranges, std::uint32_t parts);

  std::span<const WorkStage> stages() const { return {stages_.data(), stage_count_}; }
  const WorkItem* items() const { return items_.data(); }
  std::uint32_t item_count() const { return item_count_; }
  /// All claims are below it. A multiple of kClaimsPerLine.
  std::uint32_t claims() const { return claims_; }

 private:
  void add_item(const BlockRange& blocks, std::uint32_t part);
  void add_stage(std::uint32_t first_item);
  void number_claims(std::uint32_t parts);

  Buffer<WorkItem> items_;
  Buffer<WorkStage> stages_;
  Buffer<std::uint32_t> next_claim_;  ///< by part
  std::uint32_t item_count_ = 0, stage_count_ = 0, claims_ = 0;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
