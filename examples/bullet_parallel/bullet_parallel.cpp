/// The same pile on one thread, and on all cores and a GPU where that is faster. The final
/// positions are bit-identical; the second run prints the chosen backend and the reason.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include <btBulletDynamicsCommon.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string_view>
#include <vector>

namespace {

/// Drops 12,000 balls and returns the final position of the last one.
btVector3 let_fall(btDiscreteDynamicsWorld& world) {
  btStaticPlaneShape ground_shape(btVector3(0, 1, 0), 0);
  btSphereShape sphere_shape(btScalar(0.5));
  btVector3 inertia;
  sphere_shape.calculateLocalInertia(1, inertia);
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  bodies.push_back(std::make_unique<btRigidBody>(0, nullptr, &ground_shape));
  for (int i = 0; i < 12000; ++i) {
    bodies.push_back(std::make_unique<btRigidBody>(1, nullptr, &sphere_shape, inertia));
    const int layer = i / 1600, row = i / 40 % 40;
    const btVector3 cell{btScalar(i % 40), btScalar(layer), btScalar(row)};
    bodies.back()->getWorldTransform().setOrigin(
        cell * btScalar(0.97) + btVector3(cell.y() * btScalar(0.1), btScalar(0.5), 0));
  }
  for (const auto& body : bodies) world.addRigidBody(body.get());
  for (int step = 0; step < 15; ++step) world.stepSimulation(btScalar(1) / 60, 1);
  const btVector3 last = bodies.back()->getWorldTransform().getOrigin();
  for (const auto& body : bodies) world.removeRigidBody(body.get());
  return last;
}

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

btVector3 on_one_thread() {
  btDefaultCollisionConfiguration configuration;
  jfpx::bullet::CollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  jfpx::bullet::ConstraintSolver solver;
  jfpx::bullet::DynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  return let_fall(world);
}

btVector3 on_all_cores() {
  btDefaultCollisionConfiguration configuration;
  btDbvtBroadphase broadphase;
  // 0 threads: one per core. Backend::automatic, the default, takes a GPU where that has been
  // faster; Backend::cuda insists on one.
  jfpx::bullet::CollisionDispatcher dispatcher(
      &configuration, {.collider = {.backend = jfpx::Backend::automatic, .threads = 0}});
  jfpx::bullet::ConstraintSolver solver({.backend = jfpx::Backend::automatic, .threads = 0});
  jfpx::bullet::DynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration,
                                    {.threads = 0});
  const btVector3 last = let_fall(world);
  const std::string_view by = to_string(dispatcher.backend()), why = to_string(dispatcher.reason());
  std::printf("contacts by %.*s (%.*s); %llu of %llu groups solved on a GPU\n",
              static_cast<int>(by.size()), by.data(), static_cast<int>(why.size()), why.data(),
              static_cast<unsigned long long>(solver.stats().on_device),
              static_cast<unsigned long long>(solver.stats().groups));
  return last;
}

}  // namespace

int main() {
  const auto begin = std::chrono::steady_clock::now();
  const btVector3 first = on_one_thread();
  const double one_ms = milliseconds_since(begin);
  const auto again = std::chrono::steady_clock::now();
  const btVector3 second = on_all_cores();
  const double all_ms = milliseconds_since(again);
  std::printf("one thread %.0f ms, all cores %.0f ms\n", one_ms, all_ms);
  const bool same = first.x() == second.x() && first.y() == second.y() && first.z() == second.z();
  std::printf("the last ball lies at (%.9g, %.9g, %.9g): %s\n", double(first.x()),
              double(first.y()), double(first.z()), same ? "both times" : "NOT the second time");
  return same ? 0 : 1;
}
