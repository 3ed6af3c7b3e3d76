/// Bodies of many shapes fall onto terrains: stock and ours stay bit-identical with all three
/// classes and any number of threads.
#include "src/base/floating_point.hpp"
#include "tests/bullet/all_parts.hpp"

#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleInfoMap.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <array>
#include <cfenv>
#include <set>
#include <utility>

#if !defined(_WIN32)
#include "tests/bullet/stack_use.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr int kEdge = 17;  ///< points of a terrain along each of its edges

/// The heights of a terrain of hills, of `kEdge` x `kEdge` points with distance 1.
class Hills {
 public:
  explicit Hills(std::uint64_t seed) {
    Random random(seed);
    for (btScalar& height : heights_) height = random.uniform(0, Real(1.2));
    for (int z = 0; z + 1 < kEdge; ++z) {
      for (int x = 0; x + 1 < kEdge; ++x) {
        mesh_.addTriangle(point(x, z), point(x, z + 1), point(x + 1, z));
        mesh_.addTriangle(point(x + 1, z), point(x, z + 1), point(x + 1, z + 1));
      }
    }
  }
  btTriangleMesh* mesh() { return &mesh_; }
  const btScalar* heights() const { return heights_.data(); }

 private:
  btVector3 point(int x, int z) const {
    return {btScalar(x - kEdge / 2), heights_[static_cast<std::size_t>(z * kEdge + x)],
            btScalar(z - kEdge / 2)};
  }
  std::array<btScalar, kEdge * kEdge> heights_;
  btTriangleMesh mesh_;
};

/// A hull of eight points of a cube, moved at random.
btCollisionShape* make_hull(Random& random) {
  auto* hull = new btConvexHullShape();
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p =
        random.uniform_in_box({Real(0.2), Real(0.2), Real(0.2)}, {Real(0.4), Real(0.4), Real(0.4)});
    hull->addPoint({(corner & 1) != 0 ? p.x : -p.x, (corner & 2) != 0 ? p.y : -p.y,
                    (corner & 4) != 0 ? p.z : -p.z},
                   false);
  }
  hull->recalcLocalAabb();
  return hull;
}

btCollisionShape* make_multi_sphere(Random& random) {
  const btVector3 centers[] = {{btScalar(-0.25), 0, 0}, {btScalar(0.25), 0, 0}};
  const btScalar radii[] = {random.uniform(Real(0.15), Real(0.3)),
                            random.uniform(Real(0.15), Real(0.3))};
  return new btMultiSphereShape(centers, radii, 2);
}

btCollisionShape* make_falling_shape(int kind, Random& random) {
  switch (kind) {
    case 0:
      return make_hull(random);
    case 1:
      return make_multi_sphere(random);
    case 2:
      return new btSphereShape(random.uniform(Real(0.2), Real(0.45)));
    case 3:
      return new btBoxShape(
          btVector3(btScalar(0.3), random.uniform(Real(0.2), Real(0.4)), btScalar(0.25)));
    case 4:
      return new btCapsuleShape(btScalar(0.2), random.uniform(Real(0.2), Real(0.5)));
    default:
      return new btCylinderShape(
          btVector3(btScalar(0.3), random.uniform(Real(0.1), Real(0.4)), btScalar(0.3)));
  }
}
constexpr int kFallingShapes = 6;

enum class Terrain { triangles, scaled_triangles, heights };

btCollisionShape* make_terrain(Terrain terrain, Hills& hills, BulletWorld& w) {
  if (terrain == Terrain::heights) {
    return new btHeightfieldTerrainShape(kEdge, kEdge, hills.heights(), 0, btScalar(1.2), 1, false);
  }
  auto* mesh = new btBvhTriangleMeshShape(hills.mesh(), true);
  if (terrain == Terrain::triangles) return mesh;
  w.keep(mesh);
  return new btScaledBvhTriangleMeshShape(mesh, btVector3(1, btScalar(1.5), 1));
}

/// A terrain, and bodies of all shapes above it. From 256 bodies on, jfpx updates the AABBs in
/// parallel.
void add_landscape(BulletWorld& w, Terrain terrain, Hills& hills, std::uint64_t seed, int bodies) {
  w.add(w.keep(make_terrain(terrain, hills, w)), btVector3(0, 0, 0), 0)->setFriction(1);
  Random random(seed);
  for (int i = 0; i < bodies; ++i) {
    const Vec3 p = random.uniform_in_box({-4, 2, -4}, {4, 9, 4});
    btCollisionShape* shape = w.keep(make_falling_shape(i % kFallingShapes, random));
    btRigidBody* body = w.add(shape, btVector3(p.x, p.y, p.z), random.uniform(Real(0.5), 2));
    body->setAngularVelocity(btVector3(p.z, 1, p.x));
    body->setRollingFriction(btScalar(0.05));
  }
}

using TypePair = std::pair<int, int>;
TypePair type_pair(int a, int b) { return std::minmax(a, b); }

/// Shape types of the bodies that touch.
void note_touching(BulletWorld& w, std::set<TypePair>* pairs) {
  for (int i = 0; i < w.dispatcher->getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *w.dispatcher->getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() == 0) continue;
    pairs->insert(type_pair(manifold.getBody0()->getCollisionShape()->getShapeType(),
                            manifold.getBody1()->getCollisionShape()->getShapeType()));
  }
}

struct TerrainCase {
  const char* name;
  Terrain terrain;
  int type;  ///< BroadphaseNativeTypes
};

class Terrains : public ::testing::TestWithParam<TerrainCase> {};

TEST_P(Terrains, BodiesOfAllShapesMoveAsInStockBullet) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);  // outlives the worlds
  for (const unsigned threads : {1u, 3u}) {
    // Everything that jfpx supports is computed by jfpx.
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both(
        [&](BulletWorld& w) { add_landscape(w, GetParam().terrain, hills, seed + threads, 300); });
    std::set<TypePair> touching;
    for (int step = 0; step < 120; ++step) {
      ASSERT_TRUE(twins.step()) << threads << " threads";
      note_touching(twins.ours(), &touching);
    }
    for (const int type :
         {CONVEX_HULL_SHAPE_PROXYTYPE, MULTI_SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE,
          BOX_SHAPE_PROXYTYPE, CAPSULE_SHAPE_PROXYTYPE, CYLINDER_SHAPE_PROXYTYPE}) {
      EXPECT_TRUE(touching.contains(type_pair(type, GetParam().type))) << "shape type " << type;
    }
    EXPECT_TRUE(
        touching.contains(type_pair(CONVEX_HULL_SHAPE_PROXYTYPE, MULTI_SPHERE_SHAPE_PROXYTYPE)));
    EXPECT_GT(twins.stats().batches, 100u);
    EXPECT_GT(twins.stats().written, 0u);
    EXPECT_GT(twins.stats().convex_pairs, 0u);
    EXPECT_GT(dynamic_cast<ConstraintSolver&>(*twins.ours().solver).stats().groups, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, Terrains,
    ::testing::Values(TerrainCase{"triangles", Terrain::triangles, TRIANGLE_MESH_SHAPE_PROXYTYPE},
                      TerrainCase{"scaledtriangles", Terrain::scaled_triangles,
                                  SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE},
                      TerrainCase{"heights", Terrain::heights, TERRAIN_SHAPE_PROXYTYPE}),
    [](const auto& tested) { return std::string(tested.param.name); });

/// The usual callback of a program whose terrain is a mesh.
bool adjust_edges(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a,
                  int index_a, const btCollisionObjectWrapper* b, int part_b, int index_b) {
  log_event("contact " + name_of(a->getCollisionObject()) + " " + name_of(b->getCollisionObject()) +
            " " + std::to_string(index_b));
  static_cast<void>(part_a);
  static_cast<void>(index_a);
  btAdjustInternalEdgeContacts(point, b, a, part_b, index_b);
  return true;
}

TEST(InternalEdges, OfATerrainAreSmoothedAsInStockBullet) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);
  btTriangleInfoMap stock_edges, our_edges;  // outlive the worlds
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    gContactAddedCallback = adjust_edges;
    twins.both([&](BulletWorld& w) {
      add_landscape(w, Terrain::triangles, hills, seed, 100);
      btTriangleInfoMap* edges = &w == &twins.ours() ? &our_edges : &stock_edges;
      edges->clear();
      auto* mesh = static_cast<btBvhTriangleMeshShape*>(w.bodies[0]->getCollisionShape());
      btGenerateInternalEdgeInfo(mesh, edges);
      w.bodies[0]->setCollisionFlags(w.bodies[0]->getCollisionFlags() |
                                     btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    });
    const bool same = twins.step(100);
    gContactAddedCallback = nullptr;
    ASSERT_TRUE(same) << threads << " threads";
    EXPECT_GT(twins.ours().log.size(), 100u);
    EXPECT_EQ(twins.stats().last_order, OrderReason::added_callback);
  }
}

TEST(MovingMeshes, OfGImpactFallAmongBodiesAsInStockBullet) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);
  btTriangleMesh tetrahedron;
  const btVector3 corners[] = {{-1, 0, -1}, {1, 0, -1}, {0, 0, 1}, {0, btScalar(1.2), 0}};
  for (int left_out = 0; left_out < 4; ++left_out) {
    tetrahedron.addTriangle(corners[(left_out + 1) % 4], corners[(left_out + 2) % 4],
                            corners[(left_out + 3) % 4]);
  }
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both([&](BulletWorld& w) {
      btGImpactCollisionAlgorithm::registerAlgorithm(w.dispatcher.get());
      add_landscape(w, Terrain::triangles, hills, seed, 60);
      for (int i = 0; i < 4; ++i) {
        auto* mesh = new btGImpactMeshShape(&tetrahedron);
        mesh->setMargin(btScalar(0.05));
        mesh->updateBound();
        w.add(w.keep(mesh), btVector3(btScalar(i - 2), 9, btScalar(i % 2)), 2);
      }
    });
    ASSERT_TRUE(twins.step(100)) << threads << " threads";
    // Steps in which fewer than two spheres have pairs are left to Bullet.
    EXPECT_GT(twins.stats().batches, 0u);
  }
}

/// Callbacks that note what they see, and sometimes change the bodies of the contact.
void note(const char* event, const btManifoldPoint& point) {
  log_event(std::string(event) + " " + bits_of(point.m_distance1) + " " +
            bits_of(point.m_normalWorldOnB) + " " + bits_of(point.m_localPointA) + " " +
            std::to_string(point.m_lifeTime));
}
void note(const char* event, const btPersistentManifold& manifold) {
  log_event(std::string(event) + " " + name_of(manifold.getBody0()) + " " +
            name_of(manifold.getBody1()) + " " + std::to_string(manifold.getNumContacts()));
  for (int i = 0; i < manifold.getNumContacts(); ++i) note("point", manifold.getContactPoint(i));
}
void note(const btCollisionObjectWrapper& wrapper) {
  const btCollisionShape& shape = *wrapper.getCollisionShape();
  std::string text = name_of(wrapper.getCollisionObject()) + " " +
                     std::to_string(shape.getShapeType()) + " " + bits_of(shape.getMargin()) + " " +
                     bits_of(wrapper.getWorldTransform().getOrigin()) + " " +
                     std::to_string(wrapper.m_partId) + " " + std::to_string(wrapper.m_index);
  if (wrapper.m_parent != nullptr) {
    text += " in " + std::to_string(wrapper.m_parent->getCollisionShape()->getShapeType());
  }
  if (shape.getShapeType() == TRIANGLE_SHAPE_PROXYTYPE) {
    const auto& triangle = static_cast<const btTriangleShape&>(shape);
    for (const btVector3& vertex : triangle.m_vertices1) text += " " + bits_of(vertex);
  }
  log_event(std::move(text));
}
bool g_disturbs = false;
void disturb(const btCollisionObject* object) {
  if (g_current == nullptr || !g_disturbs || g_current->log.size() % 17 != 0) return;
  auto* body = btRigidBody::upcast(const_cast<btCollisionObject*>(object));
  if (body == nullptr || body->isStaticObject()) return;
  btVector3& origin = body->getWorldTransform().getOrigin();
  origin.setY(origin.y() - btScalar(0.02));
  if (body->getCollisionShape()->getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    auto* sphere = static_cast<btSphereShape*>(body->getCollisionShape());
    sphere->setUnscaledRadius(sphere->getRadius() * btScalar(1.01));
  }
}
bool observe_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a,
                   int index_a, const btCollisionObjectWrapper* b, int part_b, int index_b) {
  note("added", point);
  note(*a);
  note(*b);
  for (const int number : {part_a, index_a, part_b, index_b}) log_event(std::to_string(number));
  point.m_combinedFriction = btScalar(0.25);
  point.m_normalWorldOnB = (point.m_normalWorldOnB + btVector3(0, btScalar(0.1), 0)).normalized();
  point.m_userPersistentData = const_cast<btCollisionObject*>(a->getCollisionObject());
  disturb(a->getCollisionObject());
  disturb(b->getCollisionObject());
  return true;
}
bool observe_processed(btManifoldPoint& point, void* a, void* b) {
  note("processed", point);
  disturb(static_cast<btCollisionObject*>(a));
  disturb(static_cast<btCollisionObject*>(b));
  return true;
}
bool observe_destroyed(void* data) {
  log_event("destroyed " + name_of(static_cast<btCollisionObject*>(data)));
  return true;
}
void observe_started(btPersistentManifold* const& manifold) {
  note("started", *manifold);
  disturb(manifold->getBody0());
}
void observe_ended(btPersistentManifold* const& manifold) {
  note("ended", *manifold);
  disturb(manifold->getBody0());
}

class ObservedTerrains : public ::testing::Test {
 protected:
  ~ObservedTerrains() override { observe(0); }

  static void observe(unsigned which) {
    gContactAddedCallback = (which & 1) != 0 ? observe_added : nullptr;
    gContactProcessedCallback = (which & 2) != 0 ? observe_processed : nullptr;
    gContactDestroyedCallback = (which & 4) != 0 ? observe_destroyed : nullptr;
    gContactStartedCallback = (which & 8) != 0 ? observe_started : nullptr;
    gContactEndedCallback = (which & 16) != 0 ? observe_ended : nullptr;
  }
};

TEST_F(ObservedTerrains, CallTheCallbacksOfStockBullet) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);  // outlives the worlds
  Random random(seed);
  std::uint64_t concaves = 0, boxes = 0, planes = 0;
  for (const Terrain terrain : {Terrain::triangles, Terrain::scaled_triangles, Terrain::heights}) {
    for (unsigned repeat = 0; repeat < 6; ++repeat) {
      const unsigned which = 1 + static_cast<unsigned>(random.below(31));
      g_disturbs = repeat % 2 == 1;
      Twins twins(all_parts(1 + repeat % 3, {.minimum_batch = 0}, {.minimum_batch = 0}));
      twins.both([&](BulletWorld& w) {
        add_landscape(w, terrain, hills, seed + which, 60);
        w.add(w.keep(new btStaticPlaneShape(btVector3(1, 0, 0), -5)), btVector3(0, 0, 0), 0);
        w.add(w.keep(new btBoxShape(btVector3(1, 6, 10))), btVector3(5, 1, 0), 0);
        // Touches more triangles than small spheres.
        w.add_sphere(2, btVector3(0, 5, 0), 5);
        for (std::size_t i = 0; i < w.bodies.size(); i += 2) {
          w.bodies[i]->setCollisionFlags(w.bodies[i]->getCollisionFlags() |
                                         btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        }
      });
      observe(which);
      const bool same = twins.step(60);
      observe(0);
      ASSERT_TRUE(same) << "callbacks " << which << " disturb " << g_disturbs;
      concaves += twins.stats().sphere_concaves;
      boxes += twins.stats().sphere_boxes;
      planes += twins.stats().sphere_planes;
      EXPECT_EQ(twins.stats().ordered[0], 0u);
    }
  }
  EXPECT_GT(concaves, 0u);
  EXPECT_GT(boxes, 0u);
  EXPECT_GT(planes, 0u);
}

#if defined(NDEBUG) && !defined(_WIN32)  // where a thread takes no stack from its creator
TEST(SmallStacks, AreUsedLittleMoreThanByStockBullet) {
  if (kAddressSanitizer || kThreadSanitizer) GTEST_SKIP() << "sanitizers enlarge stack frames";
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);
  const auto most = [](BulletWorld& w) {
    std::size_t use = 0;
    for (int step = 0; step < 60; ++step) {
      use = std::max(use, stack_use([&] { w.world.stepSimulation(btScalar(1) / 60, 0); }));
    }
    return use;
  };
  for (const unsigned threads : {1u, 3u}) {
    for (const Terrain terrain : {Terrain::triangles, Terrain::heights}) {
      gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return true; };
      if (threads == 3 || terrain == Terrain::heights) gContactProcessedCallback = nullptr;
      Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
      twins.both([&](BulletWorld& w) { add_landscape(w, terrain, hills, seed, 300); });
      ASSERT_TRUE(twins.step());
      const std::size_t stock = most(twins.stock());
      EXPECT_LT(most(twins.ours()), stock + 4096) << threads << " threads; stock: " << stock;
      EXPECT_TRUE(twins.compare());
      gContactProcessedCallback = nullptr;
    }
  }
}
#endif

/// Restores the floating-point environment at the end of a test.
class EnvironmentKept {
 public:
  EnvironmentKept() = default;
  ~EnvironmentKept() { kept_.apply(); }
  EnvironmentKept(const EnvironmentKept&) = delete;
  EnvironmentKept& operator=(const EnvironmentKept&) = delete;

 private:
  FloatingPointEnvironment kept_;
};

constexpr int kTraps = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;

#if defined(__x86_64__) && !defined(_WIN32)  // few ARM64 processors have traps
TEST(FloatingPointEnvironment, MayHaveTrapsThatBulletDoesNotRaise) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(all_parts(threads, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both([&](BulletWorld& w) { add_landscape(w, Terrain::triangles, hills, seed, 300); });
    const EnvironmentKept kept;
    std::feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(kTraps);
    for (int step = 0; step < 60; ++step) {
      ASSERT_TRUE(twins.step()) << threads << " threads";
      ASSERT_EQ(fegetexcept(), kTraps);
      ASSERT_EQ(std::fetestexcept(kTraps), 0);
    }
    EXPECT_EQ(twins.stats().batches, 60u);
  }
}
#endif

TEST(FloatingPointEnvironment, WithAnotherRoundingModeIsLeftToBullet) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Hills hills(seed);
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    Twins twins(all_parts(3, {.minimum_batch = 0}, {.minimum_batch = 0}));
    twins.both([&](BulletWorld& w) { add_landscape(w, Terrain::triangles, hills, seed, 300); });
    ASSERT_TRUE(twins.step(10));
    const EnvironmentKept kept;
    std::fesetround(mode);
    ASSERT_TRUE(twins.step(50)) << mode;
    EXPECT_EQ(std::fegetround(), mode);
    EXPECT_EQ(twins.stats().fallbacks[static_cast<std::size_t>(Fallback::rounding)], 50u);
    const auto& solver = dynamic_cast<ConstraintSolver&>(*twins.ours().solver);
    EXPECT_GT(solver.stats().fallbacks[static_cast<std::size_t>(SolverFallback::rounding)], 0u);
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
