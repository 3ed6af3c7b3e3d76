/// The cross-checks detect every kind of planted difference.
#include <jfpx/bullet/verify.hpp>
#include <jfpx/error.hpp>

#include "tests/bullet/twin_worlds.hpp"

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Two equal worlds of stock dispatchers in which two spheres touch and one floats.
class TwoWorlds : public ::testing::Test {
 protected:
  TwoWorlds() {
    for (BulletWorld* w : {&a_, &b_}) {
      w->world.setGravity(btVector3(0, 0, 0));
      w->add_sphere(btScalar(0.5), btVector3(0, 0, 0));
      w->add_sphere(btScalar(0.5), btVector3(btScalar(0.9), btScalar(0.1), 0));
      w->add_sphere(btScalar(0.5), btVector3(0, 5, 0));
      w->world.performDiscreteCollisionDetection();
    }
  }
  btPersistentManifold& manifold() { return *b_.dispatcher->getManifoldByIndexInternal(0); }
  btManifoldPoint& point() { return manifold().getContactPoint(0); }
  void expect_difference(const std::string& what, const std::string& field) {
    const auto difference = first_difference(a_.world, b_.world, 42);
    ASSERT_TRUE(difference) << field;
    EXPECT_EQ(difference->what, what);
    EXPECT_EQ(difference->field, field);
    EXPECT_EQ(difference->step, 42u);
    EXPECT_NE(difference->expected_bits, difference->actual_bits);
    const std::string text = to_text(*difference);
    EXPECT_NE(text.find(field), std::string::npos) << text;
    EXPECT_NE(text.find("step 42"), std::string::npos) << text;
    EXPECT_NE(text.find("0x"), std::string::npos) << text;
  }

  static std::unique_ptr<btCollisionDispatcher> stock(btCollisionConfiguration* c) {
    return std::make_unique<btCollisionDispatcher>(c);
  }
  BulletWorld a_{std::make_unique<btDefaultCollisionConfiguration>(), stock,
                 std::make_unique<btDbvtBroadphase>()};
  BulletWorld b_{std::make_unique<btDefaultCollisionConfiguration>(), stock,
                 std::make_unique<btDbvtBroadphase>()};
};

TEST_F(TwoWorlds, AreTheSame) { EXPECT_FALSE(first_difference(a_.world, b_.world, 1)); }

TEST_F(TwoWorlds, EveryFieldOfAPointIsCompared) {
  // Each change is undone, so that the next is the only one.
  const auto changes = [&](const std::string& field, auto* value, auto other) {
    const auto before = *value;
    *value = other;
    expect_difference("manifold", field);
    *value = before;
    EXPECT_FALSE(first_difference(a_.world, b_.world, 1));
  };
  btManifoldPoint& p = point();
  const btScalar x = 7;
  changes("m_localPointA.x", &p.m_localPointA.m_floats[0], x);
  changes("m_localPointB.y", &p.m_localPointB.m_floats[1], x);
  changes("m_positionWorldOnB.z", &p.m_positionWorldOnB.m_floats[2], x);
  changes("m_positionWorldOnA.w", &p.m_positionWorldOnA.m_floats[3], x);
  changes("m_normalWorldOnB.x", &p.m_normalWorldOnB.m_floats[0], x);
  changes("m_distance1", &p.m_distance1, x);
  changes("m_combinedFriction", &p.m_combinedFriction, x);
  changes("m_combinedRollingFriction", &p.m_combinedRollingFriction, x);
  changes("m_combinedSpinningFriction", &p.m_combinedSpinningFriction, x);
  changes("m_combinedRestitution", &p.m_combinedRestitution, x);
  changes("m_partId0", &p.m_partId0, 3);
  changes("m_partId1", &p.m_partId1, 3);
  changes("m_index0", &p.m_index0, 3);
  changes("m_index1", &p.m_index1, 3);
  changes("m_userPersistentData set", &p.m_userPersistentData, static_cast<void*>(&a_));
  changes("m_contactPointFlags", &p.m_contactPointFlags, 3);
  changes("m_appliedImpulse", &p.m_appliedImpulse, x);
  changes("m_prevRHS", &p.m_prevRHS, x);
  changes("m_appliedImpulseLateral1", &p.m_appliedImpulseLateral1, x);
  changes("m_appliedImpulseLateral2", &p.m_appliedImpulseLateral2, x);
  changes("m_contactMotion1", &p.m_contactMotion1, x);
  changes("m_contactMotion2", &p.m_contactMotion2, x);
  changes("m_contactCFM", &p.m_contactCFM, x);
  changes("m_contactERP", &p.m_contactERP, x);
  changes("m_frictionCFM", &p.m_frictionCFM, x);
  changes("m_lifeTime", &p.m_lifeTime, 3);
  changes("m_lateralFrictionDir1.x", &p.m_lateralFrictionDir1.m_floats[0], x);
  changes("m_lateralFrictionDir2.z", &p.m_lateralFrictionDir2.m_floats[2], x);
}

TEST_F(TwoWorlds, WhatBulletDoesNotInitializeIsNotCompared) {
  point().m_normalWorldOnB.setW(7);
  EXPECT_FALSE(first_difference(a_.world, b_.world, 1));
}

TEST_F(TwoWorlds, ZeroAndMinusZeroDiffer) {
  ASSERT_EQ(point().m_normalWorldOnB.z(), 0);
  point().m_normalWorldOnB.setZ(-point().m_normalWorldOnB.z());
  expect_difference("manifold", "m_normalWorldOnB.z");
}

TEST_F(TwoWorlds, ManifoldsAreCompared) {
  manifold().setContactBreakingThreshold(1);
  expect_difference("manifold", "breaking threshold");
  manifold().setContactBreakingThreshold(
      a_.dispatcher->getManifoldByIndexInternal(0)->getContactBreakingThreshold());
  manifold().setContactProcessingThreshold(1);
  expect_difference("manifold", "processing threshold");
  manifold().setContactProcessingThreshold(BT_LARGE_FLOAT);
  manifold().m_companionIdB = 5;
  expect_difference("manifold", "m_companionIdB");
  manifold().m_companionIdB = 0;
  manifold().setBodies(b_.bodies[0].get(), b_.bodies[2].get());
  expect_difference("manifold", "body 1");
  manifold().setBodies(b_.bodies[0].get(), b_.bodies[1].get());
  EXPECT_FALSE(first_difference(a_.world, b_.world, 1));
  manifold().setNumContacts(0);
  expect_difference("manifold", "number of points");
  b_.dispatcher->getNewManifold(b_.bodies[0].get(), b_.bodies[1].get());
  expect_difference("world", "number of manifolds");
  b_.dispatcher->releaseManifold(b_.dispatcher->getManifoldByIndexInternal(1));
}

TEST_F(TwoWorlds, BodiesAreCompared) {
  btRigidBody& body = *b_.bodies[2];
  const btTransform pose = body.getWorldTransform();
  body.getWorldTransform().setOrigin(btVector3(0, std::nextafter(btScalar(5), btScalar(6)), 0));
  expect_difference("body", "transform origin.y");
  body.setWorldTransform(pose);
  body.getWorldTransform().getBasis()[1].setZ(btScalar(0.1));
  expect_difference("body", "transform basis row 1.z");
  body.setWorldTransform(pose);
  body.setLinearVelocity(btVector3(0, 0, 1));
  expect_difference("body", "linear velocity.z");
  body.setLinearVelocity(btVector3(0, 0, 0));
  body.setAngularVelocity(btVector3(1, 0, 0));
  expect_difference("body", "angular velocity.x");
  body.setAngularVelocity(btVector3(0, 0, 0));
  body.setInterpolationLinearVelocity(btVector3(1, 0, 0));
  expect_difference("body", "interpolation linear velocity.x");
  body.setInterpolationLinearVelocity(btVector3(0, 0, 0));
  body.forceActivationState(WANTS_DEACTIVATION);
  expect_difference("body", "activation state");
  body.forceActivationState(ACTIVE_TAG);
  body.setHitFraction(btScalar(0.5));
  expect_difference("body", "hit fraction");
  body.setHitFraction(1);
  body.applyTorque(btVector3(0, 2, 0));
  expect_difference("body", "total torque.y");
  body.clearForces();
  body.applyCentralForce(btVector3(0, 0, 2));
  expect_difference("body", "total force.z");
  body.clearForces();
  btVector3& lower = body.getBroadphaseHandle()->m_aabbMin;
  lower.setX(lower.x() + 1);
  expect_difference("body", "lower bound.x");
  lower.setX(lower.x() - 1);
  EXPECT_FALSE(first_difference(a_.world, b_.world, 1));
  b_.world.removeRigidBody(&body);
  expect_difference("world", "number of bodies");
}

TEST_F(TwoWorlds, JointsAreCompared) {
  btPoint2PointConstraint joint_a(*a_.bodies[2], btVector3(0, 1, 0)),
      joint_b(*b_.bodies[2], btVector3(0, 1, 0)), second(*b_.bodies[1], btVector3(0, 1, 0));
  btHingeConstraint hinge(*b_.bodies[2], btVector3(0, 1, 0), btVector3(1, 0, 0));
  a_.world.addConstraint(&joint_a);
  b_.world.addConstraint(&joint_b);
  EXPECT_FALSE(first_difference(a_.world, b_.world, 1));
  joint_b.setEnabled(false);
  expect_difference("joint", "enabled");
  joint_b.setEnabled(true);
  joint_b.internalSetAppliedImpulse(3);
  expect_difference("joint", "applied impulse");
  b_.world.addConstraint(&second);
  expect_difference("world", "number of joints");
  b_.world.removeConstraint(&second);
  b_.world.removeConstraint(&joint_b);
  b_.world.addConstraint(&hinge);
  expect_difference("joint", "type");
  b_.world.removeConstraint(&hinge);
  a_.world.removeConstraint(&joint_a);
}

/// ContactCheck, on world a_.
class Contacts : public TwoWorlds {
 protected:
  void capture_and_detect() {
    check_.capture(a_.world);
    a_.world.performDiscreteCollisionDetection();
  }
  btManifoldPoint& touching_point() {
    return a_.dispatcher->getManifoldByIndexInternal(0)->getContactPoint(0);
  }
  void expect_mismatch(const std::string& field) {
    EXPECT_EQ(check_.compare(a_.world, 3), 1u);
    EXPECT_EQ(check_.mismatches(), 1u);
    ASSERT_TRUE(check_.first());
    EXPECT_EQ(check_.first()->field, field);
    EXPECT_EQ(check_.first()->index, 0u);
    EXPECT_EQ(check_.first()->other, 1u);
  }
  ContactCheck check_;
};

TEST_F(Contacts, AgreeWithFindContacts) {
  capture_and_detect();
  EXPECT_EQ(check_.compare(a_.world, 1), 1u);
  EXPECT_EQ(check_.mismatches(), 0u);
  EXPECT_FALSE(check_.first());
}
TEST_F(Contacts, WithAnotherNormalAreFound) {
  capture_and_detect();
  touching_point().m_normalWorldOnB.setY(0);
  expect_mismatch("normal.y");
}
TEST_F(Contacts, WithAnotherDistanceAreFound) {
  capture_and_detect();
  touching_point().m_distance1 *= 2;
  expect_mismatch("distance");
}
TEST_F(Contacts, WithAnotherPointAreFound) {
  capture_and_detect();
  touching_point().m_positionWorldOnB.setZ(1);
  expect_mismatch("point on b.z");
}
TEST_F(Contacts, ThatBulletLostAreFound) {
  capture_and_detect();
  a_.dispatcher->getManifoldByIndexInternal(0)->setNumContacts(0);
  expect_mismatch("touching");
}
TEST_F(Contacts, ThatBulletInventedAreFound) {
  // Half a millimetre apart, with overlapping AABBs: a pair without points.
  a_.bodies[1]->getWorldTransform().setOrigin(btVector3(btScalar(1.0005), 0, 0));
  capture_and_detect();
  ASSERT_EQ(check_.compare(a_.world, 1), 0u);
  a_.dispatcher->getManifoldByIndexInternal(0)->setNumContacts(1);
  expect_mismatch("touching");
}
TEST_F(Contacts, OfFilteredPairsAreLeftOut) {
  a_.bodies[0]->setIgnoreCollisionCheck(a_.bodies[1].get(), true);
  a_.world.getPairCache()->cleanProxyFromPairs(a_.bodies[0]->getBroadphaseHandle(),
                                               a_.dispatcher.get());
  capture_and_detect();
  EXPECT_EQ(check_.compare(a_.world, 1), 0u);
  EXPECT_EQ(check_.mismatches(), 0u);
}
TEST_F(Contacts, OfTwoStaticSpheresAreLeftOut) {
  a_.add_sphere(1, btVector3(50, 0, 0), 0);
  a_.add_sphere(1, btVector3(51, 0, 0), 0);
  capture_and_detect();
  EXPECT_EQ(check_.compare(a_.world, 1), 1u);
  EXPECT_EQ(check_.mismatches(), 0u);
}
TEST_F(Contacts, OfSleepersAreTheOldOnes) {
  a_.bodies[0]->forceActivationState(ISLAND_SLEEPING);
  a_.bodies[1]->forceActivationState(ISLAND_SLEEPING);
  capture_and_detect();
  EXPECT_EQ(check_.compare(a_.world, 1), 1u);
  EXPECT_EQ(check_.mismatches(), 0u);
}
TEST_F(Contacts, OfSleepersThatNeverMetAreLeftOut) {
  for (int i = 0; i < 2; ++i) {
    btRigidBody* body = a_.add_sphere(btScalar(0.5), btVector3(30, btScalar(i) / 2, 0));
    body->forceActivationState(ISLAND_SLEEPING);
  }
  capture_and_detect();
  EXPECT_EQ(check_.compare(a_.world, 1), 1u);
  EXPECT_EQ(check_.mismatches(), 0u);
}
TEST_F(Contacts, OfASphereThatIsNotFiniteAreAnError) {
  a_.bodies[2]->getWorldTransform().setOrigin(
      btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0));
  check_.capture(a_.world);
  EXPECT_THROW(check_.compare(a_.world, 1), InvalidArgument);
}
TEST_F(Contacts, ThatWereNotCapturedAreAnError) {
  ContactCheck forgotten(make_sphere_collider());
  EXPECT_THROW(forgotten.compare(a_.world, 1), InvalidArgument);
}
TEST_F(Contacts, OfBodiesInAnotherOrderThanTheirProxies) {
  // A removal moves the last body into the gap of the world's array.
  a_.add_sphere(btScalar(0.5), btVector3(0, btScalar(5.9), 0));
  a_.world.removeRigidBody(a_.bodies[0].get());
  capture_and_detect();
  EXPECT_EQ(check_.compare(a_.world, 1), 1u);
  EXPECT_EQ(check_.mismatches(), 0u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
