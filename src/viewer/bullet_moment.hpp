/// Bullet worlds from choices, and as moments. Only for builds with Bullet.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "src/viewer/moment.hpp"
#include "src/viewer/run.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Backend and threads of a choice, with jfpx's parts throughout.
bullet::SceneWorldOptions world_options(const EngineChoice& choice);

Moment moment_of(bullet::SceneWorld& world, std::uint64_t step);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
