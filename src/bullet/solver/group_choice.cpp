/// Measured choice of the code that solves a group.
#include "src/bullet/solver/group_choice.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// First alternative, because the chooser then replaces it only for a clear gain.
constexpr std::size_t kBullet = 0;
/// [us], shorter than the time of any group, so that the chooser measures both alternatives.
constexpr double kLowerBoundUsPerManifold = 1e-3;

}  // namespace

GroupChoice::Size& GroupChoice::size_of(std::size_t manifolds) {
  return sizes_[std::min<std::size_t>(sizes_.size() - 1, std::bit_width(manifolds))];
}

bool GroupChoice::leaves_to_bullet(std::size_t manifolds) {
  Size& size = size_of(manifolds);
  timed_ = size.fills_lanes ? nullptr : &size;
  if (timed_ == nullptr) return false;
  predicted_us_ = kLowerBoundUsPerManifold * static_cast<double>(manifolds);
  const std::array predicted{predicted_us_, predicted_us_};
  const auto decision = size.chooser.choose(static_cast<double>(manifolds), predicted);
  since_ = Clock::now();
  return decision.alternative == kBullet;
}

void GroupChoice::note_lanes(std::size_t manifolds, std::size_t contacts, std::size_t blocks,
                             std::size_t lanes, std::size_t joints) {
  size_of(manifolds).fills_lanes =
      lanes > 1 && 2 * contacts >= lanes * blocks && contacts >= 2 * joints;
}

void GroupChoice::finished() {
  if (timed_ == nullptr) return;
  const std::chrono::duration<double, std::micro> us = Clock::now() - since_;
  timed_->chooser.record(us.count(), predicted_us_);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
