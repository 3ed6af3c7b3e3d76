/// Interface of the engines that run a scene: native, stock Bullet, and Bullet with jfpx's parts.
#pragma once

#include <jfpx/body.hpp>
#include <jfpx/sphere_collider.hpp>
#include <jfpx/world.hpp>

#include "src/tool/run_options.hpp"
#include "src/tool/stage_times.hpp"

#include <nlohmann/json_fwd.hpp>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

class World;

namespace tool {

nlohmann::ordered_json to_json_value(const StageTimes& times);

/// Measures of the last step.
struct StepMeasures {
  /// [m], >= 0, of the contact points detected in the step, without those of sensors; 0 without
  /// contacts
  Real deepest_penetration = 0, mean_penetration = 0;
  Real largest_speed = 0;  ///< [m/s], of the movable bodies after the step
};

/// Deepest and mean penetration of a sequence of contact points.
class Penetrations {
 public:
  /// @param distance [m], <= 0
  void add(Real distance) {
    deepest_ = std::max(deepest_, -distance);
    sum_ -= static_cast<double>(distance);
    ++count_;
  }
  Real deepest() const { return deepest_; }
  Real mean() const { return static_cast<Real>(count_ > 0 ? sum_ / count_ : 0); }

 private:
  Real deepest_ = 0;
  double sum_ = 0, count_ = 0;
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual void step() = 0;
  virtual std::vector<BodyState> states() const = 0;
  virtual std::uint64_t contacts() const = 0;  ///< number of contact points after the last step
  virtual std::uint32_t awake() const = 0;     ///< number of movable bodies awake
  virtual StepMeasures measures() const = 0;   ///< computed by each call
  virtual StageTimes times() const = 0;        ///< of the last step
  /// The world of the native engine; null for other engines and for demos.
  virtual World* world() { return nullptr; }
  virtual std::string backend() const = 0;  ///< that computed the sphere contacts of the last step
  /// Name of the native resolver; empty for Bullet and for demos without a world.
  virtual std::string resolver() const { return {}; }
  /// The backend, its algorithm and the reason for the choice, as a table entry.
  virtual std::string choice() const { return backend(); }
  /// Reason why the CPU replaced a device in any step; empty if none was replaced.
  virtual std::string device_failure() const { return {}; }
  /// Reason why the run can't continue meaningfully; empty if it can.
  virtual std::string trouble() const { return {}; }
};

/// @throws BackendUnavailable, also in a build without Bullet; InvalidScene.
std::unique_ptr<Engine> make_engine(EngineKind kind, const Scene& scene, const RunOptions& options);

/// Reports failures of a run on stderr. @return the exit status
int report_trouble(const std::string& device_failure, const std::string& trouble);

/// The options of the sphere collider.
SphereColliderOptions collider_options(const RunOptions& options);
WorldSettings world_settings(const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
