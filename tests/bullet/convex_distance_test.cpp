/// The closest points of convex shapes match btGjkPairDetector bit for bit.
#include "src/bullet/dispatch/convex_distance.hpp"

#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
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
  DetectorContact contact;
};

struct Query {
  std::unique_ptr<btConvexShape> a, b;
  btTransform pose_a = btTransform::getIdentity(), pose_b = btTransform::getIdentity();
  btScalar threshold = btScalar(0.02);
};

/// Counts of the results of queries, which show that the random ones cover all cases.
struct Tally {
  int apart = 0, contact = 0, unknown = 0, wrong = 0;
};

void ask_both(const Query& query, Tally* tally) {
  const btScalar reach = query.a->getMargin() + query.b->getMargin() + query.threshold;
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver penetration;
  btGjkPairDetector detector(query.a.get(), query.b.get(), &simplex, &penetration);
  btGjkPairDetector::ClosestPointInput stock_input;
  stock_input.m_transformA = query.pose_a;
  stock_input.m_transformB = query.pose_b;
  stock_input.m_maximumDistanceSquared = reach * reach;
  Output stock;
  detector.getClosestPoints(stock_input, stock, nullptr);

  DetectorContact ours;
  switch (find_closest_points({*query.a, *query.b, query.pose_a, query.pose_b, query.threshold},
                              &ours)) {
    case DetectorResult::unknown:
      ++tally->unknown;
      return;
    case DetectorResult::apart:
      ++tally->apart;
      tally->wrong += stock.calls != 0 ? 1 : 0;
      return;
    case DetectorResult::contact:
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

/// A length of up to two and a half decades.
btScalar random_size(Random& random) {
  return std::pow(Real(10), random.uniform(Real(-1.5), Real(1)));
}

std::unique_ptr<btConvexHullShape> random_hull(Random& random, int most) {
  auto hull = std::make_unique<btConvexHullShape>();
  // Often with equal points, and points on a common face.
  const bool on_grid = random.below(3) == 0;
  const btScalar size = random_size(random);
  for (auto left = static_cast<int>(1 + random.below(static_cast<std::uint64_t>(most))); left > 0;
       --left) {
    btVector3 point = random_vector(random, 1);
    if (on_grid)
      point = btVector3(std::round(point.x()), std::round(point.y()), std::round(point.z()));
    hull->addPoint(point * size, false);
  }
  hull->recalcLocalAabb();
  if (random.below(3) == 0) {
    hull->setLocalScaling(btVector3(1, btScalar(-2), btScalar(0.5)) * random.uniform(Real(0.5), 2));
  }
  return hull;
}

std::unique_ptr<btConvexShape> random_round_or_box(Random& random, std::uint64_t kind) {
  const btScalar r = random_size(random), h = random_size(random);
  const btVector3 half(r, h, random_size(random));
  switch (kind) {
    case 0:
      return std::make_unique<btSphereShape>(r);
    case 1:
      return std::make_unique<btBoxShape>(half);
    case 2:
      return std::make_unique<btCapsuleShape>(r, h);
    case 3:
      return std::make_unique<btCapsuleShapeX>(r, h);
    case 4:
      return std::make_unique<btCapsuleShapeZ>(r, h);
    case 5:
      return std::make_unique<btCylinderShape>(half);
    case 6:
      return std::make_unique<btCylinderShapeX>(half);
    default:
      return std::make_unique<btCylinderShapeZ>(half);
  }
}

/// Two shapes whose surfaces are near each other along some direction: apart, within the threshold,
/// or inside.
Query random_query(Random& random) {
  constexpr std::uint64_t kHull = 8;
  const auto random_shape = [&]() -> std::unique_ptr<btConvexShape> {
    const std::uint64_t kind = random.below(kHull + 6);
    if (kind >= kHull) return random_hull(random, random.below(5) == 0 ? 128 : 24);
    return random_round_or_box(random, kind);
  };
  Query query;
  query.a = random_shape();
  query.b = random_shape();
  if (random.below(4) == 0) query.a->setMargin(random.uniform(0, Real(0.2)));
  if (random.below(2) == 0) query.pose_a.setRotation(random_rotation(random));
  if (random.below(2) == 0) query.pose_b.setRotation(random_rotation(random));
  query.pose_a.setOrigin(random_vector(random, random.below(3) == 0 ? Real(1000) : Real(2)));
  btVector3 along = random_vector(random, 1);
  if (random.below(3) == 0) along = btVector3(0, along.y() < 0 ? btScalar(-1) : btScalar(1), 0);
  const btVector3 on_a =
      query.pose_a(query.a->localGetSupportingVertex(along * query.pose_a.getBasis()));
  const btVector3 on_b =
      query.pose_b(query.b->localGetSupportingVertex(-along * query.pose_b.getBasis()));
  const btScalar size = (on_b - query.pose_b.getOrigin()).length();
  query.threshold = btScalar(0.02) * random.uniform(Real(0.1), 2);
  query.pose_b.getOrigin() += on_a - on_b + along * (size * random.uniform(Real(-0.15), Real(0.1)));
  return query;
}

TEST(ConvexDistance, HasEveryBitOfBulletsDetector) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Tally tally;
  constexpr int kQueries = 150000;
  for (int i = 0; i < kQueries; ++i) ask_both(random_query(random), &tally);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.contact, kQueries / 8);
  EXPECT_GT(tally.apart, kQueries / 8);
  EXPECT_GT(tally.unknown, kQueries / 100) << "deep contacts are Bullet's";
}

/// Equal distances along several directions, in which the order of the points decides.
TEST(ConvexDistance, HasEveryBitOnFacesEdgesAndCorners) {
  const auto cube = [] {
    auto hull = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < 8; ++i) {
      hull->addPoint(
          btVector3(btScalar((i & 1) * 2 - 1), btScalar((i & 2) - 1), btScalar((i & 4) / 2 - 1)));
    }
    return hull;
  };
  Tally tally;
  for (int x = -8; x <= 8; ++x) {
    for (int y = -8; y <= 8; ++y) {
      for (int z = -8; z <= 8; ++z) {
        for (int kind = 0; kind < 6; ++kind) {
          Query query;
          query.a = std::make_unique<btBoxShape>(btVector3(1, 1, 1));
          if (kind % 2 == 0) query.a = cube();
          query.b = std::make_unique<btSphereShape>(Real(0.5));
          if (kind / 2 == 1) query.b = cube();
          if (kind / 2 == 2) query.b = std::make_unique<btCylinderShape>(btVector3(1, 1, 1));
          query.pose_b.setOrigin(btVector3(Real(x), Real(y), Real(z)) * Real(0.2575));
          ask_both(query, &tally);
          std::swap(query.a, query.b);
          ask_both(query, &tally);
        }
      }
    }
  }
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.contact, 2000);
}

TEST(ConvexDistance, HasEveryBitOfExtremeNumbers) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  Tally tally;
  for (int i = 0; i < 3000; ++i) {
    Query query = random_query(random);
    const Real extreme = random_extreme(random);
    const int axis = static_cast<int>(random.below(3));
    switch (random.below(4)) {
      case 0:
        query.pose_a.getOrigin()[axis] = extreme;
        break;
      case 1:
        query.pose_b.getOrigin()[axis] = extreme;
        break;
      case 2: {
        auto hull = random_hull(random, 12);
        btVector3 point = random_vector(random, 1);
        point[axis] = extreme;
        hull->addPoint(point);
        query.a = std::move(hull);
        break;
      }
      default:
        query.b = std::make_unique<btSphereShape>(extreme);
    }
    ask_both(query, &tally);
  }
  EXPECT_EQ(tally.wrong, 0);
}

/// Shapes without a core, and those that Bullet does not pass to the detector.
TEST(ConvexDistance, LeavesOtherShapesToBullet) {
  Random random(1);
  Query query;
  query.a = std::make_unique<btConeShape>(btScalar(1), btScalar(1));
  query.b = std::make_unique<btBoxShape>(btVector3(1, 1, 1));
  query.pose_b.setOrigin(btVector3(9, 0, 0));
  Tally tally;
  ask_both(query, &tally);
  auto large = std::make_unique<btConvexHullShape>();
  for (int i = 0; i < 200; ++i) large->addPoint(random_vector(random, 1), false);
  query.a = std::move(large);
  ask_both(query, &tally);
  query.a = std::make_unique<btCapsuleShape>(btScalar(1), btScalar(1));
  query.b = std::make_unique<btSphereShape>(btScalar(1));
  ask_both(query, &tally);
  EXPECT_EQ(tally.unknown, 3);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
