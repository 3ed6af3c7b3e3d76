/// The subcommands of jfpx. Each function adds one subcommand, which writes its exit status.
#pragma once

#include <jfpx/config.hpp>

namespace CLI {
class App;
}

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

void add_scenes_command(CLI::App& app, int& status);
void add_devices_command(CLI::App& app, int& status);
void add_calibrate_command(CLI::App& app, int& status);
void add_run_command(CLI::App& app, int& status);
void add_compare_command(CLI::App& app, int& status);
void add_replay_command(CLI::App& app, int& status);
void add_preload_command(CLI::App& app, int& status);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
