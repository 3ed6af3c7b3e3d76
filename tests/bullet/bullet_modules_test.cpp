/// Other modules of Bullet: characters, multi-bodies, serialization; and several threads.
#include <jfpx/bullet/scene_world.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <LinearMath/btSerializer.h>

#include <cstring>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// A ghost with its own pair cache, which the controller dispatches several times per step.
struct Walker {
  btSphereShape shape{btScalar(0.5)};
  btPairCachingGhostObject ghost;
  btKinematicCharacterController controller;

  explicit Walker(BulletWorld* w)
      : controller(&ghost, &shape, btScalar(0.3), btVector3(0, 1, 0)), world_(w) {
    btTransform pose;
    pose.setIdentity();
    pose.setOrigin(btVector3(-1, btScalar(0.6), btScalar(1.5)));
    ghost.setWorldTransform(pose);
    ghost.setCollisionShape(&shape);
    ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
    ghost.setUserIndex(1000);
    w->world.addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter,
                                btBroadphaseProxy::AllFilter);
    w->world.addAction(&controller);
    controller.setWalkDirection(btVector3(btScalar(0.03), 0, btScalar(0.002)));
  }
  ~Walker() {
    world_->world.removeAction(&controller);
    world_->world.removeCollisionObject(&ghost);
  }
  Walker(const Walker&) = delete;
  Walker& operator=(const Walker&) = delete;

 private:
  BulletWorld* world_;
};

TEST(BulletModules, KinematicCharacterWalksThroughAHeap) {
  btGhostPairCallback ghosts;  // must outlive the worlds
  Twins twins;
  twins.both([&](BulletWorld& w) {
    w.broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&ghosts);
    add_heap(w, 40, 61);
  });
  Walker stock(&twins.stock()), ours(&twins.ours());
  int overlaps = 0;
  for (int i = 0; i < 120; ++i) {
    if (i == 60) {
      stock.controller.jump();
      ours.controller.jump();
    }
    ASSERT_TRUE(twins.step());
    const btTransform &p = stock.ghost.getWorldTransform(), &q = ours.ghost.getWorldTransform();
    ASSERT_EQ(std::memcmp(&p, &q, sizeof p), 0) << "in step " << i;
    overlaps += ours.ghost.getNumOverlappingObjects();
  }
  EXPECT_GT(overlaps, 100) << "the character must overlap bodies";
  EXPECT_GE(twins.stats().dispatches, 240u) << "the character must dispatch its own pair cache";
}

/// A chain of spheres, each a link of one multi-body, that falls onto a heap of spheres.
struct MultiBodyWorld {
  btDefaultCollisionConfiguration configuration;
  std::unique_ptr<btCollisionDispatcher> dispatcher;
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world;
  btBoxShape ground{btVector3(50, 1, 50)};
  btSphereShape ball{btScalar(0.4)};
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;
  btMultiBody chain{4, 1, btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)), false, false};

  explicit MultiBodyWorld(std::unique_ptr<btCollisionDispatcher> d)
      : dispatcher(std::move(d)), world(dispatcher.get(), &broadphase, &solver, &configuration) {
    add(&ground, 0, btVector3(0, -1, 0));
    for (int i = 0; i < 20; ++i) {
      add(&ball, 1,
          btVector3(btScalar(0.3) * btScalar(i % 5),
                    btScalar(0.5) + btScalar(0.6) * btScalar(i / 5), 0));
    }
    for (int i = 0; i < 4; ++i) {
      chain.setupSpherical(i, 1, btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)), i - 1,
                           btQuaternion::getIdentity(), btVector3(0, btScalar(-0.45), 0),
                           btVector3(0, btScalar(-0.45), 0), false);
    }
    chain.finalizeMultiDof();
    chain.setBasePos(btVector3(btScalar(0.5), 8, btScalar(0.1)));
    world.addMultiBody(&chain);
    for (int link = -1; link < 4; ++link) {
      colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&chain, link));
      colliders.back()->setCollisionShape(&ball);
      colliders.back()->setUserIndex(100 + link);
      world.addCollisionObject(colliders.back().get());
      (link < 0 ? chain.setBaseCollider(colliders.back().get())
                : void(chain.getLink(link).m_collider = colliders.back().get()));
    }
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    chain.forwardKinematics(rotations, origins);
    chain.updateCollisionObjectWorldTransforms(rotations, origins);
  }
  ~MultiBodyWorld() {
    for (auto& collider : colliders) world.removeCollisionObject(collider.get());
    world.removeMultiBody(&chain);
    for (auto& body : bodies) world.removeRigidBody(body.get());
  }

  void add(btCollisionShape* shape, btScalar mass, const btVector3& position) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, inertia));
    btTransform pose;
    pose.setIdentity();
    pose.setOrigin(position);
    bodies.back()->setWorldTransform(pose);
    bodies.back()->setInterpolationWorldTransform(pose);
    bodies.back()->setUserIndex(static_cast<int>(bodies.size()) - 1);
    world.addRigidBody(bodies.back().get());
  }
};

TEST(BulletModules, LinksOfAMultiBodyFallOnSpheres) {
  btDefaultCollisionConfiguration stock_configuration, our_configuration;
  MultiBodyWorld stock(std::make_unique<btCollisionDispatcher>(&stock_configuration));
  auto made = std::make_unique<CollisionDispatcher>(&our_configuration,
                                                    DispatcherOptions{.minimum_batch = 0});
  const DispatchStats& stats = made->stats();
  MultiBodyWorld ours(std::move(made));
  int contacts_of_links = 0;
  for (std::uint64_t step = 1; step <= 150; ++step) {
    stock.world.stepSimulation(btScalar(1) / 60, 0);
    ours.world.stepSimulation(btScalar(1) / 60, 0);
    const auto difference = first_difference(stock.world, ours.world, step);
    ASSERT_FALSE(difference) << to_text(*difference);
    for (int i = 0; i < 4; ++i) {
      ASSERT_EQ(std::memcmp(stock.chain.getJointPosMultiDof(i), ours.chain.getJointPosMultiDof(i),
                            4 * sizeof(btScalar)),
                0)
          << "link " << i << " in step " << step;
    }
    for (int i = 0; i < ours.dispatcher->getNumManifolds(); ++i) {
      const btPersistentManifold& m = *ours.dispatcher->getManifoldByIndexInternal(i);
      const bool link = btMultiBodyLinkCollider::upcast(m.getBody0()) != nullptr ||
                        btMultiBodyLinkCollider::upcast(m.getBody1()) != nullptr;
      contacts_of_links += link ? m.getNumContacts() : 0;
    }
  }
  EXPECT_GT(contacts_of_links, 20);
  EXPECT_EQ(stats.batches, stats.dispatches);
}

std::vector<std::vector<unsigned char>> serialised_manifolds(BulletWorld& w) {
  btDefaultSerializer serializer;
  serializer.setSerializationFlags(BT_SERIALIZE_CONTACT_MANIFOLDS);
  w.world.serialize(&serializer);
  std::vector<std::vector<unsigned char>> manifolds;
  const unsigned char* buffer = serializer.getBufferPointer();
  const auto size = static_cast<std::size_t>(serializer.getCurrentBufferSize());
  // The chunks, each followed by its data, start after the file header of twelve characters.
  btChunk chunk;
  for (std::size_t at = 12; at + sizeof chunk <= size;) {
    std::memcpy(&chunk, buffer + at, sizeof chunk);
    const unsigned char* data = buffer + at + sizeof chunk;
    at += sizeof chunk + static_cast<std::size_t>(chunk.m_length);
    if (chunk.m_chunkCode == BT_CONTACTMANIFOLD_CODE) {
      manifolds.emplace_back(data, data + chunk.m_length);
    }
  }
  return manifolds;
}

TEST(BulletModules, SerialisedManifoldsAreTheSame) {
  Twins twins;
  twins.both([](BulletWorld& w) { add_heap(w, 50, 62); });
  ASSERT_TRUE(twins.step(60));
  const auto stock = serialised_manifolds(twins.stock());
  EXPECT_GT(stock.size(), 30u);
  EXPECT_EQ(stock, serialised_manifolds(twins.ours()));
}

TEST(Dispatchers, InSeveralThreadsAreIndependent) {
  const Scene scene = scenes::make("pile", {.spheres = 150, .seed = 63});
  const auto run = [&](const SceneWorldOptions& options) {
    SceneWorld world(scene, options);
    for (int i = 0; i < 60; ++i) world.step();
    return world.state_hash();
  };
  const std::uint64_t expected = run({.dispatcher = DispatcherKind::stock});
  std::uint64_t hashes[3] = {};
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < 3; ++i) {
      threads.emplace_back([&, i] {
        SceneWorldOptions options;
        options.dispatch = {.collider = {.backend = Backend::cpu, .threads = 1 + i},
                            .minimum_batch = 0};
        hashes[i] = run(options);
      });
    }
  }
  for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, expected);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
