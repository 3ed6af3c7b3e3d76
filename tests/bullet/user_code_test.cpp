/// Callbacks, filters and near callbacks that change bodies, manifolds and the pair cache during a
/// dispatch have the same effects as in stock Bullet.
#include "tests/bullet/bullet_memory.hpp"
#include "tests/bullet/random_terrain.hpp"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <algorithm>
#include <array>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// What user code does at random.
enum Deed : unsigned {
  kMoves = 1u << 0,
  kResizes = 1u << 1,
  kChangesMaterials = 1u << 2,
  kFlags = 1u << 3,
  kWrites = 1u << 4,  ///< into the manifolds of other pairs
  kRemoves = 1u << 5,
  kActivates = 1u << 6,
  kDeedCount = 7,
};
unsigned g_deeds = 0;
btNearCallback g_default_near_callback = btCollisionDispatcher::defaultNearCallback;
std::uint64_t g_seed = 0;

using Bodies = std::array<const btCollisionObject*, 2>;

bool is_among(const Bodies& busy, const btCollisionObject* body) {
  return body == busy[0] || body == busy[1];
}

void write_into_manifold(BulletWorld& w, const Bodies& busy, Random& random) {
  const int count = w.dispatcher->getNumManifolds();
  if (count == 0) return;
  btPersistentManifold* manifold = w.dispatcher->getManifoldByIndexInternal(
      static_cast<int>(random.below(std::uint64_t(count))));
  // Bullet may be in a loop over the points of this pair.
  if (is_among(busy, manifold->getBody0()) || is_among(busy, manifold->getBody1())) return;
  if (random.below(3) == 0) {
    manifold->setNumContacts(0);
  } else if (manifold->getNumContacts() > 0) {
    manifold->getContactPoint(0).m_combinedFriction = btScalar(0.3);
  } else {
    btManifoldPoint point(btVector3(0, 0, 0), btVector3(0, 0, 0), btVector3(0, 1, 0),
                          btScalar(0.01));
    point.m_lateralFrictionDir1 = btVector3(1, 0, 0);
    point.m_lateralFrictionDir2 = btVector3(0, 0, 1);
    manifold->addManifoldPoint(point);
  }
}

/// Changes a body that need not be one of the pair that is visited, `busy`. The same in both
/// worlds, because it depends on the number of logged calls.
void meddle(const Bodies& busy) {
  if (g_current == nullptr) return;
  BulletWorld& w = *g_current;
  Random random(g_seed ^ (w.log.size() * 0x9e3779b97f4a7c15u));
  if (random.below(12) != 0) return;
  btRigidBody& body = *w.bodies[random.below(w.bodies.size())];
  const unsigned deed = 1u << random.below(kDeedCount);
  if (body.isStaticObject() || body.getBroadphaseHandle() == nullptr) return;
  switch (deed & g_deeds) {
    case kMoves: {
      const Vec3 by = random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * Real(0.2);
      body.getWorldTransform().setOrigin(body.getWorldTransform().getOrigin() +
                                         btVector3(by.x, by.y, by.z));
      break;
    }
    case kResizes:
      if (body.getCollisionShape()->getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
        static_cast<btSphereShape*>(body.getCollisionShape())
            ->setUnscaledRadius(random.uniform(Real(0.2), Real(0.7)));
      }
      break;
    case kChangesMaterials:
      body.setFriction(random.uniform(0, 2));
      body.setRestitution(random.uniform(0, 1));
      body.setRollingFriction(random.uniform(0, 1));
      break;
    case kFlags:
      body.setCollisionFlags(body.getCollisionFlags() ^
                             (random.below(2) == 0 ? btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK
                                                   : btCollisionObject::CF_NO_CONTACT_RESPONSE));
      break;
    case kWrites:
      write_into_manifold(w, busy, random);
      break;
    case kRemoves:
      if (!is_among(busy, &body) && random.below(4) == 0) w.world.removeRigidBody(&body);
      break;
    case kActivates:
      body.forceActivationState(random.below(2) == 0 ? ISLAND_SLEEPING : ACTIVE_TAG);
      break;
    default:
      break;
  }
}

bool meddle_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                  const btCollisionObjectWrapper* b, int, int) {
  log_event("added " + name_of(a->getCollisionObject()) + " " + name_of(b->getCollisionObject()) +
            " " + bits_of(point.m_distance1));
  point.m_combinedRestitution *= btScalar(0.5);
  point.m_userPersistentData = const_cast<btCollisionObject*>(a->getCollisionObject());
  meddle({a->getCollisionObject(), b->getCollisionObject()});
  return true;
}
bool meddle_processed(btManifoldPoint& point, void* a, void* b) {
  const Bodies busy = {static_cast<btCollisionObject*>(a), static_cast<btCollisionObject*>(b)};
  log_event("processed " + name_of(busy[0]) + " " + name_of(busy[1]) + " " +
            bits_of(point.m_distance1));
  meddle(busy);
  return true;
}
bool meddle_destroyed(void* data) {
  log_event("destroyed " + name_of(static_cast<btCollisionObject*>(data)));
  return true;
}
void meddle_started(btPersistentManifold* const& manifold) {
  log_event("started " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()));
  meddle({manifold->getBody0(), manifold->getBody1()});
}
void meddle_ended(btPersistentManifold* const& manifold) {
  log_event("ended " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()));
}
void meddle_near(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                 const btDispatcherInfo& info) {
  const Bodies busy = {static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject),
                       static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject)};
  log_event("near " + name_of(busy[0]) + " " + name_of(busy[1]));
  meddle(busy);
  const std::size_t number = g_current->log.size();
  if (number % 17 == 0) return;
  // Bullet's algorithm of compounds reads children without an algorithm in a continuous dispatch.
  const bool any_compound = std::ranges::any_of(
      busy, [](const auto* body) { return body->getCollisionShape()->isCompound(); });
  if (number % 23 == 0 && !any_compound) {
    btDispatcherInfo continuous = info;
    continuous.m_dispatchFunc = btDispatcherInfo::DISPATCH_CONTINUOUS;
    g_default_near_callback(pair, dispatcher, continuous);
  } else {
    g_default_near_callback(pair, dispatcher, info);
  }
}

/// A dispatcher with a filter that is not pure.
template <class Base>
class Meddler final : public Base {
 public:
  using Base::Base;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    log_event("needs " + name_of(a) + " " + name_of(b));
    const bool needs = Base::needsCollision(a, b);
    meddle({a, b});
    return needs && g_current->log.size() % 19 != 0;
  }
};

/// Spheres, boxes, capsules and compounds of one child on a terrain.
class MeddledWorlds {
  RandomTerrain terrains_[2];

 public:
  MeddledWorlds(std::uint64_t seed, bool deterministic)
      : terrains_{RandomTerrain(seed), RandomTerrain(seed)}, twins(options(seed)) {
    int which = 0;
    twins.both([&](BulletWorld& w) {
      w.world.getDispatchInfo().m_deterministicOverlappingPairs = deterministic;
      Random random(seed);
      w.add(terrains_[which].shape(), btVector3(0, -1, 0), 0)->setUserIndex(1000);
      ++which;
      for (int i = 0; i < kBodies; ++i) {
        const Vec3 p = random.uniform_in_box({-2, -1, -2}, {2, 2, 2});
        btRigidBody* body = w.add(random_shape(w, random), btVector3(p.x, p.y, p.z));
        body->setFriction(random.uniform(0, 2));
        if (random.below(3) == 0) {
          body->setCollisionFlags(body->getCollisionFlags() |
                                  btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        }
      }
      if (seed % 3 == 0) w.dispatcher->setNearCallback(meddle_near);
    });
  }

  bool step() {
    const bool same = twins.step();
    twins.both([](BulletWorld& w) {
      w.log.clear();
      for (auto& body : w.bodies) {
        if (body->getBroadphaseHandle() == nullptr) w.world.addRigidBody(body.get());
      }
    });
    return same;
  }

  Twins twins;

 private:
  static constexpr int kBodies = 60;

  static TwinOptions options(std::uint64_t seed) {
    TwinOptions made;
    const DispatcherOptions ours{
        .collider = {.backend = Backend::cpu, .threads = seed % 2 == 0 ? 1u : 3u},
        .minimum_batch = 0};
    if (seed / 2 % 2 == 0) {
      made.stock = [](btCollisionConfiguration* c) {
        return std::make_unique<Meddler<btCollisionDispatcher>>(c);
      };
      made.ours = [=](btCollisionConfiguration* c) {
        return std::make_unique<Meddler<CollisionDispatcher>>(c, ours);
      };
    } else {
      made.ours = [=](btCollisionConfiguration* c) {
        return std::make_unique<CollisionDispatcher>(c, ours);
      };
    }
    return made;
  }
  static btCollisionShape* random_shape(BulletWorld& w, Random& random) {
    const btScalar size = random.uniform(Real(0.25), Real(0.6));
    switch (random.below(8)) {
      case 0:
        return w.keep(new btBoxShape(btVector3(size, size, size)));
      case 1:
        return w.keep(new btCapsuleShape(size / 2, size));
      case 2:
      case 3: {
        auto* compound = new btCompoundShape();
        w.keep(compound);
        btTransform at = btTransform::getIdentity();
        at.setOrigin(btVector3(0, size / 4, 0));
        compound->addChildShape(at, w.keep(new btSphereShape(size)));
        return compound;
      }
      default:
        return w.keep(new btSphereShape(size));
    }
  }
};

class UserCode : public ::testing::Test {
 protected:
  ~UserCode() override {
    gContactAddedCallback = nullptr;
    gContactProcessedCallback = nullptr;
    gContactDestroyedCallback = nullptr;
    gContactStartedCallback = nullptr;
    gContactEndedCallback = nullptr;
  }
};

/// Removes the first body while the dispatcher asks for the last pair, bodies 2 and 3.
template <class Base>
class Remover final : public Base {
 public:
  using Base::Base;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    btRigidBody& first = *g_current->bodies[0];
    const bool is_last_pair = std::min(a->getUserIndex(), b->getUserIndex()) == 2;
    if (is_last_pair && first.getBroadphaseHandle() != nullptr) {
      g_current->world.removeRigidBody(&first);
    }
    return Base::needsCollision(a, b);
  }
};

// Bullet's loop over the pairs refers to the entry of the pair that it visits. If a filter removes
// another pair, Bullet moves the last pair to its entry, stores the new algorithm of the last pair
// behind the array, and never destroys it.
TEST_F(UserCode, LosesTheMemoryThatBulletLoses) {
  TwinOptions options;
  options.stock = [](btCollisionConfiguration* c) {
    return std::make_unique<Remover<btCollisionDispatcher>>(c);
  };
  options.ours = [](btCollisionConfiguration* c) {
    return std::make_unique<Remover<CollisionDispatcher>>(c, DispatcherOptions{.minimum_batch = 0});
  };
  BulletMemory memory;
  const BulletWorld *stock = nullptr, *ours = nullptr;
  {
    Twins twins(options);
    stock = &twins.stock();
    ours = &twins.ours();
    twins.both([](BulletWorld& w) {
      for (int i = 0; i < 2; ++i) w.add_sphere(1, btVector3(0, btScalar(i), 0));
      for (int i = 0; i < 2; ++i) {
        auto* compound = new btCompoundShape();
        w.keep(compound);
        compound->addChildShape(btTransform::getIdentity(), w.keep(new btSphereShape(1)));
        w.add(compound, btVector3(10, btScalar(i), 0));
      }
    });
    ASSERT_TRUE(twins.step());
    EXPECT_EQ(twins.stats().batches, 1u);
    ASSERT_TRUE(twins.step(2));
  }
  EXPECT_FALSE(memory.blocks_of(stock).empty());
  EXPECT_EQ(memory.blocks_of(stock), memory.blocks_of(ours));
}

TEST_F(UserCode, MayChangeWhatLaterPairsDependOn) {
  const std::uint64_t seed = test_seed();
  std::uint64_t batches = 0, written = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    g_seed = seed + i;
    SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(g_seed));
    Random random(g_seed);
    const std::uint64_t which = random.below(32);
    gContactStartedCallback = (which & 1) != 0 ? meddle_started : nullptr;
    gContactEndedCallback = (which & 2) != 0 ? meddle_ended : nullptr;
    gContactDestroyedCallback = (which & 4) != 0 ? meddle_destroyed : nullptr;
    gContactProcessedCallback = (which & 8) != 0 ? meddle_processed : nullptr;
    gContactAddedCallback = (which & 16) != 0 ? meddle_added : nullptr;
    g_deeds = static_cast<unsigned>(random.below(1u << kDeedCount));
    // With this flag, Bullet visits pairs by indices that removals make wrong.
    const bool deterministic = random.below(4) == 0;
    if (deterministic) g_deeds &= ~unsigned{kRemoves};
    g_default_near_callback = random.below(3) == 0
                                  ? btNearCallback(btCollisionDispatcher::defaultNearCallback)
                                  : btNearCallback(CollisionDispatcher::defaultNearCallback);
    BulletMemory memory;
    const BulletWorld *stock = nullptr, *ours = nullptr;
    {
      MeddledWorlds worlds(g_seed, deterministic);
      stock = &worlds.twins.stock();
      ours = &worlds.twins.ours();
      for (int step = 0; step < 15; ++step) ASSERT_TRUE(worlds.step()) << "step " << step;
      batches += worlds.twins.stats().batches;
      written += worlds.twins.stats().written;
    }
    // See LosesTheMemoryThatBulletLoses.
    EXPECT_EQ(memory.blocks_of(stock), memory.blocks_of(ours));
    EXPECT_TRUE(memory.blocks_of(nullptr).empty());
  }
  EXPECT_GT(batches, 300u);
  EXPECT_GT(written, 1000u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
