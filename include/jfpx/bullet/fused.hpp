/// Test for fused multiply-add in the code of the calling program.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btScalar.h>

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// True if the compiler fuses a product and a sum of *this translation unit* into one operation, as
/// g++ does with -march=native unless -ffp-contract=off is given. Bullet's headers are compiled
/// into the program, so the bits of a world, with or without jfpx, then differ from those of a
/// program that is compiled for the x86-64 baseline. Always inlined, so that the result describes
/// the calling file.
[[gnu::always_inline]] inline bool fuses_products() noexcept {
  constexpr btScalar kStep = std::numeric_limits<btScalar>::epsilon();
  const volatile btScalar a = 1 + kStep, b = 1 - kStep, c = -1;  // no constant folding
  return a * b + c != 0;  // 1 - kStep^2 is 1 if it is rounded
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
