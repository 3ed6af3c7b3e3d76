/// Triangle meshes in the viewer: normals, distances, grounds, bounds, and the initial camera.
#include "src/viewer/mesh_geometry.hpp"

#include "src/collide/mesh_data.hpp"
#include "src/collide/mesh_queries.hpp"
#include "src/viewer/framing.hpp"
#include "tests/support/seed.hpp"
#include "tests/viewer/meshes.hpp"
#include "tests/viewer/painted_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>

namespace jfpx {
namespace {

using namespace view;
using test::add;
using test::run_state_of;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(MeshGeometry, EdgesOfACubeAreSharp) {
  const MeshGeometry geometry = make_geometry(test::cube_mesh(2));
  EXPECT_THAT(geometry.vertices, SizeIs(24));
  EXPECT_THAT(geometry.indices, SizeIs(36));
  for (const MeshVertex& vertex : geometry.vertices) {
    int largest = 0;
    for (const int n : vertex.normal) largest = std::max(largest, std::abs(n));
    EXPECT_EQ(largest, 32767);
  }
}

TEST(MeshGeometry, VerticesOfAGentleTerrainHaveOneNormal) {
  const auto wave = [](Real x, Real z) { return std::sin(x) * std::cos(z) * Real(0.3); };
  const TriangleMesh mesh = test::terrain(16, Real(0.25), wave);
  const MeshGeometry geometry = make_geometry(mesh);
  EXPECT_THAT(geometry.indices, SizeIs(mesh.triangles().size() * 3));
  using Place = std::pair<float, float>;
  std::map<Place, std::array<std::int16_t, 3>> normals;
  for (const MeshVertex& vertex : geometry.vertices) {
    EXPECT_GT(vertex.normal[1], 30000);
    const auto normal = std::to_array(vertex.normal);
    const Place place{vertex.position[0], vertex.position[2]};
    EXPECT_EQ(normals.try_emplace(place, normal).first->second, normal);
  }
  EXPECT_THAT(normals, SizeIs(mesh.vertices().size()));
}

TEST(MeshGeometry, TheLastVertexOfATriangleHasTheNormalOfItsFace) {
  const auto wave = [](Real x, Real z) { return std::sin(x) * std::cos(z); };
  const TriangleMesh mesh = test::terrain(16, Real(0.5), wave);
  const MeshGeometry geometry = make_geometry(mesh);
  EXPECT_LE(geometry.vertices.size(), mesh.triangles().size() * 9 / 8);  // few copies
  ASSERT_THAT(geometry.indices, SizeIs(mesh.triangles().size() * 3));
  const auto corner = [&](std::size_t i) {
    const float(&p)[3] = geometry.vertices[geometry.indices[i]].position;
    return Vec3{Real(p[0]), Real(p[1]), Real(p[2])};
  };
  for (std::size_t i = 0; i < geometry.indices.size(); i += 3) {
    const Vec3 normal = normalized(cross(corner(i + 1) - corner(i), corner(i + 2) - corner(i + 1)));
    const std::int16_t(&face)[3] = geometry.vertices[geometry.indices[i + 2]].face;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(Real(face[k]) / 32767, normal[k], 1e-4) << i;
  }
}

TEST(MeshGeometry, FrontsOfATwoSidedSurfaceAreArbitrary) {
  const std::vector<Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  const std::vector<Triangle> opposite = {{0, 1, 2}, {0, 3, 2}};
  for (const bool two_sided : {false, true}) {
    for (const MeshVertex& vertex : make_geometry({square, opposite, two_sided}).vertices) {
      EXPECT_EQ(std::abs(vertex.normal[1]), 32767) << two_sided;
    }
  }
}

TEST(MeshGeometry, LeavesOutTrianglesWithoutArea) {
  const std::vector<Vec3> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {2, 0, 0}};
  EXPECT_THAT(make_geometry({vertices, {{0, 2, 1}, {0, 1, 3}, {1, 3, 2}}}).indices, SizeIs(6));
  const TriangleMesh line(vertices, {{0, 1, 3}});
  EXPECT_THAT(make_geometry(line).indices, IsEmpty());
  EXPECT_EQ(distance_to(line, {}), kMaxReal);
  Scene scene;
  add(&scene, line, {}, 0);
  EXPECT_THAT(test::draw(scene, run_state_of(scene)).meshes(), IsEmpty());
}

TEST(MeshGeometry, TwoTrianglesWithOppositeFrontsAreOneTwoSidedTriangle) {
  const std::vector<Vec3> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}};
  const MeshGeometry geometry = make_geometry({vertices, {{0, 2, 1}, {1, 2, 0}, {1, 2, 3}}});
  EXPECT_THAT(geometry.indices, SizeIs(6));
  for (std::size_t i = 0; i < 6; ++i) {
    const bool is_pair = i < 3;
    EXPECT_EQ(geometry.vertices[geometry.indices[i]].one_sided, is_pair ? 0 : 32767) << i;
  }
}

TEST(MeshGeometry, TheTipOfALargeFanTakesLinearTime) {
  constexpr std::uint32_t kSides = 200000;  // a quadratic time is minutes
  std::vector<Vec3> vertices = {{0, 1, 0}};
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const Real angle = Real(i) * 2 * kPi / kSides;
    vertices.push_back({100 * std::cos(angle), 0, -100 * std::sin(angle)});
    triangles.push_back({0, i + 1, (i + 1) % kSides + 1});
  }
  const TriangleMesh cone(std::move(vertices), std::move(triangles));
  EXPECT_GT(make_geometry(cone).indices.size(), kSides);
}

TEST(MeshGeometry, DistanceIsThatOfTheNearestTriangle) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> anywhere(-4, 4);
  const auto point = [&] { return Vec3{anywhere(random), anywhere(random), anywhere(random)}; };
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < 300; i += 3) {
    const Vec3 at = point();
    for (int k = 0; k < 3; ++k) vertices.push_back(at + point() * Real(0.2));
    triangles.push_back({i, i + 1, i + 2});
  }
  const TriangleMesh mesh(vertices, triangles, true);
  for (int i = 0; i < 200; ++i) {
    const Vec3 eye = point() * Real(1.5);
    // Points of the triangles are not nearer, and the nearest one of many is little farther.
    Real nearest = kMaxReal;
    for (const Triangle& t : triangles) {
      for (int a = 0; a <= 20; ++a) {
        for (int b = 0; a + b <= 20; ++b) {
          const Vec3 on_it = vertices[t[0]] * (Real(a) / 20) + vertices[t[1]] * (Real(b) / 20) +
                             vertices[t[2]] * (Real(20 - a - b) / 20);
          nearest = std::min(nearest, length(on_it - eye));
        }
      }
    }
    const Real distance = distance_to(mesh, eye);
    EXPECT_LE(distance, nearest + Real(1e-5));
    EXPECT_GE(distance, nearest - Real(0.12));  // the side of a triangle is at most 2.8 m
  }
}

TEST(ScenePainter, DrawsMeshesAtTheInterpolatedPoseOfTheirBody) {
  Scene scene;
  add(&scene, Sphere{}, {0, 5, 0}, 1);
  add(&scene, test::cube_mesh(1), {1, 2, 3}, 0);
  scene.bodies[1].kinematic = true;
  const RunState from = run_state_of(scene);
  RunState to = from;
  to.states[1].position = {3, 2, 3};
  to.states[1].orientation = {0, 0, 1, 0};  // half a turn about y
  Drawing drawing({1, 1, 1});
  ScenePainter(scene).draw(from, to, Real(0.5), Colouring::speed, &drawing);
  ASSERT_EQ(drawing.meshes().size(), 1u);
  const MeshItem& item = drawing.meshes()[0].item;
  EXPECT_THAT(item.centre, ElementsAre(1, 1, 2));
  EXPECT_NEAR(item.turn[1], std::sqrt(0.5), 1e-6);
  EXPECT_EQ(drawing.meshes()[0].mesh.data(), std::get<TriangleMesh>(scene.bodies[1].shape).data());
}

TEST(ScenePainter, DrawsHeightfieldsAsMeshesThatTheyShare) {
  Scene scene;
  const Heightfield hills({3, 2, 1, 2, {0, 1, 0, 0, 2, 0}, {1}, false});
  add(&scene, Sphere{}, {0, 5, 0}, 1);
  add(&scene, hills, {1, 2, 3}, 0);
  add(&scene, hills, {5, 2, 3}, 0);
  const Drawing drawing = test::draw(scene, run_state_of(scene));
  ASSERT_EQ(drawing.meshes().size(), 2u);
  EXPECT_EQ(drawing.meshes()[0].mesh.data(), drawing.meshes()[1].mesh.data());
  EXPECT_EQ(drawing.meshes()[0].mesh, to_triangle_mesh(hills));
  EXPECT_THAT(drawing.meshes()[0].mesh.triangles(), SizeIs(2));
}

TEST(ScenePainter, DrawsNoGroundUnderATerrainAndOneBelowSmallMeshes) {
  const auto flat = [](Real, Real) { return Real(-7); };
  Scene scene;
  add(&scene, Sphere{}, {}, 1);
  scene.bodies[0].acceleration = {};  // falls through no ground
  EXPECT_THAT(test::draw(scene, run_state_of(scene)).grounds(), SizeIs(1));
  Scene terrain = scene;
  add(&terrain, test::terrain(10, 2, flat), {}, 0);
  EXPECT_THAT(test::draw(terrain, run_state_of(terrain)).grounds(), IsEmpty());
  Scene small = scene;
  add(&small, test::terrain(2, 1, flat), {5, 0, 0}, 0);
  const Drawing above = test::draw(small, run_state_of(small));
  ASSERT_THAT(above.grounds(), SizeIs(1));
  EXPECT_GT(above.grounds()[0].height, 7);
}

TEST(BoundsEstimator, IgnoresATerrainUnlessItIsAlone) {
  const auto flat = [](Real, Real) { return Real(0); };
  Scene scene;
  add(&scene, Sphere{}, {3, 1, 0}, 1);
  add(&scene, Sphere{}, {5, 1, 0}, 1);
  const Bounds bodies = bounds_of(scene, run_state_of(scene).states);
  add(&scene, test::terrain(4, 1000, flat), {}, 0);
  const Bounds both = bounds_of(scene, run_state_of(scene).states);
  EXPECT_EQ(both.centre, bodies.centre);
  EXPECT_EQ(both.radius, bodies.radius);
  Scene alone;
  add(&alone, test::terrain(4, 10, flat, {500, 0, 0}), {0, 2, 0}, 0);
  const Bounds mesh = bounds_of(alone, run_state_of(alone).states);
  EXPECT_EQ(mesh.centre, (Vec3{500, 2, 0}));
  EXPECT_NEAR(mesh.radius, std::sqrt(800.0), 1e-3);
}

TEST(InitialCamera, RisesUntilItSeesTheBodiesInACrater) {
  const auto crater = [](Real x, Real z) {
    return 12 - 12 * std::exp((x * x + z * z) / Real(-30));
  };
  Scene scene;
  for (int i = -2; i <= 2; ++i) add(&scene, Sphere{}, {Real(i), Real(2.2), 0}, 1);
  const RunState bodies = run_state_of(scene);
  const Camera without = initial_camera({}, scene, bodies);
  const TriangleMesh mesh = test::terrain(60, 1, crater);
  add(&scene, mesh, {}, 0);
  const RunState run_state = run_state_of(scene);
  const auto hidden = [&](const Vec3& eye) {
    const Vec3 from = run_state.states[0].position;
    const Real distance = length(eye - from);
    return jfpx::detail::enter(from, normalized(eye - from), mesh, make_transform({}, {}), distance)
        .hit;
  };
  ASSERT_TRUE(hidden(without.eye()));
  const Camera with = initial_camera({}, scene, run_state);
  EXPECT_FALSE(hidden(with.eye()));
  EXPECT_GT(with.eye().y, without.eye().y);
}

}  // namespace
}  // namespace jfpx
