/// Bullet worlds with special bodies and settings: stock and ours stay bit-identical.
#include "tests/bullet/all_parts.hpp"

#include <BulletCollision/BroadphaseCollision/btSimpleBroadphase.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <LinearMath/btQuickprof.h>

#include <atomic>
#include <limits>
#include <thread>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TEST(Situations, NoPairsAtAll) {
  Twins twins;
  ASSERT_TRUE(twins.step(3));
  twins.both([](BulletWorld& w) { w.add_sphere(1, btVector3(0, 0, 0)); });
  ASSERT_TRUE(twins.step(3));
  EXPECT_EQ(twins.stats().batches, 0u);
}

TEST(Situations, BodiesComeAndGo) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) { add_heap(w, 80, seed); });
  for (int round = 0; round < 40; ++round) {
    twins.both([&](BulletWorld& w) {
      Random random(seed + static_cast<std::uint64_t>(round));
      const std::size_t victim = 1 + random.below(w.bodies.size() - 1);
      btRigidBody* body = w.bodies[victim].get();
      if (body->getBroadphaseHandle() != nullptr) {
        w.world.removeRigidBody(body);
      } else {
        w.world.addRigidBody(body);
      }
      const Vec3 p = random.uniform_in_box({0, 2, 0}, {3, 4, 3});
      w.add_sphere(random.uniform(Real(0.2), Real(0.6)), btVector3(p.x, p.y, p.z));
    });
    ASSERT_TRUE(twins.step(3));
  }
}

TEST(Situations, SleepersKeepTheirPointsAndWake) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 30, 31);
    for (auto& body : w.bodies) {
      body->setSleepingThresholds(3, 3);
      body->setDamping(btScalar(0.2), btScalar(0.6));
    }
  });
  ASSERT_TRUE(twins.step(250));
  int asleep = 0;
  for (auto& body : twins.ours().bodies) asleep += body->isActive() ? 0 : 1;
  EXPECT_GT(asleep, 10) << "the scene must put bodies to sleep";
  twins.both([](BulletWorld& w) { w.add_sphere(1, btVector3(1, 6, 1), 5); });
  ASSERT_TRUE(twins.step(120));
}

/// Bodies of several shapes that sleep apart on a floor, and some balls that roll among them.
void add_sleepers(BulletWorld& w, std::uint64_t seed, int rolling) {
  Random random(seed);
  w.add(w.keep(new btBoxShape(btVector3(50, 1, 50))), btVector3(0, -1, 0), 0);
  btCollisionShape* const shapes[] = {w.keep(new btSphereShape(btScalar(0.5))),
                                      w.keep(new btBoxShape(btVector3(1, 1, 1) / 2)),
                                      w.keep(new btCapsuleShape(btScalar(0.5), 1))};
  constexpr int kEdge = 18;
  for (int i = 0; i < kEdge * kEdge; ++i) {
    btRigidBody* body =
        w.add(shapes[i % 3], btVector3(btScalar(i % kEdge) * 2, i % 3 == 2 ? 1 : btScalar(0.5),
                                       btScalar(i / kEdge) * 2));
    body->setActivationState(ISLAND_SLEEPING);
  }
  for (int i = 0; i < rolling; ++i) {
    const Vec3 p = random.uniform_in_box({0, 1, 0}, {36, 3, 36});
    w.add_sphere(btScalar(0.4), btVector3(p.x, p.y, p.z))
        ->setLinearVelocity(btVector3(p.z / 4, 0, -p.x / 4));
  }
}

TEST(Situations, AFewBodiesRollAmongSleepers) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const bool deterministic : {false, true}) {
    for (const int rolling : {0, 1, 12}) {
      for (const unsigned threads : {1u, 3u}) {
        Twins twins(all_parts(threads, {.minimum_batch = 100}));
        twins.both([&](BulletWorld& w) {
          w.world.getDispatchInfo().m_deterministicOverlappingPairs = deterministic;
          add_sleepers(w, seed, rolling);
        });
        ASSERT_TRUE(twins.step(100)) << deterministic << rolling << threads;
        EXPECT_EQ(twins.stats().batches, 100u);
      }
    }
  }
}

/// Wakes a body that has not been visited in this dispatch.
bool wake_another(btManifoldPoint&, const btCollisionObjectWrapper* a, int, int,
                  const btCollisionObjectWrapper*, int, int) {
  const int awake = a->getCollisionObject()->getUserIndex();
  g_current->bodies[static_cast<std::size_t>(awake * 7 % 320) + 1]->activate(true);
  return true;
}

TEST(Situations, ACallbackWakesSleepersDuringADispatch) {
  gContactAddedCallback = wake_another;
  Twins twins(all_parts(1, {.minimum_batch = 100}));
  twins.both([&](BulletWorld& w) {
    add_sleepers(w, 5, 3);
    for (auto& body : w.bodies) {
      body->setCollisionFlags(body->getCollisionFlags() |
                              btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    }
  });
  const bool same = twins.step(60);
  gContactAddedCallback = nullptr;
  ASSERT_TRUE(same);
}

TEST(Situations, KinematicPushersSensorsAndIgnoreLists) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 32);
    for (std::size_t i = 1; i < 6; ++i) {
      w.bodies[i]->setCollisionFlags(w.bodies[i]->getCollisionFlags() |
                                     btCollisionObject::CF_NO_CONTACT_RESPONSE);
    }
    for (std::size_t i = 10; i < 30; ++i) {
      w.bodies[i]->setIgnoreCollisionCheck(w.bodies[i + 10].get(), true);
    }
    w.world.removeRigidBody(w.bodies[7].get());
    w.bodies[7]->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    w.bodies[7]->setActivationState(DISABLE_DEACTIVATION);
    w.world.addRigidBody(w.bodies[7].get());
    w.world.removeRigidBody(w.bodies[8].get());
    w.world.addRigidBody(w.bodies[8].get(), 64, btBroadphaseProxy::StaticFilter);
  });
  for (int i = 0; i < 60; ++i) {
    twins.both([&](BulletWorld& w) {
      btTransform pose = w.bodies[7]->getWorldTransform();
      pose.setOrigin(btVector3(btScalar(i) * btScalar(0.05), 1, btScalar(1.5)));
      w.bodies[7]->setWorldTransform(pose);
      if (i == 30) w.bodies[10]->setIgnoreCollisionCheck(w.bodies[20].get(), false);
    });
    ASSERT_TRUE(twins.step());
  }
  EXPECT_GT(twins.stats().written, 0u);
}

TEST(Situations, CompoundsOfSpheresAmongSpheres) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 40, 33);
    for (int i = 0; i < 8; ++i) {
      auto* compound = new btCompoundShape();
      w.keep(compound);
      btTransform at;
      at.setIdentity();
      for (int k = 0; k < 3; ++k) {
        at.setOrigin(btVector3(btScalar(k - 1) * btScalar(0.5), 0, 0));
        compound->addChildShape(at, w.keep(new btSphereShape(btScalar(0.3))));
      }
      w.add(compound, btVector3(btScalar(i % 3), btScalar(1 + i), btScalar(i % 2)));
    }
  });
  ASSERT_TRUE(twins.step(100));
}

TEST(Situations, SpecialMaterialFlags) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 34);
    for (std::size_t i = 0; i < w.bodies.size(); ++i) {
      btRigidBody& body = *w.bodies[i];
      if (i % 3 == 0) body.setContactStiffnessAndDamping(2000, btScalar(0.2));
      if (i % 4 == 0) {
        body.setCollisionFlags(body.getCollisionFlags() |
                               btCollisionObject::CF_HAS_FRICTION_ANCHOR);
      }
      body.setFriction(btScalar(i % 7));  // products above the limit of 10
      body.setRollingFriction(btScalar(0.1) * btScalar(i % 5));
      body.setSpinningFriction(btScalar(-3) * btScalar(i % 3));
      body.setRestitution(btScalar(0.1) * btScalar(i % 11));
      body.setAnisotropicFriction(btVector3(1, btScalar(0.5), btScalar(0.2)),
                                  i % 2 == 0 ? btCollisionObject::CF_ANISOTROPIC_FRICTION : 0);
    }
  });
  ASSERT_TRUE(twins.step(80));
}

TEST(Situations, RadiiChangeByScalingAndDirectly) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 50, 35); });
  for (int round = 1; round <= 10; ++round) {
    twins.both([&](BulletWorld& w) {
      for (std::size_t i = 1; i < w.bodies.size(); i += 2) {
        auto* sphere = static_cast<btSphereShape*>(w.bodies[i]->getCollisionShape());
        if (i % 4 == 1) {
          sphere->setUnscaledRadius(sphere->getRadius() * btScalar(1.01));
        } else {
          const btScalar s = 1 + btScalar(0.02) * btScalar(round);
          sphere->setLocalScaling(btVector3(s, s, s));
        }
      }
    });
    ASSERT_TRUE(twins.step(5));
  }
}

TEST(Situations, ShapesAreExchangedWhileTheirAlgorithmsExist) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 50, 36); });
  ASSERT_TRUE(twins.step(10));
  twins.both([](BulletWorld& w) {
    auto* cache = w.world.getPairCache();
    for (std::size_t i = 1; i < 20; ++i) {
      // As Bullet requires, the pairs are cleaned when the type of the shape changes.
      cache->cleanProxyFromPairs(w.bodies[i]->getBroadphaseHandle(), w.dispatcher.get());
      w.bodies[i]->setCollisionShape(
          w.keep(new btBoxShape(btVector3(btScalar(0.3), btScalar(0.3), btScalar(0.3)))));
    }
  });
  ASSERT_TRUE(twins.step(30));
}

TEST(Situations, ManifoldPoolExhaustedWithoutDynamicAllocation) {
  TwinOptions options;
  options.configuration.m_defaultMaxPersistentManifoldPoolSize = 40;
  options.configuration.m_defaultMaxCollisionAlgorithmPoolSize = 64;
  Twins twins(options);
  twins.both([](BulletWorld& w) {
    // Spheres only: Bullet's other algorithms do not survive a null manifold.
    Random random(37);
    for (int i = 0; i < 40; ++i) {
      const Vec3 p = random.uniform_in_box({0, 0, 0}, {2, 2, 2});
      w.add_sphere(btScalar(0.5), btVector3(p.x, p.y, p.z));
    }
    w.world.setGravity(btVector3(0, 0, 0));
    w.dispatcher->setDispatcherFlags(
        w.dispatcher->getDispatcherFlags() |
        btCollisionDispatcher::CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION);
  });
  ASSERT_TRUE(twins.step(60));
  EXPECT_GT(twins.ours().world.getPairCache()->getNumOverlappingPairs(), 40)
      << "the pool must be exhausted";
}

TEST(Situations, ContinuousCollisionOfBodies) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 40, 38);
    for (std::size_t i = 1; i < w.bodies.size(); i += 3) {
      w.bodies[i]->setCcdMotionThreshold(btScalar(0.01));
      w.bodies[i]->setCcdSweptSphereRadius(btScalar(0.1));
      w.bodies[i]->setLinearVelocity(btVector3(0, -40, 0));
    }
  });
  ASSERT_TRUE(twins.step(60));
}

TEST(Situations, ContactTestsBetweenSteps) {
  struct Report : btCollisionWorld::ContactResultCallback {
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                             const btCollisionObjectWrapper* b, int, int) override {
      log_event("contact " + name_of(a->getCollisionObject()) + " " +
                name_of(b->getCollisionObject()) + " " + std::to_string(point.m_distance1));
      return 0;
    }
  };
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 50, 39); });
  for (int i = 0; i < 30; ++i) {
    twins.both([&](BulletWorld& w) {
      Report report;
      w.world.contactTest(w.bodies[static_cast<std::size_t>(1 + i)].get(), report);
      w.world.contactPairTest(w.bodies[2].get(), w.bodies[3].get(), report);
    });
    ASSERT_TRUE(twins.step());
  }
  EXPECT_FALSE(twins.ours().log.empty());
}

TEST(Situations, GhostObjectsWithPrivatePairCaches) {
  btGhostPairCallback callbacks[2];
  Twins twins;
  int world = 0;
  twins.both([&](BulletWorld& w) {
    w.world.getPairCache()->setInternalGhostPairCallback(&callbacks[world++]);
    add_heap(w, 50, 40);
    auto ghost = std::make_unique<btPairCachingGhostObject>();
    ghost->setCollisionShape(w.keep(new btSphereShape(2)));
    ghost->setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
    btTransform pose;
    pose.setIdentity();
    pose.setOrigin(btVector3(1, 1, 1));
    ghost->setWorldTransform(pose);
    ghost->setUserIndex(1000);
    w.world.addCollisionObject(ghost.get(), btBroadphaseProxy::SensorTrigger,
                               btBroadphaseProxy::AllFilter);
    w.objects.push_back(std::move(ghost));
  });
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(twins.step());
    // As in btKinematicCharacterController, the ghost's own pairs are dispatched several times.
    twins.both([&](BulletWorld& w) {
      auto* ghost = static_cast<btPairCachingGhostObject*>(w.objects[0].get());
      for (int k = 0; k < 3; ++k) {
        btTransform pose = ghost->getWorldTransform();
        pose.setOrigin(pose.getOrigin() + btVector3(btScalar(0.01), 0, 0));
        ghost->setWorldTransform(pose);
        w.dispatcher->dispatchAllCollisionPairs(ghost->getOverlappingPairCache(),
                                                w.world.getDispatchInfo(), w.dispatcher.get());
        btManifoldArray manifolds;
        const auto& pairs = ghost->getOverlappingPairCache()->getOverlappingPairArray();
        for (int p = 0; p < pairs.size(); ++p) {
          manifolds.resize(0);
          if (pairs[p].m_algorithm) pairs[p].m_algorithm->getAllContactManifolds(manifolds);
          for (int m = 0; m < manifolds.size(); ++m) {
            if (manifolds[m]->getNumContacts() == 0) continue;
            log_event("ghost " + name_of(manifolds[m]->getBody0()) + " " +
                      name_of(manifolds[m]->getBody1()) + " " +
                      std::to_string(manifolds[m]->getContactPoint(0).m_distance1));
          }
        }
      }
    });
  }
  ASSERT_TRUE(twins.step());
  EXPECT_FALSE(twins.ours().log.empty());
}

TEST(Situations, SortedPairCache) {
  // It ignores m_deterministicOverlappingPairs; the hashed one does not.
  std::vector<std::unique_ptr<btOverlappingPairCache>> caches;
  for (const bool sorted : {false, true}) {
    for (const bool deterministic : {false, true}) {
      TwinOptions options;
      options.broadphase = [&]() -> std::unique_ptr<btBroadphaseInterface> {
        btOverlappingPairCache* cache = nullptr;
        if (sorted) {
          caches.push_back(std::make_unique<btSortedOverlappingPairCache>());
          cache = caches.back().get();
        }
        return std::make_unique<btSimpleBroadphase>(1000, cache);
      };
      Twins twins(options);
      twins.both([&](BulletWorld& w) {
        add_heap(w, 40, 41);
        w.world.getDispatchInfo().m_deterministicOverlappingPairs = deterministic;
      });
      ASSERT_TRUE(twins.step(40)) << sorted << deterministic;
      EXPECT_EQ(twins.stats().batches, 40u);
    }
  }
}

TEST(Situations, PointsAddedByTheUserAreCleared) {
  // As Bullet's loader does when it restores a saved world. The spheres are apart, so the next
  // dispatch must remove the points.
  Twins twins;
  twins.both([](BulletWorld& w) {
    w.world.setGravity(btVector3(0, 0, 0));
    w.add_sphere(btScalar(0.5), btVector3(0, 0, 0));
    w.add_sphere(btScalar(0.5), btVector3(btScalar(1.01), 0, 0));
  });
  ASSERT_TRUE(twins.step(2));
  twins.both([](BulletWorld& w) {
    btPersistentManifold* manifold = w.dispatcher->getManifoldByIndexInternal(0);
    ASSERT_EQ(manifold->getNumContacts(), 0);
    for (int i = 0; i < 3; ++i) {
      const btVector3 at(btScalar(i), 0, 0);
      manifold->addManifoldPoint(btManifoldPoint(at, at, btVector3(0, 1, 0), btScalar(-0.1)));
    }
  });
  ASSERT_TRUE(twins.dispatch());
  EXPECT_EQ(twins.ours().dispatcher->getManifoldByIndexInternal(0)->getNumContacts(), 0);
}

TEST(Situations, ANegativeBreakingThresholdRefusesShallowPoints) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 40, 42);
    w.world.stepSimulation(btScalar(1) / 60, 0);
    for (int i = 0; i < w.dispatcher->getNumManifolds(); i += 2) {
      w.dispatcher->getManifoldByIndexInternal(i)->setContactBreakingThreshold(btScalar(-0.05));
    }
  });
  ASSERT_TRUE(twins.step(5));
}

TEST(Situations, ManifoldsWhoseBodiesTheUserExchanged) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 40, 45); });
  ASSERT_TRUE(twins.step(2));
  twins.both([](BulletWorld& w) {
    for (int i = 0; i < w.dispatcher->getNumManifolds(); i += 3) {
      btPersistentManifold* manifold = w.dispatcher->getManifoldByIndexInternal(i);
      manifold->setBodies(manifold->getBody1(), manifold->getBody0());
    }
  });
  twins.ours().ours()->set_verify(true);
  ASSERT_TRUE(twins.dispatch());
  EXPECT_GT(twins.stats().verified, 0u);
  EXPECT_EQ(twins.stats().mismatches, 0u) << twins.stats().first_mismatch;
}

/// Adds a pair to the cache in its first call.
template <class Base>
class PairAddingDispatcher : public Base {
 public:
  using Base::Base;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    if (cache != nullptr) std::exchange(cache, nullptr)->addOverlappingPair(first, second);
    log_event("needs " + name_of(a) + " " + name_of(b));
    return Base::needsCollision(a, b);
  }
  btOverlappingPairCache* cache = nullptr;
  btBroadphaseProxy *first = nullptr, *second = nullptr;
};

TEST(Situations, APairAddedDuringTheDispatchIsVisited) {
  TwinOptions options;
  options.stock = [](btCollisionConfiguration* c) {
    return std::make_unique<PairAddingDispatcher<btCollisionDispatcher>>(c);
  };
  options.ours = [](btCollisionConfiguration* c) {
    return std::make_unique<PairAddingDispatcher<CollisionDispatcher>>(
        c, DispatcherOptions{.minimum_batch = 0});
  };
  Twins twins(options);
  const auto arm = [](auto& dispatcher, BulletWorld& w) {
    dispatcher.cache = w.world.getPairCache();
    dispatcher.first = w.bodies[1]->getBroadphaseHandle();
    dispatcher.second = w.bodies[6]->getBroadphaseHandle();
  };
  twins.both([](BulletWorld& w) {
    w.world.setGravity(btVector3(0, 0, 0));
    // A ring of six that touch in pairs, and a far one: with 6 pairs, Bullet's array has room
    // for 8.
    for (int i = 0; i < 6; ++i) {
      const btScalar angle = btScalar(i) * SIMD_2_PI / 6;
      w.add_sphere(btScalar(0.51), btVector3(btCos(angle), btSin(angle), 0));
    }
    w.add_sphere(btScalar(0.5), btVector3(100, 0, 0));
  });
  ASSERT_TRUE(twins.step());
  ASSERT_EQ(twins.ours().world.getPairCache()->getNumOverlappingPairs(), 6);
  ASSERT_GT(twins.ours().world.getPairCache()->getOverlappingPairArray().capacity(), 6);
  arm(dynamic_cast<PairAddingDispatcher<btCollisionDispatcher>&>(*twins.stock().dispatcher),
      twins.stock());
  arm(dynamic_cast<PairAddingDispatcher<CollisionDispatcher>&>(*twins.ours().dispatcher),
      twins.ours());
  ASSERT_TRUE(twins.dispatch());
  EXPECT_EQ(twins.ours().log.back(), "needs 1 6");
}

TEST(Situations, TwoWorldsShareADispatcher) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 40, 43); });
  btDbvtBroadphase broadphases[2];
  std::unique_ptr<btDiscreteDynamicsWorld> others[2];
  btSequentialImpulseConstraintSolver solvers[2];
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  btSphereShape shape(btScalar(0.5));
  int world = 0;
  twins.both([&](BulletWorld& w) {
    others[world] = std::make_unique<btDiscreteDynamicsWorld>(
        w.dispatcher.get(), &broadphases[world], &solvers[world], w.configuration.get());
    Random random(44);
    for (int i = 0; i < 40; ++i) {
      const Vec3 p = random.uniform_in_box({0, 0, 0}, {3, 3, 3});
      bodies.push_back(std::make_unique<btRigidBody>(1, nullptr, &shape, btVector3(1, 1, 1)));
      btTransform pose;
      pose.setIdentity();
      pose.setOrigin(btVector3(p.x, p.y, p.z));
      bodies.back()->setWorldTransform(pose);
      others[world]->addRigidBody(bodies.back().get());
    }
    ++world;
  });
  for (int i = 0; i < 20; ++i) {
    for (auto& other : others) other->stepSimulation(btScalar(1) / 60, 0);
    ASSERT_TRUE(twins.step());
    const auto difference = first_difference(*others[0], *others[1], twins.steps());
    ASSERT_FALSE(difference) << to_text(*difference);
  }
  for (auto& other : others) {
    for (int i = other->getNumCollisionObjects() - 1; i >= 0; --i) {
      other->removeCollisionObject(other->getCollisionObjectArray()[i]);
    }
  }
}

TEST(Situations, CentresThatAreCoincidentDenormalInfiniteOrNotANumber) {
  constexpr btScalar kInf = std::numeric_limits<btScalar>::infinity();
  constexpr btScalar kNan = std::numeric_limits<btScalar>::quiet_NaN();
  constexpr btScalar kTiny = std::numeric_limits<btScalar>::denorm_min();
  constexpr btScalar kHuge = std::numeric_limits<btScalar>::max();
  const std::vector<btScalar> values = {0,    -btScalar(0),   kTiny, SIMD_EPSILON, SIMD_EPSILON / 2,
                                        kInf, -kInf,          kNan,  kHuge,        btScalar(0.999),
                                        1,    btScalar(1e-23)};
  Twins twins;
  twins.both([](BulletWorld& w) {
    w.world.setGravity(btVector3(0, 0, 0));
    for (int i = 0; i < 12; ++i) w.add_sphere(btScalar(0.5), btVector3(0, 0, 0));
  });
  ASSERT_TRUE(twins.dispatch());
  // The pairs exist; the centres are now moved without an update of the broadphase.
  for (int axis = 0; axis < 3; ++axis) {
    twins.both([&](BulletWorld& w) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        btVector3 at(0, 0, 0);
        at[axis] = values[i];
        at[(axis + 1) % 3] = values[(i * 5) % values.size()];
        w.bodies[i]->getWorldTransform().setOrigin(at);
        w.bodies[i]->setActivationState(ACTIVE_TAG);
      }
    });
    ASSERT_TRUE(twins.dispatch());
    EXPECT_GT(twins.stats().touching, 0u);
  }
}

/// Piles apart on a floor. One is joined, and two touch a kinematic body, or one that is static but
/// has a mass.
void add_piles(BulletWorld& w, std::uint64_t seed) {
  constexpr int kPiles = 40;
  Random random(seed);
  w.add(w.keep(new btBoxShape(btVector3(100, 1, 100))), btVector3(0, -1, 0), 0)
      ->setRollingFriction(btScalar(0.1));
  btCollisionShape* const box = w.keep(new btBoxShape(btVector3(1, 1, 1) / 2));
  for (int pile = 0; pile < kPiles; ++pile) {
    const btVector3 at(btScalar(pile % 8) * 6, 0, btScalar(pile / 8) * 6);
    const std::size_t count = pile == 7 ? 60 : 2 + random.below(8);
    btRigidBody* last = nullptr;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 p = random.uniform_in_box({0, Real(0.4), 0}, {1, 2, 1});
      const btVector3 place = at + btVector3(p.x, p.y, p.z);
      btRigidBody* const body = random.below(3) == 0
                                    ? w.add(box, place, 2)
                                    : w.add_sphere(random.uniform(Real(0.3), Real(0.6)), place);
      body->setRollingFriction(btScalar(0.1) * btScalar(pile % 3));
      body->setSpinningFriction(btScalar(0.05) * btScalar(i % 2));
      if (pile % 5 == 4)
        body->setAnisotropicFriction(btVector3(1, 2, 3) / 4, static_cast<int>(i % 4));
      if (pile % 4 == 0) body->setActivationState(DISABLE_DEACTIVATION);
      if (pile == 3 && last != nullptr) {
        w.joints.push_back(std::make_unique<btPoint2PointConstraint>(
            *last, *body, btVector3(0, btScalar(0.5), 0), btVector3(0, btScalar(-0.5), 0)));
        w.world.addConstraint(w.joints.back().get());
      }
      if (pile == 12 && i == 0) {
        w.joints.push_back(
            std::make_unique<btHingeConstraint>(*body, btVector3(0, 1, 0), btVector3(0, 0, 1)));
        w.world.addConstraint(w.joints.back().get());
      }
      last = body;
    }
  }
  btRigidBody* const plate = w.add(w.keep(new btBoxShape(btVector3(4, btScalar(0.1), 1))),
                                   btVector3(3, btScalar(0.2), 0), 0);
  plate->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  plate->setActivationState(DISABLE_DEACTIVATION);
  btRigidBody* const heavy = w.add(w.keep(new btBoxShape(btVector3(4, btScalar(0.1), 1))),
                                   btVector3(27, btScalar(0.2), 6), 5);
  heavy->setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
  w.joints.push_back(std::make_unique<btPoint2PointConstraint>(
      *plate, *w.bodies[1], btVector3(0, 1, 0), btVector3(0, 1, 0)));
  w.world.addConstraint(w.joints.back().get());
}

std::thread::id g_stepping_thread;
std::atomic<bool> g_zone_on_other_thread{false};

/// Functions for profile zones during its lifetime, which note on which threads they are called.
class WatchedZones {
 public:
  WatchedZones() {
    g_stepping_thread = std::this_thread::get_id();
    g_zone_on_other_thread = false;
    btSetCustomEnterProfileZoneFunc([](const char*) { note(); });
    btSetCustomLeaveProfileZoneFunc(note);
  }
  ~WatchedZones() {
    btSetCustomEnterProfileZoneFunc(enter_);
    btSetCustomLeaveProfileZoneFunc(leave_);
  }
  WatchedZones(const WatchedZones&) = delete;
  WatchedZones& operator=(const WatchedZones&) = delete;

 private:
  static void note() {
    if (std::this_thread::get_id() != g_stepping_thread) g_zone_on_other_thread = true;
  }
  btEnterProfileZoneFunc* const enter_ = btGetCurrentEnterProfileZoneFunc();
  btLeaveProfileZoneFunc* const leave_ = btGetCurrentLeaveProfileZoneFunc();
};

TEST(Situations, IslandsApartAreSolvedConcurrently) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  const WatchedZones zones;
  for (const unsigned threads : {1u, 4u}) {
    for (const int batch : {1, 20, 128}) {
      Twins twins(all_parts(threads, {}, {.minimum_batch = 0}));
      twins.both([&](BulletWorld& w) {
        w.world.getSolverInfo().m_minimumSolverBatchSize = batch;
        add_piles(w, seed);
      });
      constexpr int kSteps = kThreadSanitizer ? 15 : 60;
      for (int step = 0; step < kSteps; ++step) {
        twins.both([&](BulletWorld& w) {  // the kinematic body shakes
          btRigidBody& plate = *w.bodies[w.bodies.size() - 2];
          btTransform pose = plate.getWorldTransform();
          pose.getOrigin().setX(btScalar(3 + 0.05 * (step % 4)));
          plate.setWorldTransform(pose);
          plate.setInterpolationWorldTransform(pose);
        });
        ASSERT_TRUE(twins.step()) << threads << " threads, batches of " << batch;
        const btSolverAnalyticsData &stock = twins.stock().solver->m_analyticsData,
                                    &ours = twins.ours().solver->m_analyticsData;
        ASSERT_EQ(std::tuple(ours.m_numSolverCalls, ours.m_numIterationsUsed, ours.m_islandId,
                             ours.m_numBodies, ours.m_numContactManifolds,
                             ours.m_remainingLeastSquaresResidual),
                  std::tuple(stock.m_numSolverCalls, stock.m_numIterationsUsed, stock.m_islandId,
                             stock.m_numBodies, stock.m_numContactManifolds,
                             stock.m_remainingLeastSquaresResidual));
      }
      const ConstraintSolverStats& stats =
          static_cast<ConstraintSolver&>(*twins.ours().solver).stats();
      if (threads == 1) {
        EXPECT_EQ(stats.concurrent, 0u);
      } else if (batch == 1) {
        EXPECT_GT(stats.concurrent, std::uint64_t{kSteps});
        EXPECT_LT(stats.concurrent, stats.groups) << "kinematic bodies";
      }
    }
  }
  EXPECT_FALSE(g_zone_on_other_thread);
}

/// Pulls a body along a pivot that follows a body of another island.
class Follower : public btPoint2PointConstraint {
 public:
  Follower(btRigidBody& body, const btRigidBody& leader)
      : btPoint2PointConstraint(body, btVector3(0, 0, 0)), leader_(leader) {}
  void getInfo2(btConstraintInfo2* info) override {
    setPivotB(getRigidBodyA().getWorldTransform().getOrigin() + leader_.getLinearVelocity() / 50);
    btPoint2PointConstraint::getInfo2(info);
  }

 private:
  const btRigidBody& leader_;
};

// A constraint of the user may read a body of another island, and joints may share a feedback.
TEST(Situations, IslandsThatDependOnEachOtherAreSolvedInOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const bool follows : {false, true}) {
    Twins twins(all_parts(4, {}, {.minimum_batch = 0}));
    btJointFeedback feedbacks[2];  // by world
    int world = 0;
    twins.both([&](BulletWorld& w) {
      w.world.getSolverInfo().m_minimumSolverBatchSize = 1;
      add_piles(w, seed);
      const std::size_t count = w.bodies.size() - 2;
      for (std::size_t i = 1; i + 100 < count; i += 25) {
        btRigidBody &body = *w.bodies[i + 99], &other = *w.bodies[count - i];
        if (follows) {
          w.joints.push_back(std::make_unique<Follower>(body, other));
        } else {
          w.joints.push_back(
              std::make_unique<btPoint2PointConstraint>(body, btVector3(0, btScalar(0.5), 0)));
          w.joints.back()->setJointFeedback(&feedbacks[world]);
        }
        w.world.addConstraint(w.joints.back().get());
      }
      ++world;
    });
    for (int step = 0; step < (kThreadSanitizer ? 10 : 40); ++step) {
      ASSERT_TRUE(twins.step()) << follows;
      if (follows) continue;
      ASSERT_EQ(bits_of(feedbacks[0].m_appliedForceBodyA),
                bits_of(feedbacks[1].m_appliedForceBodyA));
    }
    const ConstraintSolverStats& stats =
        static_cast<ConstraintSolver&>(*twins.ours().solver).stats();
    EXPECT_EQ(stats.concurrent > 0, !follows);
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
