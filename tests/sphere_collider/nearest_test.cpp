/// Nearest points against a loop over all points and their images.
#include <jfpx/error.hpp>
#include <jfpx/nearest.hpp>

#include "src/base/interrupt.hpp"
#include "src/sphere_collider/periodic_cell.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using PointList = std::vector<Vec3>;

struct Neighbor {
  double square;
  std::uint32_t index;
  ImageShift shift;
  bool operator<(const Neighbor& other) const {
    return std::pair(square, index) < std::pair(other.square, other.index);
  }
};

/// The nearest image, by all shifts that may be nearest.
Neighbor nearest_image(const Vec3& a, const Vec3& b, std::uint32_t index,
                       const std::optional<PeriodicCell>& cell) {
  Neighbor neighbor{0, index, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const Real x = a[static_cast<int>(k)], y = b[static_cast<int>(k)];
    double nearest = static_cast<double>(x) - static_cast<double>(y);
    if (cell && cell->repeats[k]) {
      const Real length = cell->lengths[static_cast<int>(k)];
      const auto middle = static_cast<std::int32_t>(std::lround(nearest / length));
      nearest = INFINITY;
      for (std::int32_t shift = middle - 2; shift <= middle + 2; ++shift) {
        const double d = shift == 0 ? static_cast<double>(x) - static_cast<double>(y)
                                    : detail::exact_image_difference(x, y, shift, length);
        if (!(std::abs(d) < std::abs(nearest))) continue;
        nearest = d;
        neighbor.shift[k] = shift;
      }
    }
    neighbor.square += nearest * nearest;
  }
  return neighbor;
}

/// @param queries null: the points, each without itself
NearestPoints brute_force_nearest(const PointList& points, const PointList* queries, std::size_t k,
                                  const std::optional<PeriodicCell>& cell) {
  NearestPoints found{k, {}, {}, {}};
  const PointList& rows = queries == nullptr ? points : *queries;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<Neighbor> all;
    for (std::uint32_t j = 0; j < points.size(); ++j) {
      if (queries != nullptr || i != j) all.push_back(nearest_image(rows[i], points[j], j, cell));
    }
    std::sort(all.begin(), all.end());
    for (std::size_t n = 0; n < k; ++n) {
      found.indices.push_back(all.at(n).index);
      found.distances.push_back(static_cast<Real>(std::sqrt(all[n].square)));
      if (cell) found.shifts.push_back(all[n].shift);
    }
  }
  return found;
}

void expect_equal(const NearestPoints& found, const NearestPoints& expected) {
  EXPECT_EQ(found.k, expected.k);
  EXPECT_EQ(found.indices, expected.indices);
  EXPECT_EQ(found.distances, expected.distances);
  EXPECT_EQ(found.shifts, expected.shifts);
}

/// Points in [-side, side]^3. @param grid spacing of a grid, so that many distances are equal;
/// or 0
PointList random_points(std::size_t n, Real side, Real grid, Random& random) {
  PointList points(n);
  for (Vec3& p : points) {
    p = random.uniform_in_box({-side, -side, -side}, {side, side, side});
    for (int k = 0; k < 3 && grid > 0; ++k) p[k] = std::round(p[k] / grid) * grid;
  }
  return points;
}

TEST(Nearest, PointsAreThoseOfALoopOverAllPoints) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  const std::optional<PeriodicCell> cells[] = {
      std::nullopt, PeriodicCell{{2, 2, 2}}, PeriodicCell{{2, 5, Real(0.7)}},
      PeriodicCell{.lengths = {3, 1, 2}, .repeats = {true, false, true}}};
  for (const auto& cell : cells) {
    for (const Real grid : {Real(0), Real(0.25)}) {
      for (const auto& [n, k] :
           {std::pair{1, 0}, {2, 1}, {13, 12}, {300, 1}, {700, 8}, {500, 60}}) {
        const PointList points = random_points(static_cast<std::size_t>(n), 2, grid, random);
        const PointList queries = random_points(100, 3, grid, random);
        const auto size = static_cast<std::size_t>(k);
        const NearestPoints of_points = brute_force_nearest(points, nullptr, size, cell);
        const NearestPoints of_queries = brute_force_nearest(points, &queries, size, cell);
        for (const unsigned threads : {1u, 3u}) {
          const NearestOptions options{.cell = cell, .threads = threads};
          expect_equal(find_nearest(points, size, options), of_points);
          expect_equal(find_nearest(points, queries, size, options), of_queries);
        }
      }
    }
  }
}

TEST(Nearest, PointsOfAllScalesAreThoseOfALoopOverAllPoints) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  PointList points;
  for (const Real side : {Real(1e-12), Real(1e-3), Real(1), Real(1e6), Real(1e19)}) {
    for (const Vec3& p : random_points(60, side, 0, random)) points.push_back(p);
  }
  points.insert(points.end(), 50, points.front());  // coincident points
  expect_equal(find_nearest(points, 70), brute_force_nearest(points, nullptr, 70, {}));
}

TEST(Nearest, OfTwoImagesHalfALengthApartTheLowerShiftIsListed) {
  const PointList points{{0, 0, 0}, {1, 0, 0}};
  const NearestPoints found = find_nearest(points, 1, {.cell = PeriodicCell{{2, 2, 2}}});
  EXPECT_EQ(found.shifts, (std::vector<ImageShift>{{-1, 0, 0}, {0, 0, 0}}));
  EXPECT_EQ(found.distances, (std::vector<Real>{1, 1}));
}

TEST(Nearest, WithoutPointsHasEmptyRows) {
  EXPECT_TRUE(find_nearest(PointList{}, 0).indices.empty());
  EXPECT_TRUE(find_nearest(PointList{}, PointList(3), 0).indices.empty());
  EXPECT_TRUE(find_nearest(PointList(3), PointList{}, 2).indices.empty());
}

std::string error_of(const PointList& points, const PointList* queries, std::size_t k,
                     const NearestOptions& options = {}) {
  try {
    if (queries == nullptr) {
      find_nearest(points, k, options);
    } else {
      find_nearest(points, *queries, k, options);
    }
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "none";
}

TEST(Nearest, BadInputIsNamed) {
  using ::testing::EndsWith;
  using ::testing::HasSubstr;
  const PointList points(4);
  EXPECT_EQ(error_of(points, nullptr, 4),
            "k is 4; it must be at most the number of other points, 3");
  EXPECT_EQ(error_of(points, &points, 5), "k is 5; it must be at most the number of points, 4");
  EXPECT_EQ(error_of({{0, 0, 0}, {0, NAN, 0}}, nullptr, 1), "point 1: y is nan; it must be finite");
  const PointList bad{{0, 0, INFINITY}};
  EXPECT_EQ(error_of(points, &bad, 1), "query 0: z is inf; it must be finite");
  EXPECT_THAT(error_of(points, nullptr, 1, {.threads = 999}), HasSubstr("threads is 999"));
  EXPECT_THAT(error_of(points, nullptr, 1, {.cell = PeriodicCell{{1, 0, 1}}}),
              HasSubstr("periodic length y is 0; it must be > 0"));
  EXPECT_EQ(error_of({{0, 0, 0}, {2e6, 0, 0}}, nullptr, 1, {.cell = PeriodicCell{{1, 1, 1}}}),
            "point 1: x is 2000000; it must be within 2^20 periodic lengths");
  const bool is_double = sizeof(Real) == 8;
  const auto large = static_cast<Real>(is_double ? 1e151 : 1e38);
  EXPECT_THAT(error_of({{0, 0, 0}, {large, 0, 0}}, nullptr, 1),
              EndsWith(is_double ? "; it must be at most 1e150" : "; it must be at most 9e37"));
}

TEST(Nearest, ASearchCanBeInterrupted) {
  struct Interrupted {};
  const PointList points(1000);
  const Interrupt interrupt([] { throw Interrupted(); }, Interrupt::Clock::duration::zero());
  EXPECT_THROW(find_nearest(points, 3), Interrupted);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
