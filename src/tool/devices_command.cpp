/// jfpx devices: lists the backends, whether each is usable, and the reason if it is not.
#include <jfpx/backend.hpp>

#include "src/tool/commands.hpp"
#include "src/tool/output.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

void add_devices_command(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("devices", "List the backends and whether each is usable");
  command->callback([] {
    for (const BackendStatus& status : available_backends()) {
      fmt::print("{:<5} {:<12} {:<10} {}\n", to_string(status.backend),
                 status.compiled ? "compiled" : "not compiled",
                 status.usable ? "usable" : "not usable",
                 status.usable ? status.device : status.reason);
    }
  });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
