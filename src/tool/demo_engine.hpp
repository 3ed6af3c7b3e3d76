/// Demos, with their scripted inputs, as an Engine.
#pragma once

#include "src/tool/demo_names.hpp"
#include "src/tool/engine.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Runs the selected demo, or the selected scene as a demo, with the inputs of a script.
/// @param script path of an input script; empty: no inputs
/// @param start receives the initial scene of the demo; without bodies if the demo has no scene
/// @throws InvalidArgument, also for options that demos do not support; FileError; the exceptions
///   of load()
std::unique_ptr<Engine> make_demo_engine(const RunOptions& options, const std::string& script,
                                         Scene* start);

/// Name, summary and controls of a demo, as text.
std::string describe_demo(const std::string& name);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
