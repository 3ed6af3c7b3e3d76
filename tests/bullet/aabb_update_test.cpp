/// The update of AABBs has stock's pairs in stock's order, and stock's tree, after every step.
#include "src/bullet/world/aabb_update.hpp"

#include "src/bullet/world/pair_cleanup.hpp"
#include "src/bullet/world/proxy_removal.hpp"
#include "tests/bullet/arena.hpp"
#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <LinearMath/btIDebugDraw.h>

#include <cstring>
#include <optional>
#include <ostream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Writes everything that the broadphase will read in later steps, in its order.
class TreeDump {
 public:
  explicit TreeDump(const btDbvtBroadphase& tree) {
    for (const btDbvt& set : tree.m_sets) {
      add("leaves", set.m_leaves);
      add("path", static_cast<int>(set.m_opath));
      if (set.m_root != nullptr) add(*set.m_root);
    }
    for (const btDbvtProxy* proxy : tree.m_stageRoots) {
      for (add("stage", 0); proxy != nullptr; proxy = proxy->links[1]) add_proxy(*proxy);
    }
    add("new pairs", tree.m_newpairs);
    add("calls", static_cast<int>(tree.m_updates_call));
    add("done", static_cast<int>(tree.m_updates_done));
    add("cleanup", tree.m_cid);
    add("needs cleanup", tree.m_needcleanup ? 1 : 0);
    add("fixed left", tree.m_fixedleft);
    auto& cache = static_cast<btHashedOverlappingPairCache&>(*tree.m_paircache);
    const btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i) {
      add("pair", pairs[i].m_pProxy0->m_uniqueId);
      add("with", pairs[i].m_pProxy1->m_uniqueId);
      add("algorithm", pairs[i].m_algorithm != nullptr ? 1 : 0);
    }
    add("pair capacity", pairs.capacity());
    for (int i = 0; i < pairs.size(); ++i) add("next", (cache.*PairTables::next)[i]);
    for (int i = 0; i < pairs.capacity(); ++i) add("head", (cache.*PairTables::heads)[i]);
  }
  void add_manifolds(btDispatcher& dispatcher) {
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
      add("manifold", manifold.getBody0()->getWorldArrayIndex());
      add("manifold with", manifold.getBody1()->getWorldArrayIndex());
    }
  }
  void add_ghosts(btCollisionWorld& world) {
    for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
      const auto* ghost = btGhostObject::upcast(world.getCollisionObjectArray()[i]);
      if (ghost == nullptr) continue;
      add("ghost", i);
      for (int k = 0; k < ghost->getNumOverlappingObjects(); ++k) {
        add("overlaps", ghost->getOverlappingObject(k)->getBroadphaseHandle()->m_uniqueId);
      }
    }
  }

  std::optional<std::string> first_difference(const TreeDump& other) const {
    for (std::size_t i = 0; i < std::min(fields_.size(), other.fields_.size()); ++i) {
      const Field &a = fields_[i], &b = other.fields_[i];
      if (std::strcmp(a.name, b.name) == 0 && a.value == b.value) continue;
      return std::string("entry ") + std::to_string(i) + ": " + a.name + " " +
             std::to_string(a.value) + ", " + b.name + " " + std::to_string(b.value);
    }
    if (fields_.size() == other.fields_.size()) return std::nullopt;
    return std::string("sizes differ");
  }

 private:
  struct Field {
    const char* name;
    std::int64_t value;
  };

  void add(const char* name, std::int64_t value) { fields_.push_back({name, value}); }
  void add_bits(const char* name, const btVector3& v) {
    for (int i = 0; i < 3; ++i) {
      std::int64_t bits = 0;
      std::memcpy(&bits, &v[i], sizeof v[i]);
      add(name, bits);
    }
  }
  void add(const btDbvtNode& node) {
    add_bits("lower", node.volume.Mins());
    add_bits("upper", node.volume.Maxs());
    if (node.isleaf()) {
      add_proxy(*static_cast<const btDbvtProxy*>(node.data));
      return;
    }
    add("inner node", 0);
    add(*node.childs[0]);
    add(*node.childs[1]);
  }
  void add_proxy(const btDbvtProxy& proxy) {
    add("proxy", proxy.m_uniqueId);
    add("stage of proxy", proxy.stage);
    add_bits("aabb lower", proxy.m_aabbMin);
    add_bits("aabb upper", proxy.m_aabbMax);
  }

  std::vector<Field> fields_;
};

struct SideBySideOptions {
  unsigned threads = 1;
  int side_by_side = 0;
};

/// A collision world of which one part, the update of AABBs, is Bullet's or ours.
class BoxWorld {
 public:
  explicit BoxWorld(std::optional<SideBySideOptions> ours)
      : pool_(ours ? ours->threads : 1),
        update_(ours ? ours->side_by_side : 0),
        is_ours_(ours.has_value()) {
    arena_.select();
    configuration_ = std::make_unique<btDefaultCollisionConfiguration>();
    dispatcher_ = std::make_unique<btCollisionDispatcher>(configuration_.get());
    broadphase_ = std::make_unique<btDbvtBroadphase>();
    world_ = std::make_unique<btCollisionWorld>(dispatcher_.get(), broadphase_.get(),
                                                configuration_.get());
    test::Arena::select_none();
  }
  ~BoxWorld() {
    arena_.select();
    while (world_->getNumCollisionObjects() > 0) remove(0);
    world_.reset();
    broadphase_.reset();
    dispatcher_.reset();
    configuration_.reset();
    test::Arena::select_none();
  }

  btCollisionWorld& world() { return *world_; }
  btDbvtBroadphase& tree() { return *broadphase_; }
  btCollisionObject& object(int i) { return *world_->getCollisionObjectArray()[i]; }
  int count() { return world_->getNumCollisionObjects(); }
  int updated() const { return updated_; }
  int cleaned() const { return cleaned_; }
  int removed() const { return removed_; }
  void select_arena() { arena_.select(); }

  void add(std::unique_ptr<btCollisionShape> shape, const btVector3& position, int flags, int group,
           int mask, std::unique_ptr<btCollisionObject> object = nullptr) {
    if (object == nullptr) object = std::make_unique<btCollisionObject>();
    object->setCollisionShape(shape.get());
    object->getWorldTransform().setIdentity();
    object->getWorldTransform().setOrigin(position);
    object->setCollisionFlags(flags);
    world_->addCollisionObject(object.get(), group, mask);
    shapes_.push_back(std::move(shape));
    objects_.push_back(std::move(object));
  }
  void remove(int i) {
    if (is_ours_ && removal_.run(*world_, object(i), pool_)) ++removed_;
    world_->removeCollisionObject(&object(i));
  }
  void update_aabbs() {
    if (!is_ours_) {
      world_->updateAabbs();
    } else if (update_.run(*world_, pool_)) {
      ++updated_;
    } else {
      world_->updateAabbs();
    }
  }
  void find_pairs_and_dispatch() {
    if (!is_ours_ || !cleanup_.run(*world_, pool_)) {
      world_->computeOverlappingPairs();
    } else {
      ++cleaned_;
    }
    dispatcher_->dispatchAllCollisionPairs(broadphase_->getOverlappingPairCache(),
                                           world_->getDispatchInfo(), dispatcher_.get());
  }

 private:
  test::Arena arena_;
  ThreadPool pool_;
  AabbUpdate update_;
  PairCleanup cleanup_{0};
  ProxyRemoval removal_;
  bool is_ours_;
  int updated_ = 0, cleaned_ = 0, removed_ = 0;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
  std::unique_ptr<btDefaultCollisionConfiguration> configuration_;
  std::unique_ptr<btCollisionDispatcher> dispatcher_;
  std::unique_ptr<btDbvtBroadphase> broadphase_;
  std::unique_ptr<btCollisionWorld> world_;
};

class BoxTwins {
 public:
  explicit BoxTwins(const SideBySideOptions& ours) : stock_(std::nullopt), ours_(ours) {}

  BoxWorld& stock() { return stock_; }
  BoxWorld& ours() { return ours_; }
  template <class Action>
  void both(const Action& action) {
    for (BoxWorld* world : {&stock_, &ours_}) {
      world->select_arena();
      action(*world);
    }
    test::Arena::select_none();
  }
  /// Returns the first difference, if there is one.
  std::optional<std::string> step() {
    both([](BoxWorld& w) { w.update_aabbs(); });
    if (auto what = compare()) return "after the update: " + *what;
    both([](BoxWorld& w) { w.find_pairs_and_dispatch(); });
    return compare();
  }

  std::optional<std::string> compare() {
    TreeDump stock(stock_.tree()), ours(ours_.tree());
    stock.add_ghosts(stock_.world());
    ours.add_ghosts(ours_.world());
    stock.add_manifolds(*stock_.world().getDispatcher());
    ours.add_manifolds(*ours_.world().getDispatcher());
    return stock.first_difference(ours);
  }

 private:
  BoxWorld stock_, ours_;
};

std::unique_ptr<btCollisionShape> random_shape(Random& random, Real size) {
  switch (random.below(8)) {
    case 0:
      return std::make_unique<btBoxShape>(btVector3(size, size / 2, size / 3));
    case 1:
      return std::make_unique<btCapsuleShape>(size / 2, size);
    case 2:
      return std::make_unique<btCylinderShape>(btVector3(size, size, size));
    default:
      return std::make_unique<btSphereShape>(size);
  }
}

btVector3 random_place(Random& random, Real edge) {
  return {random.uniform(0, edge), random.uniform(0, edge), random.uniform(0, edge)};
}

/// Settings of a random world.
struct Plan {
  explicit Plan(Random& random)
      : bodies(20 + static_cast<int>(random.below(500))),
        edge(random.uniform(2, 14)),
        speed(random.uniform(0, Real(0.3))),
        sizes(random.below(3) == 0 ? Real(8) : Real(0.6)),
        changes(random.below(3) == 0 ? Real(0.2) : Real(0.01)),
        options{static_cast<unsigned>(1 + random.below(4)), 0} {}

  int bodies;
  Real edge, speed, sizes, changes;
  SideBySideOptions options;
};

class SilentDrawer : public btIDebugDraw {
 public:
  void drawLine(const btVector3&, const btVector3&, const btVector3&) override {}
  void drawContactPoint(const btVector3&, const btVector3&, btScalar, int,
                        const btVector3&) override {}
  void reportErrorWarning(const char*) override {}
  void draw3dText(const btVector3&, const char*) override {}
  void setDebugMode(int) override {}
  int getDebugMode() const override { return DBG_NoDebug; }
};

/// A ghost of the user, which records that a pair is added.
class UserGhost : public btGhostObject {
 public:
  void addOverlappingObjectInternal(btBroadphaseProxy* other, btBroadphaseProxy* own) override {
    ++added;
    btGhostObject::addOverlappingObjectInternal(other, own);
  }
  int added = 0;
};

/// Applies the same random events to both worlds.
class RandomBoxes {
 public:
  explicit RandomBoxes(std::uint64_t seed) : random_(seed), plan_(random_), twins_(plan_.options) {
    const bool all = random_.below(2) == 0, continuous = random_.below(4) == 0;
    const bool ghosts = random_.below(2) == 0, drawer = random_.below(3) == 0;
    const Real prediction = random_.below(3) == 0 ? random_.uniform(0, 2) : Real(0);
    twins_.both([&](BoxWorld& w) {
      w.world().setForceUpdateAllAabbs(all);
      w.world().getDispatchInfo().m_useContinuous = continuous;
      w.tree().setVelocityPrediction(prediction);
      if (ghosts) w.tree().m_paircache->setInternalGhostPairCallback(&ghost_callback_);
      if (drawer) w.world().setDebugDrawer(&drawer_);
    });
    for (int i = 0; i < plan_.bodies; ++i) add();
  }

  std::optional<std::string> step() {
    change_population();
    for (int i = 0; i < twins_.stock().count(); ++i) change_object(i);
    const int fixed = twins_.stock().tree().m_sets[1].m_leaves;
    auto difference = twins_.step();
    fixed_ += twins_.stock().tree().m_sets[1].m_leaves != fixed ? 1 : 0;
    return difference;
  }
  int updated() { return twins_.ours().updated(); }
  int cleaned() { return twins_.ours().cleaned(); }
  /// Number of steps in which objects changed between the sets of fixed and moving ones.
  int fixed() const { return fixed_; }

 private:
  void add() {
    const Real size = random_.below(20) == 0 ? plan_.sizes : random_.uniform(Real(0.1), 1) / 2;
    const btVector3 place = random_place(random_, plan_.edge);
    const int flags = random_.below(10) == 0 ? int{btCollisionObject::CF_STATIC_OBJECT} : 0;
    const int group = random_.below(4) == 0 ? 2 : 1, mask = random_.below(6) == 0 ? 1 : -1;
    const std::uint64_t shape_seed = random_.below(1u << 30), kind = random_.below(40);
    twins_.both([&](BoxWorld& w) {
      Random shape_random(shape_seed);
      std::unique_ptr<btCollisionObject> ghost;
      if (kind == 0) ghost = std::make_unique<btGhostObject>();
      if (kind == 1) ghost = std::make_unique<btPairCachingGhostObject>();
      w.add(random_shape(shape_random, size), place, flags, group, mask, std::move(ghost));
    });
  }
  void change_population() {
    if (random_.uniform(0, 1) > plan_.changes) return;
    const auto removed = static_cast<int>(random_.below(40));
    for (int i = 0; i < removed && twins_.stock().count() > 0; ++i) {
      const auto k =
          static_cast<int>(random_.below(static_cast<std::uint64_t>(twins_.stock().count())));
      twins_.both([&](BoxWorld& w) { w.remove(k); });
    }
    const auto added = static_cast<int>(random_.below(40));
    for (int i = 0; i < added; ++i) add();
  }
  void change_object(int i) {
    const std::uint64_t what = random_.below(200);
    const btVector3 motion =
        random_place(random_, 2 * plan_.speed) - btVector3(plan_.speed, plan_.speed, plan_.speed);
    const btVector3 place = random_place(random_, plan_.edge);
    const bool rests = random_.below(3) == 0;
    twins_.both([&](BoxWorld& w) {
      btCollisionObject& object = w.object(i);
      btTransform& pose = object.getWorldTransform();
      object.setInterpolationWorldTransform(pose);
      if (what == 0) object.forceActivationState(ISLAND_SLEEPING);
      if (what == 1) object.forceActivationState(ACTIVE_TAG);
      if (what == 2) pose.setOrigin(place);
      if (!rests) pose.setOrigin(pose.getOrigin() + motion);
    });
  }

  Random random_;
  btGhostPairCallback ghost_callback_;
  SilentDrawer drawer_;
  Plan plan_;
  BoxTwins twins_;
  int fixed_ = 0;
};

TEST(AabbUpdate, HasStocksTreeAndPairsInRandomWorlds) {
  const std::uint64_t seed = test_seed(), steps = world_steps_to_run(300, 900);
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  std::uint64_t done = 0;
  int fixed = 0, cleaned = 0;
  for (std::uint64_t world = 0; done < steps; ++world) {
    RandomBoxes boxes(seed + world);
    for (int step = 0; step < 60; ++step, ++done) {
      const auto difference = boxes.step();
      ASSERT_FALSE(difference) << "world " << world << ", step " << step << ": " << *difference;
    }
    EXPECT_EQ(boxes.updated(), 60);
    fixed += boxes.fixed();
    cleaned += boxes.cleaned();
  }
  EXPECT_GT(fixed, static_cast<int>(steps / 60));
  EXPECT_GT(cleaned, static_cast<int>(steps / 4));
}

/// A cloud of small spheres, and a giant that is at first far from it.
void add_cloud_and_giant(BoxWorld& w, int count) {
  Random random(21);
  w.add(std::make_unique<btSphereShape>(Real(30)), btVector3(1000, 0, 0), 0, 1, -1);
  for (int i = 0; i < count; ++i) {
    w.add(std::make_unique<btSphereShape>(Real(0.1)), random_place(random, 20), 0, 1, -1);
  }
}

/// If only the giant moves, Bullet's tree is searched; if all move, all leaves are sorted.
TEST(AabbUpdate, OrdersThousandsOfNewPairsOfOneLeaf) {
  for (const bool all_move : {false, true}) {
    BoxTwins twins({3, 0});
    twins.both([](BoxWorld& w) { add_cloud_and_giant(w, 3000); });
    ASSERT_EQ(twins.step(), std::nullopt);
    const int before = twins.ours().tree().getOverlappingPairCache()->getNumOverlappingPairs();
    twins.both([&](BoxWorld& w) {
      for (int i = 0; all_move && i < w.count(); ++i) {
        w.object(i).getWorldTransform().getOrigin() += btVector3(Real(0.2), 0, 0);
      }
      w.object(0).getWorldTransform().setOrigin({10, 10, 10});
    });
    ASSERT_EQ(twins.step(), std::nullopt);
    const int after = twins.ours().tree().getOverlappingPairCache()->getNumOverlappingPairs();
    EXPECT_GE(after - before, 3000);
  }
}

TEST(AabbUpdate, OrdersThePairsOfTheFixedSetFirst) {
  BoxTwins twins({2, 0});
  twins.both([](BoxWorld& w) {
    add_cloud_and_giant(w, 600);
    w.world().setForceUpdateAllAabbs(false);
    for (int i = 1; i < w.count(); i += 2) w.object(i).forceActivationState(ISLAND_SLEEPING);
  });
  for (int i = 0; i < 4; ++i) ASSERT_EQ(twins.step(), std::nullopt);
  ASSERT_EQ(twins.ours().tree().m_sets[btDbvtBroadphase::FIXED_SET].m_leaves, 300);
  twins.both([](BoxWorld& w) { w.object(0).getWorldTransform().setOrigin({10, 10, 10}); });
  ASSERT_EQ(twins.step(), std::nullopt);
  // All wake up in one step: each leaves the fixed set at its turn.
  twins.both([](BoxWorld& w) {
    for (int i = 1; i < w.count(); ++i) {
      w.object(i).forceActivationState(ACTIVE_TAG);
      w.object(i).getWorldTransform().getOrigin() += btVector3(Real(0.2), 0, 0);
    }
  });
  for (int i = 0; i < 4; ++i) ASSERT_EQ(twins.step(), std::nullopt);
  EXPECT_EQ(twins.ours().tree().m_sets[btDbvtBroadphase::FIXED_SET].m_leaves, 0);
}

TEST(AabbUpdate, MovesAllLeavesToOnePlaceAndApart) {
  BoxTwins twins({2, 0});
  twins.both([](BoxWorld& w) { add_cloud_and_giant(w, 400); });
  for (int step = 0; step < 6; ++step) {
    ASSERT_EQ(twins.step(), std::nullopt);
    Random random(static_cast<std::uint64_t>(step));
    std::vector<btVector3> places;
    for (int i = 0; i < twins.stock().count(); ++i) {
      places.push_back(step % 2 == 0 ? btVector3(1, 2, 3) : random_place(random, 1e5));
    }
    twins.both([&](BoxWorld& w) {
      for (int i = 0; i < w.count(); ++i) {
        w.object(i).getWorldTransform().setOrigin(places[static_cast<std::size_t>(i)]);
      }
    });
  }
}

/// Non-finite positions, AABBs that are too large, and a shape whose bounds only the user knows.
class UserSphere : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
  void getAabb(const btTransform& pose, btVector3& lower, btVector3& upper) const override {
    ++calls;
    btSphereShape::getAabb(pose, lower, upper);
  }
  static inline int calls = 0;
};

TEST(ProxyRemoval, HasStocksPairsWhenHundredsOfBodiesAreRemoved) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const int bodies : {60, 400}) {  // 400 bodies have more pairs than one thread searches
    BoxTwins twins({.threads = 3});
    twins.both([&](BoxWorld& w) {
      Random places(seed);
      for (int i = 0; i < bodies; ++i) {
        w.add(std::make_unique<btSphereShape>(Real(0.5)), random_place(places, Real(0.5)), 0, 1,
              -1);
      }
    });
    ASSERT_FALSE(twins.step());
    for (int left = bodies; left > 0; --left) {
      const auto i = static_cast<int>(random.below(static_cast<std::uint64_t>(left)));
      twins.both([&](BoxWorld& w) { w.remove(i); });
      if (left % 20 != 0) continue;
      const auto difference = twins.compare();
      ASSERT_FALSE(difference) << left << " of " << bodies << " bodies: " << *difference;
    }
    EXPECT_EQ(twins.ours().removed(), bodies);
  }
}

TEST(AabbUpdate, UpdatesOneByOneWhatItCannotComputeInAdvance) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  for (const btVector3& place : {btVector3(nan, 0, 0), btVector3(Real(1e18), 0, 0)}) {
    for (const int flags : {0, int{btCollisionObject::CF_STATIC_OBJECT}}) {
      BoxTwins twins({2, 0});
      twins.both([&](BoxWorld& w) {
        add_cloud_and_giant(w, 50);
        w.object(20).setCollisionFlags(flags);
      });
      ASSERT_EQ(twins.step(), std::nullopt);
      twins.both([&](BoxWorld& w) { w.object(20).getWorldTransform().setOrigin(place); });
      for (int i = 0; i < 3; ++i) ASSERT_EQ(twins.step(), std::nullopt);
    }
  }
  BoxTwins twins({2, 0});
  twins.both([](BoxWorld& w) {
    add_cloud_and_giant(w, 50);
    w.add(std::make_unique<UserSphere>(Real(1)), btVector3(1, 1, 1), 0, 1, -1);
  });
  ASSERT_EQ(twins.step(), std::nullopt);
  UserSphere::calls = 0;
  ASSERT_EQ(twins.step(), std::nullopt);
  EXPECT_EQ(UserSphere::calls, 2) << "once in each world";
}

TEST(AabbUpdate, LeavesGhostsOfTheUserToBullet) {
  btGhostPairCallback callback;
  BoxTwins twins({2, 0});
  std::vector<UserGhost*> ghosts;
  twins.both([&](BoxWorld& w) {
    w.tree().m_paircache->setInternalGhostPairCallback(&callback);
    auto ghost = std::make_unique<UserGhost>();
    ghosts.push_back(ghost.get());
    w.add(std::make_unique<btSphereShape>(Real(5)), btVector3(10, 10, 10), 0, 1, -1,
          std::move(ghost));
    add_cloud_and_giant(w, 300);
  });
  for (int step = 0; step < 4; ++step) {
    ASSERT_EQ(twins.step(), std::nullopt);
    EXPECT_EQ(ghosts[0]->added, ghosts[1]->added);
  }
  EXPECT_EQ(twins.ours().updated(), 0);
  EXPECT_EQ(twins.ours().cleaned(), 0);
}

TEST(AabbUpdate, SeesLeavesThatBelongToNoObject) {
  BoxTwins twins({2, 0});
  btCollisionObject trigger;
  btSphereShape shape(1);
  trigger.setCollisionShape(&shape);
  btBroadphaseProxy* proxies[2] = {};
  int world = 0;
  twins.both([&](BoxWorld& w) {
    add_cloud_and_giant(w, 100);
    proxies[world++] = w.tree().createProxy(btVector3(0, 0, 0), btVector3(10, 10, 10),
                                            SPHERE_SHAPE_PROXYTYPE, &trigger, 1, -1, nullptr);
  });
  for (int step = 0; step < 3; ++step) {
    twins.both([](BoxWorld& w) { w.object(0).getWorldTransform().setOrigin({20, 10, 10}); });
    ASSERT_EQ(twins.step(), std::nullopt);
  }
  world = 0;
  twins.both(
      [&](BoxWorld& w) { w.tree().destroyProxy(proxies[world++], w.world().getDispatcher()); });
}

/// Installs the arenas before any test allocates.
const bool g_installed = [] {
  test::Arena::install();
  return true;
}();

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
