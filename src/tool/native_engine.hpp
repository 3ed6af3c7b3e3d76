/// The native engine behind the tool's interface.
#pragma once

#include "src/tool/engine.hpp"

namespace jfpx::inline JFPX_ABI::tool {

std::unique_ptr<Engine> make_native_engine(const Scene& scene, const RunOptions& options);

}  // namespace jfpx::inline JFPX_ABI::tool
