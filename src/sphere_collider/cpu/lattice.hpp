/// The lattice of a periodic cell: a reduced basis for searches, and exact image vectors.
#pragma once

#include <jfpx/neighbors.hpp>

#include <array>
#include <cstdint>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

using Vector = std::array<double, 3>;

inline double dot(const Vector& a, const Vector& b) {
  return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}
inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vector to_vector(const Vec3& v) { return {v.x, v.y, v.z}; }

/// Shifts are numbers of given cell vectors. The basis consists of short vectors of the same
/// lattice, and of unit vectors that are orthogonal to them along axes that do not repeat. Without
/// a cell, it is that of the coordinates.
class Lattice {
 public:
  /// Shifts between points and cells are exact products with cell vectors below 2^26.
  static constexpr std::int64_t kMostShifts = std::int64_t{1} << 24;
  /// [cells] farthest point from the origin
  static constexpr double kFarthest = 1 << 22;

  /// @throws InvalidArgument as find_neighbors() for cell vectors
  explicit Lattice(const std::optional<TriclinicCell>& cell);

  bool repeats(std::size_t k) const { return repeats_[k]; }
  const Vector& basis(std::size_t k) const { return basis_[k]; }
  /// The coordinate of a point along a basis vector, in units of it.
  double coordinate(std::size_t k, const Vector& p) const { return dot(inverse_[k], p); }
  /// The gradient of coordinate(); its length is 1 / (distance of the planes of the lattice).
  const Vector& inverse(std::size_t k) const { return inverse_[k]; }

  /// The shift of a sum of basis vectors.
  /// @throws InvalidArgument if it exceeds kMostShifts
  ImageShift to_shift(const std::array<std::int64_t, 3>& of_basis) const;

  /// The point p + shift * cell vectors in the cell of the basis, except for rounding; coordinates
  /// along axes that do not repeat do not change.
  /// @return false if it is kFarthest or more away
  bool wrap(const Vec3& p, Vector* wrapped, ImageShift* shift) const;

  /// b - a + shift * vectors along an axis, as if it were rounded once to double.
  double image_difference(double a, double b, const ImageShift& shift, std::size_t axis) const;
  Vector image_vector(const Vector& a, const Vector& b, const ImageShift& shift) const {
    return {image_difference(a[0], b[0], shift, 0), image_difference(a[1], b[1], shift, 1),
            image_difference(a[2], b[2], shift, 2)};
  }
  /// The same, rounded to Real.
  Vec3 image_vector(const Vec3& a, const Vec3& b, const ImageShift& shift) const {
    const Vector v = image_vector(to_vector(a), to_vector(b), shift);
    return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
  }

 private:
  using Row = std::array<std::int64_t, 3>;

  /// A sum of cell vectors, in units of scale_.
  Vector scaled(const Row& of_given) const;
  /// Replaces a basis vector by a sum of several if that is shorter.
  bool shorten(std::size_t k, const Row& of_given);
  void reduce();
  void complete();

  std::array<bool, 3> repeats_{};
  std::array<Vector, 3> upper_{}, lower_{};  ///< parts of the cell vectors of 26 bits
  int scale_ = 0;                            ///< exponent of the longest vector
  std::array<Row, 3> of_given_{};            ///< basis vectors as sums of cell vectors
  std::array<Vector, 3> basis_{}, inverse_{};
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
