/// jfpx preload PROGRAM [ARGS]: runs an unmodified Bullet program with jfpx's parts.
#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/base/thread_pool.hpp"
#include "src/tool/commands.hpp"
#include "src/tool/options.hpp"
#include "src/tool/program_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

struct PreloadOptions {
  std::vector<std::string> command;
  std::string backend, minimum_batch, threads;  ///< empty: leaves the environment unchanged
  std::vector<std::string> parts;
  bool summary = false, verify = false;
};

/// The library at its place relative to this program, in the build tree and when installed.
std::string find_library() {
  namespace fs = std::filesystem;
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  std::string path =
      (folder / JFPX_PRELOAD_FOLDER / "libjfpx-bullet-preload.so").lexically_normal().string();
  if (!fs::exists(path)) throw Error(path + " is missing");
  // LD_PRELOAD has no syntax for quoting.
  if (path.find_first_of(" :") != std::string::npos) {
    throw Error("\"" + path + "\" can't be preloaded: its path contains a space or a colon");
  }
  return path;
}

/// The library of AddressSanitizer, which must be the first that a program loads; empty if the
/// program is not linked with it.
std::string address_sanitizer_of(const ProgramFile& program) {
  for (const std::string& library : program.libraries) {
    for (const char* start : {"libasan.so", "libclang_rt.asan", "libhwasan.so"}) {
      if (library.starts_with(start)) return library;
    }
  }
  return {};
}

/// Why jfpx cannot be loaded into the program; empty if it can.
std::string obstacle_of(const ProgramFile& program) {
  if (!program.is_of_this_machine) return "is not a program of the architecture of this command";
  if (!program.loads_libraries) return "is statically linked";
  if (program.ignores_preload) {
    return "runs with the rights of another user or group, so that LD_PRELOAD is ignored";
  }
  return {};
}

void set_environment(const PreloadOptions& options, const ProgramFile& program) {
  std::string preload = find_library();
  if (const std::string first = address_sanitizer_of(program); !first.empty()) {
    preload = first + ":" + preload;
  }
  if (const char* others = std::getenv("LD_PRELOAD"); others != nullptr && *others != '\0') {
    preload += std::string(":") + others;
  }
  setenv("LD_PRELOAD", preload.c_str(), 1);
  if (options.summary) setenv("JFPX_PRELOAD_SUMMARY", "1", 1);
  if (options.verify) setenv("JFPX_PRELOAD_VERIFY", "1", 1);
  if (!options.backend.empty()) setenv("JFPX_PRELOAD_BACKEND", options.backend.c_str(), 1);
  if (!options.threads.empty()) setenv("JFPX_PRELOAD_THREADS", options.threads.c_str(), 1);
  if (!options.parts.empty()) {
    std::string list;
    for (const std::string& part : options.parts) list += (list.empty() ? "" : ",") + part;
    setenv("JFPX_PRELOAD_PARTS", list.c_str(), 1);
  }
  if (!options.minimum_batch.empty()) {
    setenv("JFPX_PRELOAD_MINIMUM_BATCH", options.minimum_batch.c_str(), 1);
  }
}

[[noreturn]] void start(const PreloadOptions& options) {
  // Checked here as an error; inside the program, only a warning would be possible.
  if (options.backend == "cuda") (void)make_sphere_collider({.backend = Backend::cuda});
  const ProgramFile program = read_program_file(options.command[0]);
  if (const std::string obstacle = obstacle_of(program); !obstacle.empty()) {
    std::fprintf(stderr, "jfpx preload: %s %s; it runs without jfpx\n", options.command[0].c_str(),
                 obstacle.c_str());
  }
  set_environment(options, program);
  std::vector<std::string> command = options.command;
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (std::string& argument : command) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  throw Error("\"" + command[0] + "\" can't be started: " + std::strerror(errno));
}

}  // namespace

void add_preload_command(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "preload",
      "Run an unmodified, dynamically linked Bullet program with jfpx's dispatcher, solver and "
      "update of AABBs");
  auto options = std::make_shared<PreloadOptions>();
  command->add_option("command", options->command, "Program and its arguments")
      ->required()
      ->type_name("PROGRAM [ARGS]");
  command->add_flag("--summary", options->summary, "Print a summary on stderr at exit");
  command->add_flag(
      "--verify", options->verify,
      "Recompute every pair that jfpx has computed with Bullet's algorithm, and compare (slow)");
  command->add_option("--backend", options->backend, "Backend: auto, cpu or cuda [auto]")
      ->check(backend_name());
  command
      ->add_option("--parts", options->parts,
                   "Parts to replace: dispatcher, solver, world (update of AABBs) [default: all]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"dispatcher", "solver", "world"}));
  command
      ->add_option("--threads", options->threads, "CPU threads, at most 256; 0: one per core [1]")
      ->check(whole_number(ThreadPool::kMaxThreads));
  command
      ->add_option(
          "--minimum-batch", options->minimum_batch,
          "Smallest number of overlapping pairs in a dispatch, and of manifolds in a group, "
          "that jfpx computes instead of Bullet [256 pairs, 24 manifolds]")
      ->check(whole_number());
  command->footer(
      "Usage: jfpx preload [OPTIONS] PROGRAM [ARGS]. All arguments after PROGRAM are its own.\n"
      "Returns the exit status of the program, or 2 if it can't be started. Programs that link\n"
      "Bullet statically, and statically linked programs, run unchanged.");
  command->callback([options] { start(*options); });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
