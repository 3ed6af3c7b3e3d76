/// Operations on Bullet worlds shared by the tool's commands. Only for builds with Bullet.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "src/tool/engine.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

bullet::SceneWorld make_bullet_world(EngineKind kind, const Scene& scene,
                                     const RunOptions& options);
/// Number of contact points in all manifolds.
std::uint64_t count_contacts(bullet::SceneWorld& world);
/// Measures of the last step. Contact points with a positive distance are not penetrations.
StepMeasures measures_of(bullet::SceneWorld& world);
/// Name of the backend that tested the sphere pairs of the last dispatch, or "Bullet" if Bullet's
/// own code ran the dispatch.
std::string sphere_backend(const bullet::SceneWorld& world);

/// Reason why the CPU replaced a device in the dispatcher or the solver; empty if none was
/// replaced.
std::string device_failure(const bullet::SceneWorld& world);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
