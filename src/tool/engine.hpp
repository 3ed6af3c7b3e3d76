/// One way to run a scene: native, stock Bullet, or Bullet with jfpx's parts.
#pragma once

#include <jfpx/body.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/tool/run_options.hpp"

#include <nlohmann/json_fwd.hpp>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

std::string_view to_string(EngineKind kind);
/// @throws InvalidArgument for a name that to_string() does not give.
EngineKind parse_engine(std::string_view name);
/// Milliseconds spent in each stage.
struct StageTimes {
  double integrate = 0, broad = 0, detect = 0, solve = 0, total = 0;
  StageTimes& operator+=(const StageTimes& other);
};
nlohmann::ordered_json to_json_value(const StageTimes& times);

class Engine {
 public:
  virtual ~Engine() = default;
  virtual void step() = 0;
  virtual std::vector<BodyState> states() const = 0;
  virtual std::uint64_t contacts() const = 0;  ///< contact points after the last step
  virtual std::uint32_t awake() const = 0;     ///< movable bodies awake
  virtual StageTimes times() const = 0;        ///< of the last step
  virtual std::string backend() const = 0;     ///< who computed the last step's sphere contacts
  /// Who did, how and why, for a table.
  virtual std::string choice() const { return backend(); }
  /// Why x86 took over from a device at some step; empty unless it did.
  virtual std::string device_failure() const { return {}; }
  /// Why the run can't go on meaningfully; empty while all is well.
  virtual std::string trouble() const { return {}; }
};

/// @throws BackendUnavailable, also where this build has no Bullet; InvalidScene.
std::unique_ptr<Engine> make_engine(EngineKind kind, const Scene& scene, const RunOptions& options);

/// Says on stderr what went wrong while the engine ran. @return the exit status
int report_trouble(const std::string& device_failure, const std::string& trouble);

/// What the run options say about the sphere collider.
SphereColliderOptions collider_options(const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
