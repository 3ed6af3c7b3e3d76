/// Principal inertia by the cyclic Jacobi method (Golub and Van Loan, Matrix Computations, 8.5), in
/// double.
#include "src/scene/principal_inertia.hpp"

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

struct Matrix {
  double row[3][3] = {};
  double* operator[](int i) { return row[i]; }
};

/// Eliminates tensor[p][q] by a rotation in that plane, and applies it to the columns of `axes`.
void rotate(Matrix* tensor, Matrix* axes, int p, int q) {
  Matrix& m = *tensor;
  if (m[p][q] == 0) return;
  const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
  const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + square_root(theta * theta + 1));
  const double c = 1 / square_root(t * t + 1), s = t * c;
  const auto rotate_pair = [c, s](double* first, double* second) {
    const double x = *first, y = *second;
    *first = c * x - s * y;
    *second = s * x + c * y;
  };
  for (int k = 0; k < 3; ++k) rotate_pair(&m[k][p], &m[k][q]);
  for (int k = 0; k < 3; ++k) rotate_pair(&m[p][k], &m[q][k]);
  for (int k = 0; k < 3; ++k) rotate_pair(&(*axes)[k][p], &(*axes)[k][q]);
  m[p][q] = m[q][p] = 0;
}

}  // namespace

PrincipalInertia principal_inertia(const Mat3& tensor) {
  Matrix m, axes;
  double size = 0;
  for (int i = 0; i < 3; ++i) {
    axes[i][i] = 1;
    size += std::abs(static_cast<double>(tensor(i, i)));
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const auto x = static_cast<double>(i < j ? tensor(i, j) : tensor(j, i));
      const bool noise = i != j && std::abs(x) <= 4 * static_cast<double>(kEpsilon) * size;
      m[i][j] = noise ? 0 : x;
    }
  }
  // Convergence is quadratic: five sweeps reduce any tensor to rounding errors.
  for (int sweep = 0; sweep < 8; ++sweep) {
    rotate(&m, &axes, 0, 1);
    rotate(&m, &axes, 0, 2);
    rotate(&m, &axes, 1, 2);
  }
  PrincipalInertia result;
  for (int i = 0; i < 3; ++i) {
    result.moments[i] = static_cast<Real>(m[i][i]);
    for (int j = 0; j < 3; ++j) result.axes(i, j) = static_cast<Real>(axes[i][j]);
  }
  return result;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
