/// Neighbor lists against a loop over all images, in cells of any shape.
#include <jfpx/error.hpp>
#include <jfpx/neighbors.hpp>

#include "src/base/interrupt.hpp"
#include "tests/sphere_collider/image_loop.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// Expects the pairs of `all` from `least` to `cutoff`, whose distances are exact in Real.
void expect_exact(const Points& points, Real cutoff, NeighborOptions options,
                  const std::vector<ImagePair>& all) {
  options.distances = options.vectors = true;
  Neighbors expected;
  expected.offsets.assign(points.size() + 1, 0);
  for (const ImagePair& n : all) {
    const Vec3 v{static_cast<Real>(n.vector[0]), static_cast<Real>(n.vector[1]),
                 static_cast<Real>(n.vector[2])};
    const Real distance = length(v);
    if (!(distance <= cutoff && distance >= options.least_distance)) continue;
    if (!options.both_orders && !is_first_order(n)) continue;
    ++expected.offsets[n.first + 1];
    expected.first.push_back(n.first);
    expected.second.push_back(n.second);
    if (options.cell) expected.shifts.push_back(n.shift);
    expected.distances.push_back(distance);
    expected.vectors.push_back(v);
  }
  for (std::size_t i = 0; i < points.size(); ++i) expected.offsets[i + 1] += expected.offsets[i];
  expect_list(expected, options,
              [&](const NeighborOptions& o) { return find_neighbors(points, cutoff, o); });
}

TEST(Neighbors, PairsAreThoseOfALoopOverAllImages) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  for (const auto& repeats : kRepeats) {
    for (const int shear : {0, 1, 7}) {
      for (const double thin : {1.0, 0.2}) {
        for (const Real side : {Real(1.5), Real(200)}) {
          TriclinicCell cell = exact_cell(random, shear, thin);
          cell.repeats = repeats;
          for (std::size_t k = 0; k < 3; ++k) {
            if (!repeats[k] && thin == 1.0) cell.vectors[k] = {};
          }
          const Points points = exact_points(random, 12, side);
          for (const Real cutoff : {Real(0.75), Real(2.5), Real(7)}) {
            if (cutoff > 5 && shear > 1) continue;  // the loop takes long
            SCOPED_TRACE("shear " + std::to_string(shear) + ", cutoff " + std::to_string(cutoff));
            const auto all = ImageLoop(points, cell, cutoff).find();
            expect_exact(points, cutoff, {.cell = cell}, all);
            expect_exact(points, cutoff, {.cell = cell, .both_orders = true}, all);
            expect_exact(points, cutoff, {.cell = cell, .least_distance = cutoff / 2}, all);
          }
        }
      }
    }
  }
}

TEST(Neighbors, OpenPairsAreThoseOfALoop) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  for (const auto& [n, side] : {std::pair{0, 1}, {1, 1}, {2, 1}, {700, 3}, {700, 100}}) {
    Points points = exact_points(random, static_cast<std::size_t>(n), static_cast<Real>(side));
    if (n > 2) points[1] = {-4000, 4000, 0};  // far from all others
    for (const Real cutoff : {Real(0.5), Real(1.25), Real(300)}) {
      if (cutoff > 100 && side > 3) continue;
      const auto all = ImageLoop(points, {}, cutoff).find();
      expect_exact(points, cutoff, {}, all);
      expect_exact(points, cutoff, {.both_orders = true}, all);
    }
  }
}

TEST(Neighbors, ManyPointsInASkewedCellHaveThePairsOfALoop) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  for (const int shear : {0, 2}) {
    const TriclinicCell cell = exact_cell(random, shear, 1);
    const Points points = exact_points(random, 900, 4);
    const auto all = ImageLoop(points, cell, Real(0.75)).find();
    expect_exact(points, Real(0.75), {.cell = cell}, all);
    expect_exact(points, Real(0.75), {.cell = cell, .both_orders = true}, all);
  }
}

/// A real number that rounds to the value, within an error of long double.
void expect_rounded(Real value, Long exact, Long magnitude) {
  // Away from 0: a power of two has a neighbor at half of the distance on the other side.
  const Real away = std::copysign(std::numeric_limits<Real>::infinity(), value);
  const Long unit = std::abs(static_cast<Long>(std::nextafter(value, away)) - value);
  const Long error = std::numeric_limits<Long>::epsilon() * 16 * magnitude;
  EXPECT_LE(std::abs(static_cast<Long>(value) - exact), unit / 2 + error)
      << std::setprecision(25) << value << " of " << exact << ", unit " << unit;
}

TEST(Neighbors, VectorsAreThoseOfTheGivenPoints) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  for (const Real side : {Real(1), Real(3000)}) {
    // 20 points are not divided into bins.
    for (const auto& [scale, size] :
         {std::pair{1.0, 40}, {1e-9, 40}, {1e9, 40}, {1.0, 20}, {1e9, 20}}) {
      TriclinicCell cell;
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < 3; ++i) {
          cell.vectors[k][i] = scale * (random.uniform(-1, 1) + (i == k ? 3 : 0));
        }
      }
      Points points(static_cast<std::size_t>(size));
      for (Vec3& p : points) {
        p = random.uniform_in_box({-side, -side, -side}, {side, side, side}) *
            static_cast<Real>(scale);
      }
      const auto cutoff = static_cast<Real>(2 * scale);
      const auto all = ImageLoop(points, cell, cutoff).find();
      const Neighbors found = find_neighbors(
          points, cutoff, {.cell = cell, .both_orders = true, .distances = true, .vectors = true});
      std::size_t at = 0;
      for (const ImagePair& n : all) {
        const Long distance = n.distance();
        const bool listed = at < found.first.size() && found.first[at] == n.first &&
                            found.second[at] == n.second && found.shifts[at] == n.shift;
        if (distance < cutoff * Long(1 - 8 * kEpsilon)) {
          ASSERT_TRUE(listed);
        } else if (distance > cutoff * Long(1 + 8 * kEpsilon)) {
          ASSERT_FALSE(listed);
        }
        if (!listed) continue;
        for (std::size_t i = 0; i < 3; ++i) {
          expect_rounded(found.vectors[at][static_cast<int>(i)], n.vector[i],
                         static_cast<Long>(scale) * (side + 10));
        }
        EXPECT_EQ(found.distances[at], length(found.vectors[at]));
        EXPECT_LE(found.distances[at], cutoff);
        ++at;
      }
      EXPECT_EQ(at, found.first.size());
    }
  }
}

/// The numbers of neighbors in the shells of crystals.
TEST(Neighbors, ShellsOfCrystalsHaveTheirNumbersOfPoints) {
  const double h = 0.5;
  const TriclinicCell primitive{{{{0, h, h}, {h, 0, h}, {h, h, 0}}}};
  const Points fcc{{7, -3, Real(0.25)}}, diamond{{0, 0, 0}, {Real(0.25), Real(0.25), Real(0.25)}};
  const auto count = [&](const Points& points, double square) {
    const auto cutoff = static_cast<Real>(std::sqrt(square));
    return find_neighbors(points, cutoff, {.cell = primitive, .both_orders = true}).first.size() /
           points.size();
  };
  EXPECT_EQ(count(fcc, 0.51), 12u);
  EXPECT_EQ(count(fcc, 1), 12u + 6);
  EXPECT_EQ(count(fcc, 1.51), 12u + 6 + 24);
  EXPECT_EQ(count(fcc, 2.01), 12u + 6 + 24 + 12);
  EXPECT_EQ(count(diamond, 0.19), 4u);
  EXPECT_EQ(count(diamond, 0.51), 4u + 12);
  EXPECT_EQ(count(diamond, 0.69), 4u + 12 + 12);
}

TEST(Neighbors, OrthogonalCellsHaveThePairsOfPeriodicContacts) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  const auto collider = make_sphere_collider();
  for (const PeriodicCell& orthogonal :
       {PeriodicCell{{2, Real(3.7), Real(1.25)}},
        PeriodicCell{.lengths = {Real(2.3), 1, 2}, .repeats = {true, false, true}}}) {
    const Real cutoff = Real(0.6);
    TriclinicCell cell{.repeats = orthogonal.repeats};
    for (std::size_t k = 0; k < 3; ++k) {
      cell.vectors[k][k] = orthogonal.lengths[static_cast<int>(k)];
    }
    for (const Real side : {Real(2), Real(1000)}) {
      std::vector<SphereInstance> spheres(500);
      Points points(spheres.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        points[i] = random.uniform_in_box({-side, -2, -side}, {side, 2, side});
        spheres[i] = {points[i], cutoff / 2};
      }
      const Neighbors found = find_neighbors(points, cutoff, {.cell = cell, .distances = true});
      const auto contacts = find_periodic_contacts(*collider, spheres, orthogonal);
      ASSERT_EQ(found.first.size(), contacts.size());
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        EXPECT_EQ(found.first[i], contacts[i].contact.a);
        EXPECT_EQ(found.second[i], contacts[i].contact.b);
        EXPECT_EQ(found.shifts[i], contacts[i].shift);
        EXPECT_EQ(found.distances[i] - cutoff, contacts[i].contact.distance);
      }
    }
  }
}

TEST(Neighbors, BadInputIsNamed) {
  using ::testing::HasSubstr;
  const Points points{{0, 0, 0}, {1, 1, 1}};
  const TriclinicCell unit{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
  EXPECT_THAT(neighbor_error(points, 0), HasSubstr("cutoff is 0; it must be from "));
  EXPECT_THAT(neighbor_error(points, NAN), HasSubstr("cutoff is nan"));
  EXPECT_THAT(neighbor_error(points, INFINITY), HasSubstr("cutoff is inf"));
  EXPECT_THAT(neighbor_error(points, 1, {.least_distance = 2}), HasSubstr("least distance is 2"));
  EXPECT_THAT(neighbor_error(points, 1, {.least_distance = -1}), HasSubstr("least distance is -1"));
  EXPECT_THAT(neighbor_error({{0, 0, 0}, {0, NAN, 0}}, 1),
              HasSubstr("point 1: y is nan; it must be"));
  EXPECT_THAT(neighbor_error({{0, 0, -INFINITY}}, 1), HasSubstr("point 0: z is -inf; it must be"));
  EXPECT_THAT(neighbor_error(points, 1, {.threads = 999}), HasSubstr("threads is 999"));
  EXPECT_THAT(neighbor_error({{0, 0, 0}, {5e6, 0, 0}}, 1, {.cell = unit}),
              HasSubstr("point 1 is too far from the origin; it must be within 2^22 cells"));
  const auto of_cell = [&](const std::array<std::array<double, 3>, 3>& vectors, Real cutoff = 1) {
    return neighbor_error(points, cutoff, {.cell = TriclinicCell{vectors}});
  };
  EXPECT_THAT(of_cell({{{1, 0, 0}, {0, NAN, 0}, {0, 0, 1}}}), HasSubstr("cell vector 1: y is nan"));
  EXPECT_THAT(of_cell({{{1, 0, 0}, {0, 1, 0}, {INFINITY, 0, 1}}}),
              HasSubstr("cell vector 2: x is inf; it must be finite"));
  EXPECT_THAT(of_cell({{{1, 0, 0}, {0, 0, 0}, {0, 0, 1}}}),
              HasSubstr("cell vector 1 is zero; it must not be where the cell repeats"));
  for (const double x : {2.0, 0.1, std::sqrt(2.0), 1e-12, 1e-300, 1e100}) {
    EXPECT_THAT(of_cell({{{1, 0, 0}, {x, 0, 0}, {0, 0, 1}}}), HasSubstr("dependent")) << x;
  }
  EXPECT_THAT(of_cell({{{1, 0, 0}, {0, 1e300, 0}, {0, 0, 1}}}), HasSubstr("at most 2^508"));
  EXPECT_THAT(of_cell({{{1, 1, 0}, {0, 1, 1}, {1, 2, 1}}}), HasSubstr("linearly dependent"));
  EXPECT_THAT(of_cell({{{1, 0, 0}, {1e9, 1, 0}, {0, 0, 1}}}), HasSubstr("too skewed"));
  EXPECT_THAT(of_cell({{{1e-9, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), HasSubstr("within 2^22 cells"));
  EXPECT_THAT(
      neighbor_error({{0, 0, 0}}, 1,
                     {.cell = TriclinicCell{{{{1e-9, 0, 0}, {0, 1, 0}, {}}}, {true, true, false}}}),
      HasSubstr("the cutoff is more than 2^24 heights of the cell"));
  EXPECT_THAT(neighbor_error({{0, 0, 0}}, 1e6, {.cell = unit}), HasSubstr("more than 2^30 images"));
  EXPECT_EQ(neighbor_error(points, 1, {.cell = unit}), "none");
}

TEST(Neighbors, ASearchCanBeInterrupted) {
  struct Interrupted {};
  const Points points(1000);
  const Interrupt interrupt([] { throw Interrupted(); }, Interrupt::Clock::duration::zero());
  EXPECT_THROW(find_neighbors(points, 1), Interrupted);
  const std::array<std::uint64_t, 3> offsets{0, 500, 1000};
  EXPECT_THROW(find_neighbors_in_systems(points, offsets, {}, 1), Interrupted);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
