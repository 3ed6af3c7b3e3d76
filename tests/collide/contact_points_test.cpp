/// Contact points of solids other than half-spaces: each is in the middle of the overlap, that is,
/// within half the depth of both solids.
#include "tests/collide/random_solids.hpp"
#include "tests/collide/support_oracle.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kPartners;
using test::partner;
using test::Point;
using test::random_tilt;
using test::SupportSolid;
using test::to_point;

/// [m], by which the points of a contact with less than 0.1 m depth are farthest outside the
/// overlap, along random directions. The polygon that stands for a cap makes it 2 % of the radius.
double distance_outside(const detail::PairManifold& found, const SupportSolid& a,
                        const SupportSolid& b, Random* random, int* points) {
  double most = 0;
  for (std::uint32_t k = 0; k < found.touch_count; ++k) {
    const double depth = -static_cast<double>(found.touches[k].distance);
    if (depth > 0.1) continue;
    const Point p = to_point(found.touches[k].point);
    for (int i = 0; i < 100; ++i) {
      const Point d = to_point(test::random_direction(random));
      most = std::max(most, test::dot(p, d) - std::min(a.reach(d), b.reach(d)) - 0.52 * depth);
    }
    ++*points;
  }
  return most;
}
constexpr double kMost = 0.02;

TEST(ContactPoints, AreInTheOverlapOfTwoSolids) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int points[kPartners] = {};
  for (int n = 0; n < 4000; ++n) {
    const auto kind = static_cast<std::uint64_t>(n % kPartners);
    const SolidShape a = partner(kind, &random), b = partner(random.below(kPartners), &random);
    const Transform pose_a = make_transform(random_tilt(&random), {});
    const Transform pose_b =
        make_transform(random_tilt(&random), random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    const double outside =
        distance_outside(test::contact_between(a, pose_a, b, pose_b), SupportSolid(a, pose_a),
                         SupportSolid(b, pose_b), &random, &points[kind]);
    EXPECT_LT(outside, kMost) << n << ", kind " << kind;
  }
  for (const int count : points) EXPECT_GT(count, 30);
}

detail::PairManifold contact_with_triangle(const SolidShape& solid, const Transform& pose,
                                           const std::vector<Vec3>& corners) {
  const TriangleMesh mesh(corners, {{0, 1, 2}}, true);
  const detail::MeshView view = detail::view_of(mesh);
  detail::PairManifold found;
  const auto find = [&](const auto& s) {
    detail::TriangleInstance triangle;
    ASSERT_TRUE(make_instance(view, 0, {}, pose.origin, &triangle));
    find_contact(detail::instance(s, pose), triangle, {}, &found);
  };
  std::visit(find, solid);
  return found;
}

TEST(ContactPoints, AreInTheOverlapOfASolidAndATriangle) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int points[kPartners] = {};
  for (int n = 0; n < 6000; ++n) {
    const auto kind = static_cast<std::uint64_t>(n % kPartners);
    const SolidShape solid = partner(kind, &random);
    const Transform pose = make_transform(random_tilt(&random), {});
    const Transform plane =
        make_transform(random_tilt(&random), random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    std::vector<Vec3> corners;
    for (int k = 0; k < 3; ++k) {
      corners.push_back(transform_point(plane, random.uniform_in_box({-1, 0, -1}, {1, 0, 1})));
    }
    const Vec3 across = cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (!(length(across) > 0.1_r)) continue;
    const double outside =
        distance_outside(contact_with_triangle(solid, pose, corners), SupportSolid(solid, pose),
                         SupportSolid(corners), &random, &points[kind]);
    EXPECT_LT(outside, kMost) << n << ", kind " << kind;
  }
  for (const int count : points) EXPECT_GT(count, 30);
}

struct SolidPair {
  SolidShape a, b;
  Transform pose_a, pose_b;
};

/// Pairs whose supporting edges, or middles of caps, are far from each other: the point was up to
/// 0.4 m outside.
TEST(ContactPoints, AreInTheOverlapOfFacesAndCapsThatAreHardlyTilted) {
  const Transform upright{};
  const auto pose = [](const Vec3& x, const Vec3& y, const Vec3& z, const Vec3& origin) {
    return Transform{from_columns(x, y, z), origin};
  };
  const SolidPair pairs[] = {
      // Two caps, of which the centre of one is far from the other.
      {Cone{0.725454748_r, 0.07570526_r}, Cylinder{0.0570465215_r, 0.300950766_r},
       pose({0.99986351_r, -0.016118787_r, -0.003627799_r},
            {0.0033094538_r, -0.019733071_r, 0.99979991_r},
            {-0.016187148_r, -0.99967545_r, -0.019676924_r}, {}),
       pose({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, {0.65590012_r, -0.39428377_r, -0.33447504_r})},
      {Cylinder{0.119001389_r, 0.34820044_r},
       Cone{0.714757323_r, 0.221043304_r},
       pose({0.99983525_r, -0.018140059_r, -0.00067369029_r},
            {0.018140558_r, 0.99983519_r, 0.00074127718_r},
            {0.00066013244_r, -0.00075337611_r, 0.99999952_r}, {}),
       {upright.basis, {0.64894593_r, 0.41188848_r, -0.37507069_r}}},
      // A line beside a face, of which all edges support the line.
      {Cylinder{0.313857436_r, 0.131036013_r}, Box{{0.61410445_r, 0.39620212_r, 0.26215997_r}},
       pose({0.99997038_r, 0.0067797932_r, -0.0036453006_r},
            {-0.0067428392_r, 0.99992669_r, 0.010055989_r},
            {0.0037132108_r, -0.010031112_r, 0.99994278_r}, {}),
       pose({-0.019163847_r, 0.99760735_r, 0.066426978_r},
            {-0.99978364_r, -0.01858294_r, -0.0093524624_r},
            {-0.0080956779_r, -0.066591829_r, 0.99774748_r},
            {-0.72021925_r, 0.33124697_r, 0.28734171_r})},
  };
  Random random(1);
  int points = 0;
  for (const SolidPair& p : pairs) {
    const double outside = distance_outside(test::contact_between(p.a, p.pose_a, p.b, p.pose_b),
                                            SupportSolid(p.a, p.pose_a),
                                            SupportSolid(p.b, p.pose_b), &random, &points);
    EXPECT_LT(outside, kMost);
  }
  EXPECT_GE(points, 3);
}

/// Edges that do not cross, along whose common normal the box and the triangle overlap a little
/// less than along the normal of a face: the point was 0.5 m outside.
TEST(ContactPoints, AreThoseOfAFaceIfTheEdgesDoNotCross) {
  const SolidShape box = Box{{0.36061656_r, 0.16643941_r, 0.42177144_r}};
  const Transform pose{from_columns({0.99918038_r, 0.033604126_r, 0.022569273_r},
                                    {-0.022399899_r, -0.005408287_r, 0.99973446_r},
                                    {0.033717263_r, -0.99942058_r, -0.0046510696_r}),
                       {}};
  const std::vector<Vec3> corners = {{1.0484824_r, -0.39129537_r, 0.65658951_r},
                                     {0.044118166_r, -0.4124299_r, -0.034572005_r},
                                     {1.9223284_r, -0.37946016_r, -0.14248286_r}};
  Random random(1);
  int points = 0;
  const double outside =
      distance_outside(contact_with_triangle(box, pose, corners), SupportSolid(box, pose),
                       SupportSolid(corners), &random, &points);
  EXPECT_LT(outside, kMost);
  EXPECT_GE(points, 1);
}

}  // namespace
}  // namespace jfpx
