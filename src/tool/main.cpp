/// The jfpx command.
#include <jfpx/thesis/worst_first.hpp>

#include "src/base/system.hpp"
#include "src/tool/commands.hpp"
#include "src/tool/failure.hpp"
#include "src/tool/interrupts.hpp"
#include "src/tool/options.hpp"
#include "src/tool/precision.hpp"
#include "src/tool/ranks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace jfpx;

/// Message for an unknown command or option, which CLI11 reports as a missing command.
std::string what_is_wrong(const CLI::App& app, const CLI::Error& error) {
  const std::vector<std::string> unknown = app.remaining(true);
  if (!app.get_subcommands().empty() || unknown.empty()) return error.what();
  const std::string& word = unknown.front();
  return fmt::format("there is no {} \"{}\"", word.starts_with('-') ? "option" : "command", word);
}

/// Flushes stdout and reports write errors.
int finish_output(int status) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  fmt::print(stderr, "jfpx: stdout can't be written: {}\n", std::strerror(errno));
  return status == tool::kSuccess ? tool::kBadUsage : status;
}

/// Inserts "--" before the program of `preload`, because later options belong to the program.
std::vector<std::string> separate_program(const CLI::App& app, std::vector<std::string> arguments) {
  const CLI::App* command = nullptr;
  for (auto it = arguments.begin(); it != arguments.end() && *it != "--"; ++it) {
    if (it->starts_with('-')) {
      const CLI::Option* option = command ? command->get_option_no_throw(*it) : nullptr;
      if (option == nullptr) option = app.get_option_no_throw(*it);
      const bool takes_next = option != nullptr && option->get_items_expected_min() > 0;
      if (takes_next && std::next(it) != arguments.end()) ++it;
    } else if (command == nullptr) {
      if (*it != "preload") break;
      command = app.get_subcommand(*it);
    } else {
      arguments.insert(it, "--");
      break;
    }
  }
  return arguments;
}

int run(const std::vector<std::string>& given) {
  CLI::App app("jfpx " JFPX_VERSION
               ": rigid-body collision with identical bits on the CPU, on CUDA and inside Bullet.",
               "jfpx");
  app.set_version_flag("--version", "jfpx " JFPX_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  std::string precision(tool::kPrecision);
  app.add_option("--precision", precision, "float or double")
      ->check(CLI::IsMember({"float", "double"}))
      ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  jfpx compare boxes-and-balls --spheres 448 --steps 600\n"
      "  jfpx run pile --spheres 2048 --steps 120 --hash\n"
      "  mpirun -n 8 jfpx run pile --spheres 20000 --hash\n"
      "  jfpx scenes gas --spheres 100 --export > gas.json && jfpx run gas.json\n"
      "\n"
      "Exit status: 0 success; 1 a check failed (mismatch, divergence); 2 invalid usage or "
      "input;\n"
      "3 backend not usable. Results are written to stdout, messages to stderr.");
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return "jfpx: " + what_is_wrong(*failed, error) + "\nRun with --help for more information.\n";
  });
  int status = tool::kSuccess;
  tool::add_compare_command(app, status);
  tool::add_run_command(app, status);
  tool::add_replay_command(app, status);
  tool::add_preload_command(app, status);
  tool::add_scenes_command(app, status);
  tool::add_devices_command(app, status);
  tool::add_calibrate_command(app, status);
  for (CLI::App* command : app.get_subcommands({})) {
    const std::string& name = command->get_name();
    if (name == "run" || name == "preload") continue;  // preload: the program may use MPI
    command->preparse_callback([name](std::size_t) { tool::require_one_process(name); });
  }
  std::vector<std::string> arguments = separate_program(app, given);
  tool::switch_precision_if_requested(arguments);
  std::ranges::reverse(arguments);
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? tool::kSuccess : tool::kBadUsage;
  }
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    thesis::enable();
    return finish_output(run(start_program(argc, argv)));
  } catch (const tool::Interrupted& interrupted) {
    tool::end_by_signal(interrupted.signal);
  } catch (...) {
    return tool::report_failure(std::current_exception());
  }
}
