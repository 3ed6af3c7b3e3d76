/// Tests of heightfields: bad input, and equality with meshes of the same triangles: neighbors,
/// search, contacts, rays and overlaps.
#include <jfpx/error.hpp>
#include <jfpx/heightfield.hpp>

#include "src/collide/core_sweep.hpp"
#include "src/collide/mesh_queries.hpp"
#include "src/world/bodies/sub_shape_view.hpp"
#include "tests/world/random_bodies.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace jfpx {
namespace {

using test::operator""_r;
using detail::MeshView;
using testing::HasSubstr;

std::string fault_of(HeightfieldDef def) {
  try {
    Heightfield heightfield(std::move(def));
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "no error";
}

TEST(Heightfield, ErrorsNameTheMember) {
  const HeightfieldDef good{3, 2, 1, 1, std::vector<Real>(6, 0), {}, false};
  EXPECT_EQ(fault_of(good), "no error");
  const auto complaint = [&](const auto& change) {
    HeightfieldDef def = good;
    change(def);
    return fault_of(std::move(def));
  };
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.columns = 1; }),
              HasSubstr("columns is 1; it must be from 2 to 65536"));
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.rows = 0; }), HasSubstr("rows is 0"));
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.rows = 70000; }), HasSubstr("rows is 70000"));
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.columns = d.rows = 65536; }),
              HasSubstr("rows * columns = 4294967296; it must be at most 268435456"));
  for (const Real spacing : {0.0_r, -1.0_r, test::kNan, test::kInfinity, 1.1e9_r}) {
    EXPECT_THAT(complaint([&](HeightfieldDef& d) { d.spacing_x = spacing; }),
                HasSubstr("spacing_x is "));
  }
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.spacing_z = 0; }),
              HasSubstr("spacing_z is 0.000000; it must be > 0 and at most 2000000000.000000"));
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.heights.pop_back(); }),
              HasSubstr("heights has 5 items; it must have rows * columns = 6"));
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.heights[4] = test::kNan; }),
              HasSubstr("heights[4] is nan; it must be between -1e9 and 1e9"));
  EXPECT_THAT(complaint([](HeightfieldDef& d) { d.heights[1] = 2e9_r; }),
              HasSubstr("heights[1] is 2000000000"));
  for (const std::uint32_t cell : {2u, 3u, 4u, 6u, 0xffffffffu}) {
    EXPECT_THAT(complaint([&](HeightfieldDef& d) {
                  d.holes = {0, cell};
                }),
                HasSubstr("holes[1] is " + std::to_string(cell)));
  }
}

TEST(Heightfield, CopiesShareTheirData) {
  const HeightfieldDef def{2, 2, 1, 2, {0, 1, 2, 3}, {}, true};
  const Heightfield heightfield(def), copy = heightfield;
  EXPECT_EQ(copy.data(), heightfield.data());
  EXPECT_EQ(copy, Heightfield(def));
  EXPECT_NE(copy, Heightfield({2, 2, 1, 2, {0, 1, 2, 4}, {}, true}));
  EXPECT_EQ(Heightfield(), Heightfield(HeightfieldDef{}));
  EXPECT_EQ(heightfield.vertex(1, 0), (Vec3{-0.5_r, 2, 1}));
  EXPECT_EQ(to_triangle_mesh(Heightfield()), TriangleMesh());
}

/// A heightfield and the mesh of its triangles.
struct GridAndMesh {
  Heightfield heightfield;
  TriangleMesh mesh;
  MeshView grid, arrays;
  std::vector<std::uint32_t> numbers;  ///< by triangle of the mesh: that of the heightfield

  explicit GridAndMesh(HeightfieldDef def)
      : heightfield(std::move(def)),
        mesh(to_triangle_mesh(heightfield)),
        grid(detail::view_of(heightfield)),
        arrays(detail::view_of(mesh)) {
    for (std::uint32_t i = 0; i < grid.triangle_count; ++i) {
      if (grid.has_triangle(i)) numbers.push_back(i);
    }
  }
  /// The numbers in the heightfield of some triangles of the mesh, sorted.
  std::vector<std::uint32_t> renumbered(const std::vector<std::uint32_t>& triangles) const {
    std::vector<std::uint32_t> result;
    for (const std::uint32_t i : triangles) result.push_back(numbers[i]);
    std::ranges::sort(result);
    return result;
  }
};

std::set<std::uint32_t> ring_of(const MeshView& mesh, std::uint32_t vertex) {
  std::set<std::uint32_t> found;
  mesh.all_neighbors(vertex, [&](std::uint32_t neighbor) {
    found.insert(neighbor);
    return true;
  });
  return found;
}

TEST(Heightfield, TrianglesAndNeighborsAreThoseOfTheMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int run = 0; run < 60; ++run) {
    const GridAndMesh twins(test::random_heightfield(&random, run % 5 == 0 ? 40 : 6));
    ASSERT_EQ(twins.numbers.size(), twins.mesh.triangles().size());
    const std::vector<std::uint32_t> holes = twins.heightfield.def().holes;
    const std::size_t hole_count = std::set<std::uint32_t>(holes.begin(), holes.end()).size();
    ASSERT_EQ(
        twins.numbers.size(),
        2 * ((twins.heightfield.rows() - 1) * (twins.heightfield.columns() - 1) - hole_count));
    for (std::uint32_t i = 0; i < twins.numbers.size(); ++i) {
      const std::uint32_t number = twins.numbers[i];
      Vec3 p[3], q[3];
      twins.grid.get_corners(number, p);
      twins.arrays.get_corners(i, q);
      ASSERT_EQ(twins.grid.normal(number, p), twins.arrays.normal(i, q));
      ASSERT_GT(twins.grid.normal(number, p).y, 0);
      ASSERT_EQ(twins.grid.flat_edges(number), twins.arrays.flat_edges(i));
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(p[k], q[k]);
        ASSERT_EQ(twins.grid.vertex(number, k), twins.arrays.vertex(i, k));
        ASSERT_EQ(twins.grid.opposite(number, k), twins.arrays.opposite(i, k));
      }
    }
    for (std::uint32_t i = 0; i < twins.grid.vertex_count; ++i) {
      ASSERT_EQ(ring_of(twins.grid, i), ring_of(twins.arrays, i)) << i;
    }
  }
}

/// Coordinates near those of vertices, and equal to them.
Real coordinate_near(Random* random, Real first, Real size) {
  const std::uint64_t kind = random->below(8);
  if (kind == 0) return first + size * static_cast<Real>(random->below(40));
  if (kind == 1) return random->uniform(-1e4_r, 1e4_r);
  return random->uniform(-2, 3) * absolute(first);
}

TEST(Heightfield, SearchFindsTheTrianglesOfTheMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t found = 0;
  for (int run = 0; run < 60; ++run) {
    const GridAndMesh twins(test::random_heightfield(&random, run % 2 == 0 ? 40 : 6));
    const Vec3 first = twins.heightfield.vertex(0, 0);
    for (int n = 0; n < 60; ++n) {
      const Vec3 from{coordinate_near(&random, first.x, twins.heightfield.def().spacing_x),
                      random.uniform(-2, 2),
                      coordinate_near(&random, first.z, twins.heightfield.def().spacing_z)};
      const Vec3 size = random.uniform_in_box({0, 0, 0}, {1, 1, 1}) *
                        (random.below(4) == 0 ? Real(0) : random.uniform(0, 9));
      std::vector<std::uint32_t> in_grid, in_tree;
      twins.grid.visit_overlapping({from, from + size},
                                   [&](std::uint32_t i) { in_grid.push_back(i); });
      twins.arrays.visit_overlapping({from, from + size},
                                     [&](std::uint32_t i) { in_tree.push_back(i); });
      std::ranges::sort(in_grid);
      ASSERT_EQ(in_grid, twins.renumbered(in_tree));
      found += in_grid.size();
    }
  }
  EXPECT_GT(found, 1000u);
}

TEST(Heightfield, ContactsAreThoseOfTheMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t touching = 0;
  for (int run = 0; run < 100; ++run) {
    const GridAndMesh twins(test::random_heightfield(&random, 7));
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-5, -5, -5}, {5, 5, 5}));
    for (int n = 0; n < 20; ++n) {
      const Vec3 reach = twins.heightfield.data()->half_extents;
      const Vec3 above = random.uniform_in_box(-reach, reach) + Vec3{0, random.uniform(0, 1), 0};
      const Transform at =
          make_transform(test::random_rotation(&random), transform_point(pose, above));
      const Vec3 motion = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
      const detail::PairMotion pair{motion, 0.02_r, 2, at.origin, pose.origin};
      const SolidShape solid = test::random_sub_shape(&random);
      for (std::uint32_t i = 0; i < twins.numbers.size(); ++i) {
        const auto contact = [&](const MeshView& mesh, std::uint32_t triangle) {
          detail::PairManifold found;
          std::visit(
              [&](const auto& s) {
                find_contact_with_triangle(detail::instance(s, at), mesh, triangle, pose, pair,
                                           &found);
              },
              solid);
          return found;
        };
        const detail::PairManifold p = contact(twins.grid, twins.numbers[i]);
        const detail::PairManifold q = contact(twins.arrays, i);
        ASSERT_EQ(p.point_count, q.point_count);
        ASSERT_EQ(p.touch_count, q.touch_count);
        for (std::uint32_t k = 0; k < p.point_count; ++k) {
          ASSERT_EQ(p.normal, q.normal);
          ASSERT_EQ(p.points[k].arm_a, q.points[k].arm_a);
          ASSERT_EQ(p.points[k].arm_b, q.points[k].arm_b);
          ASSERT_EQ(p.points[k].distance, q.points[k].distance);
        }
        touching += p.touch_count > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(touching, 300u);
}

/// A ray with a random origin near a heightfield. Some are vertical, or in a plane of vertices.
std::pair<Vec3, Vec3> random_ray(Random* random, const GridAndMesh& twins) {
  const HeightfieldDef& def = twins.heightfield.def();
  const Vec3 reach = twins.heightfield.data()->half_extents;
  Vec3 from = random->uniform_in_box(-reach, reach) * 2 + Vec3{0, random->uniform(-3, 3), 0};
  if (random->below(4) == 0) {
    from = twins.heightfield.vertex(static_cast<std::uint32_t>(random->below(def.rows)),
                                    static_cast<std::uint32_t>(random->below(def.columns))) +
           Vec3{0, random->uniform(0, 3), 0};
  }
  if (random->below(10) == 0) from = from * 100;
  Vec3 to = twins.heightfield.vertex(static_cast<std::uint32_t>(random->below(def.rows)),
                                     static_cast<std::uint32_t>(random->below(def.columns)));
  if (random->below(2) == 0) to += random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
  if (random->below(10) == 0) to = from - Vec3{0, 1, 0};
  const Vec3 offset = to - from;
  return {from, length(offset) > 0.001_r ? normalized(offset) : Vec3{0, -1, 0}};
}

TEST(Heightfield, RaysAreThoseOfTheMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int hits = 0;
  for (int run = 0; run < 60; ++run) {
    const GridAndMesh twins(test::random_heightfield(&random, run % 2 == 0 ? 60 : 6));
    for (int n = 0; n < 200; ++n) {
      const auto [from, direction] = random_ray(&random, twins);
      const Transform pose =
          n % 2 == 0 ? Transform{} : make_transform(test::random_rotation(&random), from);
      const Vec3 origin = transform_point(pose, from), along = pose.basis * direction;
      const Real most = random.below(3) == 0 ? random.uniform(0, 20) : test::kInfinity;
      const detail::RayEntry p = detail::enter(origin, along, twins.heightfield, pose, most);
      const detail::RayEntry q = detail::enter(origin, along, twins.mesh, pose, most);
      ASSERT_EQ(p.hit, q.hit) << run << ", " << n;
      hits += p.hit ? 1 : 0;
      if (!p.hit) continue;
      ASSERT_EQ(p.distance, q.distance) << run << ", " << n;
      ASSERT_EQ(p.normal, q.normal) << run << ", " << n;
    }
  }
  EXPECT_GT(hits, 1000);
}

/// A ray and the line through it, in double precision.
struct ExactHit {
  double distance = 0;  ///< [m], along the ray to the plane of a triangle
  double least = -1;    ///< [-], barycentric coordinate; negative outside of the triangle
  double error = 0;     ///< [-], of `least`
};
ExactHit exact_hit(const Vec3 (&corner)[3], const Vec3& origin, const Vec3& direction) {
  const detail::Vec3d d = detail::difference(direction, {});
  const detail::Vec3d ab = detail::difference(corner[1], corner[0]);
  const detail::Vec3d ac = detail::difference(corner[2], corner[0]);
  const detail::Vec3d from = detail::difference(origin, corner[0]);
  const detail::Vec3d p = cross(d, ac), q = cross(from, ab);
  const double det = dot(ab, p);
  if (std::abs(det) < 1e-9) return {};
  const double distance = dot(ac, q) / det;
  const double u = dot(from, p) / det, v = dot(d, q) / det;
  return {distance, std::min({u, v, 1 - u - v}),
          1e-3 + 2e-6 * (1 + std::abs(distance)) / std::abs(det)};
}

/// Rays that pass close to an edge of a triangle may hit it or not.
TEST(Heightfield, RaysAreThoseOfAnOracleInDouble) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int hits = 0, misses = 0;
  for (int run = 0; run < 30; ++run) {
    HeightfieldDef def = test::random_heightfield(&random, 40);
    def.two_sided = true;
    const GridAndMesh twins(std::move(def));
    for (int n = 0; n < 100; ++n) {
      const auto [from, direction] = random_ray(&random, twins);
      constexpr double kNone = 1e30, kNear = 1e-3;
      double certain = kNone, possible = kNone;  // distances of the first hit
      for (const std::uint32_t i : twins.numbers) {
        Vec3 corner[3];
        twins.grid.get_corners(i, corner);
        const ExactHit exact = exact_hit(corner, from, direction);
        const double t = exact.distance;
        if (t > kNear && exact.least > exact.error) certain = std::min(certain, t);
        if (t > -kNear && exact.least > -exact.error) possible = std::min(possible, t);
      }
      const detail::RayEntry found =
          detail::enter(from, direction, twins.heightfield, Transform{}, test::kInfinity);
      const double distance = found.hit ? static_cast<double>(found.distance) : kNone;
      const double error = 1e-3 + 1e-4 * std::min(distance, 1e6);
      ASSERT_LE(distance, certain + error) << run << ", " << n;
      if (possible < certain) continue;  // also rays in the plane of a triangle
      ASSERT_GE(distance, possible - error) << run << ", " << n;
      ++(found.hit ? hits : misses);
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_GT(misses, 300);
}

TEST(Heightfield, SweepsAndOverlapsAreThoseOfTheMesh) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int stopped = 0, touching = 0;
  for (int run = 0; run < 60; ++run) {
    const GridAndMesh twins(test::random_heightfield(&random, run % 3 == 0 ? 40 : 8));
    const Vec3 reach = twins.heightfield.data()->half_extents + Vec3{0, 2, 0};
    for (int n = 0; n < 50; ++n) {
      const Vec3 from = random.uniform_in_box(-reach, reach);
      const Vec3 motion = random.uniform_in_box({-4, -4, -4}, {4, 4, 4});
      const auto first = [&](const MeshView& mesh) {
        Real least = 2;
        sweep_core_to_mesh({from, motion, 0.2_r, 1e-6_r}, mesh,
                           [&](Real t) { return least = std::min(least, t); });
        return least;
      };
      const Real t = first(twins.grid);
      ASSERT_EQ(t, first(twins.arrays));
      stopped += t <= 1 ? 1 : 0;

      const SphereInstance ball{from, random.uniform(0.05_r, 1)};
      const Transform pose = make_transform(test::random_rotation(&random), from * 0.3_r);
      const auto touches = [&](const MeshView& mesh) {
        std::size_t count = 0;
        const Vec3 half{ball.radius, ball.radius, ball.radius};
        visit_triangles_around(mesh, pose, ball.centre, half, [&](std::uint32_t triangle) {
          detail::PairManifold found;
          find_contact_with_triangle(ball, mesh, triangle, pose, {}, &found);
          count += found.touch_count;
        });
        return count;
      };
      const std::size_t count = touches(twins.grid);
      ASSERT_EQ(count, touches(twins.arrays));
      touching += count > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(stopped, 200);
  EXPECT_GT(touching, 200);
}

/// Steep triangles may have no area in the precision of the engine.
TEST(Heightfield, HugeHeightsAreNoError) {
  const Heightfield steep({3, 3, 0.001_r, 0.001_r, {0, 1e9_r, 0, 0, 0, 0, 0, -1e9_r, 0}, {}, true});
  const GridAndMesh twins(steep.def());
  const detail::RayEntry down =
      detail::enter({0.0004_r, 5, 0.0001_r}, {0, -1, 0}, steep, Transform{}, test::kInfinity);
  EXPECT_EQ(down.hit, detail::enter({0.0004_r, 5, 0.0001_r}, {0, -1, 0}, twins.mesh, Transform{},
                                    test::kInfinity)
                          .hit);
  for (std::uint32_t i = 0; i < twins.grid.triangle_count; ++i) {
    if (!twins.grid.has_triangle(i)) continue;
    Vec3 p[3];
    twins.grid.get_corners(i, p);
    EXPECT_NEAR(length(twins.grid.normal(i, p)), 1, 1e-5_r);
  }
}

}  // namespace
}  // namespace jfpx
