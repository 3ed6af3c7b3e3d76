/// A world with soft bodies has stock Bullet's bits with our dispatcher and solver.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Balls and crates fall onto a rope and a plate.
class SoftWorld {
 public:
  SoftWorld(std::unique_ptr<btSequentialImpulseConstraintSolver> solver, bool ours)
      : dispatcher_(ours ? std::make_unique<CollisionDispatcher>(&configuration_)
                         : std::make_unique<btCollisionDispatcher>(&configuration_)),
        solver_(std::move(solver)),
        world_(dispatcher_.get(), &broadphase_, solver_.get(), &configuration_) {
    add({0, btScalar(-0.5), 0}, &floor_, 0);
    for (int i = 0; i < 24; ++i) {
      const auto x = static_cast<btScalar>(i % 4), z = static_cast<btScalar>(i / 4 % 3);
      const auto y = 2 + static_cast<btScalar>(i);
      btCollisionShape* const shapes[] = {&ball_, &crate_};
      add({x - btScalar(1.5), y * btScalar(0.6), z - 1}, shapes[i % 2], 1);
    }
    btSoftBodyWorldInfo& info = world_.getWorldInfo();
    info.m_sparsesdf.Initialize();
    info.m_gravity = world_.getGravity();
    rope_ = btSoftBodyHelpers::CreateRope(info, {-4, 1, 0}, {4, 1, 0}, 16, 1 + 2);
    world_.addSoftBody(rope_);
  }
  ~SoftWorld() {
    world_.removeSoftBody(rope_);
    delete rope_;
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  SoftWorld(const SoftWorld&) = delete;
  SoftWorld& operator=(const SoftWorld&) = delete;

  void step() { world_.stepSimulation(btScalar(1) / 60, 0); }
  /// Positions of all bodies and of the nodes of the rope.
  std::vector<btScalar> positions() const {
    std::vector<btScalar> all;
    const auto add_point = [&all](const btVector3& p) {
      all.insert(all.end(), {p.x(), p.y(), p.z()});
    };
    for (const auto& body : bodies_) add_point(body->getCenterOfMassPosition());
    for (int i = 0; i < rope_->m_nodes.size(); ++i) add_point(rope_->m_nodes[i].m_x);
    return all;
  }

 private:
  void add(const btVector3& position, btCollisionShape* shape, btScalar mass) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    bodies_.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, inertia));
    bodies_.back()->setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), position));
    world_.addRigidBody(bodies_.back().get());
  }

  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btCollisionDispatcher> dispatcher_;
  std::unique_ptr<btSequentialImpulseConstraintSolver> solver_;
  btSoftRigidDynamicsWorld world_;
  btBoxShape floor_{{20, btScalar(0.5), 20}};
  btSphereShape ball_{btScalar(0.4)};
  btBoxShape crate_{{btScalar(0.3), btScalar(0.3), btScalar(0.3)}};
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  btSoftBody* rope_ = nullptr;
};

TEST(SoftBodies, MoveAsInStockBullet) {
  SoftWorld stock(std::make_unique<btSequentialImpulseConstraintSolver>(), false);
  SoftWorld ours(std::make_unique<ConstraintSolver>(), true);
  const std::vector<btScalar> start = stock.positions();
  for (int n = 0; n < 240; ++n) {
    stock.step();
    ours.step();
    ASSERT_EQ(ours.positions(), stock.positions()) << "step " << n;
  }
  // The last three numbers are a free node of the rope, which the bodies and gravity have moved.
  EXPECT_NE(stock.positions()[start.size() - 26], start[start.size() - 26]);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
