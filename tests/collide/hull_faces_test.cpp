/// Tests of Hull: construction from faces, scaling, and errors.
#include <jfpx/random.hpp>

#include "tests/collide/hull_oracle.hpp"
#include "tests/support/seed.hpp"

namespace jfpx {
namespace {

using test::box_corners;
using test::face_lists;
using test::hull_fault;
using test::HullPoints;
using test::prism;
using test::real;

TEST(Hull, FacesGiveTheHullThatTheyCameFrom) {
  const test::Seed seed;
  Random random(seed);
  for (int n = 0; n < 50; ++n) {
    HullPoints points;
    for (std::uint64_t i = 0, count = 10 + random.below(60); i < count; ++i) {
      points.push_back(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    }
    const Hull hull(points);
    std::vector<std::uint32_t> order(hull.vertices().size());
    std::iota(order.begin(), order.end(), 0u);
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    HullPoints vertices(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) vertices[order[i]] = hull.vertices()[i];
    auto faces = face_lists(hull);
    for (auto& face : faces) {
      for (std::uint32_t& corner : face) corner = order[corner];
      const auto shift = static_cast<std::ptrdiff_t>(random.below(face.size()));
      std::rotate(face.begin(), face.begin() + shift, face.end());
    }
    std::ranges::reverse(faces);
    EXPECT_EQ(Hull(vertices, faces), hull);
  }
}

TEST(Hull, TrianglesOfACubeAreMerged) {
  const HullPoints vertices = box_corners({-1, -1, -1}, {1, 1, 1});
  std::vector<std::vector<std::uint32_t>> triangles;
  const std::uint32_t squares[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& s : squares) {
    triangles.push_back({s[0], s[1], s[2]});
    triangles.push_back({s[2], s[3], s[0]});
  }
  EXPECT_EQ(Hull(vertices, triangles), Hull(vertices));
}

TEST(Hull, ScaledHullHasTheSameFaces) {
  const Hull hull(prism(12));
  const Hull large = hull.scaled({2, 3, 4});
  EXPECT_EQ(face_lists(large), face_lists(hull));
  EXPECT_NEAR(large.volume(), 24 * hull.volume(), 1e-5);
  const Hull mirrored = hull.scaled({-1, 1, 1});
  test::expect_closed(mirrored);
  test::expect_convex(mirrored);
  EXPECT_NEAR(mirrored.volume(), hull.volume(), 1e-12);
  EXPECT_EQ(mirrored.scaled({-1, 1, 1}), hull);
  EXPECT_EQ(hull.translated({1, 2, 3}).bounds().lower.z, 2);
  EXPECT_THROW(hull.scaled({0, 1, 1}), InvalidArgument);
  EXPECT_THROW(hull.scaled({1, std::numeric_limits<Real>::infinity(), 1}), InvalidArgument);
  EXPECT_THROW(hull.scaled({real(1e10), 1, 1}), InvalidArgument);
  EXPECT_THROW(hull.scaled({1, 1, kEpsilon}), InvalidArgument);
}

TEST(Hull, CopiesShareTheirData) {
  const Hull hull(prism(5));
  Hull copy = hull, moved = std::move(copy);
  EXPECT_EQ(&moved.data(), &hull.data());
  EXPECT_EQ(&copy.data(), &hull.data());
  EXPECT_EQ(moved, hull);
  EXPECT_FALSE(moved == Hull());
}

TEST(Hull, ErrorsNameFieldValueAndRange) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_EQ(hull_fault(HullPoints{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}),
            "points has 3 points; it must have at least 4");
  EXPECT_EQ(hull_fault(HullPoints{{0, 0, 0}, {1, nan, 0}, {0, 1, 0}, {0, 0, 1}}),
            "points[1] is (1, nan, 0); it must be finite and between -1e9 and 1e9");
  EXPECT_EQ(hull_fault(HullPoints{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, real(2e9)}}),
            "points[3] is (0, 0, 2e+09); it must be finite and between -1e9 and 1e9");
  const auto is_flat = [](const HullPoints& points, const std::string& where) {
    const std::string fault = hull_fault(points);
    return fault.starts_with("points is within ") &&
           fault.ends_with(" m of " + where + "; it must have points on both sides of every plane");
  };
  EXPECT_TRUE(is_flat({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, "a point"));
  EXPECT_TRUE(is_flat({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, "a point"));
  EXPECT_TRUE(is_flat({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}, "a line"));
  EXPECT_TRUE(is_flat({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}, {2, 5, 1}}, "a plane"));
  if (sizeof(Real) == 8) {
    const Real d = real(1e-120);
    EXPECT_NE(hull_fault(box_corners({0, 0, 0}, {d, d, d})).find("its volume is a normal double"),
              std::string::npos);
  }
}

TEST(Hull, ErrorsOfFacesNameFaceAndRange) {
  const HullPoints vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  using Faces = std::vector<std::vector<std::uint32_t>>;
  const Faces good = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_EQ(Hull(vertices, good), Hull(vertices));
  const auto fault = [&](std::size_t face, std::vector<std::uint32_t> corners) {
    Faces faces = good;
    faces[face] = std::move(corners);
    return hull_fault(vertices, faces);
  };
  EXPECT_EQ(hull_fault(vertices, Faces{good.begin(), good.begin() + 3}),
            "faces has 3 faces; it must have at least 4");
  EXPECT_EQ(fault(2, {0, 3}), "faces[2] has 2 vertices; it must have at least 3");
  EXPECT_EQ(fault(2, {0, 3, 4}),
            "faces[2][2] is 4; it must be less than 4, the number of vertices");
  EXPECT_EQ(fault(2, {0, 3, 0}), "faces[2] has vertex 0 twice; its vertices must differ");
  EXPECT_EQ(fault(3, {1, 3, 2}),
            "faces[3] has an edge from vertex 1 to vertex 3, as faces[1]; neighbouring faces must "
            "have it in opposite directions");
  Faces inside_out = good;
  for (auto& face : inside_out) std::ranges::reverse(face);
  EXPECT_NE(hull_fault(vertices, inside_out).find("counter-clockwise as seen from outside"),
            std::string::npos);
  HullPoints more = vertices;
  more.push_back({real(0.1), real(0.1), real(0.1)});
  EXPECT_EQ(hull_fault(more, good), "vertices[4] has no face; it must be in at least 2 faces");
  more.back() = more.front();
  EXPECT_EQ(hull_fault(more, good), "vertices[4] is (0, 0, 0); it must differ from vertices[0]");
  // A dent: a vertex inside instead of a face.
  more.back() = {real(0.1), real(0.1), real(0.1)};
  Faces dented = {good.begin(), good.begin() + 3};
  dented.insert(dented.end(), {{1, 2, 4}, {2, 3, 4}, {3, 1, 4}});
  EXPECT_NE(hull_fault(more, dented).find("behind another vertex; it must be plane"),
            std::string::npos);
  // A cube without a face, one with a bent face, and one with a face that crosses itself.
  const Hull cube(box_corners({0, 0, 0}, {1, 1, 1}));
  const Faces squares = face_lists(cube);
  EXPECT_NE(hull_fault(cube.vertices(), Faces{squares.begin(), squares.end() - 1})
                .find("of no other face; the faces must be closed"),
            std::string::npos);
  HullPoints bent(cube.vertices().begin(), cube.vertices().end());
  bent.back() = {real(1.1), real(1.2), real(1.3)};
  EXPECT_NE(hull_fault(bent, squares).find("it must be plane"), std::string::npos);
  // Two tetrahedra are two surfaces.
  HullPoints two = vertices;
  Faces both = good;
  for (const Vec3& v : vertices) two.push_back(v + Vec3{5, 0, 0});
  for (const auto& face : good) both.push_back({face[0] + 4, face[1] + 4, face[2] + 4});
  EXPECT_EQ(hull_fault(two, both),
            "faces has 8 vertices, 12 edges and 8 faces, of which 4 are connected to the first; it "
            "must be one surface without holes");
}

}  // namespace
}  // namespace jfpx
