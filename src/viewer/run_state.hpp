/// State of a run after a step: all data for a picture or the panel.
#pragma once

#include <jfpx/world.hpp>

#include "src/tool/stage_times.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

struct RunState {
  std::uint64_t step = 0;
  double time = 0;                  ///< [s] since the run began
  Real dt = 0;                      ///< [s], of the last step
  std::vector<BodyState> states;    ///< in the order of the scene's bodies
  std::vector<std::uint8_t> awake;  ///< in the same order, 1 or 0
  std::vector<Contact> contacts;    ///< BodyId::index is the index in the scene
  tool::StageTimes times;
  std::uint32_t substeps = 0;    ///< of the native resolver soft-step; otherwise 0
  std::uint64_t iterations = 0;  ///< of the native resolver worst-first, both loops
  std::string computed_by;       ///< backend of a native step, or of the sphere contacts
  std::string solved_by;         ///< backend of Bullet's solver; empty for a native run
  std::string trouble;           ///< reason why the run can't continue meaningfully
};

/// Linear interpolation between two steps, because pictures are not synchronous with steps.
inline Vec3 interpolate(const Vec3& a, const Vec3& b, Real share) { return a + (b - a) * share; }

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
