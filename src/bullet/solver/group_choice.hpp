/// Choice between Bullet's own code and that of jfpx for groups with little parallelism.
#pragma once

#include "src/base/sized_chooser.hpp"

#include <bitset>
#include <chrono>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Groups whose rows fill at least half of the vector lanes are always solved by jfpx. For other
/// groups, both alternatives are measured by group size, because their times depend on the bodies
/// that the contacts share, on the processor and on joints. Not thread-safe.
class JFPX_BULLET_API GroupChoice {
 public:
  /// Whether Bullet's own code should solve the group.
  bool leaves_to_bullet(std::size_t manifolds);
  /// Records how a group that jfpx has solved on the CPU has filled the lanes.
  void note_lanes(std::size_t manifolds, std::size_t contacts, std::size_t blocks,
                  std::size_t lanes, std::size_t joints);
  /// Records the end of the group for which leaves_to_bullet() was last called.
  void finished();

 private:
  using Clock = std::chrono::steady_clock;

  /// By number of bits of the manifolds. Initially true, because jfpx solves the first group.
  std::bitset<65> fills_lanes_ = ~std::bitset<65>();
  SizedChooser chooser_;
  bool is_measured_ = false;  ///< the group for which leaves_to_bullet() was last called
  Clock::time_point since_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
