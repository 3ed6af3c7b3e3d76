/// Spheres and planes match btConvexPlaneCollisionAlgorithm bit for bit, for any values.
#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/dispatch/point_fields.hpp"
#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionDispatch/btConvexPlaneCollisionAlgorithm.h>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

btVector3 random_vector(Random& random, Real extent) {
  const Vec3 v = random.uniform_in_box({-extent, -extent, -extent}, {extent, extent, extent});
  return {v.x, v.y, v.z};
}

btTransform random_pose(Random& random, Real extent) {
  btTransform pose(btQuaternion::getIdentity(), random_vector(random, extent));
  const btVector3 v = random_vector(random, 1);
  const btQuaternion q(v.x(), v.y(), v.z(), random.uniform(Real(-1), Real(1)));
  if (random.below(2) == 0 && q.length2() > Real(0.01)) pose.setRotation(q.normalized());
  return pose;
}

/// Counts of the results of encounters, which show that the random ones cover all cases.
struct Tally {
  int apart = 0, touching = 0, left = 0;
};

/// A sphere and a plane in several encounters, so that points of earlier ones are refreshed.
class Meeting {
 public:
  explicit Meeting(Random& random)
      : sphere_shape_(std::pow(Real(10), random.uniform(Real(-1.5), Real(1)))),
        plane_shape_(random_vector(random, 1) + btVector3(0, 2, 0), random.uniform(-2, 2)),
        sphere_first_(random.below(2) == 0) {
    sphere.setCollisionShape(&sphere_shape_);
    plane.setCollisionShape(&plane_shape_);
    sphere.setFriction(random.uniform(0, 2));
    plane.setWorldTransform(random_pose(random, random.below(3) == 0 ? Real(1000) : Real(2)));
  }

  /// Moves the sphere so that its surface is near that of the plane.
  void place(Random& random) {
    const btScalar height = sphere_shape_.getRadius() * random.uniform(Real(-0.5), Real(1.1));
    btTransform pose = random_pose(random, 0);
    const btVector3 over =
        plane_shape_.getPlaneNormal() * (plane_shape_.getPlaneConstant() + height);
    pose.setOrigin(plane.getWorldTransform()(over + random_vector(random, Real(0.01))));
    sphere.setWorldTransform(pose);
  }
  void set_radius(btScalar radius) { sphere_shape_.setUnscaledRadius(radius); }

  /// Updates a manifold with Bullet and with jfpx, and compares.
  void meet(Tally* tally) {
    const btCollisionObject& a = sphere_first_ ? sphere : plane;
    const btCollisionObject& b = sphere_first_ ? plane : sphere;
    const btCollisionObjectWrapper wrap_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(),
                                          -1, -1);
    const btCollisionObjectWrapper wrap_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(),
                                          -1, -1);
    if (!algorithm_) {
      const btCollisionAlgorithmConstructionInfo info(&dispatcher_, 1);
      algorithm_ = std::make_unique<btConvexPlaneCollisionAlgorithm>(nullptr, info, &wrap_a,
                                                                     &wrap_b, !sphere_first_, 0, 0);
      stock_ = dispatcher_.getManifoldByIndexInternal(0);
      ours_ = *stock_;
    }
    btManifoldResult result(&wrap_a, &wrap_b);
    algorithm_->processCollision(&wrap_a, &wrap_b, btDispatcherInfo(), &result);
    if (!update_sphere_plane(&ours_, a, b, sphere_first_)) {
      ++tally->left;
      ours_ = *stock_;
      return;
    }
    ++(stock_->getNumContacts() == 0 ? tally->apart : tally->touching);
    FieldComparison compare;
    compare("number of points", stock_->getNumContacts(), ours_.getNumContacts());
    for (int i = 0; i < stock_->getNumContacts() && !compare.first(); ++i) {
      compare_points(stock_->getContactPoint(i), ours_.getContactPoint(i), &compare);
    }
    EXPECT_FALSE(compare.first()) << to_text(*compare.first());
  }

  btCollisionObject sphere, plane;

 private:
  btSphereShape sphere_shape_;
  btStaticPlaneShape plane_shape_;
  bool sphere_first_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  std::unique_ptr<btConvexPlaneCollisionAlgorithm> algorithm_;
  btPersistentManifold* stock_ = nullptr;  // the algorithm's
  btPersistentManifold ours_;
};

TEST(SpherePlane, HasEveryBitOfBulletsAlgorithm) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Tally tally;
  for (int i = 0; i < 1000; ++i) {
    Meeting meeting(random);
    for (int k = 0; k < 20; ++k) {
      meeting.place(random);
      meeting.meet(&tally);
    }
  }
  EXPECT_EQ(tally.left, 0);
  EXPECT_GT(tally.touching, 10000);
  EXPECT_GT(tally.apart, 200);
}

TEST(SpherePlane, HasEveryBitOfExtremeNumbersOrLeavesThem) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Tally tally;
  for (int i = 0; i < 3000; ++i) {
    Meeting meeting(random);
    for (int k = 0; k < 3; ++k) {
      meeting.place(random);
      const Real extreme = random_extreme(random);
      const int axis = static_cast<int>(random.below(3));
      switch (k == 0 ? 0 : random.below(4)) {
        case 0:
          break;  // an ordinary encounter first, whose points exist later
        case 1:
          meeting.sphere.getWorldTransform().getOrigin()[axis] = extreme;
          break;
        case 2:
          // A pose that scales, or worse, because Bullet does not require a valid basis.
          meeting.sphere.getWorldTransform().getBasis()[axis] = btVector3(0, extreme, 0);
          break;
        default:
          meeting.set_radius(extreme);
      }
      meeting.meet(&tally);
    }
  }
  EXPECT_GT(tally.left, 100);
  EXPECT_GT(tally.touching, 1000);
  EXPECT_GT(tally.apart, 100);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
