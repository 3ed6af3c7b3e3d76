/// Tests of triangle meshes: irregular input, contacts of single triangles against a convex
/// distance in double, and contacts of closed surfaces against those of solids.
#include <jfpx/collide.hpp>
#include <jfpx/error.hpp>

#include "src/collide/mesh_queries.hpp"
#include "src/world/bodies/sub_shape_view.hpp"
#include "tests/collide/rounded_points.hpp"
#include "tests/world/random_bodies.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;
using test::core_gap;
using test::RoundedPoints;
using testing::HasSubstr;

std::string message_of(const TriangleMeshDef& def) {
  try {
    TriangleMesh mesh(def);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "no error";
}

TEST(TriangleMesh, ErrorsNameTheVertexOrTheTriangle) {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_THAT(message_of({corners, {{0, 1, 2}, {0, 1, 3}}}),
              HasSubstr("triangles[1][2] is 3; it must be an index of the mesh's 3 vertices"));
  EXPECT_THAT(message_of({{{0, test::kNan, 0}}, {}}), HasSubstr("vertices[0][1] is nan"));
  EXPECT_THAT(message_of({{{0, 0, 2e9_r}}, {}}),
              HasSubstr("vertices[0][2] is 2000000000.000000; it must be between -1e9 and 1e9"));
}

TEST(TriangleMesh, ReportCountsIrregularities) {
  // A square of two triangles; vertices 4 and 5 are copies of 1 and 2.
  TriangleMeshDef def{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}, {-0.0_r, 1, 0}},
                      {{0, 1, 2}, {4, 3, 5}}};
  TriangleMeshReport report = TriangleMesh(def).report();
  EXPECT_EQ(report.open_edges, 4u);
  EXPECT_EQ(report.degenerate + report.duplicate + report.shared_edges + report.flipped_edges, 0u);
  def.triangles.push_back({3, 4, 2});  // the second one, from its other side
  def.triangles.push_back({1, 2, 0});  // the first one, from another vertex
  def.triangles.insert(def.triangles.end(), {{0, 1, 4}, {0, 0, 0}});
  report = TriangleMesh(def).report();
  EXPECT_EQ(report.duplicate, 1u);
  EXPECT_EQ(report.degenerate, 2u);
  EXPECT_EQ(report.shared_edges, 0u);
  def.vertices.push_back({0, 0, 1});
  def.triangles.push_back({1, 2, 6});
  EXPECT_EQ(TriangleMesh(def).report().shared_edges, 1u);
  EXPECT_EQ(TriangleMesh({def.vertices[0], def.vertices[1], def.vertices[2], def.vertices[3]},
                         {{0, 1, 2}, {1, 2, 3}})
                .report()
                .flipped_edges,
            1u);
}

TEST(TriangleMesh, CopiesShareTheirData) {
  const TriangleMesh mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const TriangleMesh copy = mesh;
  EXPECT_EQ(copy.data(), mesh.data());
  EXPECT_EQ(copy, TriangleMesh(mesh.def()));
  EXPECT_NE(copy, TriangleMesh(mesh.def().vertices, mesh.def().triangles, true));
  EXPECT_EQ(TriangleMesh(), TriangleMesh(TriangleMeshDef{}));
}

detail::PairManifold contact_of(const SolidShape& solid, const Transform& at,
                                const TriangleMesh& mesh, std::uint32_t triangle,
                                const Transform& pose, const detail::PairMotion& pair) {
  detail::PairManifold found;
  const detail::MeshView view = detail::view_of(mesh);
  std::visit(
      [&](const auto& s) {
        find_contact_with_triangle(detail::instance(s, at), view, triangle, pose, pair, &found);
      },
      solid);
  return found;
}

/// All features of a triangle without neighbors have contacts. The depth is that of the separating
/// axis or closest points: pushing the solid out by it along the normal ends the overlap.
TEST(TriangleMesh, ContactsOfOneTriangleAreThoseOfTheOracle) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching = 0, deep = 0, missed = 0;
  for (int n = 0; n < 3000; ++n) {
    std::vector<Vec3> v;
    for (int k = 0; k < 3; ++k) v.push_back(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    if (!(length(cross(v[1] - v[0], v[2] - v[0])) > 0.1_r)) continue;
    const TriangleMesh mesh(v, {{0, 1, 2}}, true);
    const Transform pose = make_transform(test::random_rotation(&random), {});
    const SolidShape solid = test::random_sub_shape(&random);
    const auto is_round = [](const auto& s) { return detail::Round<std::decay_t<decltype(s)>>; };
    if (std::visit(is_round, solid)) continue;  // see round_contact_test.cpp
    const Transform at = make_transform(test::random_rotation(&random),
                                        random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    RoundedPoints a(solid, at), b(Sphere{1}, pose);
    b.points.clear();
    for (const Vec3& p : v) b.add(pose, p);
    const double radius = a.radius, core = core_gap(a, b), gap = core - radius;
    const detail::PairManifold found = contact_of(solid, at, mesh, 0, pose, {});
    const double tolerance = 2e-5;
    if (gap > tolerance) {
      ASSERT_EQ(found.touch_count, 0u) << n << ", gap " << gap;
      continue;
    }
    if (core > 0 && gap > -tolerance) continue;
    if (core == 0 && found.touch_count == 0) {  // the depth may be less than rounding
      ++missed;
      continue;
    }
    ASSERT_GT(found.touch_count, 0u) << n << ", gap " << gap;
    ++touching;
    Real distance = 0;
    for (std::uint32_t k = 0; k < found.touch_count; ++k) {
      distance = std::min(distance, found.touches[k].distance);
    }
    ASSERT_NEAR(static_cast<double>(length(found.normal)), 1, 1e-5);
    if (core > 1e-4) {  // the core does not intersect the triangle
      ASSERT_NEAR(static_cast<double>(distance), gap, 0.011 * radius + 1e-4) << n;
    }
    // Without overlap after the motion; capsules may take up to a hundredth of the radius less.
    a.move(found.normal * -distance);
    const double left = core_gap(a, b) - radius;
    const bool intersects = core < 1e-9;
    deep += intersects ? 1 : 0;
    // The depth of an axis that intersects the triangle is that above its face.
    const bool is_above_face = intersects && std::holds_alternative<Capsule>(solid);
    ASSERT_GT(left, is_above_face ? gap : -0.02 * radius - 1e-3) << n << ", " << solid.index();
  }
  EXPECT_LE(missed, 2);
  EXPECT_GT(touching, 200);
  EXPECT_GT(deep, 30);
}

/// A box whose faces are grids of triangles with their fronts outwards.
TriangleMesh mesh_of(const Box& box, std::uint32_t cells) {
  TriangleMeshDef def;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const Real side = face % 2 == 0 ? 1.0_r : -1.0_r;
    const auto first = static_cast<std::uint32_t>(def.vertices.size());
    for (std::uint32_t i = 0; i <= cells; ++i) {
      for (std::uint32_t j = 0; j <= cells; ++j) {
        const auto share = [&](std::uint32_t k) {
          return 2 * static_cast<Real>(k) / static_cast<Real>(cells) - 1;
        };
        Vec3 p;
        p[axis] = side * box.half_extents[axis];
        p[u] = share(i) * box.half_extents[u];
        p[v] = share(j) * box.half_extents[v];
        def.vertices.push_back(p);
      }
    }
    for (std::uint32_t i = 0; i < cells; ++i) {
      for (std::uint32_t j = 0; j < cells; ++j) {
        const std::uint32_t a = first + i * (cells + 1) + j, b = a + cells + 1;
        const bool is_upper = side > 0;
        def.triangles.push_back(is_upper ? Triangle{a, b, b + 1} : Triangle{a, b + 1, b});
        def.triangles.push_back(is_upper ? Triangle{a, b + 1, a + 1} : Triangle{a, a + 1, b + 1});
      }
    }
  }
  return TriangleMesh(std::move(def));
}

TEST(TriangleMesh, ABoxOfTrianglesIsClosed) {
  const TriangleMeshReport report = mesh_of({{1, 2, 3}}, 5).report();
  EXPECT_EQ(report.open_edges + report.shared_edges + report.flipped_edges + report.degenerate, 0u);
}

/// No contact has the normal of an edge between two triangles of a face.
TEST(TriangleMesh, ABoxOfTrianglesHasTheContactsOfABox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching = 0;
  for (int n = 0; n < 400; ++n) {
    const Box box{random.uniform_in_box({0.3_r, 0.3_r, 0.3_r}, {1, 1, 1})};
    const TriangleMesh mesh = mesh_of(box, static_cast<std::uint32_t>(1 + random.below(4)));
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * 5);
    // The centre is outside of the box.
    Vec3 local;
    do {
      local = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
    } while (!(length(detail::offset_from_box(local, box)) > 0.01_r));
    const SphereInstance ball{transform_point(pose, local), random.uniform(0.1_r, 1)};
    const Touch expected = collide(ball, box, pose);
    if (expected.touching && expected.distance > -1e-4_r) continue;
    std::size_t found = 0;
    for (std::uint32_t i = 0; i < mesh.triangles().size(); ++i) {
      const detail::PairManifold contact =
          contact_of(Sphere{ball.radius}, {pose.basis, ball.centre}, mesh, i, pose, {});
      for (std::uint32_t k = 0; k < contact.touch_count; ++k) {
        ASSERT_TRUE(expected.touching) << n;
        ++found;
        // Both triangles at a seam may have the contact, with normals up to a thousandth apart.
        ASSERT_NEAR(contact.touches[k].distance, expected.distance, 1e-5_r) << n;
        ASSERT_LT(length(contact.normal - expected.normal), 2e-3_r) << n;
        ASSERT_LT(length(contact.touches[k].point - expected.point), 2e-3_r) << n;
      }
    }
    ASSERT_EQ(found > 0, expected.touching) << n;
    touching += expected.touching ? 1 : 0;
  }
  EXPECT_GT(touching, 25);
}

/// A box that lies on a flat mesh has a contact at each of its corners, whatever the triangles.
TEST(TriangleMesh, ABoxOnAFlatMeshTouchesWithItsCornersOnly) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int n = 0; n < 200; ++n) {
    const auto cells = static_cast<std::uint32_t>(1 + random.below(12));
    const TriangleMesh mesh = mesh_of({{2, 0.5_r, 2}}, cells);
    const Box box{random.uniform_in_box({0.2_r, 0.1_r, 0.2_r}, {0.6_r, 0.6_r, 0.6_r})};
    const Real angle = random.uniform(-1, 1);
    const Quat turn = normalized(Quat{1, 0, angle, 0});
    const Vec3 centre{random.uniform(-0.9_r, 0.9_r), 0.499_r + box.half_extents.y,
                      random.uniform(-0.9_r, 0.9_r)};
    std::size_t points = 0;
    for (std::uint32_t i = 0; i < mesh.triangles().size(); ++i) {
      const detail::PairManifold contact =
          contact_of(box, make_transform(turn, centre), mesh, i, {}, {});
      for (std::uint32_t k = 0; k < contact.touch_count; ++k) {
        ASSERT_LT(length(contact.normal - Vec3{0, 1, 0}), 1e-5_r) << n;
        ASSERT_NEAR(contact.touches[k].distance, -0.001_r, 1e-5_r) << n;
        const Vec3 p =
            transform_transpose(make_transform(turn, {}).basis, contact.touches[k].point - centre);
        ASSERT_NEAR(absolute(p.x), box.half_extents.x, 1e-4_r) << n;
        ASSERT_NEAR(absolute(p.z), box.half_extents.z, 1e-4_r) << n;
        ++points;
      }
    }
    ASSERT_GE(points, 4u) << n;
    ASSERT_LE(points, 8u) << n;  // a corner at a seam may have two
  }
}

TEST(TriangleMesh, RaysFromInsideNeverPassASeam) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const Box box{{1, 0.7_r, 1.3_r}};
  TriangleMeshDef def = mesh_of(box, 4).def();
  def.two_sided = true;
  const TriangleMesh mesh(def);
  for (int n = 0; n < 20000; ++n) {
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-9, -9, -9}, {9, 9, 9}));
    const Vec3 from = random.uniform_in_box({-0.5_r, -0.5_r, -0.5_r}, {0.5_r, 0.5_r, 0.5_r});
    // To a point on an edge, or to a vertex.
    const Triangle& t = mesh.triangles()[random.below(mesh.triangles().size())];
    const Vec3 p = mesh.vertices()[t[0]], q = mesh.vertices()[t[1]];
    const Real share = random.below(3) == 0 ? 0.0_r : random.uniform(0, 1);
    const Vec3 target = add_scaled(p, q - p, share);
    const Vec3 direction = normalized(pose.basis * (target - from));
    const detail::RayEntry entry =
        detail::enter(transform_point(pose, from), direction, mesh, pose, kMaxReal);
    ASSERT_TRUE(entry.hit) << n;
    ASSERT_NEAR(entry.distance, length(target - from), 1e-4_r) << n;
    ASSERT_LT(dot(entry.normal, direction), 0) << n;
  }
}

TEST(TriangleMesh, RaysPassTheBackOfAOneSidedTriangle) {
  const std::vector<Vec3> v{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
  const TriangleMesh one_sided(v, {{0, 1, 2}}), two_sided(v, {{0, 1, 2}}, true);
  const auto hits = [](const TriangleMesh& mesh, Real from) {
    return detail::enter({0.2_r, from, 0.2_r}, {0, from > 0 ? -1.0_r : 1.0_r, 0}, mesh, {},
                         kMaxReal)
        .hit;
  };
  EXPECT_TRUE(hits(one_sided, 1));
  EXPECT_FALSE(hits(one_sided, -1));
  EXPECT_TRUE(hits(two_sided, -1));
}

}  // namespace
}  // namespace jfpx
