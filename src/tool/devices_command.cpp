/// jfpx devices: lists the backends, whether each is usable, and the reason if it is not. On a
/// machine with several GPUs, it lists these, too, and which of them are linked.
#include <jfpx/backend.hpp>

#include "src/tool/commands.hpp"
#include "src/tool/output.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

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
    const std::vector<Gpu> gpus = available_gpus();
    if (gpus.size() < 2) return;
    for (const Gpu& gpu : gpus) {
      fmt::print("GPU {} {}", gpu.number, gpu.name);
      if (!gpu.usable) fmt::print(", not usable: {}", gpu.reason);
      if (!gpu.linked.empty()) fmt::print(", linked with {}", fmt::join(gpu.linked, ", "));
      fmt::print("\n");
    }
  });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
