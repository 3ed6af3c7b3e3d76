/// The native engine as an Engine.
#include "src/tool/native_engine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

class NativeEngine final : public Engine {
 public:
  NativeEngine(const Scene& scene, const RunOptions& options)
      : world_(scene, world_settings(options)) {}

  void step() override {
    report_ = world_.step();
    if (!report_.device_failure.empty()) device_failure_ = report_.device_failure;
  }
  std::vector<BodyState> states() const override { return world_.states(); }
  std::uint64_t contacts() const override { return report_.contacts; }
  std::uint32_t awake() const override { return report_.awake; }
  StepMeasures measures() const override { return measures_of(world_, report_); }
  StageTimes times() const override { return stage_times(report_); }
  World* world() override { return &world_; }
  std::string backend() const override { return std::string(to_string(report_.backend)); }
  std::string resolver() const override {
    return std::string(resolver_name(world_.settings().solver));
  }
  std::string choice() const override {
    return fmt::format("{}, {}, {}", to_string(report_.backend), to_string(report_.algorithm),
                       to_string(report_.choice));
  }
  std::string device_failure() const override { return device_failure_; }
  std::string trouble() const override { return trouble_of(report_); }

 private:
  World world_;
  StepReport report_;
  std::string device_failure_;
};

}  // namespace

StepMeasures measures_of(const World& world, const StepReport& report) {
  Penetrations penetrations;
  // Contacts of generators follow the detected contacts; a failed step has no contacts.
  const std::span<const Contact> contacts = world.contacts();
  for (const Contact& c : contacts.first(std::min<std::size_t>(report.contacts, contacts.size()))) {
    if (!c.sensor) penetrations.add(c.distance);
  }
  Real speed = 0;
  for (const BodyId id : world.bodies()) {
    if (world.mass(id) > 0) speed = std::max(speed, length(world.state(id).velocity));
  }
  return {penetrations.deepest(), penetrations.mean(), speed};
}

std::unique_ptr<Engine> make_native_engine(const Scene& scene, const RunOptions& options) {
  return std::make_unique<NativeEngine>(scene, options);
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
