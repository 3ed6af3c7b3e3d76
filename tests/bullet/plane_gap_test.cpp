/// Bodies far from a plane are those for which btConvexPlaneCollisionAlgorithm finds no point.
#include "src/bullet/dispatch/plane_gap.hpp"

#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionDispatch/btConvexPlaneCollisionAlgorithm.h>

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// A box and a plane in poses that often are no rotations, or far from the origin.
class BoxAndPlane {
 public:
  explicit BoxAndPlane(Random& random)
      : box_shape_(vector(random, Real(0.05), 1)),
        plane_shape_(vector(random, -1, 1) + btVector3(0, 2, 0), random.uniform(-2, 2)) {
    box.setCollisionShape(&box_shape_);
    plane.setCollisionShape(&plane_shape_);
    const Real far = random.below(3) == 0 ? Real(1000) : Real(2);
    plane.setWorldTransform(pose(random, far));
    btTransform at = pose(random, 0);
    // Both sides of the bound, and close to it.
    const btScalar height = radius() * random.uniform(Real(0.5), 2) + random.uniform(0, Real(0.1));
    at.setOrigin(plane.getWorldTransform()(plane_shape_.getPlaneNormal() *
                                           (plane_shape_.getPlaneConstant() + height)));
    box.setWorldTransform(at);
  }

  btScalar radius() const { return box_shape_.getHalfExtentsWithMargin().length(); }
  /// Whether Bullet, with perturbation, finds a point.
  bool touches(Random& random) {
    const btCollisionObjectWrapper a(nullptr, &box_shape_, &box, box.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper b(nullptr, &plane_shape_, &plane, plane.getWorldTransform(), -1,
                                     -1);
    const btCollisionAlgorithmConstructionInfo info(&dispatcher_, 1);
    const int perturbations = static_cast<int>(random.below(5));
    btConvexPlaneCollisionAlgorithm algorithm(nullptr, info, &a, &b, false, perturbations, 3);
    btManifoldResult result(&a, &b);
    algorithm.processCollision(&a, &b, btDispatcherInfo(), &result);
    threshold = dispatcher_.getManifoldByIndexInternal(0)->getContactBreakingThreshold();
    return dispatcher_.getManifoldByIndexInternal(0)->getNumContacts() > 0;
  }

  btCollisionObject box, plane;
  btScalar threshold = 0;

 private:
  static btVector3 vector(Random& random, Real lower, Real upper) {
    const Vec3 v = random.uniform_in_box({lower, lower, lower}, {upper, upper, upper});
    return {v.x, v.y, v.z};
  }
  static btTransform pose(Random& random, Real extent) {
    btTransform pose(btQuaternion::getIdentity(), vector(random, -extent, extent));
    const btVector3 v = vector(random, -1, 1);
    const btQuaternion q(v.x(), v.y(), v.z(), random.uniform(-1, 1));
    if (q.length2() > Real(0.01)) pose.setRotation(q.normalized());
    if (random.below(4) == 0) pose.getBasis()[1] *= random.uniform(Real(0.5), 2);
    return pose;
  }

  btBoxShape box_shape_;
  btStaticPlaneShape plane_shape_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
};

TEST(PlaneGap, BodiesFarFromAPlaneHaveNoPoints) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  int clear = 0, touching = 0, neither = 0;
  for (int i = 0; i < 5000; ++i) {
    BoxAndPlane both(random);
    const bool touches = both.touches(random);
    if (is_clear_of_plane(both.box, both.radius(), both.plane, both.threshold)) {
      ASSERT_FALSE(touches) << "case " << i;
      ++clear;
    } else {
      ++(touches ? touching : neither);
    }
  }
  EXPECT_GT(clear, 1000);
  EXPECT_GT(touching, 200);
  EXPECT_GT(neither, 200);
}

TEST(PlaneGap, NumbersThatAreNotFiniteAreNotFar) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const Real bad :
       {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity()}) {
    for (int i = 0; i < 30; ++i) {
      BoxAndPlane both(random);
      btTransform& pose = (i % 2 == 0 ? both.box : both.plane).getWorldTransform();
      if (i % 3 == 0) {
        pose.getOrigin()[i % 9 / 3] = bad;
      } else {
        pose.getBasis()[i % 9 / 3] = btVector3(bad, bad, bad);
      }
      EXPECT_FALSE(is_clear_of_plane(both.box, both.radius(), both.plane, 0)) << i;
    }
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
