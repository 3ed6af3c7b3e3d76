/// Replacement of the command `preload` in a build that does not have it, which says why.
#include <jfpx/error.hpp>

#include "src/tool/commands.hpp"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

void add_preload_command(CLI::App& app, int&) {
#if defined(__linux__)
  const std::string reason = "built without Bullet";
#else
  const std::string reason = "it takes the run-time linker of Linux; link jfpx_bullet instead";
#endif
  CLI::App* command = app.add_subcommand("preload", "Not available: " + reason);
  command->add_option_function<std::vector<std::string>>(
      "PROGRAM", [](const auto&) {}, "");
  command->callback([reason] { throw BackendUnavailable("preload: " + reason); });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
