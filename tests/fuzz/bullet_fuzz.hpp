/// What a fuzz target for Bullet worlds says when it found something.
#pragma once

#include "tests/bullet/stock_elsewhere.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <sstream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// @param least the world, shrunk
template <class World>
[[noreturn]] void report_difference(const Failure& failure, const World& least) {
  std::ostringstream text;
  text << "after step " << failure.step << ": " << failure.what << "\nshrunk to:\n" << least;
  fuzz::report_finding(text.str());
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
