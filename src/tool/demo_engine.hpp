/// Demos behind the tool's interface: how one runs with its inputs.
#pragma once

#include "src/tool/demo_names.hpp"
#include "src/tool/engine.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// The demo or scene that the options name, as a demo, with the inputs of a script; "" is no input.
/// @param start receives the scene that the demo starts with; without bodies, if it has none
/// @throws InvalidArgument, also for options that a demo does not have; FileError; as load()
std::unique_ptr<Engine> make_demo_engine(const RunOptions& options, const std::string& script,
                                         Scene* start);

/// Name, summary and controls of a demo, for a user.
std::string describe_demo(const std::string& name);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
