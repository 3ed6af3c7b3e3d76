/// Steps of scenes of each kind, without and with code of the user in the dispatch, in stock Bullet
/// and with the three classes of jfpx, in turn. Times are CPU time of the thread with one thread,
/// else wall clock. A ratio is the median over the steps of jfpx / stock, so a value below 1 means
/// that jfpx is faster.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/bullet/verify.hpp>
#include <jfpx/random.hpp>

#include "bench/bullet/series.hpp"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr int kSide = 15;  ///< bodies along an edge of the cube from which they fall

enum class Scene {
  spheres,
  wrapped_spheres,  ///< each is the only child of a compound
  spheres_and_boxes,
  spheres_and_boxes_on_terrain,
  pairs_of_spheres,  ///< compounds of two children
  boxes,
  hulls,
};
enum class UserCode { none, added, started_and_ended, processed, filter, near, near_of_jfpx };

bool soften(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
            const btCollisionObjectWrapper*, int, int) {
  point.m_combinedFriction *= btScalar(0.9);
  return true;
}
std::size_t g_calls = 0;
void count_manifold(btPersistentManifold* const&) { ++g_calls; }
bool count_point(btManifoldPoint&, void*, void*) {
  ++g_calls;
  return true;
}
void pass_on(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
             const btDispatcherInfo& info) {
  ++g_calls;
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}
void pass_on_to_jfpx(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                     const btDispatcherInfo& info) {
  ++g_calls;
  CollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}
/// A dispatcher that ignores pairs of some bodies.
template <class Base>
class Filter final : public Base {
 public:
  using Base::Base;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    if (a->getUserIndex() == 1 && b->getUserIndex() == 1) return false;
    return Base::needsCollision(a, b);
  }
};

void set_callbacks(UserCode code) {
  gContactAddedCallback = code == UserCode::added ? soften : nullptr;
  gContactStartedCallback = code == UserCode::started_and_ended ? count_manifold : nullptr;
  gContactEndedCallback = code == UserCode::started_and_ended ? count_manifold : nullptr;
  gContactProcessedCallback = code == UserCode::processed ? count_point : nullptr;
}

/// A heap in a box without a lid, in a world of Bullet's or of jfpx's classes.
class HeapWorld {
 public:
  /// @param threads 0: stock Bullet
  HeapWorld(Scene scene, UserCode code, unsigned threads) {
    const bool filters = code == UserCode::filter;
    if (threads == 0) {
      dispatcher_ = make<btCollisionDispatcher>(filters, &configuration_);
      solver_ = std::make_unique<btSequentialImpulseConstraintSolver>();
      world_ = std::make_unique<btDiscreteDynamicsWorld>(dispatcher_.get(), &broadphase_,
                                                         solver_.get(), &configuration_);
    } else {
      dispatcher_ = make<CollisionDispatcher>(
          filters, &configuration_,
          DispatcherOptions{.collider = {.backend = Backend::cpu, .threads = threads}});
      solver_ = std::make_unique<ConstraintSolver>(
          ConstraintSolverOptions{.backend = Backend::cpu, .threads = threads});
      world_ = std::make_unique<DynamicsWorld>(dispatcher_.get(), &broadphase_, solver_.get(),
                                               &configuration_,
                                               DynamicsWorldOptions{.threads = threads});
    }
    if (code == UserCode::near) dispatcher_->setNearCallback(pass_on);
    if (code == UserCode::near_of_jfpx) dispatcher_->setNearCallback(pass_on_to_jfpx);
    make_walls(scene == Scene::spheres_and_boxes_on_terrain);
    make_bodies(scene, code == UserCode::added);
  }
  ~HeapWorld() {
    for (const auto& body : bodies_) world_->removeRigidBody(body.get());
  }
  HeapWorld(const HeapWorld&) = delete;
  HeapWorld& operator=(const HeapWorld&) = delete;

  void step() { world_->stepSimulation(btScalar(1) / 60, 0); }
  btDiscreteDynamicsWorld& world() { return *world_; }

 private:
  template <class Dispatcher, class... Arguments>
  static std::unique_ptr<btCollisionDispatcher> make(bool filters, const Arguments&... arguments) {
    if (filters) return std::make_unique<Filter<Dispatcher>>(arguments...);
    return std::make_unique<Dispatcher>(arguments...);
  }
  btRigidBody* add(btCollisionShape* shape, btScalar mass, const btVector3& position) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform.setOrigin(position);
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    world_->addRigidBody(bodies_.back().get());
    return bodies_.back().get();
  }
  template <class Shape>
  Shape* keep(Shape* shape) {
    shapes_.emplace_back(shape);
    return shape;
  }

  void make_walls(bool terrain) {
    if (terrain) {
      const int points = 2 * static_cast<int>(kHalf) + 9;
      Random random(3);
      for (int i = 0; i < points * points; ++i) heights_.push_back(random.uniform(0, Real(0.7)));
      add(keep(new btHeightfieldTerrainShape(points, points, heights_.data(), 1, -1, 1, 1,
                                             sizeof(btScalar) == 8 ? PHY_DOUBLE : PHY_FLOAT,
                                             false)),
          0, btVector3(0, -1, 0));
    } else {
      add(keep(new btBoxShape(btVector3(kHalf + 2, 1, kHalf + 2))), 0, btVector3(0, -1, 0));
    }
    for (const btScalar side : {btScalar(-1), btScalar(1)}) {
      add(keep(new btBoxShape(btVector3(1, 100, kHalf + 2))), 0,
          btVector3(side * (kHalf + 1), 0, 0));
      add(keep(new btBoxShape(btVector3(kHalf + 2, 100, 1))), 0,
          btVector3(0, 0, side * (kHalf + 1)));
    }
  }
  void make_bodies(Scene scene, bool custom_material) {
    auto* sphere = keep(new btSphereShape(btScalar(0.5)));
    auto* box = keep(new btBoxShape(btVector3(btScalar(0.4), btScalar(0.5), btScalar(0.45))));
    auto* hull = keep(new btConvexHullShape());
    for (const btScalar x : {btScalar(-0.4), btScalar(0.5)}) {
      for (const btVector3& point : {btVector3(x, btScalar(0.1), 0), btVector3(0, x, btScalar(0.1)),
                                     btVector3(btScalar(0.1), 0, x)}) {
        hull->addPoint(point);
      }
    }
    auto* wrapped = keep(new btCompoundShape());
    wrapped->addChildShape(btTransform::getIdentity(), sphere);
    auto* two = keep(new btCompoundShape());
    for (const btScalar x : {btScalar(-0.3), btScalar(0.3)}) {
      two->addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(x, 0, 0)), sphere);
    }
    Random random(7);
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      btCollisionShape* shape = i % 2 == 0 ? static_cast<btCollisionShape*>(sphere) : box;
      if (scene == Scene::spheres) shape = sphere;
      if (scene == Scene::wrapped_spheres) shape = wrapped;
      if (scene == Scene::pairs_of_spheres) shape = two;
      if (scene == Scene::boxes) shape = box;
      if (scene == Scene::hulls) shape = hull;
      const auto along = [&](int place) {
        return btScalar(1.1) * btScalar(place) - kHalf + btScalar(0.7) +
               random.uniform(0, Real(0.1));
      };
      const btScalar x = along(i % kSide), z = along(i / kSide % kSide);
      const btScalar y = btScalar(1.1) * btScalar(i / kSide / kSide) + btScalar(0.6);
      btRigidBody* body = add(shape, 1, btVector3(x, y, z));
      body->setActivationState(DISABLE_DEACTIVATION);
      body->setUserIndex(i % 50 == 0 ? 1 : 0);
      if (custom_material) {
        body->setCollisionFlags(body->getCollisionFlags() |
                                btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
      }
    }
  }

  static constexpr btScalar kHalf = btScalar(0.55) * kSide + btScalar(0.2);
  std::vector<btScalar> heights_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  btDefaultCollisionConfiguration configuration_;
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btCollisionDispatcher> dispatcher_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
};

void step_heap(benchmark::State& state, Scene scene, UserCode code) {
  set_callbacks(code);
  HeapWorld stock(scene, code, 0);
  HeapWorld ours(scene, code, static_cast<unsigned>(state.range(0)));
  compare_steps(state, &stock, &ours);
  set_callbacks(UserCode::none);
}

void register_all() {
  const auto add = [](const std::string& name, Scene scene, UserCode code) {
    benchmark::RegisterBenchmark(name.c_str(),
                                 [=](benchmark::State& state) { step_heap(state, scene, code); })
        ->ArgName("threads")
        ->Arg(1)
        ->Arg(2)
        ->Iterations(120)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  };
  using enum Scene;
  using enum UserCode;
  add("spheres/none", spheres, none);
  add("spheres/added", spheres, added);
  add("spheres/started_and_ended", spheres, started_and_ended);
  add("spheres/processed", spheres, processed);
  add("spheres/filter", spheres, filter);
  add("spheres/near", spheres, near);
  add("spheres/near_of_jfpx", spheres, near_of_jfpx);
  add("wrapped_spheres/none", wrapped_spheres, none);
  add("wrapped_spheres/filter", wrapped_spheres, filter);
  add("spheres_and_boxes/none", spheres_and_boxes, none);
  add("spheres_and_boxes/filter", spheres_and_boxes, filter);
  add("terrain/none", spheres_and_boxes_on_terrain, none);
  add("terrain/added", spheres_and_boxes_on_terrain, added);
  add("terrain/filter", spheres_and_boxes_on_terrain, filter);
  add("pairs_of_spheres/none", pairs_of_spheres, none);
  add("boxes/none", boxes, none);
  add("hulls/none", hulls, none);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bullet::run_benchmarks(argc, argv, jfpx::bullet::register_all);
}
