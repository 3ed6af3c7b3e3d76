/// Classes of the user that are compiled without RTTI, whose vtables have no type_info, match
/// stock.
#include <jfpx/bullet/dynamics_world.hpp>

#include "tests/bullet/no_rtti_unit.hpp"
#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TwinOptions with_our_world() {
  TwinOptions options;
  options.parts.world = [](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                           btConstraintSolver* solver, btCollisionConfiguration* configuration) {
    return std::make_unique<DynamicsWorld>(dispatcher, broadphase, solver, configuration);
  };
  return options;
}

TEST(NoRtti, BroadphaseAndPairCacheMatchStock) {
  TwinOptions options = with_our_world();
  options.broadphase = test::make_no_rtti_broadphase;
  Twins twins(options);
  twins.both([](BulletWorld& w) { add_heap(w, 60, 71); });
  ASSERT_TRUE(twins.step(60));
  EXPECT_GT(twins.stats().written, 100u);
  EXPECT_EQ(twins.stats().last_order, OrderReason::pair_cache);
}

TEST(NoRtti, DispatcherMatchesStock) {
  TwinOptions options = with_our_world();
  options.ours = test::make_no_rtti_dispatcher;
  Twins twins(options);
  twins.both([](BulletWorld& w) { add_heap(w, 60, 72); });
  ASSERT_TRUE(twins.step(60));
}

TEST(NoRtti, CreateFunctionLeavesDispatchesToBullet) {
  const auto create = test::make_no_rtti_create_function();
  Twins twins(with_our_world());
  twins.both([&](BulletWorld& w) {
    w.dispatcher->registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE,
                                              create.get());
    add_heap(w, 60, 73);
  });
  ASSERT_TRUE(twins.step(60));
  EXPECT_EQ(twins.stats().last_fallback, Fallback::create_function);
}

TEST(NoRtti, BodiesAndShapesMatchStock) {
  Twins twins(with_our_world());
  twins.both([](BulletWorld& w) {
    add_heap(w, 60, 74);
    for (int i = 0; i < 10; ++i) {
      w.bodies.push_back(test::make_no_rtti_body(w.keep(test::make_no_rtti_sphere(btScalar(0.4)))));
      btRigidBody& body = *w.bodies.back();
      body.setUserIndex(static_cast<int>(w.bodies.size()) - 1);
      body.getWorldTransform().setOrigin(btVector3(btScalar(i) / 4, 3, 1));
      body.setInterpolationWorldTransform(body.getWorldTransform());
      w.world.addRigidBody(&body);
    }
  });
  ASSERT_TRUE(twins.step(60));
  EXPECT_GT(twins.stats().written, 100u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
