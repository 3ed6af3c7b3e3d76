/// Replacements for a build without Bullet, which report that Bullet is missing.
#include <jfpx/error.hpp>

#include "src/tool/bullet_engine.hpp"
#include "src/tool/comparison.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

std::unique_ptr<Engine> make_bullet_engine(EngineKind kind, const Scene&, const RunOptions&) {
  throw BackendUnavailable(std::string(to_string(kind)) + ": built without Bullet");
}

Comparison compare(const Scene&, const RunOptions&) {
  throw BackendUnavailable("compare: built without Bullet");
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
