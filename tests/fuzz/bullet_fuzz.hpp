/// What a fuzz target for Bullet worlds says when it found something.
#pragma once

#include "tests/bullet/stock_elsewhere.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <sstream>

namespace jfpx::inline JFPX_ABI::bullet {

template <class World>
[[noreturn]] void report_difference(const Failure& failure, const World& world) {
  std::ostringstream text;
  text << "after step " << failure.step << ": " << failure.what << '\n' << world;
  fuzz::report_finding(text.str());
}

}  // namespace jfpx::inline JFPX_ABI::bullet
