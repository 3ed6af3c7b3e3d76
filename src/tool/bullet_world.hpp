/// What the tool does with Bullet worlds in more than one place. Only for builds with Bullet.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "src/tool/engine.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

bullet::SceneWorld make_bullet_world(EngineKind kind, const Scene& scene,
                                     const RunOptions& options);
StageTimes last_step_times(const bullet::SceneWorld& world);
/// Contact points in all manifolds.
std::uint64_t count_contacts(bullet::SceneWorld& world);
/// Who tested the sphere pairs of the last dispatch: a backend, or "Bullet" where it was left to
/// Bullet's own code.
std::string sphere_backend(const bullet::SceneWorld& world);

/// Why x86 took over from a device in dispatcher or solver; empty if in neither.
std::string device_failure(const bullet::SceneWorld& world);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
