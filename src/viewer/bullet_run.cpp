/// Bullet as a run, in which each of the three parts can be replaced at any step.
#include "src/viewer/bullet_run.hpp"

#include "src/viewer/exchangeable_collider.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// Bodies are added in the order of the scene.
BodyId id_of(const btCollisionObject* body) {
  return {static_cast<std::uint32_t>(body->getWorldArrayIndex()), 0};
}

std::vector<Contact> contacts_of(btCollisionDispatcher& dispatcher) {
  std::vector<Contact> contacts;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      const btVector3 middle =
          (point.m_positionWorldOnA + point.m_positionWorldOnB) * btScalar(0.5);
      contacts.push_back({id_of(manifold->getBody0()), id_of(manifold->getBody1()),
                          from_bullet(point.m_normalWorldOnB), from_bullet(middle),
                          point.getDistance()});
    }
  }
  return contacts;
}

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
    solver_->reset_stats();  // limits the statistics to this step
    world_.step();
    ++step_;
  }

  RunState run_state() override { return run_state_of(world_, step_); }

  EngineChoice choice() const override { return choice_; }
  bool switch_to(const EngineChoice& choice) override {
    if (choice.engine == EngineKind::native || choice.threads != choice_.threads) return false;
    if (choice.backend != choice_.backend) {
      auto solver = make_solver(choice);
      collider_->exchange(make_sphere_collider(collider_options(choice)));
      solver_ = std::move(solver);  // the manifolds store the impulses for warm starting
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
    options.solver = bullet::SolverKind::stock;  // replaced by solver_
    options.make_collider = [this] {
      auto collider =
          std::make_unique<ExchangeableCollider>(make_sphere_collider(collider_options(choice_)));
      collider_ = collider.get();
      return collider;
    };
    return bullet::SceneWorld(scene, options);
  }

  // Each of the three parts lets Bullet's own code do work below its minimum batch. The choices
  // therefore differ in three numbers only and share the state of Bullet.
  void apply_choice() {
    const auto minimum = [this](bool jfpx) {
      return jfpx && choice_.engine == EngineKind::bullet ? choice_.minimum_batch
                                                          : std::numeric_limits<std::size_t>::max();
    };
    world_.jfpx_dispatcher()->set_minimum_batch(minimum(true));
    solver_->set_minimum_batch(minimum(choice_.jfpx_solver));
    world_.world().setConstraintSolver(solver_.get());
    dynamic_cast<bullet::DynamicsWorld&>(world_.world())
        .set_minimum_batch(minimum(choice_.jfpx_world));
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

RunState run_state_of(bullet::SceneWorld& world, std::uint64_t step) {
  RunState run_state;
  run_state.step = step;
  run_state.states = world.states();
  for (const btRigidBody* body : world.bodies()) {
    run_state.awake.push_back(body->isActive() || body->isStaticObject() ? 1 : 0);
  }
  run_state.contacts = contacts_of(world.dispatcher());
  run_state.times = tool::stage_times_of_bullet(world.last_step());
  run_state.computed_by = "Bullet";
  if (const bullet::CollisionDispatcher* dispatcher = world.jfpx_dispatcher()) {
    const bullet::DispatchStats& stats = dispatcher->stats();
    if (stats.batches > 0 && stats.last_fallback == bullet::Fallback::none) {
      run_state.computed_by = to_string(dispatcher->backend());
    }
    run_state.trouble = stats.failure;
  }
  run_state.solved_by = "Bullet";
  const auto* solver =
      dynamic_cast<const bullet::ConstraintSolver*>(world.world().getConstraintSolver());
  if (solver != nullptr) {
    const bullet::ConstraintSolverStats& stats = solver->stats();
    if (stats.groups > 0) run_state.solved_by = to_string(Backend::cpu);
    if (stats.on_device > 0) run_state.solved_by = to_string(Backend::cuda);
    if (run_state.trouble.empty()) run_state.trouble = stats.device_failure;
  }
  return run_state;
}

bool has_engine(EngineKind) { return true; }

std::unique_ptr<Run> detail::make_bullet_run(const Scene& scene, const EngineChoice& choice,
                                             std::uint64_t first_step) {
  return std::make_unique<BulletRun>(scene, choice, first_step);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
