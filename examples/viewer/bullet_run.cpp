/// Bullet as a run: stock dispatch or jfpx's, exchangeable at any step.
#include "examples/viewer/bullet_moment.hpp"
#include "examples/viewer/run.hpp"

#include <limits>

namespace jfpx::inline JFPX_ABI::view {
namespace {

bullet::SceneWorld make_world(const Scene& scene, const EngineChoice& choice) {
  bullet::SceneWorldOptions options;
  options.dispatch.collider.backend = choice.backend;
  options.dispatch.collider.threads = choice.threads;
  return bullet::SceneWorld(scene, options);
}

class BulletRun final : public Run {
 public:
  BulletRun(const Scene& scene, const EngineChoice& choice, std::uint64_t first_step)
      : choice_(choice), step_(first_step), world_(make_world(scene, choice)) {
    apply_engine();
  }

  void step() override {
    world_.step();
    ++step_;
  }

  Moment moment() override { return moment_of(world_, step_); }

  EngineChoice choice() const override { return choice_; }
  bool switch_to(const EngineChoice& choice) override {
    EngineChoice same_collider = choice;
    same_collider.engine = choice_.engine;
    if (choice.engine == EngineKind::native || !(same_collider == choice_)) return false;
    choice_ = choice;
    apply_engine();
    return true;
  }

 private:
  // The dispatcher leaves a batch that is too small to Bullet's own code, and so all of them: the
  // two engines differ in one number and share all that Bullet remembers.
  void apply_engine() {
    constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();
    world_.jfpx_dispatcher()->set_minimum_batch(choice_.engine == EngineKind::bullet ? 0 : kNever);
  }

  EngineChoice choice_;
  std::uint64_t step_;
  bullet::SceneWorld world_;
};

}  // namespace

bool has_engine(EngineKind) { return true; }

std::unique_ptr<Run> detail::make_bullet_run(const Scene& scene, const EngineChoice& choice,
                                             std::uint64_t first_step) {
  return std::make_unique<BulletRun>(scene, choice, first_step);
}

}  // namespace jfpx::inline JFPX_ABI::view
