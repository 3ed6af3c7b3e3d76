/// Validation and inversion of inertia tensors, in double, scaled to a trace of 1, so that no
/// product overflows.
#include "src/scene/inertia_tensor.hpp"

#include <jfpx/scene.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// A symmetric matrix, stored as its entries on and above the diagonal.
struct Symmetric {
  double xx, yy, zz, xy, yz, zx;

  double minor_xy() const { return xx * yy - xy * xy; }
  double determinant() const {
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx);
  }
  /// Sylvester's criterion.
  bool positive_definite() const { return xx > 0 && minor_xy() > 0 && determinant() > 0; }
};

double trace(const Mat3& m) {
  return static_cast<double>(m(0, 0)) + static_cast<double>(m(1, 1)) + static_cast<double>(m(2, 2));
}

Symmetric scaled(const Mat3& m, double scale) {
  const auto entry = [&](int i, int j) {
    return (static_cast<double>(m(i, j)) + static_cast<double>(m(j, i))) / 2 / scale;
  };
  return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(2, 0)};
}

bool is_symmetric(const Mat3& m) {
  const double tolerance = 16 * static_cast<double>(kEpsilon) * trace(m);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const double skew = static_cast<double>(m(i, j)) - static_cast<double>(m(j, i));
    if (!(skew <= tolerance && skew >= -tolerance)) return false;
  }
  return true;
}

}  // namespace

const char* inertia_must_be(const Mat3& tensor) {
  for (const Vec3& row : tensor.row) {
    if (!is_finite(row)) return "finite";
  }
  if (!(trace(tensor) > 0)) return "positive definite";
  if (!is_symmetric(tensor)) return "symmetric";
  const Symmetric i = scaled(tensor, trace(tensor));
  if (!i.positive_definite()) return "positive definite";
  // The second moment of the mass, tr(I)/2 - I, is positive semidefinite, which is equivalent to
  // the triangle inequality of the principal moments. Equality (a flat body) is accepted with the
  // precision of four typed digits.
  const double half = 0.5 + static_cast<double>(kUnitTolerance);
  const Symmetric second_moment{half - i.xx, half - i.yy, half - i.zz, -i.xy, -i.yz, -i.zx};
  if (!second_moment.positive_definite()) {
    return "such that no principal moment exceeds the sum of the others";
  }
  const Mat3 inverse = inverse_inertia(tensor);
  for (const Vec3& row : inverse.row) {
    if (!is_finite(row)) return "such that its inverse is finite";
  }
  return nullptr;
}

Mat3 inverse_inertia(const Mat3& tensor) {
  const auto invert = [](Real moment) { return Real(1) / moment; };
  if (is_diagonal(tensor)) {
    return diagonal({invert(tensor(0, 0)), invert(tensor(1, 1)), invert(tensor(2, 2))});
  }
  const double scale = trace(tensor);
  const Symmetric i = scaled(tensor, scale);
  const double k = 1 / (i.determinant() * scale);
  const auto real = [k](double cofactor) { return static_cast<Real>(cofactor * k); };
  const Real xy = real(i.zx * i.yz - i.xy * i.zz), yz = real(i.xy * i.zx - i.xx * i.yz),
             zx = real(i.xy * i.yz - i.yy * i.zx);
  return {{{real(i.yy * i.zz - i.yz * i.yz), xy, zx},
           {xy, real(i.xx * i.zz - i.zx * i.zx), yz},
           {zx, yz, real(i.minor_xy())}}};
}

bool is_diagonal(const Mat3& tensor) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (tensor(i, j) != 0 || tensor(j, i) != 0) return false;
  }
  return true;
}

Mat3 symmetric_part(const Mat3& tensor) {
  return tensor * Real(0.5) + transposed(tensor) * Real(0.5);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
