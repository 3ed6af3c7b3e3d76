/// Bullet as a run: each of its three parts stock or jfpx's, exchangeable at any step.
#include "src/viewer/bullet_moment.hpp"
#include "src/viewer/exchangeable_collider.hpp"

#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

class BulletRun final : public Run {
 public:
  BulletRun(const Scene& scene, const EngineChoice& choice, std::uint64_t first_step)
      : choice_(choice),
        step_(first_step),
        solver_(make_solver(choice)),
        world_(make_world(scene)) {
    apply_choice();
  }

  void step() override {
    solver_->reset_stats();  // so that they tell who solved this step
    world_.step();
    ++step_;
  }

  Moment moment() override { return moment_of(world_, step_); }

  EngineChoice choice() const override { return choice_; }
  bool switch_to(const EngineChoice& choice) override {
    if (choice.engine == EngineKind::native || choice.threads != choice_.threads) return false;
    if (choice.backend != choice_.backend) {
      auto solver = make_solver(choice);
      collider_->exchange(make_sphere_collider(collider_options(choice)));
      solver_ = std::move(solver);  // impulses to start from are in the manifolds
    }
    choice_ = choice;
    apply_choice();
    return true;
  }

 private:
  static std::unique_ptr<bullet::ConstraintSolver> make_solver(const EngineChoice& choice) {
    return std::make_unique<bullet::ConstraintSolver>(world_options(choice).solve);
  }

  bullet::SceneWorld make_world(const Scene& scene) {
    bullet::SceneWorldOptions options = world_options(choice_);
    options.solver = bullet::SolverKind::stock;  // solver_ takes its place
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
      return jfpx && choice_.engine == EngineKind::bullet ? choice_.minimum_batch
                                                          : std::numeric_limits<std::size_t>::max();
    };
    world_.jfpx_dispatcher()->set_minimum_batch(least(true));
    solver_->set_minimum_batch(least(choice_.jfpx_solver));
    world_.world().setConstraintSolver(solver_.get());
    dynamic_cast<bullet::DynamicsWorld&>(world_.world())
        .set_minimum_batch(least(choice_.jfpx_world));
  }

  EngineChoice choice_;
  std::uint64_t step_;
  ExchangeableCollider* collider_ = nullptr;  // owned by the world
  std::unique_ptr<bullet::ConstraintSolver> solver_;
  bullet::SceneWorld world_;
};

}  // namespace

bullet::SceneWorldOptions world_options(const EngineChoice& choice) {
  bullet::SceneWorldOptions options;
  options.dispatch.collider = collider_options(choice);
  options.solve.backend = choice.backend;
  options.solve.threads = options.step.threads = choice.threads;
  return options;
}

bool has_engine(EngineKind) { return true; }

std::unique_ptr<Run> detail::make_bullet_run(const Scene& scene, const EngineChoice& choice,
                                             std::uint64_t first_step) {
  return std::make_unique<BulletRun>(scene, choice, first_step);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
