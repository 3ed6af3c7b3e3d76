/// Tests of Hull: faces by brute force on integer points, promises on random and degenerate points,
/// mass properties in closed form.
#include <jfpx/hull.hpp>
#include <jfpx/random.hpp>

#include "tests/collide/hull_oracle.hpp"
#include "tests/support/seed.hpp"

#include <bit>
#include <string>

namespace jfpx {
namespace {

using test::box_corners;
using test::face_lists;
using test::hull_fault;
using test::HullPoints;
using test::prism;
using test::real;

/// Points on the unit sphere, evenly spaced along a spiral.
HullPoints hull_spiral(int count) {
  HullPoints points;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z), angle = 2.399963 * i;
    points.push_back({real(r * std::cos(angle)), real(r * std::sin(angle)), real(z)});
  }
  return points;
}
Quat hull_rotation(Random* random) {
  const auto u = [random] { return random->uniform(-1, 1); };
  const Quat q{u(), u(), u(), u()};
  return length_squared(q) > Real(0.01) ? normalized(q) : Quat{};
}
Vec3 hull_direction(Random* random) {
  for (;;) {
    const Vec3 v = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    if (length(v) > Real(0.1)) return normalized(v);
  }
}
void hull_shuffle(HullPoints* points, Random* random) {
  for (std::size_t i = points->size(); i > 1; --i) {
    std::swap((*points)[i - 1], (*points)[random->below(i)]);
  }
}
TEST(Hull, CubeHasSixSquares) {
  const Hull hull(box_corners({-1, -2, -3}, {1, 2, 3}));
  test::expect_hull_of(hull, box_corners({-1, -2, -3}, {1, 2, 3}));
  ASSERT_EQ(hull.faces().size(), 6u);
  EXPECT_EQ(hull.edges().size(), 12u);
  for (const HullFace& face : hull.faces()) {
    EXPECT_EQ(face.corner_count, 4);
    const Vec3 size{1, 2, 3}, n = face.normal;
    EXPECT_EQ(std::abs(n.x) + std::abs(n.y) + std::abs(n.z), 1);
    EXPECT_EQ(face.offset, std::abs(dot(n, size)));
  }
  EXPECT_EQ(hull.bounds(), (Aabb{{-1, -2, -3}, {1, 2, 3}}));
}

TEST(Hull, DefaultIsTheCubeOfABox) {
  EXPECT_EQ(Hull(), Hull(box_corners({real(-0.5), real(-0.5), real(-0.5)},
                                     {real(0.5), real(0.5), real(0.5)})));
  EXPECT_EQ(Hull().volume(), 1);
}

TEST(Hull, TetrahedronAndOctahedronHaveTriangles) {
  const HullPoints tetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  test::expect_hull_of(Hull(tetrahedron), tetrahedron);
  EXPECT_EQ(Hull(tetrahedron).faces().size(), 4u);
  const HullPoints octahedron = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                 {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  test::expect_hull_of(Hull(octahedron), octahedron);
  EXPECT_EQ(Hull(octahedron).faces().size(), 8u);
}

TEST(Hull, PrismHasTwoPolygonsAndOneFacePerSide) {
  for (int sides = 3; sides <= 64; ++sides) {
    SCOPED_TRACE(sides);
    const Hull hull(prism(sides));
    test::expect_hull_of(hull, prism(sides));
    const auto n = static_cast<std::size_t>(sides);
    ASSERT_EQ(hull.faces().size(), n + 2);
    EXPECT_EQ(hull.vertices().size(), 2 * n);
    const double area = 0.5 * sides * std::sin(2 * 3.14159265358979323846 / sides);
    EXPECT_NEAR(hull.volume(), 2 * area, 1e-6 * area);
  }
}

TEST(Hull, IntegerPointsHaveTheFacesOfBruteForce) {
  const test::Seed seed;
  Random random(seed);
  int solids = 0;
  for (int n = 0; n < 300; ++n) {
    const std::uint64_t side = 2 + random.below(4), count = 4 + random.below(20);
    HullPoints points;
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto coordinate = [&] { return static_cast<Real>(random.below(side)); };
      const Real x = coordinate(), y = coordinate(), z = coordinate();
      points.push_back({x, y, z});
    }
    const auto expected = test::faces_by_brute_force(points);
    if (expected.empty()) {
      EXPECT_THROW(Hull{points}, InvalidArgument);
      continue;
    }
    ++solids;
    const Hull hull(points);
    test::expect_hull_of(hull, points);
    ASSERT_EQ(test::face_sets(hull), expected) << n;
  }
  EXPECT_GT(solids, 150);
}

TEST(Hull, FullGridIsABox) {
  HullPoints points;
  for (int i = 0; i < 1000; ++i) points.push_back({real(i % 10), real(i / 10 % 10), real(i / 100)});
  EXPECT_EQ(Hull(points), Hull(box_corners({0, 0, 0}, {9, 9, 9})));
}

TEST(Hull, RandomPointsHaveTheFacesOfBruteForce) {
  const test::Seed seed;
  Random random(seed);
  for (int n = 0; n < 100; ++n) {
    HullPoints points;
    const std::uint64_t count = 4 + random.below(16);
    // Multiples of 1/4096: far more than the tolerances apart, unless exactly coplanar.
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto coordinate = [&] { return static_cast<Real>(random.below(8192)) / 4096 - 1; };
      const Real x = coordinate(), y = coordinate(), z = coordinate();
      points.push_back({x, y, z});
    }
    const Hull hull(points);
    test::expect_hull_of(hull, points);
    // A vertex may be close to the hull of the others, or two faces nearly coplanar.
    if (sizeof(Real) == 8) {
      ASSERT_EQ(test::face_sets(hull), test::faces_by_brute_force(points)) << n;
    }
  }
}

TEST(Hull, IsAFunctionOfTheSetOfPoints) {
  const test::Seed seed;
  Random random(seed);
  for (int n = 0; n < 100; ++n) {
    HullPoints points;
    const bool is_grid = random.below(2) == 0;
    for (std::uint64_t i = 0, count = 8 + random.below(80); i < count; ++i) {
      Vec3 p = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      if (is_grid) p = {std::floor(p.x), std::floor(p.y), std::floor(p.z)};
      points.push_back(p);
    }
    points.insert(points.end(), {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 3}});
    const Hull hull(points);
    HullPoints other = points;
    for (int i = 0; i < 20; ++i) other.push_back(points[random.below(points.size())]);
    for (Vec3& p : other) {
      for (int i = 0; i < 3; ++i) {
        if (p[i] == 0 && random.below(2) == 0) p[i] = -p[i];
      }
    }
    hull_shuffle(&other, &random);
    const Hull same(other);
    ASSERT_EQ(hull, same);
    ASSERT_TRUE(std::ranges::equal(hull.edges(), same.edges()));
    ASSERT_EQ(hull.volume(), same.volume());
    ASSERT_EQ(hull.inertia(1), same.inertia(1));
    for (const Vec3& v : same.vertices()) {
      for (int i = 0; i < 3; ++i) ASSERT_FALSE(v[i] == 0 && std::signbit(v[i]));
    }
  }
}

TEST(Hull, EqualHullsShareTheirData) {
  const test::Seed seed;
  Random random(seed);
  for (int n = 0; n < 300; ++n) {  // hulls of earlier rounds exist no longer
    HullPoints points, other;
    for (int i = 0; i < 12; ++i) points.push_back(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    const Hull hull(points);
    hull_shuffle(&points, &random);
    EXPECT_EQ(&Hull(points).data(), &hull.data());
    EXPECT_EQ(&Hull(hull.vertices(), face_lists(hull)).data(), &hull.data());
    for (const Vec3& p : points) other.push_back(p * Real(1.25));
    EXPECT_NE(&Hull(other).data(), &hull.data());
  }
}

TEST(Hull, RoundingOfARotationDoesNotBendAGrid) {
  const test::Seed seed;
  Random random(seed);
  for (int n = 0; n < 50; ++n) {
    const Transform pose =
        make_transform(hull_rotation(&random), random.uniform_in_box({-3, -3, -3}, {3, 3, 3}));
    const Vec3 size = random.uniform_in_box({real(0.2), real(0.2), real(0.2)}, {2, 2, 2});
    HullPoints points;
    constexpr int kSide = 7;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const Vec3 p{real(i % kSide), real(i / kSide % kSide), real(i / kSide / kSide)};
      points.push_back(transform_point(pose, component_product(p * (1 / real(kSide - 1)), size)));
    }
    const Hull hull(points);
    test::expect_hull_of(hull, points);
    ASSERT_EQ(hull.vertices().size(), 8u) << n;
    ASSERT_EQ(hull.faces().size(), 6u) << n;
  }
}

/// Points of many kinds, most of them nearly degenerate.
HullPoints random_hull_points(Random* random) {
  HullPoints points;
  const std::uint64_t kind = random->below(8), count = 5 + random->below(90);
  const Vec3 axis = hull_direction(random), other = hull_direction(random);
  const Real tiny = std::pow(Real(10), -random->uniform(1, 9));
  for (std::uint64_t i = 0; i < count; ++i) {
    const Vec3 p = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    const Real t = random->uniform(-1, 1), s = random->uniform(-1, 1);
    switch (kind) {
      case 0:  // a cloud
        points.push_back(p);
        break;
      case 1:  // a sphere
        points.push_back(hull_direction(random));
        break;
      case 2:  // near a plane
        points.push_back(axis * t + other * s + p * tiny);
        break;
      case 3:  // near a line
        points.push_back(axis * t + p * tiny);
        break;
      case 4:  // clusters
        points.push_back(box_corners({}, {1, 1, 1})[i % 8] + p * tiny);
        break;
      case 5:  // a flat dome
        points.push_back({t, s, -tiny * (t * t + s * s)});
        break;
      case 6:  // a circle and two points
        points.push_back(i < 2 ? Vec3{0, 0, i == 0 ? -tiny : tiny} : normalized(Vec3{p.x, p.y, 0}));
        break;
      default:  // a small cap of a sphere
        points.push_back(normalized(Vec3{p.x * tiny, p.y * tiny, 1}));
        break;
    }
  }
  if (random->below(3) == 0) {
    const Transform pose =
        make_transform(hull_rotation(random), random->uniform_in_box({-2, -2, -2}, {2, 2, 2}));
    for (Vec3& p : points) p = transform_point(pose, p);
  }
  return points;
}

TEST(Hull, KeepsItsPromisesForNearlyDegeneratePoints) {
  const test::Seed seed;
  Random random(seed);
  int solids = 0;
  for (int n = 0; n < 2000; ++n) {
    const HullPoints points = random_hull_points(&random);
    try {
      const Hull hull(points);
      ++solids;
      ASSERT_NO_FATAL_FAILURE(test::expect_hull_of(hull, points)) << n;
      ASSERT_EQ(Hull(hull.vertices(), face_lists(hull)), hull) << n;
    } catch (const InvalidArgument& error) {
      EXPECT_NE(std::string(error.what()).find("is within"), std::string::npos) << error.what();
    }
    ASSERT_FALSE(testing::Test::HasFailure()) << n;
  }
  EXPECT_GT(solids, 800);
}

TEST(Hull, ThinPlateIsSolidAboveTheTolerance) {
  const Real u = kEpsilon;
  const Hull plate(box_corners({-1, -1, 0}, {1, 1, 200 * u}));
  test::expect_hull_of(plate, box_corners({-1, -1, 0}, {1, 1, 200 * u}));
  EXPECT_EQ(plate.faces().size(), 6u);
  EXPECT_NEAR(plate.volume() / (800 * static_cast<double>(u)), 1, 1e-12);
  const Mat3 inertia = plate.central_inertia(12);
  EXPECT_EQ(inertia, diagonal({4, 4, 8}));
  EXPECT_THROW(Hull(box_corners({-1, -1, 0}, {1, 1, 50 * u})), InvalidArgument);
}

TEST(Hull, ScalesFromDenormalsToALargeWorld) {
  const Real least = std::numeric_limits<Real>::denorm_min();
  const Real scales[] = {sizeof(Real) == 4 ? 100 * least : real(1e-100), real(1e-30), real(1e-3),
                         real(1e9)};
  for (const Real scale : scales) {
    SCOPED_TRACE(scale);
    HullPoints points = box_corners({-scale, -scale, -scale}, {scale, scale, scale});
    points.push_back({scale / 2, scale, scale / 4});
    const Hull hull(points);
    test::expect_hull_of(hull, points);
    EXPECT_EQ(hull.faces().size(), 6u);
    const auto s = static_cast<double>(scale);
    EXPECT_DOUBLE_EQ(hull.volume() / (s * s * s), 8);
  }
}

TEST(Hull, MassPropertiesOfABoxAreThoseOfTheClosedForm) {
  const Hull box(box_corners({1, 2, 3}, {3, 5, 9}));
  EXPECT_DOUBLE_EQ(box.volume(), 36);
  EXPECT_EQ(box.centre_of_mass(), (Vec3{2, 3.5, 6}));
  const double mass = 12, a = 4, b = 9, c = 36;  // squares of the edges
  const Mat3 central = box.central_inertia(real(mass)), about_origin = box.inertia(real(mass));
  const double moments[] = {b + c, c + a, a + b}, centre[] = {2, 3.5, 6};
  const double tolerance = 1e3 * static_cast<double>(kEpsilon);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double own = i == j ? moments[i] : 0;
      const double shift = (i == j ? 4 + 12.25 + 36 : 0) - centre[i] * centre[j];
      EXPECT_NEAR(static_cast<double>(central(i, j)), own, tolerance);
      EXPECT_NEAR(static_cast<double>(about_origin(i, j)), own + mass * shift, tolerance);
    }
  }
}

TEST(Hull, MassPropertiesOfATetrahedronAreThoseOfTheClosedForm) {
  const Hull tetrahedron(HullPoints{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  EXPECT_DOUBLE_EQ(tetrahedron.volume(), 1.0 / 6);
  EXPECT_EQ(tetrahedron.centre_of_mass(), (Vec3{0.25, 0.25, 0.25}));
  // The means of x^2 and of x y are 1/10 and 1/20.
  const Mat3 inertia = tetrahedron.inertia(20);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(static_cast<double>(inertia(i, j)), i == j ? 4 : -1, 1e-6);
    }
  }
}

/// FNV-1a over all arrays.
std::uint64_t hull_hash(const Hull& hull) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&hash](double x) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3u;
  };
  const detail::HullData& data = hull.data();
  for (const Vec3& v : data.vertices) add(v.x), add(v.y), add(v.z);
  for (const HullFace& f : data.faces)
    add(f.normal.x), add(f.normal.y), add(f.normal.z), add(f.offset);
  for (const std::uint8_t corner : data.corners) add(corner);
  for (const HullEdge& e : data.edges) add(e.a), add(e.b), add(e.left_face), add(e.right_face);
  add(data.volume);
  for (const double x : data.centre) add(x);
  for (const double x : data.spread) add(x);
  return hash;
}

TEST(Hull, HasPinnedBits) {
  Random random(1);
  HullPoints cloud, slab;
  for (int i = 0; i < 200; ++i) cloud.push_back(random.uniform_in_box({-1, -2, -3}, {1, 2, 3}));
  const Transform pose = make_transform(normalized(Quat{1, 2, 3, 4}), {3, 2, 1});
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p{real(i % 10), real(i / 10 % 10), real(i / 100) / 1000};
    slab.push_back(transform_point(pose, p));
  }
  const bool is_double = sizeof(Real) == 8;
  EXPECT_EQ(hull_hash(Hull(cloud)), is_double ? 3849923421456728165u : 15375888164110597014u);
  EXPECT_EQ(hull_hash(Hull(slab)), is_double ? 5392564845503510025u : 18130602464565497963u);
}

TEST(Hull, PointsCloserThanTheToleranceAreOneVertex) {
  const test::Seed seed;
  Random random(seed);
  for (int n = 0; n < 100; ++n) {
    const Transform pose = make_transform(hull_rotation(&random), {1, 2, 3});
    const Real radius = 4 * kEpsilon;
    HullPoints points;
    for (const Vec3& corner : box_corners({-1, -1, -1}, {1, 1, 1})) {
      for (int i = 0; i < 20; ++i) {
        const Vec3 noise =
            random.uniform_in_box({-radius, -radius, -radius}, {radius, radius, radius});
        points.push_back(transform_point(pose, corner) + noise);
      }
    }
    const Hull hull(points);
    ASSERT_EQ(hull.vertices().size(), 8u) << n;
    ASSERT_EQ(hull.faces().size(), 6u) << n;
  }
}

TEST(Hull, HasAtMost128Vertices) {
  EXPECT_EQ(Hull(hull_spiral(128)).vertices().size(), 128u);
  test::expect_hull_of(Hull(hull_spiral(128)), hull_spiral(128));
  EXPECT_EQ(Hull(hull_spiral(128)).faces().size(), Hull::kMaxFaces);
  EXPECT_EQ(hull_fault(hull_spiral(129)),
            "points has a hull with 129 vertices; it must have at most 128");
  EXPECT_EQ(hull_fault(hull_spiral(5000)),
            "points has a hull with 5000 vertices; it must have at most 128");
}

TEST(Hull, ManyPointsAreReducedOrRefused) {
  const test::Seed seed;
  Random random(seed);
  HullPoints points;
  const Quat turn = hull_rotation(&random);
  const Vec3 corner{1, 2, 3};
  for (int i = 0; i < 100000; ++i) {
    Vec3 p = random.uniform_in_box(-corner, corner);
    const auto face = static_cast<int>(random.below(4));
    if (face < 3) p[face] = random.below(2) == 0 ? corner[face] : -corner[face];
    points.push_back(rotate(turn, p));
  }
  for (const Vec3& p : box_corners(-corner, corner)) points.push_back(rotate(turn, p));
  const Hull box(points);
  EXPECT_EQ(box.vertices().size(), 8u);
  EXPECT_EQ(box.faces().size(), 6u);
  const std::string fault = hull_fault(hull_spiral(100000));
  EXPECT_NE(fault.find("vertices; it must have at most 128"), std::string::npos) << fault;
}

}  // namespace
}  // namespace jfpx
