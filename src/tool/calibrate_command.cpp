/// jfpx calibrate: measures the costs for the automatic selection of backend and algorithm.
#include <jfpx/backend.hpp>

#include "src/sphere_collider/cost_cache.hpp"
#include "src/sphere_collider/cost_model.hpp"
#include "src/tool/calibration.hpp"
#include "src/tool/commands.hpp"
#include "src/tool/cost_fit.hpp"
#include "src/tool/options.hpp"
#include "src/tool/output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

struct CalibrateOptions {
  std::string json;
  bool show = false, quiet = false;
};

std::string from_how_many(const CostTerms& a, const CostTerms& b) {
  const double n = crossover(a, b);
  return n == 0 ? "never" : fmt::format("{:.0f}", n);
}

/// Costs as tables, those of CUDA only `with_cuda`.
std::string report(const CostModel& costs, bool with_cuda) {
  Table terms({"method", "call us", "byte ns", "sphere ns", "pair ns", "contact ns"});
  const auto add = [&](const char* name, const CostTerms& t) {
    const auto number = [](double value) { return fmt::format("{:.4g}", value); };
    terms.add({name, number(t.call_us), number(t.byte_ns), number(t.sphere_ns), number(t.pair_ns),
               number(t.contact_ns)});
  };
  add("cpu, all pairs", costs.cpu_all_pairs);
  add("cpu, grid", costs.cpu_grid);
  add("cpu, given pairs", costs.cpu_given_pairs);
  add("cpu, step of a world", costs.cpu_world);
  if (with_cuda) {
    add("cuda, all pairs", costs.cuda_all_pairs);
    add("cuda, grid", costs.cuda_grid);
    add("cuda, given pairs", costs.cuda_given_pairs);
    add("cuda, step of a world", costs.cuda_world);
  }
  Table crossovers({"with 3 contacts per sphere", "faster from spheres"});
  crossovers.add(
      {"cpu: grid instead of all pairs", from_how_many(costs.cpu_all_pairs, costs.cpu_grid)});
  if (!with_cuda) return fmt::format("{}\n{}", terms.text(), crossovers.text());
  crossovers.add(
      {"cuda: grid instead of all pairs", from_how_many(costs.cuda_all_pairs, costs.cuda_grid)});
  crossovers.add(
      {"all pairs: cuda instead of cpu", from_how_many(costs.cpu_all_pairs, costs.cuda_all_pairs)});
  crossovers.add(
      {"step of a world: cuda instead of cpu", from_how_many(costs.cpu_world, costs.cuda_world)});
  return fmt::format("{}\nstart of cuda: {:.0f} ms\n\n{}", terms.text(), costs.cuda_start_ms,
                     crossovers.text());
}

MeasuredCostModel measure(const CalibrateOptions& options) {
  std::unique_ptr<Progress> progress;
  const Calibration result = calibrate([&](std::uint64_t done, std::uint64_t total) {
    if (!progress) progress = std::make_unique<Progress>("measuring", total, options.quiet);
    progress->advance_to(done);
  });
  progress.reset();
  if (!result.no_cuda.empty() && !options.quiet) {
    fmt::print(stderr, "jfpx: cuda was not measured: {}\n", result.no_cuda);
  }
  store_costs(result.costs);
  return {result.costs, this_machine()};
}

MeasuredCostModel show(const CalibrateOptions& options) {
  const CalibratedCosts cached = calibrated_costs();
  if (cached.problem.empty()) return {cached.costs, this_machine()};
  if (!options.quiet) {
    fmt::print(stderr, "jfpx: {}: showing the default costs\n", cached.problem);
  }
  return {cached.costs, {.machine = "none: default costs", .driver = ""}};
}

bool cuda_is_usable() {
  return std::ranges::any_of(available_backends(), [](const BackendStatus& status) {
    return status.backend == Backend::cuda && status.usable;
  });
}

int run(const CalibrateOptions& options) {
  OutputFile json(options.json);
  const MeasuredCostModel model = options.show ? show(options) : measure(options);
  json.write(to_json(model));
  json.finish();
  if (!options.quiet && options.json != "-") {
    fmt::print("{}\n{}\n", report(model.costs, cuda_is_usable()), cost_model_path());
  }
  return kSuccess;
}

}  // namespace

void add_calibrate_command(CLI::App& app, int& status) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "Measure this machine for the automatic choice of backend and algorithm");
  command->add_flag("--show", options->show, "Show the costs in use without measuring");
  command->add_option("--json", options->json,
                      "Write the costs as JSON to this file; - writes to stdout");
  command->add_flag("--quiet", options->quiet, "Print only the output of --json -");
  command->footer(
      "Takes a few seconds. The costs are stored in the cache folder (XDG_CACHE_HOME) together\n"
      "with the machine, the driver and the version. The commands run, compare, replay, preload\n"
      "and jfpx-view use them as long as these three are unchanged; after a new version of jfpx,\n"
      "calibrate again. Other programs load them with calibrated_costs() and pass them in\n"
      "SphereColliderOptions::costs.");
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
