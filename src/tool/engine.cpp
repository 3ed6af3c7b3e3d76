/// Creation of engines, and their common options.
#include "src/tool/engine.hpp"

#include "src/base/system.hpp"
#include "src/sphere_collider/cost_cache.hpp"
#include "src/tool/bullet_engine.hpp"
#include "src/tool/native_engine.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <system_error>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

/// Read once, because a command may create several engines and must print a warning once. A
/// machine without measured costs is normal and causes no warning.
const CostModel& costs_of_this_machine(bool quiet) {
  static const CostModel costs = [quiet] {
    const CalibratedCosts cached = calibrated_costs();
    std::error_code ignored;
    if (!quiet && !cached.problem.empty() &&
        std::filesystem::exists(to_path(cost_model_path()), ignored)) {
      fmt::print(stderr, "jfpx: default costs are used (see: jfpx calibrate): {}\n",
                 cached.problem);
    }
    return cached.costs;
  }();
  return costs;
}

}  // namespace

nlohmann::ordered_json to_json_value(const StageTimes& times) {
  return {{"integrate", times.integrate},
          {"broad", times.broad},
          {"detect", times.detect},
          {"solve", times.solve},
          {"total", times.total}};
}

int report_trouble(const std::string& device_failure, const std::string& trouble) {
  if (!device_failure.empty()) {
    fmt::print(stderr, "jfpx: the CPU has replaced the GPU: {}\n", device_failure);
  }
  if (trouble.empty()) return kSuccess;
  fmt::print(stderr, "jfpx: {}\n", trouble);
  return kCheckFailed;
}

SphereColliderOptions collider_options(const RunOptions& options) {
  SphereColliderOptions collider;
  collider.backend = options.backend;
  collider.threads = options.threads;
  if (options.backend == Backend::automatic && options.devices.empty())
    collider.costs = costs_of_this_machine(options.quiet || !writes_output(options));
  return collider;
}

WorldSettings world_settings(const RunOptions& options) {
  SphereColliderOptions collider = collider_options(options);
  collider.threads = 1;
  return {.collider = collider,
          .devices = options.devices,
          .threads = options.threads,
          .communicator = options.communicator};
}

std::unique_ptr<Engine> make_engine(EngineKind kind, const Scene& scene,
                                    const RunOptions& options) {
  if (kind == EngineKind::native) return make_native_engine(scene, options);
  return make_bullet_engine(kind, scene, options);
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
