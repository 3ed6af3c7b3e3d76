/// Neighbor lists of many systems, and with cutoffs by pair.
#include <jfpx/error.hpp>
#include <jfpx/neighbors.hpp>

#include "tests/sphere_collider/image_loop.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// Cutoffs by pair: limit(a, b), without rounding, of points a and b; 0: none.
template <class Limit>
void expect_by_pair(const Points& points, const TriclinicCell& cell, Real cutoff,
                    NeighborOptions options, Real largest, const Limit& limit) {
  std::vector<ImagePair> all = ImageLoop(points, cell, largest).find();
  std::erase_if(all, [&](const ImagePair& n) {
    const Real most = limit(n.first, n.second);
    return most == 0 || n.distance() > most;
  });
  options.cell = cell;
  for (const bool both_orders : {false, true}) {
    options.both_orders = both_orders;
    options.distances = options.vectors = true;
    std::vector<std::uint32_t> first, second;
    std::vector<ImageShift> shifts;
    for (const ImagePair& n : all) {
      if (!both_orders && !is_first_order(n)) continue;
      if (n.distance() < options.least_distance) continue;
      first.push_back(n.first);
      second.push_back(n.second);
      shifts.push_back(n.shift);
    }
    for (const auto& [threads, simd] : {std::pair{1u, SimdLevel::automatic},
                                        {3u, SimdLevel::automatic},
                                        {1u, SimdLevel::scalar}}) {
      options.threads = threads;
      options.simd = simd;
      const Neighbors found = find_neighbors(points, cutoff, options);
      EXPECT_EQ(found.first, first);
      EXPECT_EQ(found.second, second);
      EXPECT_EQ(found.shifts, shifts);
      EXPECT_EQ(found.offsets.back(), first.size());
      for (std::size_t i = 0; i < found.vectors.size(); ++i) {
        EXPECT_EQ(found.distances[i], length(found.vectors[i]));
      }
    }
  }
}

TEST(Neighbors, RadiiAndSpeciesHaveThePairsOfALoop) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  for (const std::size_t n : {std::size_t{1}, std::size_t{20}, std::size_t{200}}) {
    for (const auto& repeats : kRepeats) {
      TriclinicCell cell = exact_cell(random, static_cast<int>(n % 3), 1);
      cell.repeats = repeats;
      const Points points = exact_points(random, n, 3);
      // Multiples of 1/8, so that pairs at the cutoff are common, and no sum is rounded.
      std::vector<Real> radii(n);
      for (Real& r : radii) r = std::round(random.uniform(0, 8)) / 8;
      const auto radius = [&](std::size_t i) { return radii[i]; };
      const Real most = *std::max_element(radii.begin(), radii.end());
      expect_by_pair(points, cell, 0, {.radii = radii}, 2 * most + Real(0.1),
                     [&](auto a, auto b) { return radius(a) + radius(b); });
      expect_by_pair(points, cell, Real(0.25), {.radii = radii, .least_distance = Real(0.25)},
                     2 * most + Real(0.3),
                     [&](auto a, auto b) { return radius(a) + radius(b) + Real(0.25); });

      const std::vector<Real> matrix{Real(1.5), 0, Real(0.5), 0, 0, 1, Real(0.5), 1, Real(0.25)};
      std::vector<std::uint32_t> species(n);
      for (auto& s : species) s = static_cast<std::uint32_t>(random.uniform(0, Real(2.99)));
      const auto value = [&](auto a, auto b) { return matrix[species[a] * 3 + species[b]]; };
      const NeighborOptions options{.species = species, .species_cutoffs = matrix};
      expect_by_pair(points, cell, 0, options, Real(1.6), value);
      expect_by_pair(points, cell, Real(0.5), options, Real(2.1),
                     [&](auto a, auto b) { return value(a, b) > 0 ? value(a, b) + Real(0.5) : 0; });
    }
  }
}

TEST(Neighbors, EqualRadiiAndSpeciesHaveTheListOfOneCutoff) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  Points points(400);
  for (Vec3& p : points) p = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
  const TriclinicCell cell = exact_cell(random, 1, 1);
  const NeighborOptions one{.cell = cell, .distances = true};
  const Neighbors expected = find_neighbors(points, Real(0.75), one);
  const std::vector<Real> radii(points.size(), Real(0.25)), matrix(4, Real(0.75));
  const std::vector<std::uint32_t> species(points.size(), 1);
  NeighborOptions by_radii = one, by_species = one;
  by_radii.radii = radii;
  by_species.species = species;
  by_species.species_cutoffs = matrix;
  const std::vector<std::uint64_t> offsets{0, points.size()};
  for (const Neighbors& found :
       {find_neighbors(points, Real(0.25), by_radii), find_neighbors(points, 0, by_species),
        find_neighbors_in_systems(points, offsets, {}, Real(0.25), by_radii)}) {
    EXPECT_EQ(found.offsets, expected.offsets);
    EXPECT_EQ(found.second, expected.second);
    EXPECT_EQ(found.shifts, expected.shifts);
    EXPECT_EQ(found.distances, expected.distances);
  }
}

/// The result of find_neighbors() for one system after the other.
Neighbors loop_over_systems(const Points& points, const std::vector<std::uint64_t>& offsets,
                            const std::vector<TriclinicCell>& cells, Real cutoff,
                            NeighborOptions options) {
  Neighbors all;
  all.offsets = {0};
  const auto append = [](auto* to, const auto& from) {
    to->insert(to->end(), from.begin(), from.end());
  };
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
    if (!cells.empty()) options.cell = cells[i];
    const auto first = static_cast<std::uint32_t>(offsets[i]);
    Neighbors system =
        find_neighbors(std::span(points).subspan(first, offsets[i + 1] - first), cutoff, options);
    for (auto& index : system.first) index += first;
    for (auto& index : system.second) index += first;
    for (std::size_t k = 1; k < system.offsets.size(); ++k) {
      all.offsets.push_back(all.first.size() + system.offsets[k]);
    }
    append(&all.first, system.first);
    append(&all.second, system.second);
    append(&all.shifts, system.shifts);
    append(&all.distances, system.distances);
    append(&all.vectors, system.vectors);
  }
  return all;
}

void expect_systems(const Points& points, const std::vector<std::uint64_t>& offsets,
                    const std::vector<TriclinicCell>& cells, Real cutoff, NeighborOptions options) {
  const Neighbors expected = loop_over_systems(points, offsets, cells, cutoff, options);
  expect_list(expected, options, [&](const NeighborOptions& o) {
    return find_neighbors_in_systems(points, offsets, cells, cutoff, o);
  });
}

TEST(Neighbors, SystemsHaveTheListsOfALoop) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  for (const bool small : {true, false}) {
    std::vector<std::uint64_t> offsets{0};
    for (int i = 0; i < 40; ++i) {
      const int size = small ? i % 5 * (i % 4) : (i % 8 == 3 ? 300 : i % 3 * 20);
      offsets.push_back(offsets.back() + static_cast<std::uint64_t>(size));
    }
    Points points(offsets.back());
    const Real side = small ? Real(3) : Real(6);
    for (Vec3& p : points) p = random.uniform_in_box({-side, -side, -side}, {side, side, side});
    std::vector<TriclinicCell> cells;
    for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
      cells.push_back(exact_cell(random, static_cast<int>(i % 4), i % 3 == 0 ? 0.3 : 1));
      cells.back().repeats = kRepeats[i % 8];
    }
    const Real cutoff = small ? Real(2) : Real(0.8);
    for (const bool both_orders : {false, true}) {
      const NeighborOptions options{
          .both_orders = both_orders, .distances = true, .vectors = both_orders};
      expect_systems(points, offsets, cells, cutoff, options);
      expect_systems(points, offsets, {}, cutoff, options);
      NeighborOptions with_cell = options;
      with_cell.cell = cells[0];
      expect_systems(points, offsets, {}, cutoff, with_cell);
    }
  }
}

TEST(Neighbors, NoSystemsAndEmptySystemsHaveNoNeighbors) {
  const std::array<std::uint64_t, 4> empty{};
  const std::vector<TriclinicCell> cells(3, TriclinicCell{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}});
  for (const std::size_t systems : {std::size_t{0}, std::size_t{3}}) {
    for (const bool has_cells : {false, true}) {
      const Neighbors found = find_neighbors_in_systems(
          {}, std::span(empty).first(systems + 1), std::span(cells).first(has_cells ? systems : 0),
          1, {.distances = true});
      EXPECT_EQ(found.offsets, std::vector<std::uint64_t>{0});
      EXPECT_TRUE(found.first.empty() && found.shifts.empty() && found.distances.empty());
    }
  }
}

TEST(Neighbors, BadRadiiAndSpeciesAreNamed) {
  using ::testing::HasSubstr;
  const Points points(2);
  using Radii = std::vector<Real>;
  using Species = std::vector<std::uint32_t>;
  const auto of_radii = [&](const Radii& radii, Real cutoff = 0, Real least = 0) {
    return neighbor_error(points, cutoff, {.radii = radii, .least_distance = least});
  };
  EXPECT_EQ(of_radii({1, 0}), "none");
  EXPECT_EQ(of_radii({0, 0}), "none");
  EXPECT_THAT(of_radii({1}),
              HasSubstr("there are 1 radii; there must be one for each of 2 points"));
  EXPECT_THAT(of_radii({1, -1}), HasSubstr("radius 1 is -1; it must be 0, or from"));
  EXPECT_THAT(of_radii({NAN, 1}), HasSubstr("radius 0 is nan"));
  EXPECT_THAT(of_radii({INFINITY, 1}), HasSubstr("radius 0 is inf"));
  EXPECT_THAT(of_radii({1, 1}, -1), HasSubstr("cutoff is -1; it must be 0, or from"));
  EXPECT_THAT(of_radii({1, 1}, 0, 3), HasSubstr("least distance is 3"));
  const Real big = std::sqrt(std::numeric_limits<Real>::max());
  EXPECT_THAT(of_radii({1, big / 4}, big),
              HasSubstr("the sum of the largest radii and the cutoff"));
  const auto of_species = [&](const Species& species, const Radii& matrix, Real cutoff = 0) {
    return neighbor_error(points, cutoff, {.species = species, .species_cutoffs = matrix});
  };
  EXPECT_EQ(of_species({0, 1}, {1, 0, 0, 1}), "none");
  EXPECT_EQ(of_species({0, 0}, {0}), "none");
  EXPECT_THAT(of_species({0, 2}, {1, 0, 0, 1}), HasSubstr("species 1 is 2; it must be less than"));
  EXPECT_THAT(of_species({0}, {1}), HasSubstr("there are 1 species"));
  EXPECT_THAT(of_species({0, 0}, {}, 1), HasSubstr("species 0 is 0"));
  EXPECT_THAT(of_species({0, 0}, {1, 0, 1}), HasSubstr("they must be a square matrix"));
  EXPECT_THAT(of_species({0, 1}, {1, 2, 1, 1}),
              HasSubstr("cutoff of species 0 and 1 is 2, and in the other order 1"));
  EXPECT_THAT(of_species({0, 1}, {1, 1, 1, -1}), HasSubstr("cutoff of species 1 and 1 is -1"));
  EXPECT_THAT(of_species({0, 1}, {1, 1, 1, NAN}), HasSubstr("cutoff of species 1 and 1 is nan"));
  const Radii radii{1, 1};
  const Species species{0, 0};
  EXPECT_THAT(neighbor_error(points, 0, {.radii = radii, .species = species}),
              HasSubstr("exclude"));
  EXPECT_EQ(neighbor_error({}, 0, {.radii = Radii()}), "none");
}

TEST(Neighbors, BadSystemsAreNamed) {
  using ::testing::HasSubstr;
  const TriclinicCell unit{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
  TriclinicCell bad = unit;
  bad.vectors[1] = {};
  const auto error_in = [&](const std::vector<std::uint64_t>& offsets,
                            const std::vector<TriclinicCell>& cells, Real cutoff = 1,
                            const NeighborOptions& options = {}, const Points& points = Points(3)) {
    try {
      find_neighbors_in_systems(points, offsets, cells, cutoff, options);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(error_in({0, 1, 3}, {unit, unit}), "none");
  EXPECT_EQ(error_in({}, {}), "offsets must begin with 0");
  EXPECT_EQ(error_in({0, 2, 1, 3}, {}), "offset 2 is 1; it must be at least the offset before, 2");
  EXPECT_EQ(error_in({0, 2}, {}), "the last offset is 2; it must be the number of points, 3");
  EXPECT_EQ(error_in({0, 1, 3}, {unit}),
            "there are 1 periodic cells; there must be one for each of 2 systems");
  EXPECT_THAT(error_in({0, 1, 3}, {unit, unit}, 1, {.cell = unit}), HasSubstr("in the options"));
  EXPECT_THAT(error_in({0, 1, 3}, {unit, bad}), HasSubstr("system 1: cell vector 1 is zero"));
  EXPECT_THAT(error_in({0, 0, 3}, {bad, unit}), HasSubstr("system 0: cell vector 1 is zero"));
  EXPECT_THAT(error_in({0, 1, 3}, {}, 1, {.cell = bad}), ::testing::StartsWith("cell vector 1"));
  EXPECT_THAT(error_in({0, 1, 3}, {}, NAN), HasSubstr("cutoff is nan"));
  EXPECT_THAT(error_in({0, 1, 3}, {}, 1, {}, {{}, {}, {0, NAN, 0}}),
              HasSubstr("point 2: y is nan"));
  EXPECT_THAT(error_in({0, 1, 3}, {unit, unit}, 1, {}, {{}, {}, {0, 5e6, 0}}),
              HasSubstr("system 1: point 2 is too far from the origin"));
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
