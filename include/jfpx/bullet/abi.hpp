/// Compile-time checks of Bullet's configuration: jfpx reproduces the bits of one configuration.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btScalar.h>

#include <type_traits>

#if defined(BT_USE_SSE) || defined(BT_USE_NEON)
#error "jfpx keeps the bits of Bullet's scalar code: undefine BT_USE_SSE and BT_USE_NEON"
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

static_assert(std::is_same_v<btScalar, Real>,
              "jfpx::bullet requires Bullet in float, jfpx::bullet_f64 requires Bullet in double "
              "(BT_USE_DOUBLE_PRECISION); this build mixes the two");

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
