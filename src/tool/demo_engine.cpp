/// Demos, with their scripted inputs, as an Engine.
#include "src/tool/demo_engine.hpp"

#include <jfpx/error.hpp>

#include "src/base/stopwatch.hpp"
#include "src/demos/input_script.hpp"
#include "src/tool/native_engine.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

std::unique_ptr<demos::Demo> make_demo(const RunOptions& options) {
  const WorldSettings world = world_settings(options);
  if (!is_demo(options.scene)) return demos::make(load(options), world);
  if (const char* option = option_of_scenes(options)) {
    throw InvalidArgument(std::string(option) + " requires a scene; " + options.scene +
                          " is a demo");
  }
  return demos::make(options.scene,
                     {.scene = scene_options(options), .dt = options.dt, .world = world});
}

class DemoEngine final : public Engine {
 public:
  DemoEngine(std::unique_ptr<demos::Demo> demo, const demos::InputScript& script)
      : demo_(std::move(demo)), player_(script, *demo_) {}

  void step() override {
    Stopwatch watch;
    report_ = demo_->step(player_.next());
    report_.total_ms = watch.lap_ms();  // includes the controls
    if (!report_.device_failure.empty()) device_failure_ = report_.device_failure;
  }
  std::vector<BodyState> states() const override { return demo_->states(); }
  std::uint64_t contacts() const override { return report_.contacts; }
  std::uint32_t awake() const override { return report_.awake; }
  StepMeasures measures() const override {
    if (demo_->world() != nullptr) return measures_of(*demo_->world(), report_);
    StepMeasures measures;
    for (const BodyState& state : demo_->states()) {
      measures.largest_speed = std::max(measures.largest_speed, length(state.velocity));
    }
    return measures;
  }
  StageTimes times() const override { return stage_times(report_); }
  std::string backend() const override { return std::string(to_string(report_.backend)); }
  std::string resolver() const override {
    const World* world = demo_->world();
    return world == nullptr ? std::string() : std::string(resolver_name(world->settings().solver));
  }
  std::string device_failure() const override { return device_failure_; }
  std::string trouble() const override { return trouble_of(report_); }

 private:
  std::unique_ptr<demos::Demo> demo_;
  demos::ScriptPlayer player_;
  StepReport report_;
  std::string device_failure_;
};

}  // namespace

std::unique_ptr<Engine> make_demo_engine(const RunOptions& options, const std::string& script,
                                         Scene* start) {
  std::unique_ptr<demos::Demo> demo = make_demo(options);
  *start = demo->scene() != nullptr ? *demo->scene() : Scene{};
  start->name = demo->name();
  start->dt = demo->dt();
  const demos::InputScript inputs = script.empty()
                                        ? demos::InputScript{.demo = start->name, .lines = {}}
                                        : demos::load_input_script(script);
  return std::make_unique<DemoEngine>(std::move(demo), inputs);
}

std::string describe_demo(const std::string& name) {
  const auto demo = demos::make(name);
  std::string text;
  for (const demos::Entry& entry : demos::all()) {
    if (entry.name == name) text = fmt::format("{}: {}\n\n", entry.name, entry.summary);
  }
  for (const demos::Control& control : demo->controls()) {
    text += fmt::format("  {:<12} {:<6} {}{}\n", control.name, control.key, control.summary,
                        control.repeats ? ", in every step while the key is down" : "");
  }
  return text;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
