/// Replacements for a build without Bullet, which report that Bullet is missing.
#include <jfpx/error.hpp>

#include "src/viewer/run.hpp"
#include "src/viewer/viewer.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

bool has_engine(EngineKind engine) { return engine == EngineKind::native; }

std::unique_ptr<Run> detail::make_bullet_run(const Scene&, const EngineChoice& choice,
                                             std::uint64_t) {
  throw BackendUnavailable(std::string(to_string(choice.engine)) + ": built without Bullet");
}

std::unique_ptr<Viewer> make_side_by_side(const ViewOptions&) {
  throw BackendUnavailable("side by side: built without Bullet");
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
