/// Command-line options shared by several commands.
#include "src/tool/options.hpp"

#include "src/base/thread_pool.hpp"

#include <charconv>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

constexpr std::uint64_t kMaxCount = std::numeric_limits<std::uint32_t>::max();

}  // namespace

CLI::Validator whole_number(std::uint64_t largest) {
  return {
      [largest](std::string& text) {
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool whole = error == std::errc() && end == text.data() + text.size();
        return whole && value <= largest ? ""
                                         : "is " + text + "; it must be a whole number from 0 to " +
                                               std::to_string(largest);
      },
      ""};
}

void add_threads_option(CLI::App& app, unsigned& threads) {
  app.add_option("--threads", threads, "CPU threads, at most 256; 0: one per core")
      ->check(whole_number(ThreadPool::kMaxThreads))
      ->capture_default_str();
}

CLI::Validator engine_name() {
  return CLI::IsMember(std::vector<std::string>(std::begin(kEngineNames), std::end(kEngineNames)));
}

CLI::Validator backend_name() {
  return {[](std::string& text) {
            return parse_backend(text) ? "" : "is " + text + "; it must be auto, cpu or cuda";
          },
          ""};
}

void add_backend_option(CLI::App& app, Backend& backend, const std::string& help) {
  app.add_option_function<std::string>(
         "--backend", [&backend](const std::string& text) { backend = *parse_backend(text); }, help)
      ->check(backend_name());
}

void add_scene_options(CLI::App& app, RunOptions& options, const std::string& scene) {
  app.add_option("SCENE", options.scene, scene)->required();
  app.add_option("--spheres", options.spheres, "Number of spheres of a named scene")
      ->check(whole_number(kMaxCount));
  app.add_option("--boxes", options.boxes,
                 "Number of boxes, for named scenes with boxes (see: jfpx scenes)")
      ->check(whole_number(kMaxCount));
  app.add_option("--seed", options.seed, "Seed of a named scene")
      ->check(whole_number())
      ->capture_default_str();
  app.add_option("--dt", options.dt, "Time step in seconds [default: the scene's]");
  app.add_flag("--no-sleep", options.no_sleep, "Keep all bodies awake");
  app.add_option_function<std::string>(
         "--resolver",
         [&options](const std::string& name) { options.resolver = parse_resolver(name); },
         "Native engine: resolver of contacts, soft-step or worst-first [default: the scene's]")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(kResolverNames), std::end(kResolverNames))));
  app.add_option("--substeps", options.substeps,
                 "Resolver soft-step: number of substeps per step, 1 to 64 [default: the scene's]")
      ->check(whole_number(kMaxCount));
}

void add_run_options(CLI::App& app, RunOptions& options) {
  app.add_option("--steps", options.steps, "Number of steps")
      ->check(whole_number())
      ->capture_default_str();
  add_backend_option(app, options.backend);
  add_threads_option(app, options.threads);
  app.add_option(
         "--minimum-batch", options.minimum_batch,
         "Bullet: smallest number of pairs in a dispatch, and of manifolds in a group, that "
         "jfpx computes instead of Bullet [default: compare: 0; run: 256 pairs, 24 manifolds]")
      ->check(whole_number());
  const CLI::IsMember implementation({"stock", "jfpx"});
  app.add_option("--solver", options.solver, "Bullet: constraint solver, stock or jfpx")
      ->check(implementation)
      ->capture_default_str();
  app.add_option("--world", options.world, "Bullet: dynamics world, stock or jfpx")
      ->check(implementation)
      ->capture_default_str();
  app.add_option("--json", options.json,
                 "Write the results as JSON to this file; - writes to stdout instead of a table");
  app.add_flag("--hash", options.hash,
               "Print the hash of the final state as the last line (16 hexadecimal digits); the "
               "output of --json contains it");
  app.add_flag("--quiet", options.quiet, "Print only the output of --hash and --json -");
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
