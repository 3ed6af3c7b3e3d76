/// Reduction of a lattice basis, its completion to three vectors, and exact images.
#include "src/sphere_collider/cpu/lattice.hpp"

#include <jfpx/error.hpp>

#include "src/sphere_collider/periodic_cell.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Squares of distances in a few cells are finite in double.
constexpr double kLongestVector = 0x1p508;

std::string name_of(std::size_t k) { return "cell vector " + std::to_string(k); }

[[noreturn]] void reject_dependent() {
  throw InvalidArgument(
      "cell vectors along which the cell repeats are linearly dependent, or too skewed; they must "
      "span a cell");
}

}  // namespace

Lattice::Lattice(const std::optional<TriclinicCell>& cell) {
  double longest = 0;
  for (std::size_t k = 0; cell && k < 3; ++k) {
    repeats_[k] = cell->repeats[k];
    if (!repeats_[k]) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = cell->vectors[k][axis];
      if (!(std::abs(x) <= kLongestVector)) {
        char text[32];
        std::snprintf(text, sizeof text, "%.9g", x);
        throw InvalidArgument(name_of(k) + ": " + "xyz"[axis] + " is " + text +
                              "; it must be finite and at most 2^508");
      }
      longest = std::max(longest, std::abs(x));
      const double product = x * ((1 << 26) + 1);  // Dekker 1971
      upper_[k][axis] = product - (product - x);
      lower_[k][axis] = x - upper_[k][axis];
    }
    if (cell->vectors[k] == std::array<double, 3>{}) {
      throw InvalidArgument(name_of(k) + " is zero; it must not be where the cell repeats");
    }
    of_given_[k][k] = 1;
  }
  if (longest > 0) scale_ = std::ilogb(longest);
  reduce();
  complete();
}

ImageShift Lattice::to_shift(const std::array<std::int64_t, 3>& of_basis) const {
  ImageShift shift{};
  for (std::size_t m = 0; m < 3; ++m) {
    // Each factor is less than 2^26.
    const std::int64_t sum = (of_basis[0] * of_given_[0][m] + of_basis[1] * of_given_[1][m]) +
                             of_basis[2] * of_given_[2][m];
    if (std::abs(sum) >= kMostShifts) {
      throw InvalidArgument("a shift is " + std::to_string(sum) + " times " + name_of(m) +
                            "; it must be less than 2^24 times");
    }
    shift[m] = static_cast<std::int32_t>(sum);
  }
  return shift;
}

bool Lattice::wrap(const Vec3& p, Vector* wrapped, ImageShift* shift) const {
  const Vector given = to_vector(p);
  std::array<std::int64_t, 3> cells{};
  *wrapped = given;
  *shift = {};
  // The first quotient of a distant point is rounded. After the third, the point is in the cell or
  // on its surface, except for the rounding of its coordinate.
  for (int round = 0; round < 3; ++round) {
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!repeats_[k]) continue;
      const double moved = std::floor(coordinate(k, *wrapped));
      if (moved == 0) continue;
      if (!(std::abs(moved) < kFarthest)) return false;
      inside = false;
      cells[k] -= static_cast<std::int64_t>(moved);
    }
    if (inside) break;
    *shift = to_shift(cells);
    *wrapped = image_vector(Vector{}, given, *shift);
  }
  return true;
}

double Lattice::image_difference(double a, double b, const ImageShift& shift,
                                 std::size_t axis) const {
  // Products are exact: the parts of a vector have 26 bits, and a shift has at most 26.
  double error = 0;
  double sum = detail::sum_with_error(b, -a, &error);
  for (std::size_t k = 0; k < 3; ++k) {
    if (shift[k] == 0) continue;
    const double count = shift[k];
    sum = detail::sum_with_error(sum, count * upper_[k][axis], &error);
    sum = detail::sum_with_error(sum, count * lower_[k][axis], &error);
  }
  return sum + error;
}

Vector Lattice::scaled(const Row& of_given) const {
  const Vector v =
      image_vector(Vector{}, Vector{},
                   {static_cast<std::int32_t>(of_given[0]), static_cast<std::int32_t>(of_given[1]),
                    static_cast<std::int32_t>(of_given[2])});
  return {std::ldexp(v[0], -scale_), std::ldexp(v[1], -scale_), std::ldexp(v[2], -scale_)};
}

bool Lattice::shorten(std::size_t k, const Row& of_given) {
  for (const std::int64_t count : of_given) {
    if (std::abs(count) >= kMostShifts) reject_dependent();
  }
  const Vector shorter = scaled(of_given);
  // The factor prevents a cycle between vectors that are equally long except for rounding.
  if (!(dot(shorter, shorter) < dot(basis_[k], basis_[k]) * (1 - 1e-9))) return false;
  of_given_[k] = of_given;
  basis_[k] = shorter;
  return true;
}

void Lattice::reduce() {
  for (std::size_t k = 0; k < 3; ++k) {
    if (repeats_[k]) basis_[k] = scaled(of_given_[k]);
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t m = 0; m < 3; ++m) {
        if (k == m || !repeats_[k] || !repeats_[m]) continue;
        const double square = dot(basis_[m], basis_[m]);
        if (!(square > 0)) reject_dependent();
        const double count = std::nearbyint(dot(basis_[k], basis_[m]) / square);
        if (count == 0) continue;
        if (!(std::abs(count) < kFarthest)) reject_dependent();
        Row sum = of_given_[k];
        for (std::size_t i = 0; i < 3; ++i) {
          sum[i] -= static_cast<std::int64_t>(count) * of_given_[m][i];
        }
        changed = shorten(k, sum) || changed;
      }
    }
    if (changed || !(repeats_[0] && repeats_[1] && repeats_[2])) continue;
    // No vector of a basis that is reduced in pairs is shortened by one other, but maybe by two.
    for (std::size_t k = 0; k < 3 && !changed; ++k) {
      const std::size_t m = (k + 1) % 3, n = (k + 2) % 3;
      for (const auto& [s, t] : {std::pair{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
        Vector shorter;
        for (std::size_t i = 0; i < 3; ++i) {
          shorter[i] = basis_[k][i] + s * basis_[m][i] + t * basis_[n][i];
        }
        // Few sums are; shorten() computes them exactly.
        if (dot(shorter, shorter) > dot(basis_[k], basis_[k])) continue;
        Row sum = of_given_[k];
        for (std::size_t i = 0; i < 3; ++i) sum[i] += s * of_given_[m][i] + t * of_given_[n][i];
        changed = shorten(k, sum) || changed;
      }
    }
  }
}

void Lattice::complete() {
  const auto unit = [](const Vector& v) {
    const double length = std::sqrt(dot(v, v));
    return Vector{v[0] / length, v[1] / length, v[2] / length};
  };
  std::size_t periodic = 0, last = 0, open = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    periodic += repeats_[k] ? 1 : 0;
    (repeats_[k] ? last : open) = k;
  }
  if (periodic == 0) {
    for (std::size_t k = 0; k < 3; ++k) basis_[k][k] = 1;
  } else if (periodic == 1) {
    const Vector& v = basis_[last];
    std::size_t axis = 0;  // the axis at the largest angle
    for (std::size_t k = 1; k < 3; ++k) {
      if (std::abs(v[k]) < std::abs(v[axis])) axis = k;
    }
    Vector direction{};
    direction[axis] = 1;
    basis_[(last + 1) % 3] = unit(cross(unit(v), direction));
    basis_[(last + 2) % 3] = unit(cross(unit(v), basis_[(last + 1) % 3]));
  } else if (periodic == 2) {
    basis_[open] = unit(cross(unit(basis_[(open + 1) % 3]), unit(basis_[(open + 2) % 3])));
  }
  // The volume of a reduced cell is at least 0.7 of the product of its lengths.
  std::array<Vector, 3> units;
  for (std::size_t k = 0; k < 3; ++k) units[k] = unit(basis_[k]);
  const double volume = dot(units[0], cross(units[1], units[2]));
  if (!(std::abs(volume) > 0.01)) reject_dependent();
  for (std::size_t k = 0; k < 3; ++k) {
    inverse_[k] = cross(units[(k + 1) % 3], units[(k + 2) % 3]);
    const double length = repeats_[k] ? std::sqrt(dot(basis_[k], basis_[k])) : 1;
    const int exponent = repeats_[k] ? scale_ : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      inverse_[k][axis] = std::ldexp(inverse_[k][axis] / volume / length, -exponent);
      basis_[k][axis] = std::ldexp(basis_[k][axis], exponent);
    }
  }
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
