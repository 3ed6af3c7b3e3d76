/// Bullet as a run: each of its three parts stock or jfpx's, exchangeable at any step.
#include "examples/viewer/bullet_moment.hpp"
#include "examples/viewer/exchangeable_collider.hpp"

#include <limits>

namespace jfpx::inline JFPX_ABI::view {
namespace {

class BulletRun final : public Run {
 public:
  BulletRun(const Scene& scene, const EngineChoice& choice, std::uint64_t first_step)
      : choice_(choice), step_(first_step), world_(make_world(scene)) {
    apply_choice();
  }

  void step() override {
    world_.step();
    ++step_;
  }

  Moment moment() override { return moment_of(world_, step_); }

  EngineChoice choice() const override { return choice_; }
  bool switch_to(const EngineChoice& choice) override {
    if (choice.engine == EngineKind::native || choice.threads != choice_.threads) return false;
    if (choice.backend != choice_.backend) {
      collider_->exchange(make_sphere_collider(collider_options(choice)));
    }
    choice_ = choice;
    apply_choice();
    return true;
  }

 private:
  bullet::SceneWorld make_world(const Scene& scene) {
    bullet::SceneWorldOptions options = world_options(choice_);
    options.make_collider = [this] {
      auto collider =
          std::make_unique<ExchangeableCollider>(make_sphere_collider(collider_options(choice_)));
      collider_ = collider.get();
      return collider;
    };
    return bullet::SceneWorld(scene, options);
  }

  // Each of the three parts leaves what is too small to Bullet's own code, and so everything: all
  // choices differ in three numbers and share all that Bullet remembers.
  void apply_choice() {
    const auto least = [this](bool jfpx) {
      return jfpx && choice_.engine == EngineKind::bullet ? std::size_t{0}
                                                          : std::numeric_limits<std::size_t>::max();
    };
    world_.jfpx_dispatcher()->set_minimum_batch(least(true));
    dynamic_cast<bullet::ConstraintSolver&>(*world_.world().getConstraintSolver())
        .set_minimum_batch(least(choice_.jfpx_solver));
    dynamic_cast<bullet::DynamicsWorld&>(world_.world())
        .set_minimum_batch(least(choice_.jfpx_world));
  }

  EngineChoice choice_;
  std::uint64_t step_;
  ExchangeableCollider* collider_ = nullptr;  // owned by the world
  bullet::SceneWorld world_;
};

}  // namespace

bullet::SceneWorldOptions world_options(const EngineChoice& choice) {
  bullet::SceneWorldOptions options;
  options.dispatch.collider = collider_options(choice);
  options.solve.threads = options.step.threads = choice.threads;
  return options;
}

bool has_engine(EngineKind) { return true; }

std::unique_ptr<Run> detail::make_bullet_run(const Scene& scene, const EngineChoice& choice,
                                             std::uint64_t first_step) {
  return std::make_unique<BulletRun>(scene, choice, first_step);
}

}  // namespace jfpx::inline JFPX_ABI::view
