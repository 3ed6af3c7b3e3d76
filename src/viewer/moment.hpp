/// One instant of a run: all that a picture or the panel shows of it.
#pragma once

#include <jfpx/world.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Milliseconds of one step.
struct StageTimes {
  double integrate = 0, broad = 0, detect = 0, solve = 0, total = 0;
};

struct Moment {
  std::uint64_t step = 0;
  double time = 0;                  ///< [s] since the run began
  Real dt = 0;                      ///< [s], of the step that led here
  std::vector<BodyState> states;    ///< in the order of the scene's bodies
  std::vector<std::uint8_t> awake;  ///< likewise, 1 or 0
  std::vector<Contact> contacts;    ///< a and b are places in the scene
  StageTimes times;
  std::uint64_t iterations = 0;  ///< of the native resolver, both loops
  std::string computed_by;       ///< who found the sphere contacts
  std::string solved_by;         ///< Bullet: who swept over the rows; of a native run empty
  std::string trouble;           ///< why the run can't go on meaningfully
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
