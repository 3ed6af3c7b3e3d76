/// Two equal Bullet worlds, one with Bullet's dispatcher and one with ours, that are stepped side
/// by side and compared after every step.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/verify.hpp>
#include <jfpx/random.hpp>

#include "src/base/sanitizers.hpp"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// A new seed for a random test, or the seed in JFPX_TEST_SEED.
inline std::uint64_t test_seed() {
  const char* fixed = std::getenv("JFPX_TEST_SEED");
  return fixed != nullptr ? std::strtoull(fixed, nullptr, 0) : std::random_device{}();
}

/// A special or extreme value.
inline Real random_extreme(Random& random) {
  using Limits = std::numeric_limits<Real>;
  constexpr Real kExtremes[] = {
      Real(0),        -Real(0),           Limits::denorm_min(), Limits::min(), Limits::max(),
      -Limits::max(), Limits::infinity(), Limits::quiet_NaN(),  Real(1e6),     Real(1e-6)};
  return kExtremes[random.below(std::size(kExtremes))];
}

/// Number of steps of random worlds to run; JFPX_TEST_WORLD_STEPS overrides it.
inline std::uint64_t world_steps_to_run(std::uint64_t in_slow_builds, std::uint64_t otherwise) {
  const char* setting = std::getenv("JFPX_TEST_WORLD_STEPS");
  if (setting != nullptr) return std::strtoull(setting, nullptr, 0);
#if defined(NDEBUG)
  constexpr bool kSlow = kAddressSanitizer || kThreadSanitizer;
#else
  constexpr bool kSlow = true;
#endif
  return kSlow ? in_slow_builds : otherwise;
}

/// Factories of the parts of a world that a test may replace.
struct WorldParts {
  std::function<std::unique_ptr<btSequentialImpulseConstraintSolver>()> solver = [] {
    return std::make_unique<btSequentialImpulseConstraintSolver>();
  };
  std::function<std::unique_ptr<btDiscreteDynamicsWorld>(
      btDispatcher*, btBroadphaseInterface*, btConstraintSolver*, btCollisionConfiguration*)>
      world = [](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                 btConstraintSolver* constraint_solver, btCollisionConfiguration* configuration) {
        return std::make_unique<btDiscreteDynamicsWorld>(dispatcher, broadphase, constraint_solver,
                                                         configuration);
      };
};

/// A Bullet world that owns all of its parts. The dispatcher is created by a function, because it
/// needs the configuration.
struct BulletWorld {
  using MakeDispatcher =
      std::function<std::unique_ptr<btCollisionDispatcher>(btCollisionConfiguration*)>;
  using MakeBroadphase = std::function<std::unique_ptr<btBroadphaseInterface>()>;

  BulletWorld(std::unique_ptr<btCollisionConfiguration> c, const MakeDispatcher& make_dispatcher,
              std::unique_ptr<btBroadphaseInterface> b, const WorldParts& parts = {})
      : configuration(std::move(c)),
        dispatcher(make_dispatcher(configuration.get())),
        broadphase(std::move(b)),
        solver(parts.solver()),
        made_world(
            parts.world(dispatcher.get(), broadphase.get(), solver.get(), configuration.get())) {}
  ~BulletWorld() {
    for (const auto& joint : joints) world.removeConstraint(joint.get());
    for (int i = world.getNumCollisionObjects() - 1; i >= 0; --i) {
      world.removeCollisionObject(world.getCollisionObjectArray()[i]);
    }
    // The predictive contacts of the last step, which Bullet's world does not release.
    while (dispatcher->getNumManifolds() > 0) {
      dispatcher->releaseManifold(dispatcher->getManifoldByIndexInternal(0));
    }
  }

  btCollisionShape* keep(btCollisionShape* shape) {
    shapes.emplace_back(shape);
    return shape;
  }
  /// Adds a body; mass 0 is static.
  btRigidBody* add(btCollisionShape* shape, const btVector3& position, btScalar mass = 1) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, inertia));
    btRigidBody* body = bodies.back().get();
    btTransform pose;
    pose.setIdentity();
    pose.setOrigin(position);
    body->setWorldTransform(pose);
    body->setInterpolationWorldTransform(pose);
    body->setUserIndex(static_cast<int>(bodies.size()) - 1);
    world.addRigidBody(body);
    return body;
  }
  btRigidBody* add_sphere(btScalar radius, const btVector3& position, btScalar mass = 1) {
    return add(keep(new btSphereShape(radius)), position, mass);
  }
  CollisionDispatcher* ours() { return dynamic_cast<CollisionDispatcher*>(dispatcher.get()); }

  std::unique_ptr<btCollisionConfiguration> configuration;
  std::unique_ptr<btCollisionDispatcher> dispatcher;
  std::unique_ptr<btBroadphaseInterface> broadphase;
  std::unique_ptr<btSequentialImpulseConstraintSolver> solver;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btCollisionObject>> objects;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<std::unique_ptr<btTypedConstraint>> joints;  ///< destroyed before the bodies
  std::unique_ptr<btDiscreteDynamicsWorld> made_world;
  btDiscreteDynamicsWorld& world = *made_world;
  std::vector<std::string> log;  ///< calls of callbacks for this world
};

/// The world whose step is running; global callbacks write into its log.
inline BulletWorld* g_current = nullptr;

inline void log_event(std::string text) {
  if (g_current != nullptr) g_current->log.push_back(std::move(text));
}
/// Every bit of a number.
inline std::string bits_of(btScalar value) {
  char text[32];
  std::snprintf(text, sizeof text, "%a", static_cast<double>(value));
  return text;
}
inline std::string bits_of(const btVector3& v) {
  return bits_of(v.x()) + "," + bits_of(v.y()) + "," + bits_of(v.z());
}
inline std::string name_of(const btCollisionObject* body) {
  return std::to_string(body->getUserIndex());
}

struct TwinOptions {
  BulletWorld::MakeDispatcher stock = [](btCollisionConfiguration* c) {
    return std::make_unique<btCollisionDispatcher>(c);
  };
  BulletWorld::MakeDispatcher ours = [](btCollisionConfiguration* c) {
    return std::make_unique<CollisionDispatcher>(c, DispatcherOptions{.minimum_batch = 0});
  };
  BulletWorld::MakeBroadphase broadphase = [] { return std::make_unique<btDbvtBroadphase>(); };
  btDefaultCollisionConstructionInfo configuration = {};
  WorldParts parts;  ///< of our world
};

class Twins {
 public:
  explicit Twins(const TwinOptions& options = {})
      : stock_(std::make_unique<btDefaultCollisionConfiguration>(options.configuration),
               options.stock, options.broadphase()),
        ours_(std::make_unique<btDefaultCollisionConfiguration>(options.configuration),
              options.ours, options.broadphase(), options.parts) {}
  ~Twins() { g_current = nullptr; }

  BulletWorld& stock() { return stock_; }
  BulletWorld& ours() { return ours_; }
  const DispatchStats& stats() { return ours_.ours()->stats(); }

  /// Applies an action to both worlds.
  template <class Action>
  void both(Action action) {
    for (BulletWorld* world : {&stock_, &ours_}) {
      g_current = world;
      action(*world);
    }
    g_current = nullptr;
  }

  /// Steps both and compares worlds and logs. Returns false after a failure.
  bool step(int steps = 1) {
    for (int i = 0; i < steps; ++i) {
      both([](BulletWorld& w) { w.world.stepSimulation(btScalar(1) / 60, 0); });
      ++step_;
      if (!compare()) return false;
    }
    return true;
  }
  /// Runs only the dispatch, for the current bodies.
  bool dispatch() {
    both([](BulletWorld& w) {
      w.dispatcher->dispatchAllCollisionPairs(w.world.getPairCache(), w.world.getDispatchInfo(),
                                              w.dispatcher.get());
    });
    return compare();
  }
  bool compare() {
    const auto difference = first_difference(stock_.world, ours_.world, step_);
    if (difference) {
      ADD_FAILURE() << to_text(*difference);
      return false;
    }
    EXPECT_EQ(stock_.log, ours_.log) << "in step " << step_;
    return stock_.log == ours_.log;
  }
  std::uint64_t steps() const { return step_; }

 private:
  BulletWorld stock_, ours_;
  std::uint64_t step_ = 0;
};

/// A heap of spheres of several radii above a static box, close enough to touch all the time.
inline void add_heap(BulletWorld& w, int count, std::uint64_t seed, btScalar edge = 3) {
  Random random(seed);
  w.add(w.keep(new btBoxShape(btVector3(50, 1, 50))), btVector3(0, -1, 0), 0);
  for (int i = 0; i < count; ++i) {
    const Vec3 p = random.uniform_in_box({0, 0, 0}, {edge, edge, edge});
    const Real radius = random.uniform(Real(0.2), Real(0.6));
    w.add_sphere(radius, btVector3(p.x, p.y + Real(0.6), p.z));
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
