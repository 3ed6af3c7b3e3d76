/// Makes engines by name.
#include "src/tool/engine.hpp"

#include <jfpx/error.hpp>

#include "src/tool/bullet_engine.hpp"
#include "src/tool/native_engine.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

/// Read once: a command may make several engines, and why the file is not used is told once.
const CostModel& costs_of_this_machine(bool quiet) {
  static const CostModel costs = [quiet] {
    const CalibratedCosts cached = calibrated_costs();
    if (!quiet && !cached.problem.empty()) {
      fmt::print(stderr, "jfpx: default costs are used (see: jfpx calibrate): {}\n",
                 cached.problem);
    }
    return cached.costs;
  }();
  return costs;
}

}  // namespace

std::string_view to_string(EngineKind kind) { return kEngineNames[static_cast<int>(kind)]; }

EngineKind parse_engine(std::string_view name) {
  const auto* found = std::ranges::find(kEngineNames, name);
  if (found != std::end(kEngineNames)) {
    return static_cast<EngineKind>(found - std::begin(kEngineNames));
  }
  throw InvalidArgument(
      fmt::format("engine is \"{}\"; it must be one of {}", name, fmt::join(kEngineNames, ", ")));
}

StageTimes& StageTimes::operator+=(const StageTimes& other) {
  integrate += other.integrate;
  broad += other.broad;
  detect += other.detect;
  solve += other.solve;
  total += other.total;
  return *this;
}

nlohmann::ordered_json to_json_value(const StageTimes& times) {
  return {{"integrate", times.integrate},
          {"broad", times.broad},
          {"detect", times.detect},
          {"solve", times.solve},
          {"total", times.total}};
}

int report_trouble(const std::string& device_failure, const std::string& trouble) {
  if (!device_failure.empty()) {
    fmt::print(stderr, "jfpx: x86 has taken over: {}\n", device_failure);
  }
  if (trouble.empty()) return kSuccess;
  fmt::print(stderr, "jfpx: {}\n", trouble);
  return kCheckFailed;
}

SphereColliderOptions collider_options(const RunOptions& options) {
  SphereColliderOptions collider;
  collider.backend = options.backend;
  collider.threads = options.threads;
  if (options.backend == Backend::automatic) collider.costs = costs_of_this_machine(options.quiet);
  return collider;
}

std::unique_ptr<Engine> make_engine(EngineKind kind, const Scene& scene,
                                    const RunOptions& options) {
  if (kind == EngineKind::native) return make_native_engine(scene, options);
  return make_bullet_engine(kind, scene, options);
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
