/// Choice between Bullet's own code and that of jfpx for groups with little parallelism.
#pragma once

#include "src/base/time_chooser.hpp"

#include <chrono>
#include <vector>

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
  struct Size {
    TimeChooser chooser{2};
    bool fills_lanes = true;  ///< initial value, because jfpx solves the first group
  };

  Size& size_of(std::size_t manifolds);

  std::vector<Size> sizes_ = std::vector<Size>(33);  ///< by number of bits of the manifolds
  Size* timed_ = nullptr;  ///< of the group whose time is measured, if any
  double predicted_us_ = 0;
  Clock::time_point since_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
