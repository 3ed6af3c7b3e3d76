/// A Bullet world as a moment. Only for builds with Bullet.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "examples/viewer/moment.hpp"

namespace jfpx::inline JFPX_ABI::view {

Moment moment_of(bullet::SceneWorld& world, std::uint64_t step);

}  // namespace jfpx::inline JFPX_ABI::view
