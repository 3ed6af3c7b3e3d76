/// Runs a world with jfpx beside the same world in stock Bullet, compares them after every step,
/// and prints what jfpx has computed and what it has left to Bullet's code.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/bullet/verify.hpp>

#include <btBulletDynamicsCommon.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string_view>
#include <vector>

namespace {

/// The bodies of the program: a pile of spheres and boxes.
class Bodies {
 public:
  explicit Bodies(btDiscreteDynamicsWorld* world) : world_(world) {
    add(0, &ground_, btVector3(0, -1, 0));
    for (int i = 0; i < 600; ++i) {
      const int column = i % 8, row = i / 8 % 8, layer = i / 64;
      const btVector3 cell{btScalar(column), btScalar(layer), btScalar(row)};
      btCollisionShape* shape = i % 5 == 0 ? static_cast<btCollisionShape*>(&box_) : &sphere_;
      add(1, shape, cell * btScalar(0.9) + btVector3(cell.y() * btScalar(0.1), btScalar(0.5), 0));
    }
  }
  ~Bodies() {
    for (const auto& body : bodies_) world_->removeRigidBody(body.get());
  }
  Bodies(const Bodies&) = delete;
  Bodies& operator=(const Bodies&) = delete;

 private:
  void add(btScalar mass, btCollisionShape* shape, const btVector3& position) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    bodies_.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, inertia));
    bodies_.back()->setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), position));
    world_->addRigidBody(bodies_.back().get());
  }

  btDiscreteDynamicsWorld* world_;
  btBoxShape ground_{btVector3(50, 1, 50)},
      box_{btVector3(btScalar(0.4), btScalar(0.4), btScalar(0.4))};
  btSphereShape sphere_{btScalar(0.5)};
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

void print_count(std::string_view what, unsigned long long count) {
  if (count > 0) std::printf("  %.*s: %llu\n", static_cast<int>(what.size()), what.data(), count);
}

void print_statistics(const jfpx::bullet::CollisionDispatcher& dispatcher,
                      const jfpx::bullet::ConstraintSolver& solver) {
  using jfpx::bullet::Fallback, jfpx::bullet::OrderReason, jfpx::bullet::SolverFallback;
  const jfpx::bullet::DispatchStats& stats = dispatcher.stats();
  const jfpx::bullet::ConstraintSolverStats& solved = solver.stats();
  if (!stats.warning.empty()) std::printf("%s\n", stats.warning.c_str());

  std::printf("dispatches: %llu by jfpx, the others by Bullet\n",
              static_cast<unsigned long long>(stats.batches));
  for (std::size_t i = 0; i < stats.fallbacks.size(); ++i)
    print_count(to_string(static_cast<Fallback>(i)), stats.fallbacks[i]);
  std::printf("of these in Bullet's order, which is slower: %llu\n",
              static_cast<unsigned long long>(stats.batches - stats.ordered[0]));
  for (std::size_t i = 1; i < stats.ordered.size(); ++i)
    print_count(to_string(static_cast<OrderReason>(i)), stats.ordered[i]);
  std::printf("groups: %llu solved by jfpx, the others by Bullet\n",
              static_cast<unsigned long long>(solved.groups));
  for (std::size_t i = 0; i < solved.fallbacks.size(); ++i)
    print_count(to_string(static_cast<SolverFallback>(i)), solved.fallbacks[i]);
}

}  // namespace

int main() {
  btDefaultCollisionConfiguration stock_configuration, configuration;
  btCollisionDispatcher stock_dispatcher(&stock_configuration);
  btDbvtBroadphase stock_broadphase, broadphase;
  btSequentialImpulseConstraintSolver stock_solver;
  btDiscreteDynamicsWorld stock_world(&stock_dispatcher, &stock_broadphase, &stock_solver,
                                      &stock_configuration);
  jfpx::bullet::CollisionDispatcher dispatcher(&configuration);
  jfpx::bullet::ConstraintSolver solver;
  jfpx::bullet::DynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  const Bodies stock_bodies(&stock_world), bodies(&world);

  jfpx::bullet::ContactCheck contacts;
  for (std::uint64_t step = 1; step <= 120; ++step) {
    contacts.capture(stock_world);
    stock_world.stepSimulation(btScalar(1) / 60, 0);
    world.stepSimulation(btScalar(1) / 60, 0);
    contacts.compare(stock_world, step);
    if (const auto difference = jfpx::bullet::first_difference(stock_world, world, step)) {
      std::printf("%s\n", to_text(*difference).c_str());
      return 1;
    }
  }
  print_statistics(dispatcher, solver);
  std::printf("no difference; %llu contacts compared with SphereCollider, %llu different\n",
              static_cast<unsigned long long>(contacts.compared()),
              static_cast<unsigned long long>(contacts.mismatches()));
  return contacts.mismatches() == 0 ? 0 : 1;
}
