/// The jfpx command.
#include <jfpx/error.hpp>

#include "src/tool/commands.hpp"
#include "src/tool/options.hpp"
#include "src/tool/precision.hpp"

#include <fmt/format.h>

#include <new>

namespace {

using namespace jfpx;

int run(int argc, char** argv) {
  tool::switch_precision_if_asked(argc, argv);
  CLI::App app("jfpx " JFPX_VERSION
               ": rigid-body collision with the same bits on x86, on CUDA and inside Bullet.",
               "jfpx");
  app.set_version_flag("--version", "jfpx " JFPX_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  std::string precision = sizeof(Real) == 4 ? "float" : "double";
  app.add_option("--precision", precision, "float or double")
      ->check(CLI::IsMember({"float", "double"}))
      ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  jfpx compare boxes-and-balls --spheres 448 --steps 600\n"
      "  jfpx run pile --spheres 2048 --steps 120 --hash\n"
      "  jfpx scenes gas --spheres 100 --export > gas.json && jfpx run gas.json\n"
      "\n"
      "Exit status: 0 all well; 1 a check failed (mismatch, divergence); 2 bad usage or bad "
      "input;\n"
      "3 backend not usable. Results go to stdout, everything else to stderr.");
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    const std::vector<std::string> unknown = failed->remaining(true);
    const std::string what = failed->get_subcommands().empty() && !unknown.empty()
                                 ? "there is no command \"" + unknown.front() + "\""
                                 : error.what();
    return "jfpx: " + what + "\nRun with --help for more information.\n";
  });
  int status = tool::kSuccess;
  tool::add_compare_command(app, status);
  tool::add_run_command(app, status);
  tool::add_replay_command(app, status);
  tool::add_preload_command(app, status);
  tool::add_scenes_command(app, status);
  tool::add_devices_command(app, status);
  tool::add_calibrate_command(app, status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? tool::kSuccess : tool::kBadUsage;
  }
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const BackendUnavailable& error) {
    fmt::print(stderr, "jfpx: {}\n", error.what());
    return tool::kBackendUnavailable;
  } catch (const DeviceError& error) {
    fmt::print(stderr, "jfpx: {}\n", error.what());
    return tool::kBackendUnavailable;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "jfpx: out of memory\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "jfpx: {}\n", error.what());
  }
  return tool::kBadUsage;
}
