/// Searches for touching pairs that the culling of the CUDA backend would lose. The functions are
/// those of the kernels, compiled for the host, so that no GPU is needed.
#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cuda/grid_cells.hpp"
#include "src/sphere_collider/cuda/local_filter.hpp"
#include "src/sphere_collider/cuda/quantized_filter.hpp"
#include "src/sphere_collider/cuda/sphere_filter.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Limits = std::numeric_limits<Real>;

/// A number of any magnitude. Powers of two, for which rounding is special, are frequent.
Real any_magnitude(Random& random) {
  const int range = Limits::max_exponent - Limits::min_exponent + Limits::digits;
  const int exponent = Limits::min_exponent - Limits::digits +
                       static_cast<int>(random.below(static_cast<std::uint64_t>(range)));
  const Real mantissa = random.below(4) == 0 ? 1 : random.uniform(1, 2);
  const Real value = std::ldexp(mantissa, exponent - 1);
  return value > 0 && is_finite(value) ? value : Limits::denorm_min();
}

/// Two spheres whose distance is the sum of their radii up to a few rounding errors, at any scale.
struct Pair {
  SphereInstance a, b;
};
Pair nearly_touching(Random& random) {
  Pair p;
  const Real scale = any_magnitude(random);
  p.a.radius = scale;
  p.b.radius = random.below(3) == 0 ? any_magnitude(random) : scale * random.uniform(Real(0.1), 3);
  if (!(p.b.radius > 0) || !is_finite(p.b.radius)) p.b.radius = scale;
  const Real offset = random.below(2) == 0 ? 0 : any_magnitude(random);
  p.b.centre = Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} * offset;
  if (!is_finite(p.b.centre)) p.b.centre = {};
  Vec3 direction{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  if (random.below(3) == 0) direction = {1, 0, 0};
  direction = normalized(direction);
  p.a.centre = p.b.centre + direction * (p.a.radius + p.b.radius);
  for (int i = 0; i < 3; ++i) {
    for (std::uint64_t k = random.below(4); k > 0; --k) {
      const Real towards = random.below(2) == 0 ? Limits::max() : Limits::lowest();
      p.a.centre[i] = std::nextafter(p.a.centre[i], towards);
    }
  }
  if (!is_finite(p.a.centre)) p.a.centre = p.b.centre;
  return p;
}

/// Whether a search from sphere `from` covers the cell of `to`.
bool covers_cell_of(const SphereInstance& from, const SphereInstance& to,
                    const cuda::GridScale& scale) {
  const cuda::GridCell cell = cuda::grid_cell_of(to, scale);
  const Real half = cuda::half_cell_of(scale.half_0, cell.level);
  const Real inverse = cuda::inverse_width(half);
  const Real search_radius = cuda::search_radius_of(from.radius, half);
  const std::int32_t cells[3] = {cell.x, cell.y, cell.z};
  for (int i = 0; i < 3; ++i) {
    const Real x = from.centre[i];
    const Real cells_a_metre = i == 0 ? cuda::inverse_x_of(inverse, scale) : inverse;
    if (cells[i] < cuda::cell_of(cuda::moved(x, -search_radius), cells_a_metre)) return false;
    if (cells[i] > cuda::cell_of(cuda::moved(x, search_radius), cells_a_metre)) return false;
  }
  return true;
}

/// Counts the decisions of a filter, which may exclude pairs or be certain that they touch.
struct Decisions {
  int touching = 0, apart = 0, certain = 0, excluded = 0;

  /// @return whether the decision agrees with the exact test
  bool add(const SphereInstance& a, const SphereInstance& b, bool is_excluded, bool is_certain) {
    const bool is_touching = detail::test_sphere_pair(a, b).touching != 0;
    (is_touching ? touching : apart) += 1;
    excluded += is_excluded ? 1 : 0;
    certain += is_certain ? 1 : 0;
    return !(is_touching && is_excluded) && !(is_certain && !is_touching);
  }
};

TEST(CudaFilter, LetsEveryTouchingPairThrough) {
  Random random(base_seed());
  int touching = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const Pair p = nearly_touching(random);
    if (detail::test_sphere_pair(p.a, p.b).touching == 0) continue;
    ++touching;
    ASSERT_TRUE(cuda::closeness(p.a, p.b).near) << "pair " << i << ", " << seed_note();
  }
  EXPECT_GT(touching, 200'000) << "the test must cover touching pairs";
}

TEST(CudaFilter, DecidesAsTheExactTestDoes) {
  Random random(base_seed());
  int certain = 0, apart = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    Pair p = nearly_touching(random);
    p.a.radius *= 1 + static_cast<Real>(random.below(32)) * Limits::epsilon();
    if (!is_finite(p.a.radius)) continue;
    const bool touching = detail::test_sphere_pair(p.a, p.b).touching != 0;
    apart += touching ? 0 : 1;
    if (cuda::closeness(p.a, p.b).certain) {
      ++certain;
      ASSERT_TRUE(touching) << "pair " << i << ", " << seed_note();
    }
    ASSERT_EQ(cuda::touch(p.a, p.b), touching) << "pair " << i << ", " << seed_note();
  }
  EXPECT_GT(certain, 50'000) << "the test must cover certain pairs";
  EXPECT_GT(apart, 50'000) << "the test must cover pairs that are just apart";
}

TEST(CudaFilter, ExcessKeepsTouchingPairsAndIsCertainOnlyOfThem) {
  Random random(base_seed());
  Decisions decisions;
  for (int i = 0; i < 2'000'000; ++i) {
    Pair p = nearly_touching(random);
    p.a.radius *= 1 + static_cast<Real>(random.below(64)) * (Limits::epsilon() / 2);
    if (!is_finite(p.a.radius)) continue;
    const Real sum = p.a.radius + p.b.radius;
    const Real bound =
        cuda::error_bound_of(random.below(2) == 0 ? sum : sum * random.uniform(1, 4));
    const Real excess = cuda::excess(p.a, p.b);
    ASSERT_TRUE(decisions.add(p.a, p.b, excess > bound, excess < -bound))
        << "pair " << i << ", " << seed_note();
  }
  EXPECT_GT(decisions.touching, 400'000) << "the test must cover touching pairs";
  EXPECT_GT(decisions.apart, 100'000) << "the test must cover pairs that are just apart";
  EXPECT_GT(decisions.certain, 10'000) << "a filter that is never certain would pass";
  EXPECT_GT(decisions.excluded, 1'000) << "a filter that excludes nothing would pass";
}

TEST(CudaFilter, LocalDepthKeepsTouchingPairsAndIsCertainOnlyOfThem) {
  Random random(base_seed());
  Decisions decisions;
  const auto point = [&](Real size) {
    return Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} * size;
  };
  for (int i = 0; i < 1'000'000; ++i) {
    const Real largest = std::ldexp(random.uniform(1, 2), static_cast<int>(random.below(39)) - 20);
    const bool is_equal = random.below(2) == 0;
    const Vec3 origin = point(largest * std::ldexp(Real(1), static_cast<int>(random.below(20))));
    // Spheres that are searched together can be far from each other along a row of cells.
    const Real distance = std::ldexp(largest, static_cast<int>(random.below(4) * random.below(6)));
    SphereInstance a{origin + point(4 * distance), is_equal ? largest : largest * Real(0.7)};
    // The distance differs from the sum of the radii by a factor of 1 + 2^-12 to 1 + 2^-26.
    const Real gap = std::ldexp(random.uniform(-1, 1), -12 - static_cast<int>(random.below(15)));
    SphereInstance b{a.centre + normalized(point(1)) * ((a.radius + largest) * (1 + gap)), largest};
    if (random.below(4) == 0) std::swap(a.centre, b.centre);
    const cuda::LocalQuery query = cuda::local_query(a, largest, origin);
    const float depth = cuda::local_depth(query, cuda::local_candidate(b.centre, origin));
    ASSERT_TRUE(decisions.add(a, b, !(depth > 0), depth > query.doubt))
        << "pair " << i << ", " << seed_note();
  }
  EXPECT_GT(decisions.touching, 300'000) << "the test must cover touching pairs";
  EXPECT_GT(decisions.apart, 300'000) << "the test must cover pairs that are just apart";
  EXPECT_GT(decisions.certain, 10'000) << "a filter that is never certain would pass";
  EXPECT_GT(decisions.excluded, 10'000) << "a filter that excludes nothing would pass";
}

// No decision may be wrong if the square of the sum of the radii overflows.
TEST(CudaFilter, IsRightWhereSquaresOverflow) {
  const Real huge = std::sqrt(Limits::max());
  for (const Real scale : {Real(0.25), Real(0.5), Real(0.70710678), Real(1), Real(1.5), Real(2)}) {
    for (const Real distance : {Real(0), Real(0.5), Real(0.9999999), Real(1), Real(1.9999999),
                                Real(2), Real(2.0000002), Real(2.5)}) {
      const SphereInstance a{{0, 0, 0}, huge * scale},
          b{{huge * scale * distance, 0, 0}, huge * scale};
      const bool touching = detail::test_sphere_pair(a, b).touching != 0;
      EXPECT_EQ(cuda::touch(a, b), touching) << scale << " " << distance;
      const Real bound = cuda::error_bound_of(a.radius + b.radius), excess = cuda::excess(a, b);
      EXPECT_FALSE(touching && excess > bound) << scale << " " << distance;
      EXPECT_FALSE(!touching && excess < -bound) << scale << " " << distance;
    }
  }
}

// A filter that accepts every pair would pass the first test.
TEST(CudaFilter, StopsPairsThatAreApartByMoreThanRoundings) {
  Random random(base_seed());
  for (int i = 0; i < 100'000; ++i) {
    SphereInstance a{random.uniform_in_box({-9, -9, -9}, {9, 9, 9}), random.uniform(Real(0.1), 2)};
    SphereInstance b{random.uniform_in_box({-9, -9, -9}, {9, 9, 9}), random.uniform(Real(0.1), 2)};
    const Real gap = length(a.centre - b.centre) - (a.radius + b.radius);
    if (gap > 64 * kEpsilon * 32) {
      ASSERT_FALSE(cuda::closeness(a, b).near) << seed_note();
    }
  }
}

TEST(CudaGrid, TouchingSpheresAreWithinTheSearchRadius) {
  Random random(base_seed());
  int touching = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const Pair p = nearly_touching(random);
    if (detail::test_sphere_pair(p.a, p.b).touching == 0) continue;
    ++touching;
    // The scale may depend on a third, larger sphere.
    Real half_0 = cuda::half_cell_for_radius(std::max(p.a.radius, p.b.radius));
    if (random.below(2) == 0) half_0 = std::max(half_0, half_0 * random.uniform(1, 1000));
    if (!is_finite(half_0)) continue;
    cuda::GridScale scale{half_0, static_cast<int>(random.below(cuda::kLastLevel + 1))};
    const int level_a = cuda::level_of(p.a, scale), level_b = cuda::level_of(p.b, scale);
    if (random.below(2) == 0) {  // as narrow in x as half the cells of the finer level
      const Real half = cuda::half_cell_of(half_0, std::max(level_a, level_b));
      scale.inverse_x = 2 * cuda::inverse_width(half);
    }
    const auto note = [&] { return "pair " + std::to_string(i) + ", " + seed_note(); };
    if (level_a >= level_b) {
      ASSERT_TRUE(covers_cell_of(p.a, p.b, scale)) << note();
    }
    if (level_b >= level_a) {
      ASSERT_TRUE(covers_cell_of(p.b, p.a, scale)) << note();
    }
    const bool a_is_wide = level_a < level_b;
    const SphereInstance& wide = a_is_wide ? p.a : p.b;
    const SphereInstance& fine = a_is_wide ? p.b : p.a;
    if (level_a != level_b && cuda::is_far(wide)) {
      ASSERT_GE(std::min(level_a, level_b), cuda::widest_far_level(fine, scale)) << note();
    }
  }
  EXPECT_GT(touching, 200'000) << "the test must cover touching pairs";
}

TEST(CudaGrid, ASphereSearchesFewCells) {
  Random random(base_seed());
  for (int i = 0; i < 200'000; ++i) {
    const Pair p = nearly_touching(random);
    const Real half_0 = cuda::half_cell_for_radius(std::max(p.a.radius, p.b.radius));
    const cuda::GridCell cell = cuda::grid_cell_of(p.a, {half_0});
    const Real half = cuda::half_cell_of(half_0, cell.level);
    const Real search_radius = cuda::search_radius_of(p.a.radius, half),
               inverse = cuda::inverse_width(half);
    for (int axis = 0; axis < 3; ++axis) {
      const Real x = p.a.centre[axis];
      const std::int64_t cells =
          std::int64_t{cuda::cell_of(cuda::moved(x, search_radius), inverse)} -
          cuda::cell_of(cuda::moved(x, -search_radius), inverse) + 1;
      ASSERT_LE(cells, cuda::kRowsApart) << "pair " << i << ", " << seed_note();
    }
  }
}

TEST(CudaGrid, LevelsHalveFromTheLargestSphereOn) {
  const Real half_0 = Real(0.75);
  EXPECT_EQ(cuda::level_for(Real(0.75), {half_0}), 0);
  EXPECT_EQ(cuda::level_for(Real(0.5), {half_0}), 0);
  EXPECT_EQ(cuda::level_for(Real(0.375), {half_0}), 1);
  EXPECT_EQ(cuda::level_for(std::nextafter(Real(0.375), Real(1)), {half_0}), 0);
  EXPECT_EQ(cuda::level_for(Real(0.75) / 1024, {half_0}), 10);
  EXPECT_EQ(cuda::level_for(Real(1e-30), {half_0}), cuda::kLastLevel);
  EXPECT_EQ(cuda::level_for(Real(3), {half_0}), -2);
  EXPECT_EQ(cuda::half_cell_of(half_0, 3), Real(0.09375));
  EXPECT_EQ(cuda::level_for(Real(0.75) / 1024, {half_0, 6}), 6);
  EXPECT_EQ(cuda::level_for(Real(0.375), {half_0, 6}), 1);
}

/// The sum of products of a row and a column, which must be exact in any order.
float quantized_sum(const cuda::QuantizedTerms& row, const cuda::QuantizedTerms& column,
                    Random& random) {
  double exact = 0;
  std::vector<float> products;
  for (unsigned k = 0; k < cuda::kTerms; ++k) {
    for (const float term : {row.values[k], column.values[k]}) {
      EXPECT_LE(std::abs(term), 2048) << "half precision represents no larger integer";
      EXPECT_EQ(term, std::round(term));
    }
    products.push_back(row.values[k] * column.values[k]);
    exact += static_cast<double>(row.values[k]) * static_cast<double>(column.values[k]);
  }
  float sum = 0;
  while (!products.empty()) {
    const std::size_t k = random.below(products.size());
    sum += products[k];
    products.erase(products.begin() + static_cast<std::ptrdiff_t>(k));
  }
  EXPECT_EQ(static_cast<double>(sum), exact);
  return sum;
}

TEST(CudaQuantizedFilter, LetsEveryTouchingPairThrough) {
  Random random(base_seed());
  int touching = 0;
  for (int i = 0; i < 300'000 && !::testing::Test::HasFailure(); ++i) {
    const Pair p = nearly_touching(random);
    if (detail::test_sphere_pair(p.a, p.b).touching == 0) continue;
    ++touching;
    // The bounds of the tile may contain other spheres, at any distance.
    Vec3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(p.a.centre[axis], p.b.centre[axis]);
      high[axis] = std::max(p.a.centre[axis], p.b.centre[axis]);
      if (random.below(3) == 0) low[axis] = std::min(low[axis], -any_magnitude(random));
      if (random.below(3) == 0) high[axis] = std::max(high[axis], any_magnitude(random));
    }
    Real largest = std::max(p.a.radius, p.b.radius);
    if (random.below(3) == 0) largest = std::max(largest, any_magnitude(random));
    const cuda::Quantization quantization = cuda::quantization_around(low, high, largest);
    const auto a = quantized(quantization, p.a), b = quantized(quantization, p.b);
    ASSERT_LT(quantized_sum(row_terms(a), column_terms(b), random), 0)
        << "pair " << i << ", " << seed_note();
  }
  EXPECT_GT(touching, 50'000) << "the test must cover touching pairs; " << seed_note();
}

TEST(CudaQuantizedFilter, RejectsSpheresThatAreApart) {
  Random random(base_seed());
  for (int i = 0; i < 10'000; ++i) {
    SphereInstance a{{0, 0, 0}, random.uniform(Real(0.5), 1)}, b{{}, random.uniform(Real(0.5), 1)};
    const Vec3 direction = normalized(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    b.centre = direction * ((a.radius + b.radius) * Real(1.1));
    const cuda::Quantization quantization = cuda::quantization_around({-8, -8, -8}, {8, 8, 8}, 1);
    const auto row = quantized(quantization, a), column = quantized(quantization, b);
    ASSERT_GE(quantized_sum(row_terms(row), column_terms(column), random), 0) << seed_note();
  }
}

// Lines along every axis and diagonal, a plane and a cube, each with as many cells as buckets: no
// bucket may hold many cells. A hash that ignored a coordinate would put 32 to 65 536 into one.
TEST(CudaGrid, CellsFillTheTableEvenly) {
  constexpr std::uint32_t kTable = 1 << 16;
  const auto most_in_a_bucket = [&](auto&& cell) {
    std::vector<int> load(kTable);
    for (int i = 0; i < static_cast<int>(kTable); ++i) {
      const Vec3 c = cell(i);
      ++load[(cuda::row_of(static_cast<int>(c.y), static_cast<int>(c.z), 3) +
              static_cast<std::uint32_t>(static_cast<int>(c.x))) %
             kTable];
    }
    return *std::max_element(load.begin(), load.end());
  };
  const auto real = [](int i) { return static_cast<Real>(i); };
  EXPECT_LT(most_in_a_bucket([&](int i) { return Vec3{real(i), 7, -3}; }), 24);
  EXPECT_LT(most_in_a_bucket([&](int i) { return Vec3{5, real(i), 0}; }), 24);
  EXPECT_LT(most_in_a_bucket([&](int i) { return Vec3{5, 0, real(-i)}; }), 24);
  EXPECT_LT(most_in_a_bucket([&](int i) { return Vec3{real(i), real(i), real(i)}; }), 24);
  EXPECT_LT(most_in_a_bucket([&](int i) { return Vec3{real(i % 256), 9, real(i / 256)}; }), 24);
  EXPECT_LT(most_in_a_bucket([&](int i) {
              return Vec3{real(i % 32 - 16), real(i / 32 % 32 - 16), real(i / 1024 - 32)};
            }),
            24);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
