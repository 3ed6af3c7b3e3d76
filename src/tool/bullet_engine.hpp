/// Bullet as an Engine. In a build without Bullet these functions throw.
#pragma once

#include "src/tool/engine.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// `kind` is bullet or bullet_stock. @throws BackendUnavailable in a build without Bullet.
std::unique_ptr<Engine> make_bullet_engine(EngineKind kind, const Scene& scene,
                                           const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
