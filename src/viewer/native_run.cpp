/// The native engine as a run.
#include "src/viewer/exchangeable_collider.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

class NativeRun final : public Run {
 public:
  NativeRun(Scene scene, const EngineChoice& choice, std::uint64_t first_step)
      : choice_(choice),
        first_step_(first_step),
        scene_(std::move(scene)),
        world_(scene_, world_settings(choice)) {}

  void step() override { report_ = world_.step(); }

  RunState run_state() override {
    RunState run_state;
    run_state.step = first_step_ + report_.step;
    world_.states(&run_state.states);
    for (const BodyId id : world_.bodies()) run_state.awake.push_back(world_.awake(id) ? 1 : 0);
    run_state.contacts.assign(world_.contacts().begin(), world_.contacts().end());
    run_state.times = tool::stage_times(report_);
    run_state.iterations = report_.position_iterations + report_.velocity_iterations;
    if (scene_.solver == Solver::soft_step) run_state.substeps = scene_.soft_step.substeps;
    run_state.computed_by = to_string(report_.backend);
    run_state.trouble = tool::trouble_of(report_);
    return run_state;
  }

  EngineChoice choice() const override { return choice_; }
  bool switch_to(const EngineChoice& choice) override {
    if (choice.engine != EngineKind::native || choice.threads != choice_.threads) return false;
    // A world on another device continues with the same bits.
    World next(scene_, world_settings(choice));
    next.restore(world_.snapshot());
    world_ = std::move(next);
    choice_ = choice;
    return true;
  }

 private:
  EngineChoice choice_;
  std::uint64_t first_step_;
  Scene scene_;
  World world_;
  StepReport report_;
};

}  // namespace

std::unique_ptr<Run> detail::make_native_run(const Scene& scene, const EngineChoice& choice,
                                             std::uint64_t first_step) {
  return std::make_unique<NativeRun>(scene, choice, first_step);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
