/// Convex shapes on meshes and height fields match btConvexConcaveCollisionAlgorithm bit for bit.
#include "src/bullet/dispatch/triangle_algorithms.hpp"
#include "tests/bullet/random_terrain.hpp"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/NarrowPhaseCollision/btMinkowskiPenetrationDepthSolver.h>

#include <algorithm>
#include <array>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// The same terrain in two worlds, and bodies near its surface.
class Landscape {
 public:
  struct Options {
    unsigned threads = 1;
    bool verify = false;
    /// Without polyhedra: Bullet reads outside of arrays if one has a pose that is not finite.
    bool only_round = false;
  };
  Landscape(std::uint64_t seed, const Options& options)
      : twins(batch_options(options.threads, options.verify)),
        terrains_{RandomTerrain(seed), RandomTerrain(seed)} {
    Random random(seed + 1);
    const bool terrain_first = random.below(2) == 0;
    turn_ = random.below(2) == 0 ? random_turned_pose(random, 2) : btTransform::getIdentity();
    const std::uint64_t bodies_seed = random.below(1u << 30);
    const bool separating_axes = random.below(4) == 0;
    twins.both([&](BulletWorld& w) {
      w.world.getDispatchInfo().m_enableSatConvex = separating_axes;
      if (terrain_first) add_terrain(w);
      Random shapes(bodies_seed);
      for (int i = 0; i < kBodies; ++i) {
        std::uint64_t kind = shapes.below(kConvexKinds);
        if (options.only_round && kind != 1) kind = 8;
        btRigidBody* body = w.add(w.keep(make_random_convex(kind, shapes)), btVector3(0, 0, 0));
        body->setFriction(shapes.uniform(0, 2));
        body->setRollingFriction(shapes.uniform(0, Real(0.2)));
        if (i % 7 == 0) body->setContactStiffnessAndDamping(1000, btScalar(0.1));
        if (i % 11 == 0) {
          body->setCollisionFlags(body->getCollisionFlags() |
                                  btCollisionObject::CF_HAS_FRICTION_ANCHOR);
        }
      }
      if (!terrain_first) add_terrain(w);
      for (auto& body : w.bodies) {
        if (shapes.below(20) == 0 && body.get() != terrain_of(w)) {
          body->setIgnoreCollisionCheck(terrain_of(w), true);
        }
      }
    });
  }

  /// Moves all bodies; `extent` is small for bodies that keep their contacts.
  void move(Random& random, Real extent) {
    const std::uint64_t seed = random.below(1u << 30);
    twins.both([&](BulletWorld& w) {
      Random same(seed);
      for (auto& body : w.bodies) {
        if (body.get() == terrain_of(w)) continue;
        const btTransform turn = random_turned_pose(same, extent);
        if (extent > 1) {
          const Vec3 p = same.uniform_in_box({-6, Real(-1.2), -6}, {6, Real(1.5), 6});
          body->setWorldTransform(turn_ *
                                  btTransform(turn.getRotation(), btVector3(p.x, p.y, p.z)));
        } else {
          body->getWorldTransform().setOrigin(body->getWorldTransform().getOrigin() +
                                              turn.getOrigin());
        }
        if (same.below(30) == 0) body->getCollisionShape()->setMargin(same.uniform(0, Real(0.1)));
      }
    });
  }
  void move_terrain(Random& random) {
    const btTransform shift = random_turned_pose(random, Real(0.05));
    twins.both([&](BulletWorld& w) {
      terrain_of(w)->getWorldTransform().setOrigin(terrain_of(w)->getWorldTransform().getOrigin() +
                                                   shift.getOrigin());
    });
  }
  void deform(Random& random) {
    const std::uint64_t seed = random.below(1u << 30);
    for (RandomTerrain& terrain : terrains_) {
      Random same(seed);
      terrain.deform(same);
    }
  }
  /// Sets heights to special or extreme values, without adapting the tree of a mesh.
  void spoil_heights(Random& random) {
    const std::uint64_t seed = random.below(1u << 30);
    for (RandomTerrain& terrain : terrains_) {
      Random same(seed);
      for (int k = 0; k < 8; ++k) terrain.set_height(same, random_extreme(same));
    }
  }
  /// Finds the pairs and dispatches them.
  bool detect() {
    twins.both([](BulletWorld& w) { w.world.performDiscreteCollisionDetection(); });
    return twins.compare();
  }
  btRigidBody* terrain_of(BulletWorld& w) { return terrain_bodies_[&w == &twins.ours() ? 1 : 0]; }

  Twins twins;

 private:
  static constexpr int kBodies = 60;

  void add_terrain(BulletWorld& w) {
    const std::size_t i = &w == &twins.ours() ? 1 : 0;
    terrain_bodies_[i] = w.add(terrains_[i].shape(), btVector3(0, 0, 0), 0);
    terrain_bodies_[i]->setWorldTransform(turn_);
  }

  std::array<RandomTerrain, 2> terrains_;
  std::array<btRigidBody*, 2> terrain_bodies_{};
  btTransform turn_;
};

TEST(ConcaveCommit, HasEveryBitOfBulletsAlgorithmForAnyNumberOfThreads) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  std::uint64_t spheres = 0, others = 0;
  std::array<std::uint64_t, kConcaveFallbackCount> fallbacks{};
  for (int i = 0; i < 60; ++i) {
    constexpr std::array<unsigned, 3> kThreads = {1, 3, 16};
    const std::uint64_t world_seed = random.below(1u << 30);
    SCOPED_TRACE("world " + std::to_string(world_seed));
    Landscape landscape(world_seed,
                        {.threads = kThreads[static_cast<std::size_t>(i) % kThreads.size()]});
    for (int k = 0; k < 12; ++k) {
      landscape.move(random, k % 4 == 0 ? Real(2) : Real(0.01));
      if (random.below(3) == 0) landscape.move_terrain(random);
      if (random.below(4) == 0) landscape.deform(random);
      ASSERT_TRUE(landscape.detect()) << "dispatch " << k;
    }
    const DispatchStats& stats = landscape.twins.stats();
    spheres += stats.sphere_concaves;
    others += stats.concave_pairs;
    for (std::size_t k = 0; k < fallbacks.size(); ++k) fallbacks[k] += stats.concave_fallbacks[k];
  }
  EXPECT_GT(spheres, 5000u);
  EXPECT_GT(others, 5000u);
  const auto count = [&](ConcaveFallback fallback) {
    return fallbacks[static_cast<std::size_t>(fallback)];
  };
  EXPECT_EQ(count(ConcaveFallback::concave_class), 0u);
  EXPECT_GT(count(ConcaveFallback::convex_class), 0u);
  EXPECT_GT(count(ConcaveFallback::separating_axes), 0u);
  EXPECT_EQ(count(ConcaveFallback::not_finite), 0u);
}

TEST(ConcaveCommit, HasBulletsBitsForExtremePoses) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  std::uint64_t not_finite = 0;
  for (int i = 0; i < 60; ++i) {
    const std::uint64_t world_seed = random.below(1u << 30);
    SCOPED_TRACE("world " + std::to_string(world_seed));
    Landscape landscape(world_seed, {.threads = i % 2 == 0 ? 1u : 3u, .only_round = true});
    landscape.move(random, 2);
    ASSERT_TRUE(landscape.detect());
    for (int k = 0; k < 5; ++k) {
      const std::uint64_t pose_seed = random.below(1u << 30);
      landscape.twins.both([&](BulletWorld& w) {
        Random same(pose_seed);
        for (auto& body : w.bodies) {
          if (same.below(4) != 0) continue;
          // The boxes of the broadphase keep their places, so that the pairs remain.
          btVector3& origin = body->getWorldTransform().getOrigin();
          origin[static_cast<int>(same.below(3))] = random_extreme(same);
        }
      });
      ASSERT_TRUE(landscape.twins.dispatch()) << "dispatch " << k;
    }
    not_finite += landscape.twins.stats()
                      .concave_fallbacks[static_cast<std::size_t>(ConcaveFallback::not_finite)];
  }
  EXPECT_GT(not_finite, 100u);
}

TEST(ConcaveCommit, HasBulletsBitsForExtremeVertices) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  for (int i = 0; i < 60; ++i) {
    const std::uint64_t world_seed = random.below(1u << 30);
    SCOPED_TRACE("world " + std::to_string(world_seed));
    Landscape landscape(world_seed, {.threads = i % 2 == 0 ? 1u : 3u, .only_round = true});
    for (int k = 0; k < 4; ++k) {
      landscape.move(random, k == 0 ? Real(2) : Real(0.01));
      ASSERT_TRUE(landscape.detect()) << "dispatch " << k;
      landscape.spoil_heights(random);
    }
  }
}

TEST(ConcaveCommit, IsVerifiedAgainstBulletsAlgorithm) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Landscape landscape(seed, {.threads = 3, .verify = true});
  for (int k = 0; k < 12; ++k) {
    landscape.move(random, k % 4 == 0 ? Real(2) : Real(0.01));
    ASSERT_TRUE(landscape.detect()) << "dispatch " << k;
  }
  const DispatchStats& stats = landscape.twins.stats();
  EXPECT_GT(stats.sphere_concaves, 0u);
  EXPECT_EQ(stats.concave_pairs, 0u);
  EXPECT_GT(stats.concave_fallbacks[static_cast<std::size_t>(ConcaveFallback::verified)], 0u);
  EXPECT_GE(stats.verified, stats.sphere_concaves);
  EXPECT_EQ(stats.mismatches, 0u) << stats.first_mismatch;
}

/// A mesh whose arrays are locked by the user.
class LockedArrays final : public btTriangleIndexVertexArray {
 public:
  void getLockedReadOnlyVertexIndexBase(const unsigned char** vertices, int& vertex_count,
                                        PHY_ScalarType& type, int& stride,
                                        const unsigned char** indices, int& index_stride,
                                        int& face_count, PHY_ScalarType& index_type,
                                        int part) const override {
    ++locks_;
    btTriangleIndexVertexArray::getLockedReadOnlyVertexIndexBase(
        vertices, vertex_count, type, stride, indices, index_stride, face_count, index_type, part);
  }
  void unLockReadOnlyVertexBase(int) const override { --locks_; }
  int locks() const { return locks_; }

 private:
  mutable int locks_ = 0;
};

/// Two triangles below four balls and four boxes that rest on them.
struct Table {
  void fill(BulletWorld& w, btTriangleIndexVertexArray* arrays) {
    btIndexedMesh part;
    part.m_numTriangles = 2;
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(indices.data());
    part.m_triangleIndexStride = 3 * sizeof(int);
    part.m_numVertices = 4;
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(vertices.data());
    part.m_vertexStride = 3 * sizeof(btScalar);
    arrays->addIndexedMesh(part);
    w.add(w.keep(new btBvhTriangleMeshShape(arrays, true)), btVector3(0, 0, 0), 0);
    for (int i = 0; i < 8; ++i) {
      btCollisionShape* shape = nullptr;
      if (i % 2 == 0) {
        shape = new btSphereShape(btScalar(0.4));
      } else {
        shape = new btBoxShape(btVector3(btScalar(0.3), btScalar(0.4), btScalar(0.3)));
      }
      w.add(w.keep(shape), btVector3(btScalar(i) - 4, btScalar(0.4), btScalar(0.1)));
    }
  }
  std::vector<btScalar> vertices = {-6, 0, -6, 6, 0, -6, -6, 0, 6, 6, 0, 6};
  std::vector<int> indices = {0, 2, 1, 1, 2, 3};
};

std::uint64_t count_of(Twins& twins, ConcaveFallback fallback) {
  return twins.stats().concave_fallbacks[static_cast<std::size_t>(fallback)];
}

TEST(ConcaveCommit, LeavesArraysOfTheUserToBullet) {
  Table table;
  LockedArrays stock, ours;
  Twins twins(batch_options(3));
  twins.both([&](BulletWorld& w) { table.fill(w, &w == &twins.ours() ? &ours : &stock); });
  ASSERT_TRUE(twins.step(10));
  EXPECT_EQ(ours.locks(), stock.locks());
  EXPECT_EQ(count_of(twins, ConcaveFallback::concave_class), 9u * 8u) << "all but the first step";
  EXPECT_EQ(twins.stats().sphere_concaves + twins.stats().concave_pairs, 0u);
}

TEST(ConcaveCommit, LeavesAlgorithmsOfTheUserToBullet) {
  Table table;
  btTriangleIndexVertexArray stock, ours;
  btMinkowskiPenetrationDepthSolver depth_solver;
  btConvexConvexAlgorithm::CreateFunc boxes(&depth_solver), spheres(&depth_solver);
  Twins twins(batch_options(3));
  twins.both([&](BulletWorld& w) {
    table.fill(w, &w == &twins.ours() ? &ours : &stock);
    w.dispatcher->registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE,
                                              &boxes);
    w.dispatcher->registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE,
                                              &spheres);
  });
  ASSERT_TRUE(twins.step(10));
  EXPECT_EQ(count_of(twins, ConcaveFallback::create_function), 9u * 8u);
  EXPECT_EQ(twins.stats().sphere_concaves + twins.stats().concave_pairs, 0u);
}

TEST(ConcaveCommit, ReadsShapesThatTheUserReplaces) {
  Table table;
  btTriangleIndexVertexArray stock, ours;
  Twins twins(batch_options(3));
  twins.both([&](BulletWorld& w) { table.fill(w, &w == &twins.ours() ? &ours : &stock); });
  ASSERT_TRUE(twins.step(3));
  // Without cleaning the pairs, so that the algorithms remain.
  twins.both([](BulletWorld& w) {
    w.bodies[1]->setCollisionShape(w.bodies[2]->getCollisionShape());
    w.bodies[4]->setCollisionShape(w.bodies[3]->getCollisionShape());
    w.bodies[5]->setCollisionShape(w.keep(new btCapsuleShape(btScalar(0.3), btScalar(0.4))));
    auto* compound = new btCompoundShape();
    compound->addChildShape(btTransform::getIdentity(), w.bodies[3]->getCollisionShape());
    w.bodies[6]->setCollisionShape(w.keep(compound));
  });
  ASSERT_TRUE(twins.step(3));
  twins.both([](BulletWorld& w) {
    w.bodies[0]->setCollisionShape(w.keep(new btBoxShape(btVector3(6, btScalar(0.1), 6))));
  });
  ASSERT_TRUE(twins.step(3));
  EXPECT_GT(twins.stats().sphere_concaves, 0u);
  EXPECT_GT(twins.stats().concave_pairs, 0u);
  EXPECT_GT(count_of(twins, ConcaveFallback::convex_class), 0u);
  EXPECT_GT(count_of(twins, ConcaveFallback::concave_class), 0u);
}

TEST(ConcaveCommit, RunsBatchesWithoutSpheresOnOneThread) {
  RandomTerrain stock(8), ours(8);
  for (const int boxes : {20, 100}) {
    Twins twins(batch_options(1));
    twins.both([&](BulletWorld& w) {
      w.add((&w == &twins.ours() ? ours : stock).shape(), btVector3(0, 0, 0), 0);
      auto* box = w.keep(new btBoxShape(btVector3(btScalar(0.2), btScalar(0.3), btScalar(0.2))));
      for (int i = 0; i < boxes; ++i) {
        w.add(box, btVector3(btScalar(i % 10) - 5, btScalar(0.5), btScalar(i / 10) - 5));
      }
    });
    ASSERT_TRUE(twins.step(5));
    EXPECT_EQ(twins.stats().batches > 0, boxes == 100);
    EXPECT_EQ(twins.stats().concave_pairs > 0, boxes == 100);
  }
}

TEST(ConcaveFallbacks, HaveDifferentTexts) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < kConcaveFallbackCount; ++i) {
    texts.emplace_back(to_string(static_cast<ConcaveFallback>(i)));
  }
  std::sort(texts.begin(), texts.end());
  EXPECT_EQ(std::unique(texts.begin(), texts.end()), texts.end());
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "unknown"), 0);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
