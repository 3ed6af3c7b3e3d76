/// What a program does with a world around its steps: stock and ours call, find and move the same.
#include "tests/bullet/all_parts.hpp"

#include <BulletDynamics/Vehicle/btRaycastVehicle.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Heaps of spheres and boxes.
void add_town(BulletWorld& w, std::uint64_t seed) {
  add_heap(w, 80, seed);
  btCollisionShape* crate =
      w.keep(new btBoxShape(btVector3(btScalar(0.3), btScalar(0.3), btScalar(0.3))));
  for (int i = 0; i < 40; ++i) {
    w.add(crate, btVector3(btScalar(i % 5) - 3, btScalar(0.3) + btScalar(0.61) * btScalar(i / 5),
                           btScalar(-1.5)));
  }
}

/// Wind in every substep.
void before_tick(btDynamicsWorld* world, btScalar dt) {
  log_event("before " + bits_of(dt) + " " +
            std::to_string(world->getDispatcher()->getNumManifolds()));
  for (int i = 0; i < world->getNumCollisionObjects(); i += 3) {
    auto* body = btRigidBody::upcast(world->getCollisionObjectArray()[i]);
    if (body != nullptr && body->isActive()) body->applyCentralForce({2, 0, btScalar(0.5)});
  }
}

/// Contacts after a substep, as a game plays sounds of impacts, and a shot.
void after_tick(btDynamicsWorld* world, btScalar dt) {
  log_event("after " + bits_of(dt));
  for (int i = 0; i < world->getDispatcher()->getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *world->getDispatcher()->getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      if (point.getAppliedImpulse() < 1) continue;
      log_event(name_of(manifold.getBody0()) + " hits " + name_of(manifold.getBody1()) + " " +
                bits_of(point.getAppliedImpulse()) + " " + bits_of(point.getPositionWorldOnB()));
    }
  }
  auto* body = btRigidBody::upcast(world->getCollisionObjectArray()[1]);
  body->activate();
  body->applyCentralImpulse({0, btScalar(0.3), 0});
}

TEST(TickCallbacks, SeeAndChangeTheSameWorldInEverySubstep) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both([&](BulletWorld& w) {
      add_town(w, seed);
      w.world.setInternalTickCallback(before_tick, nullptr, true);
      w.world.setInternalTickCallback(after_tick);
    });
    Random random(seed);
    for (int frame = 0; frame < 60; ++frame) {
      const btScalar time = random.uniform(0, Real(0.05));
      twins.both([&](BulletWorld& w) { w.world.stepSimulation(time, 4, btScalar(1) / 120); });
      ASSERT_TRUE(twins.compare()) << "in frame " << frame << ", " << threads << " threads";
    }
    EXPECT_GT(twins.ours().log.size(), 200u);
    EXPECT_GT(twins.stats().batches, 60u);
  }
}

/// Logs every hit, in the order of the calls.
struct LoggedRay : btCollisionWorld::RayResultCallback {
  btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool in_world) override {
    log_event("ray " + name_of(result.m_collisionObject) + " " + bits_of(result.m_hitFraction) +
              " " + bits_of(result.m_hitNormalLocal) + (in_world ? " world" : ""));
    return nearest ? m_closestHitFraction = result.m_hitFraction : m_closestHitFraction;
  }
  bool nearest = false;
};

struct LoggedSweep : btCollisionWorld::ConvexResultCallback {
  btScalar addSingleResult(btCollisionWorld::LocalConvexResult& result, bool in_world) override {
    log_event("sweep " + name_of(result.m_hitCollisionObject) + " " +
              bits_of(result.m_hitFraction) + " " + bits_of(result.m_hitNormalLocal) + " " +
              bits_of(result.m_hitPointLocal) + (in_world ? " world" : ""));
    return nearest ? m_closestHitFraction = result.m_hitFraction : m_closestHitFraction;
  }
  bool nearest = false;
};

void ask(BulletWorld& w, Random random) {
  btBoxShape box(btVector3(btScalar(0.2), btScalar(0.1), btScalar(0.3)));
  btSphereShape ball(btScalar(0.25));
  for (int i = 0; i < 12; ++i) {
    const Vec3 p = random.uniform_in_box({-4, 0, -4}, {4, 5, 4});
    const Vec3 q = random.uniform_in_box({-4, 0, -4}, {4, 5, 4});
    const btVector3 from(p.x, p.y, p.z), to(q.x, q.y, q.z);
    LoggedRay ray;
    ray.nearest = i % 2 == 0;
    w.world.rayTest(from, to, ray);
    LoggedSweep sweep;
    sweep.nearest = i % 3 == 0;
    const btConvexShape& shape = i % 2 == 0 ? static_cast<btConvexShape&>(box) : ball;
    w.world.convexSweepTest(&shape, btTransform(btQuaternion::getIdentity(), from),
                            btTransform(btQuaternion(btVector3(0, 1, 0), 1), to), sweep);
  }
}

TEST(Queries, BetweenStepsFindTheSameInTheSameOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    // Enough bodies for the parallel update of the AABBs.
    twins.both([&](BulletWorld& w) {
      add_town(w, seed);
      Random random(seed);
      btCollisionShape* ball = w.keep(new btSphereShape(btScalar(0.3)));
      for (int i = 0; i < 250; ++i) {
        const Vec3 p = random.uniform_in_box({-4, 0, -4}, {4, 6, 4});
        w.add(ball, btVector3(p.x, p.y, p.z));
      }
    });
    for (std::uint64_t step = 0; step < 60; ++step) {
      ASSERT_TRUE(twins.step()) << threads << " threads";
      twins.both([&](BulletWorld& w) { ask(w, Random(seed + step)); });
      ASSERT_TRUE(twins.compare()) << threads << " threads";
    }
    EXPECT_GT(twins.ours().log.size(), 1000u);
  }
}

/// A car with four wheels, which is driven by an action of the world.
class Car {
 public:
  explicit Car(BulletWorld* w) : world_(w), caster_(&w->world) {
    auto* chassis = new btBoxShape(btVector3(btScalar(0.8), btScalar(0.25), btScalar(1.6)));
    body_ = w->add(w->keep(chassis), btVector3(0, btScalar(1.2), -8), 400);
    body_->setActivationState(DISABLE_DEACTIVATION);
    vehicle_ = std::make_unique<btRaycastVehicle>(tuning_, body_, &caster_);
    vehicle_->setCoordinateSystem(0, 1, 2);
    for (int wheel = 0; wheel < 4; ++wheel) {
      const btVector3 at(wheel % 2 == 0 ? btScalar(0.8) : btScalar(-0.8), 0,
                         wheel < 2 ? btScalar(1.2) : btScalar(-1.2));
      vehicle_->addWheel(at, {0, -1, 0}, {-1, 0, 0}, btScalar(0.5), btScalar(0.4), tuning_,
                         wheel < 2);
    }
    w->world.addVehicle(vehicle_.get());
  }
  ~Car() { world_->world.removeVehicle(vehicle_.get()); }
  Car(const Car&) = delete;
  Car& operator=(const Car&) = delete;

  void drive(int step) {
    for (int wheel = 2; wheel < 4; ++wheel) vehicle_->applyEngineForce(1500, wheel);
    for (int wheel = 0; wheel < 2; ++wheel)
      vehicle_->setSteeringValue(btScalar(step % 80 - 40) * btScalar(0.01), wheel);
    if (step > 150) vehicle_->setBrake(30, 0);
  }
  void log() {
    for (int i = 0; i < vehicle_->getNumWheels(); ++i) {
      vehicle_->updateWheelTransform(i, true);
      const btWheelInfo& wheel = vehicle_->getWheelInfo(i);
      const auto* ground = static_cast<btRigidBody*>(wheel.m_raycastInfo.m_groundObject);
      log_event((ground != nullptr ? name_of(ground) : "air") + " " +
                bits_of(wheel.m_worldTransform.getOrigin()) + " " +
                bits_of(wheel.m_wheelsSuspensionForce) + " " + bits_of(wheel.m_rotation) + " " +
                bits_of(wheel.m_skidInfo));
    }
    log_event(bits_of(vehicle_->getCurrentSpeedKmHour()));
  }
  btScalar z() const { return body_->getCenterOfMassPosition().z(); }

 private:
  BulletWorld* world_;
  btRaycastVehicle::btVehicleTuning tuning_;
  btDefaultVehicleRaycaster caster_;
  btRigidBody* body_ = nullptr;
  std::unique_ptr<btRaycastVehicle> vehicle_;
};

TEST(RaycastVehicles, DriveThroughAHeapAsInStockBullet) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both([&](BulletWorld& w) { add_town(w, seed); });
    Car stock(&twins.stock()), ours(&twins.ours());
    for (int step = 0; step < 200; ++step) {
      twins.both([&](BulletWorld& w) { (&w == &twins.ours() ? ours : stock).drive(step); });
      ASSERT_TRUE(twins.step()) << threads << " threads";
      twins.both([&](BulletWorld& w) { (&w == &twins.ours() ? ours : stock).log(); });
      ASSERT_TRUE(twins.compare()) << threads << " threads";
    }
    EXPECT_GT(ours.z(), -6) << "the car must reach the heap";
  }
}

/// Logs what the world writes.
struct LoggedMotion : btMotionState {
  explicit LoggedMotion(const btTransform& start, int index) : pose(start), name(index) {}
  void getWorldTransform(btTransform& out) const override { out = pose; }
  void setWorldTransform(const btTransform& in) override {
    pose = in;
    log_event(std::to_string(name) + " is at " + bits_of(in.getOrigin()));
  }
  btTransform pose;
  int name;
};

TEST(MotionStates, ReceiveTheSameInterpolatedPosesInTheSameOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 3u}) {
    std::vector<std::unique_ptr<LoggedMotion>> states;  // outlive the worlds
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both([&](BulletWorld& w) {
      add_town(w, seed);
      for (auto& body : w.bodies) {
        states.push_back(
            std::make_unique<LoggedMotion>(body->getWorldTransform(), body->getUserIndex()));
        if (body->getUserIndex() % 4 != 3) body->setMotionState(states.back().get());
      }
    });
    Random random(seed);
    for (int frame = 0; frame < 60; ++frame) {
      const btScalar time = random.uniform(0, Real(0.05));
      twins.both([&](BulletWorld& w) { w.world.stepSimulation(time, 3); });
      ASSERT_TRUE(twins.compare()) << "in frame " << frame << ", " << threads << " threads";
    }
    EXPECT_GT(twins.ours().log.size(), 1000u);
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
