/// Makes engines by name.
#include "src/tool/engine.hpp"

#include <jfpx/error.hpp>

#include "src/tool/bullet_engine.hpp"
#include "src/tool/native_engine.hpp"

namespace jfpx::inline JFPX_ABI::tool {

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
  return collider;
}

std::unique_ptr<Engine> make_engine(EngineKind kind, const Scene& scene,
                                    const RunOptions& options) {
  if (kind == EngineKind::native) return make_native_engine(scene, options);
  return make_bullet_engine(kind, scene, options);
}

}  // namespace jfpx::inline JFPX_ABI::tool
