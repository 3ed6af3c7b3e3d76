/// Motion along and about the axes that a body has not locked.
#pragma once

#include <jfpx/body.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The components of a velocity or a displacement along free axes; the others are 0.
JFPX_HD constexpr Vec3 free_linear(const MotionLocks& locks, const Vec3& v) {
  return {locks.linear_x ? Real(0) : v.x, locks.linear_y ? Real(0) : v.y,
          locks.linear_z ? Real(0) : v.z};
}
/// The components of an angular velocity about free axes; the others are 0.
JFPX_HD constexpr Vec3 free_angular(const MotionLocks& locks, const Vec3& v) {
  return {locks.angular_x ? Real(0) : v.x, locks.angular_y ? Real(0) : v.y,
          locks.angular_z ? Real(0) : v.z};
}

/// Whether the rotation about an axis is locked.
JFPX_HD constexpr bool any_angular(const MotionLocks& locks) {
  return locks.angular_x || locks.angular_y || locks.angular_z;
}
JFPX_HD constexpr bool all_angular(const MotionLocks& locks) {
  return locks.angular_x && locks.angular_y && locks.angular_z;
}

/// Whether the body does not move along any axis.
JFPX_HD constexpr bool all_linear(const MotionLocks& locks) {
  return locks.linear_x && locks.linear_y && locks.linear_z;
}

/// Lower triangular matrix L with L * L^T = m. Columns without a positive pivot are 0.
/// @param m symmetric and positive semidefinite
JFPX_HD inline Mat3 cholesky_factor(const Mat3& m) {
  Mat3 lower = diagonal({0, 0, 0});
  for (int k = 0; k < 3; ++k) {
    Real pivot = m(k, k);
    for (int j = 0; j < k; ++j) pivot -= lower(k, j) * lower(k, j);
    if (!(pivot > 0)) continue;
    lower(k, k) = square_root(pivot);
    for (int i = k + 1; i < 3; ++i) {
      Real sum = m(i, k);
      for (int j = 0; j < k; ++j) sum -= lower(i, j) * lower(k, j);
      lower(i, k) = sum / lower(k, k);
    }
  }
  return lower;
}

/// Inverse inertia of a body that rotates about free axes only, world axes: the inverse of the rows
/// and columns of its inertia tensor that belong to free axes, and 0 in all others.
///
/// With the inverse tensor A * A^T, this is the product of the free rows of A without their
/// components along the locked rows, so rounding keeps it positive semidefinite.
/// @param inverse of the whole inertia, body axes @param axes of the body, as columns
[[gnu::noinline]] JFPX_HD inline Mat3 locked_inverse_inertia(const MotionLocks& locks,
                                                             const Mat3& inverse,
                                                             const Mat3& axes) {
  const bool is_locked[3] = {locks.angular_x, locks.angular_y, locks.angular_z};
  Mat3 a = axes * cholesky_factor(inverse);
  for (int k = 0; k < 3; ++k) {
    if (!is_locked[k]) continue;
    const Vec3 locked = a.row[k];
    const Real size2 = length_squared(locked);
    if (size2 > 0) {
      for (Vec3& row : a.row) row -= locked * (dot(row, locked) / size2);
    }
    a.row[k] = {};
  }
  Mat3 result;
  for (int i = 0; i < 3; ++i) {
    result.row[i] = {dot(a.row[i], a.row[0]), dot(a.row[i], a.row[1]), dot(a.row[i], a.row[2])};
  }
  return result;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
