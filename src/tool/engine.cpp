/// Makes engines by name.
#include "src/tool/engine.hpp"

#include <jfpx/error.hpp>

#include "src/tool/bullet_engine.hpp"
#include "src/tool/cost_cache.hpp"
#include "src/tool/native_engine.hpp"

#include <fmt/format.h>

namespace jfpx::inline JFPX_ABI::tool {
namespace {

/// Read once: a command may make several engines, and why the file is not used is told once.
const CostModel& costs_of_this_machine(bool quiet) {
  static const CostModel costs = [quiet] {
    const CachedCosts cached = load_cached_costs();
    if (!quiet && !cached.problem.empty()) {
      fmt::print(stderr, "jfpx: default costs are used (see: jfpx calibrate): {}\n",
                 cached.problem);
    }
    return cached.costs;
  }();
  return costs;
}

}  // namespace

std::string_view to_string(EngineKind kind) {
  switch (kind) {
    case EngineKind::native:
      return "native";
    case EngineKind::bullet:
      return "bullet";
    case EngineKind::bullet_stock:
      return "bullet-stock";
  }
  return "unknown";
}

EngineKind parse_engine(std::string_view name) {
  for (const EngineKind kind : {EngineKind::native, EngineKind::bullet, EngineKind::bullet_stock}) {
    if (name == to_string(kind)) return kind;
  }
  throw InvalidArgument("engine is \"" + std::string(name) +
                        "\"; it must be native, bullet or bullet-stock");
}

StageTimes& StageTimes::operator+=(const StageTimes& other) {
  integrate += other.integrate;
  broad += other.broad;
  detect += other.detect;
  solve += other.solve;
  total += other.total;
  return *this;
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

}  // namespace jfpx::inline JFPX_ABI::tool
