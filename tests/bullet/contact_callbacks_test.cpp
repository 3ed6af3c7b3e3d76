/// The calls of the global contact callbacks, and their order, are compared entry by entry.
#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Resets all callbacks at the end of a test.
class ContactCallbacks : public ::testing::Test {
 protected:
  ~ContactCallbacks() override {
    gContactAddedCallback = nullptr;
    gContactProcessedCallback = nullptr;
    gContactDestroyedCallback = nullptr;
    gContactStartedCallback = nullptr;
    gContactEndedCallback = nullptr;
  }
};

std::string numbers_of(const btManifoldPoint& point) {
  return std::to_string(point.m_distance1) + " " + std::to_string(point.m_combinedFriction) + " " +
         std::to_string(point.m_normalWorldOnB.y());
}

bool on_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a, int index_a,
              const btCollisionObjectWrapper* b, int part_b, int index_b) {
  log_event("added " + name_of(a->getCollisionObject()) + " " + name_of(b->getCollisionObject()) +
            " " + numbers_of(point));
  for (const btCollisionObjectWrapper* wrapper : {a, b}) {
    log_event(std::to_string(wrapper->getCollisionShape()->getShapeType()) + " " +
              bits_of(wrapper->getWorldTransform().getOrigin()) + " " +
              std::to_string(wrapper->m_partId) + " " + std::to_string(wrapper->m_index) +
              (wrapper->m_parent == nullptr ? "" : " parent"));
  }
  for (const int number : {part_a, index_a, part_b, index_b}) log_event(std::to_string(number));
  point.m_combinedFriction = btScalar(0.125);
  point.m_userPersistentData = const_cast<btCollisionObject*>(a->getCollisionObject());
  return true;
}
bool on_processed(btManifoldPoint& point, void* a, void* b) {
  log_event("processed " + name_of(static_cast<btCollisionObject*>(a)) + " " +
            name_of(static_cast<btCollisionObject*>(b)) + " " + numbers_of(point));
  return true;
}
bool on_destroyed(void* data) {
  log_event("destroyed " + name_of(static_cast<btCollisionObject*>(data)));
  return true;
}
void on_started(btPersistentManifold* const& manifold) {
  log_event("started " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()) + " " +
            std::to_string(manifold->getNumContacts()));
}
void on_ended(btPersistentManifold* const& manifold) {
  log_event("ended " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()) + " " +
            std::to_string(manifold->getNumContacts()));
}

void flag_custom_material(BulletWorld& w, std::size_t stride) {
  for (std::size_t i = 0; i < w.bodies.size(); i += stride) {
    w.bodies[i]->setCollisionFlags(w.bodies[i]->getCollisionFlags() |
                                   btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  }
}

bool was_logged(const BulletWorld& w, const std::string& event) {
  return std::any_of(w.log.begin(), w.log.end(),
                     [&](const std::string& entry) { return entry.starts_with(event); });
}

TEST_F(ContactCallbacks, AllTogetherReceiveTheSameCalls) {
  gContactAddedCallback = on_added;
  gContactProcessedCallback = on_processed;
  gContactDestroyedCallback = on_destroyed;
  gContactStartedCallback = on_started;
  gContactEndedCallback = on_ended;
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 50, 21);
    flag_custom_material(w, 3);
  });
  ASSERT_TRUE(twins.step(60));
  for (const char* event : {"added", "processed", "destroyed", "started", "ended"}) {
    EXPECT_TRUE(was_logged(twins.ours(), event)) << event;
  }
  EXPECT_EQ(twins.stats().batches, 60u);
}

TEST_F(ContactCallbacks, EachAloneReceivesTheSameCalls) {
  for (int which = 0; which < 5; ++which) {
    gContactAddedCallback = which == 0 ? on_added : nullptr;
    gContactProcessedCallback = which == 1 ? on_processed : nullptr;
    gContactDestroyedCallback = which == 2 ? on_destroyed : nullptr;
    gContactStartedCallback = which == 3 ? on_started : nullptr;
    gContactEndedCallback = which == 4 ? on_ended : nullptr;
    Twins twins;
    twins.both([](BulletWorld& w) {
      add_heap(w, 40, 22);
      flag_custom_material(w, 2);
    });
    ASSERT_TRUE(twins.step(30)) << which;
    if (which != 2) {
      EXPECT_FALSE(twins.ours().log.empty()) << which;
    }
  }
}

btScalar combined_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return btManifoldResult::calculateCombinedFriction(a, b);
}

TEST_F(ContactCallbacks, AreTheReasonForBulletsOrderInTheStatistics) {
  using enum OrderReason;
  for (const OrderReason reason :
       {none, contact_callback, combine_callback, processed_callback, added_callback, filter}) {
    const std::size_t index = static_cast<std::size_t>(reason);
    for (int which = 0; which < (reason == contact_callback ? 3 : 1); ++which) {
      const bool contact = reason == contact_callback;
      gContactStartedCallback = contact && which == 0 ? on_started : nullptr;
      gContactEndedCallback = contact && which == 1 ? on_ended : nullptr;
      gContactDestroyedCallback = contact && which == 2 ? on_destroyed : nullptr;
      gContactProcessedCallback = reason == processed_callback ? on_processed : nullptr;
      gContactAddedCallback = reason == added_callback ? on_added : nullptr;
      const auto combine = gCalculateCombinedFrictionCallback;
      if (reason == combine_callback) gCalculateCombinedFrictionCallback = combined_friction;
      TwinOptions options;
      if (reason == filter) {
        struct Own : CollisionDispatcher {
          using CollisionDispatcher::CollisionDispatcher;
        };
        options.ours = [](btCollisionConfiguration* c) {
          return std::make_unique<Own>(c, DispatcherOptions{.minimum_batch = 0});
        };
      }
      Twins twins(options);
      twins.both([&](BulletWorld& w) {
        add_heap(w, 40, 27);
        if (reason == added_callback) flag_custom_material(w, 2);
      });
      const bool same = twins.step(10);
      gCalculateCombinedFrictionCallback = combine;
      ASSERT_TRUE(same) << to_string(reason);
      EXPECT_EQ(twins.stats().ordered[index], 10u) << to_string(reason);
      EXPECT_EQ(twins.stats().last_order, reason);
      const bool by_bullet = reason == combine_callback;
      EXPECT_EQ(twins.stats().written == 0, by_bullet) << to_string(reason);
    }
  }
}

TEST_F(ContactCallbacks, AddedIsNotCalledWithoutFlaggedBodies) {
  gContactAddedCallback = on_added;
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 40, 23); });
  ASSERT_TRUE(twins.step(20));
  EXPECT_TRUE(twins.ours().log.empty());
  EXPECT_GT(twins.stats().written, 0u);
}

TEST_F(ContactCallbacks, SetMidRunAreCalledFromTheNextStep) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    add_heap(w, 50, 24);
    flag_custom_material(w, 2);
  });
  ASSERT_TRUE(twins.step(10));
  gContactAddedCallback = on_added;
  gContactDestroyedCallback = on_destroyed;
  ASSERT_TRUE(twins.step(10));
  // The points of the last step carry user data; only their destruction calls a callback now.
  gContactAddedCallback = nullptr;
  twins.both([](BulletWorld& w) { w.log.clear(); });
  ASSERT_TRUE(twins.step(1));
  EXPECT_TRUE(was_logged(twins.ours(), "destroyed"));
  gContactAddedCallback = on_added;
  gContactEndedCallback = on_ended;
  ASSERT_TRUE(twins.step(10));
  EXPECT_TRUE(was_logged(twins.ours(), "added"));
  EXPECT_TRUE(was_logged(twins.ours(), "destroyed"));
  EXPECT_TRUE(was_logged(twins.ours(), "ended"));
}

TEST_F(ContactCallbacks, AreNotCalledByVerify) {
  gContactStartedCallback = on_started;
  gContactEndedCallback = on_ended;
  TwinOptions options;
  options.ours = [](btCollisionConfiguration* c) {
    return std::make_unique<CollisionDispatcher>(
        c, DispatcherOptions{.minimum_batch = 0, .verify = true});
  };
  Twins twins(options);
  twins.both([](BulletWorld& w) { add_heap(w, 40, 25); });
  ASSERT_TRUE(twins.step(20));
  EXPECT_GT(twins.stats().verified, 0u);
  EXPECT_EQ(twins.stats().mismatches, 0u) << twins.stats().first_mismatch;
}

/// Dispatches the world's own pairs again during a dispatch.
void on_started_dispatch_again(btPersistentManifold* const& manifold) {
  on_started(manifold);
  if (g_current->log.size() > 400) return;  // the inner dispatch starts contacts too
  static bool inside = false;
  if (inside) return;
  inside = true;
  btHashedOverlappingPairCache cache;
  cache.addOverlappingPair(g_current->bodies[1]->getBroadphaseHandle(),
                           g_current->bodies[2]->getBroadphaseHandle());
  g_current->dispatcher->dispatchAllCollisionPairs(&cache, g_current->world.getDispatchInfo(),
                                                   g_current->dispatcher.get());
  cache.removeOverlappingPair(g_current->bodies[1]->getBroadphaseHandle(),
                              g_current->bodies[2]->getBroadphaseHandle(),
                              g_current->dispatcher.get());
  inside = false;
}

TEST_F(ContactCallbacks, MayDispatchAnotherCache) {
  gContactStartedCallback = on_started_dispatch_again;
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 40, 26); });
  ASSERT_TRUE(twins.step(5));
  EXPECT_GT(twins.stats().fallbacks[static_cast<std::size_t>(Fallback::nested)], 0u);
}

/// Changes bodies in a way that later pairs of the same dispatch notice.
void disturb(const btCollisionObject* object) {
  if (g_current == nullptr || g_current->log.size() % 7 != 0) return;
  auto* body = btRigidBody::upcast(const_cast<btCollisionObject*>(object));
  if (body->isStaticObject()) return;
  if (g_current->log.size() % 3 == 0) {
    static_cast<btSphereShape*>(body->getCollisionShape())->setUnscaledRadius(btScalar(0.45));
  } else {
    body->getWorldTransform().getOrigin().setX(body->getWorldTransform().getOrigin().x() +
                                               btScalar(0.01));
  }
  body->setFriction(btScalar(0.1) * btScalar(g_current->log.size() % 10));
  body->activate(true);
}
void on_started_disturb(btPersistentManifold* const& manifold) {
  on_started(manifold);
  disturb(manifold->getBody0());
}
void on_ended_disturb(btPersistentManifold* const& manifold) {
  on_ended(manifold);
  disturb(manifold->getBody1());
}
bool on_destroyed_disturb(void* data) {
  on_destroyed(data);
  disturb(static_cast<btCollisionObject*>(data));
  return true;
}
bool on_added_disturb(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a,
                      int index_a, const btCollisionObjectWrapper* b, int part_b, int index_b) {
  on_added(point, a, part_a, index_a, b, part_b, index_b);
  disturb(b->getCollisionObject());
  return true;
}
bool on_processed_disturb(btManifoldPoint& point, void* a, void* b) {
  on_processed(point, a, b);
  disturb(static_cast<btCollisionObject*>(b));
  return true;
}

TEST_F(ContactCallbacks, MayChangeTheBodiesOfTheirContact) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (unsigned which = 1; which < 32; ++which) {
    gContactStartedCallback = (which & 1) != 0 ? on_started_disturb : nullptr;
    gContactEndedCallback = (which & 2) != 0 ? on_ended_disturb : nullptr;
    gContactDestroyedCallback = (which & 4) != 0 ? on_destroyed_disturb : nullptr;
    gContactProcessedCallback = (which & 8) != 0 ? on_processed_disturb : nullptr;
    gContactAddedCallback = (which & 16) != 0 ? on_added_disturb : nullptr;
    Twins twins;
    twins.both([&](BulletWorld& w) {
      add_heap(w, 60, seed);
      flag_custom_material(w, 5);
    });
    ASSERT_TRUE(twins.step(20)) << which;
    EXPECT_EQ(twins.stats().batches, 20u);
    EXPECT_GT(twins.stats().written, 0u);
  }
}

/// Removes a body that the started contact does not concern, and adds it again later.
void on_started_remove(btPersistentManifold* const& manifold) {
  on_started(manifold);
  if (g_current == nullptr || g_current->log.size() % 50 != 0) return;
  for (auto& body : g_current->bodies) {
    if (body.get() == manifold->getBody0() || body.get() == manifold->getBody1()) continue;
    if (body->isStaticObject() || body->getBroadphaseHandle() == nullptr) continue;
    if ((g_current->log.size() + static_cast<std::size_t>(body->getUserIndex())) % 3 != 0) continue;
    g_current->world.removeRigidBody(body.get());
    return;
  }
}

TEST_F(ContactCallbacks, MayRemoveBodies) {
  gContactStartedCallback = on_started_remove;
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 80, 28); });
  for (int step = 0; step < 30; ++step) {
    ASSERT_TRUE(twins.step());
    twins.both([](BulletWorld& w) {
      for (auto& body : w.bodies) {
        if (body->getBroadphaseHandle() == nullptr) w.world.addRigidBody(body.get());
      }
    });
  }
  EXPECT_GT(twins.stats().written, 0u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
