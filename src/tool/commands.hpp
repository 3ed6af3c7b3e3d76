/// The subcommands of jfpx: each adds itself to the command line and runs when it was chosen.
#pragma once

#include <jfpx/config.hpp>

#include <CLI/CLI.hpp>

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
