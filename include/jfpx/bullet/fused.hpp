/// Whether a program's own copy of Bullet's inline arithmetic has Bullet's bits.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btScalar.h>

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// True if the compiler of *this translation unit* makes one operation of a product and a sum, as
/// g++ does with -march=native unless told -ffp-contract=off. Bullet's headers are compiled into
/// the program; then even a world without jfpx has other bits than one whose program is compiled
/// for any x86-64. Always inlined: each caller answers for itself.
[[gnu::always_inline]] inline bool fuses_products() noexcept {
  constexpr btScalar kStep = std::numeric_limits<btScalar>::epsilon();
  btScalar a = 1 + kStep, b = 1 - kStep, c = -1;
  asm("" : "+m"(a), "+m"(b), "+m"(c));  // not to be computed by the compiler
  return a * b + c != 0;                // 1 - kStep^2 is 1 if it is rounded
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
