/// Creation and states of runs of Bullet worlds. Only for builds with Bullet.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "src/viewer/run.hpp"
#include "src/viewer/run_state.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Options for a world with all of jfpx's parts, with the backend and threads of a choice.
bullet::SceneWorldOptions world_options(const EngineChoice& choice);

RunState run_state_of(bullet::SceneWorld& world, std::uint64_t step);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
