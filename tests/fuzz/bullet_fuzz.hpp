/// Report of a difference that a fuzz target for Bullet worlds has found.
#pragma once

#include "tests/bullet/solver_world.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <sstream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// @param least the shrunk world
template <class World>
[[noreturn]] void report_difference(const Failure& failure, const World& least) {
  std::ostringstream text;
  text << "after step " << failure.step << ": " << failure.what << "\nshrunk to:\n" << least;
  fuzz::report_finding(text.str());
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
