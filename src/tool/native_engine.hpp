/// The native engine as an Engine.
#pragma once

#include <jfpx/world.hpp>

#include "src/tool/engine.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

std::unique_ptr<Engine> make_native_engine(const Scene& scene, const RunOptions& options);

/// Measures of the last step of a world. @param report of this step
StepMeasures measures_of(const World& world, const StepReport& report);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
