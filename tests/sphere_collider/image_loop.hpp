/// Points and cells whose differences are exact, and a loop over their images, for tests of
/// neighbor lists.
#pragma once

#include <jfpx/error.hpp>
#include <jfpx/neighbors.hpp>

#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

using Points = std::vector<Vec3>;
using Long = long double;
using LongVector = std::array<Long, 3>;

inline Long dot(const LongVector& a, const LongVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// A pair and its image vector in long double.
struct ImagePair {
  std::uint32_t first, second;
  ImageShift shift;
  LongVector vector;
  Long distance() const { return std::sqrt(dot(vector, vector)); }
};

/// All pairs in both orders at a distance of about `cutoff` or less, by all shifts that may be that
/// near: the shift along vector k is that of the coordinates along it, up to cutoff / height.
class ImageLoop {
 public:
  ImageLoop(const Points& points, const std::optional<TriclinicCell>& cell, Real cutoff)
      : points_(points), cutoff_(cutoff) {
    for (std::size_t k = 0; cell && k < 3; ++k) {
      for (std::size_t i = 0; i < 3 && cell->repeats[k]; ++i) vectors_[k][i] = cell->vectors[k][i];
    }
    set_duals();
  }

  std::vector<ImagePair> find() const {
    std::vector<ImagePair> found;
    for (std::uint32_t a = 0; a < points_.size(); ++a) {
      for (std::uint32_t b = 0; b < points_.size(); ++b) add(a, b, &found);
    }
    return found;
  }

 private:
  /// The dual basis of the vectors that repeat, from the inverse of their Gram matrix, by
  /// elimination. A row of the matrix of a vector that does not repeat is that of the identity.
  void set_duals() {
    std::array<std::array<Long, 6>, 3> rows{};
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t m = 0; m < 3; ++m) rows[k][m] = dot(vectors_[k], vectors_[m]);
      if (dot(vectors_[k], vectors_[k]) == 0) rows[k][k] = 1;
      rows[k][3 + k] = 1;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      std::size_t pivot = k;
      for (std::size_t m = k + 1; m < 3; ++m) {
        if (std::abs(rows[m][k]) > std::abs(rows[pivot][k])) pivot = m;
      }
      std::swap(rows[k], rows[pivot]);
      const Long scale = rows[k][k];
      for (Long& x : rows[k]) x /= scale;
      for (std::size_t m = 0; m < 3; ++m) {
        const Long factor = rows[m][k];
        for (std::size_t i = 0; i < 6 && m != k; ++i) rows[m][i] -= factor * rows[k][i];
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t m = 0; m < 3; ++m) {
        for (std::size_t i = 0; i < 3; ++i) duals_[k][i] += rows[k][3 + m] * vectors_[m][i];
      }
    }
  }

  void add(std::uint32_t a, std::uint32_t b, std::vector<ImagePair>* found) const {
    LongVector open;
    for (std::size_t i = 0; i < 3; ++i) {
      const int axis = static_cast<int>(i);
      open[i] = static_cast<Long>(points_[b][axis]) - static_cast<Long>(points_[a][axis]);
    }
    std::array<std::int32_t, 3> low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Long middle = -dot(open, duals_[k]);
      const Long range = cutoff_ * std::sqrt(dot(duals_[k], duals_[k])) + Long(1e-6);
      low[k] = static_cast<std::int32_t>(std::ceil(middle - range));
      high[k] = static_cast<std::int32_t>(std::floor(middle + range));
      if (dot(duals_[k], duals_[k]) == 0) low[k] = high[k] = 0;
    }
    ImageShift s;
    for (s[0] = low[0]; s[0] <= high[0]; ++s[0]) {
      for (s[1] = low[1]; s[1] <= high[1]; ++s[1]) {
        for (s[2] = low[2]; s[2] <= high[2]; ++s[2]) {
          if (a == b && s == ImageShift{}) continue;
          ImagePair neighbor{a, b, s, open};
          for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < 3; ++i) neighbor.vector[i] += s[k] * vectors_[k][i];
          }
          if (neighbor.distance() <= cutoff_ * Long(1.001)) found->push_back(neighbor);
        }
      }
    }
  }

  const Points& points_;
  Long cutoff_;
  std::array<LongVector, 3> vectors_{}, duals_{};
};

inline bool is_first_order(const ImagePair& n) {
  return n.first != n.second ? n.first < n.second : n.shift > ImageShift{};
}

/// A random cell whose vectors are multiples of 1/8. @param thin scale of the vector 1
inline TriclinicCell exact_cell(Random& random, int shear, double thin) {
  TriclinicCell cell;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = random.uniform(-1, 1) + (i == k ? 3 : 0);
      cell.vectors[k][i] = std::round(x * (k == 1 ? thin : 1) * 8) / 8;
    }
  }
  if (shear != 0) {
    for (std::size_t i = 0; i < 3; ++i) {
      cell.vectors[0][i] += shear * cell.vectors[1][i];
      cell.vectors[2][i] -= (shear + 1) * cell.vectors[0][i];
    }
  }
  return cell;
}
inline Points exact_points(Random& random, std::size_t n, Real side) {
  Points points(n);
  for (Vec3& p : points) {
    p = random.uniform_in_box({-side, -side, -side}, {side, side, side});
    for (int k = 0; k < 3; ++k) p[k] = std::round(p[k] * 8) / 8;
  }
  return points;
}

constexpr std::array<bool, 3> kRepeats[] = {
    {true, true, true},   {true, true, false},  {true, false, true},  {false, true, true},
    {true, false, false}, {false, true, false}, {false, false, true}, {false, false, false}};

/// Expects a list for all numbers of threads and vector widths.
/// @param find returns the list for the options
template <class Find>
void expect_list(const Neighbors& expected, NeighborOptions options, const Find& find) {
  for (const auto& [threads, simd] :
       {std::pair{1u, SimdLevel::automatic}, {3u, SimdLevel::automatic}, {1u, SimdLevel::scalar}}) {
    options.threads = threads;
    options.simd = simd;
    const Neighbors found = find(options);
    EXPECT_EQ(found.offsets, expected.offsets);
    EXPECT_EQ(found.first, expected.first);
    EXPECT_EQ(found.second, expected.second);
    EXPECT_EQ(found.shifts, expected.shifts);
    EXPECT_EQ(found.distances, expected.distances);
    EXPECT_EQ(found.vectors, expected.vectors);
  }
}

/// The message of the error of find_neighbors().
inline std::string neighbor_error(const Points& points, Real cutoff,
                                  const NeighborOptions& options = {}) {
  try {
    find_neighbors(points, cutoff, options);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "none";
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
