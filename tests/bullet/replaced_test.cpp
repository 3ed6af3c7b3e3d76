/// Parts of a dispatcher that a user may replace: near callback, create function, filters, combine
/// callbacks. Event logs are compared entry by entry.
#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

void logging_near_callback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                           const btDispatcherInfo& info) {
  const auto* a = static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  const auto* b = static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  log_event("near " + name_of(a) + " " + name_of(b));
  // Spheres with an even sum of numbers pass through each other.
  if ((a->getUserIndex() + b->getUserIndex()) % 2 == 0) return;
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

TEST(ReplacedNearCallback, SeesEveryPairAndDecides) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 11);
    w.dispatcher->setNearCallback(logging_near_callback);
  });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(twins.ours().log.size(), 1000u);
  EXPECT_EQ(twins.stats().last_fallback, Fallback::near_callback);
  EXPECT_EQ(twins.stats().batches, 0u);
}

void near_callback_with_our_default(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                                    const btDispatcherInfo& info) {
  const auto* a = static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  const auto* b = static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  log_event("near " + name_of(a) + " " + name_of(b));
  if ((a->getUserIndex() + b->getUserIndex()) % 7 == 0) return;
  CollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
  if ((a->getUserIndex() + b->getUserIndex()) % 9 == 0) {  // twice
    CollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
  }
}

TEST(ReplacedNearCallback, ThatCallsOurDefaultRunsInBatches) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 11);
    w.dispatcher->setNearCallback(near_callback_with_our_default);
  });
  ASSERT_TRUE(twins.step(30));
  // All but the first, or all, because the other world has called the function before.
  EXPECT_GE(twins.stats().batches, 29u);
  EXPECT_EQ(twins.stats().ordered[static_cast<std::size_t>(OrderReason::near_callback)],
            twins.stats().batches);
  EXPECT_GT(twins.stats().written, 1000u);
  EXPECT_GT(twins.stats().sphere_boxes, 0u);
  // A near callback that does not is left to Bullet from the second dispatch on.
  const std::uint64_t batches = twins.stats().batches;
  twins.both([](BulletWorld& w) { w.dispatcher->setNearCallback(logging_near_callback); });
  ASSERT_TRUE(twins.step(5));
  EXPECT_EQ(twins.stats().batches, batches + 1);
}

/// Leaves a dispatch by an exception, so that the batch ends early.
void throwing_near_callback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                            const btDispatcherInfo& info) {
  log_event("near");
  if (g_current->log.size() % 40 == 39) throw 1;
  CollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

TEST(ReplacedNearCallback, MayThrowOutOfABatch) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 14);
    w.dispatcher->setNearCallback(throwing_near_callback);
    for (int step = 0; step < 10; ++step) {
      try {
        w.dispatcher->dispatchAllCollisionPairs(w.world.getPairCache(), w.world.getDispatchInfo(),
                                                w.dispatcher.get());
      } catch (int) {
        log_event("thrown");
      }
    }
  });
  EXPECT_TRUE(twins.compare());
  twins.both([](BulletWorld& w) {
    w.dispatcher->setNearCallback(btCollisionDispatcher::defaultNearCallback);
  });
  ASSERT_TRUE(twins.step(5));
}

TEST(ReplacedNearCallback, ComesAndGoesMidRun) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 60, 12); });
  ASSERT_TRUE(twins.step(10));
  twins.both([](BulletWorld& w) { w.dispatcher->setNearCallback(logging_near_callback); });
  ASSERT_TRUE(twins.step(10));
  twins.both([](BulletWorld& w) {
    w.dispatcher->setNearCallback(btCollisionDispatcher::defaultNearCallback);
  });
  ASSERT_TRUE(twins.step(10));
  EXPECT_EQ(twins.stats().batches, 20u);
}

bool replace_near_callback(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                           const btCollisionObjectWrapper*, int, int) {
  g_current->dispatcher->setNearCallback(logging_near_callback);
  return false;
}

TEST(ReplacedNearCallback, InTheMiddleOfADispatchIsCalledForTheRest) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 60, 13); });
  ASSERT_TRUE(twins.step(10));
  gContactAddedCallback = replace_near_callback;
  twins.both([](BulletWorld& w) {
    w.log.clear();
    for (const auto& body : w.bodies) {
      body->setCollisionFlags(body->getCollisionFlags() |
                              btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    }
  });
  const bool same = twins.dispatch();
  gContactAddedCallback = nullptr;
  EXPECT_TRUE(same);
  EXPECT_GT(twins.stock().log.size(), 20u);
  EXPECT_EQ(twins.stats().last_fallback, Fallback::none);
}

/// A user's algorithm for two spheres: Bullet's with a log.
class LoggingAlgorithm : public btSphereSphereCollisionAlgorithm {
 public:
  using btSphereSphereCollisionAlgorithm::btSphereSphereCollisionAlgorithm;
  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* out) override {
    log_event("process " + name_of(a->getCollisionObject()) + " " +
              name_of(b->getCollisionObject()));
    btSphereSphereCollisionAlgorithm::processCollision(a, b, info, out);
  }
  struct CreateFunc : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override {
      void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(LoggingAlgorithm));
      return new (memory) LoggingAlgorithm(nullptr, info, a, b);
    }
  };
};

void replace_sphere_algorithm(BulletWorld& w, btCollisionAlgorithmCreateFunc* create) {
  w.dispatcher->registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, create);
}

TEST(ReplacedCreateFunction, MakesAllAlgorithms) {
  LoggingAlgorithm::CreateFunc create;
  Twins twins;
  twins.both([&](BulletWorld& w) {
    add_heap(w, 60, 13);
    replace_sphere_algorithm(w, &create);
  });
  ASSERT_TRUE(twins.step(30));
  EXPECT_GT(twins.ours().log.size(), 1000u);
  EXPECT_EQ(twins.stats().last_fallback, Fallback::create_function);
}

TEST(ReplacedCreateFunction, ForeignAlgorithmsRemainAfterItIsRestored) {
  // After the original function is restored, batches contain pairs of both kinds.
  LoggingAlgorithm::CreateFunc create;
  btCollisionAlgorithmCreateFunc* original[2] = {};
  Twins twins;
  int world = 0;
  twins.both([&](BulletWorld& w) {
    add_heap(w, 60, 14);
    original[world++] = w.configuration->getCollisionAlgorithmCreateFunc(SPHERE_SHAPE_PROXYTYPE,
                                                                         SPHERE_SHAPE_PROXYTYPE);
    replace_sphere_algorithm(w, &create);
  });
  ASSERT_TRUE(twins.step(5));
  world = 0;
  twins.both([&](BulletWorld& w) { replace_sphere_algorithm(w, original[world++]); });
  twins.both([](BulletWorld& w) { w.log.clear(); });
  ASSERT_TRUE(twins.step(40));
  EXPECT_EQ(twins.stats().batches, 40u);
  EXPECT_GT(twins.ours().log.size(), 100u) << "foreign algorithms must still be called";
  EXPECT_GT(twins.stats().written, 100u) << "Bullet's own must not be";
}

/// Filters in a subclass, and logs every call.
template <class Base>
class FilteringDispatcher : public Base {
 public:
  using Base::Base;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    log_event("needs " + name_of(a) + " " + name_of(b));
    return (a->getUserIndex() * 7 + b->getUserIndex()) % 5 != 0 && Base::needsCollision(a, b);
  }
};

TEST(ReplacedFilter, IsCalledOncePerPairInOrder) {
  TwinOptions options;
  options.stock = [](btCollisionConfiguration* c) {
    return std::make_unique<FilteringDispatcher<btCollisionDispatcher>>(c);
  };
  options.ours = [](btCollisionConfiguration* c) {
    return std::make_unique<FilteringDispatcher<CollisionDispatcher>>(
        c, DispatcherOptions{.minimum_batch = 0});
  };
  Twins twins(options);
  twins.both([](BulletWorld& w) { add_heap(w, 60, 15); });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(twins.ours().log.size(), 1000u);
  EXPECT_EQ(twins.stats().batches, 40u);
  EXPECT_GT(twins.stats().written, 100u);
}

/// A body that logs the calls of its filter.
class AskedBody : public btRigidBody {
 public:
  AskedBody(btScalar mass, btCollisionShape* shape, const btVector3& inertia)
      : btRigidBody(mass, nullptr, shape, inertia) {
    m_checkCollideWith = 1;
  }
  bool checkCollideWithOverride(const btCollisionObject* other) const override {
    log_event("filtered " + name_of(this) + " with " + name_of(other));
    return btRigidBody::checkCollideWithOverride(other);
  }
};

TEST(ReplacedFilter, OfABodyIsCalledForEveryPair) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 16);
    for (int i = 0; i < 3; ++i) {
      auto* shape = w.keep(new btSphereShape(btScalar(0.7)));
      w.bodies.push_back(std::make_unique<AskedBody>(1, shape, btVector3(1, 1, 1)));
      w.bodies.back()->setUserIndex(static_cast<int>(w.bodies.size()) - 1);
      btTransform pose;
      pose.setIdentity();
      pose.setOrigin(btVector3(1, btScalar(i + 1), 1));
      w.bodies.back()->setWorldTransform(pose);
      w.world.addRigidBody(w.bodies.back().get());
    }
  });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(twins.ours().log.size(), 100u);
  EXPECT_EQ(twins.stats().batches, 40u);
}

btScalar logging_combine(const btCollisionObject* a, const btCollisionObject* b) {
  log_event("combine " + name_of(a) + " " + name_of(b));
  return btScalar(0.1) * static_cast<btScalar>((a->getUserIndex() + b->getUserIndex()) % 10);
}

/// Replaces a global callback for the duration of a test.
template <class Callback>
class Replace {
 public:
  Replace(Callback* place, Callback callback) : place_(place), before_(*place) {
    *place = callback;
  }
  ~Replace() { *place_ = before_; }
  Replace(const Replace&) = delete;
  Replace& operator=(const Replace&) = delete;

 private:
  Callback* place_;
  Callback before_;
};

TEST(ReplacedCombineCallback, OfEachKindDecides) {
  for (CalculateCombinedCallback* place :
       {&gCalculateCombinedFrictionCallback, &gCalculateCombinedRestitutionCallback,
        &gCalculateCombinedRollingFrictionCallback, &gCalculateCombinedSpinningFrictionCallback,
        &gCalculateCombinedContactDampingCallback, &gCalculateCombinedContactStiffnessCallback}) {
    const Replace<CalculateCombinedCallback> replace(place, logging_combine);
    Twins twins;
    twins.both([](BulletWorld& w) {
      add_heap(w, 40, 17);
      // Damping and stiffness are combined only for bodies that have them.
      for (std::size_t i = 0; i < w.bodies.size(); i += 3) {
        w.bodies[i]->setContactStiffnessAndDamping(1000, btScalar(0.3));
      }
    });
    ASSERT_TRUE(twins.step(20));
    EXPECT_GT(twins.ours().log.size(), 100u);
    EXPECT_EQ(twins.stats().batches, 20u);
  }
}

TEST(ContinuousDispatch, LowersTheTimeOfImpactAsBulletDoes) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 40, 18);
    w.world.getDispatchInfo().m_dispatchFunc = btDispatcherInfo::DISPATCH_CONTINUOUS;
    w.world.getDispatchInfo().m_timeOfImpact = 5;
  });
  ASSERT_TRUE(twins.step(3));
  EXPECT_EQ(twins.ours().world.getDispatchInfo().m_timeOfImpact,
            twins.stock().world.getDispatchInfo().m_timeOfImpact);
  EXPECT_EQ(twins.stats().last_fallback, Fallback::continuous);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
