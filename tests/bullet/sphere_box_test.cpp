/// The closest points of spheres and boxes match btGjkPairDetector bit for bit.
#include "src/bullet/dispatch/sphere_box.hpp"

#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <bit>
#include <cmath>
#include <numbers>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

using Bits = std::conditional_t<sizeof(Real) == 8, std::uint64_t, std::uint32_t>;
Bits bits(btScalar x) { return std::bit_cast<Bits>(x); }

struct Output : btDiscreteCollisionDetectorInterface::Result {
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& point, btScalar depth) override {
    ++calls;
    contact = {normal, point, depth};
  }
  int calls = 0;
  SphereBoxContact contact;
};

struct Query {
  btTransform sphere_pose, box_pose;
  btScalar radius;
  btVector3 half;
  btScalar threshold;
  bool sphere_first;
};

/// Counts of the results of queries, which show that the random ones cover all cases.
struct Tally {
  int apart = 0, contact = 0, unknown = 0, wrong = 0;
};

void ask_both(const Query& query, Tally* tally) {
  const btSphereShape sphere(query.radius);
  const btBoxShape box(query.half);
  const btConvexInternalShape* a = &sphere;
  const btConvexInternalShape* b = &box;
  btTransform pose_a = query.sphere_pose, pose_b = query.box_pose;
  if (!query.sphere_first) {
    std::swap(a, b);
    std::swap(pose_a, pose_b);
  }
  const btScalar reach = a->getMargin() + b->getMargin() + query.threshold;

  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver penetration;
  btGjkPairDetector detector(a, b, &simplex, &penetration);
  btGjkPairDetector::ClosestPointInput stock_input;
  stock_input.m_transformA = pose_a;
  stock_input.m_transformB = pose_b;
  stock_input.m_maximumDistanceSquared = reach * reach;
  Output stock;
  detector.getClosestPoints(stock_input, stock, nullptr);

  SphereBoxContact ours;
  const SphereBoxResult answer = find_closest_points({.pose_a = pose_a,
                                                      .pose_b = pose_b,
                                                      .margin_a = a->getMargin(),
                                                      .margin_b = b->getMargin(),
                                                      .core = box.getImplicitShapeDimensions(),
                                                      .sphere_first = query.sphere_first,
                                                      .maximum_distance_squared = reach * reach},
                                                     &ours);
  switch (answer) {
    case SphereBoxResult::unknown:
      ++tally->unknown;
      return;
    case SphereBoxResult::apart:
      ++tally->apart;
      tally->wrong += stock.calls != 0 ? 1 : 0;
      return;
    case SphereBoxResult::contact:
      ++tally->contact;
      break;
  }
  bool same = stock.calls == 1 && bits(ours.distance) == bits(stock.contact.distance);
  for (int i = 0; i < 3; ++i) {
    same = same && bits(ours.normal_on_b[i]) == bits(stock.contact.normal_on_b[i]) &&
           bits(ours.point_on_b[i]) == bits(stock.contact.point_on_b[i]);
  }
  tally->wrong += same ? 0 : 1;
}

btQuaternion random_rotation(Random& random) {
  const Vec3 v = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
  btQuaternion q(v.x, v.y, v.z, random.uniform(Real(-1), Real(1)));
  return q.length2() > Real(0.01) ? q.normalized() : btQuaternion::getIdentity();
}

btVector3 random_vector(Random& random, Real extent) {
  const Vec3 v = random.uniform_in_box({-extent, -extent, -extent}, {extent, extent, extent});
  return {v.x, v.y, v.z};
}

/// A box of up to three decades of edges, turned or not, and a sphere whose surface is near the
/// box's: outside, beyond the threshold, or inside.
Query random_query(Random& random) {
  Query query;
  const auto size = [&] { return std::pow(Real(10), random.uniform(Real(-1), Real(1.5))); };
  query.half = btVector3(size(), size(), size());
  query.radius = std::pow(Real(10), random.uniform(Real(-1.5), Real(0.5)));
  query.threshold = Real(0.02) * query.radius;
  query.sphere_first = random.below(2) == 0;
  query.box_pose.setIdentity();
  query.sphere_pose.setIdentity();
  if (random.below(2) == 0) query.box_pose.setRotation(random_rotation(random));
  if (random.below(2) == 0) query.sphere_pose.setRotation(random_rotation(random));
  query.box_pose.setOrigin(random_vector(random, random.below(3) == 0 ? Real(1000) : Real(2)));
  // A point of the surface, then along some direction by about the radius.
  btVector3 local = random_vector(random, 1) * query.half;
  const int axis = static_cast<int>(random.below(3));
  if (random.below(3) != 0) local[axis] = local[axis] < 0 ? -query.half[axis] : query.half[axis];
  btVector3 out(0, 0, 0);
  out[axis] = local[axis] < 0 ? Real(-1) : Real(1);
  if (random.below(3) == 0) out = random_vector(random, 1);
  local += out * (query.radius * random.uniform(Real(-0.2), Real(2.5)));
  query.sphere_pose.setOrigin(query.box_pose(local));
  return query;
}

TEST(SphereBox, HasEveryBitOfBulletsDetector) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Tally tally;
  constexpr int kQueries = 300000;
  for (int i = 0; i < kQueries; ++i) ask_both(random_query(random), &tally);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.contact, kQueries / 4);
  EXPECT_GT(tally.apart, kQueries / 100);
  EXPECT_GT(tally.unknown, kQueries / 100) << "spheres deep inside are Bullet's";
}

TEST(SphereBox, HasEveryBitOnFacesEdgesAndCorners) {
  Tally tally;
  for (int x = -6; x <= 6; ++x) {
    for (int y = -6; y <= 6; ++y) {
      for (int z = -6; z <= 6; ++z) {
        for (const bool sphere_first : {true, false}) {
          Query query{btTransform::getIdentity(),
                      btTransform::getIdentity(),
                      Real(0.5),
                      btVector3(1, 1, 1),
                      Real(0.02),
                      sphere_first};
          query.sphere_pose.setOrigin(btVector3(Real(x), Real(y), Real(z)) * Real(0.25));
          ask_both(query, &tally);
        }
      }
    }
  }
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.contact, 500);
}

TEST(SphereBox, HasEveryBitOfExtremeNumbers) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Tally tally;
  for (int i = 0; i < 3000; ++i) {
    Query query = random_query(random);
    const Real extreme = random_extreme(random);
    switch (random.below(4)) {
      case 0:
        query.sphere_pose.getOrigin()[static_cast<int>(random.below(3))] = extreme;
        break;
      case 1:
        query.box_pose.getOrigin()[static_cast<int>(random.below(3))] = extreme;
        break;
      case 2:
        query.half[static_cast<int>(random.below(3))] = extreme;
        break;
      default:
        query.radius = extreme;
    }
    ask_both(query, &tally);
  }
  EXPECT_EQ(tally.wrong, 0);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
