/// Measured choice of the code that solves a group.
#include "src/bullet/solver/group_choice.hpp"

#include <bit>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// First alternative, because the chooser then replaces it only for a clear gain.
constexpr std::size_t kBullet = 0;

std::size_t bits_of(std::size_t manifolds) {
  return static_cast<std::size_t>(std::bit_width(manifolds));
}

}  // namespace

bool GroupChoice::leaves_to_bullet(std::size_t manifolds) {
  is_measured_ = !fills_lanes_[bits_of(manifolds)];
  if (!is_measured_) return false;
  const bool result = chooser_.choose(manifolds) == kBullet;
  since_ = Clock::now();
  return result;
}

void GroupChoice::note_lanes(std::size_t manifolds, std::size_t contacts, std::size_t blocks,
                             std::size_t lanes, std::size_t joints) {
  fills_lanes_[bits_of(manifolds)] =
      lanes > 1 && 2 * contacts >= lanes * blocks && contacts >= 2 * joints;
}

void GroupChoice::finished() {
  if (!is_measured_) return;
  const std::chrono::duration<double, std::micro> us = Clock::now() - since_;
  chooser_.record(us.count());
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
