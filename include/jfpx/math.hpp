/// Vectors, quaternions, matrices, transforms and axis-aligned boxes (thesis 4.2) as plain values
/// with inline functions. Every expression is a fixed sequence of single IEEE operations, so host
/// and device produce the same bits; device code must be compiled with nvcc's --fmad=false.
#pragma once

#include <jfpx/config.hpp>

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#if defined(__MINGW32__) && defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {

/// Machine epsilon of Real. A vector of at most this length has no direction.
inline constexpr Real kEpsilon = std::numeric_limits<Real>::epsilon();
/// The largest finite Real, as a constant, because device code can't call numeric_limits.
inline constexpr Real kMaxReal = (std::numeric_limits<Real>::max)();  // not the macro of windows.h
inline constexpr Real kPi = static_cast<Real>(3.14159265358979323846);

/// Correctly rounded square root, with the same bits from nvcc and the host compilers.
JFPX_INLINE inline float square_root(float x) {
#if defined(__CUDA_ARCH__)
  return ::sqrt(x);
#else
  return std::sqrt(x);
#endif
}
JFPX_INLINE inline double square_root(double x) {
#if defined(__CUDA_ARCH__)
  return ::sqrt(x);
#elif defined(__MINGW32__) && defined(__x86_64__)
  // sqrt() of MinGW-w64 rounds twice, first to the format of the x87 unit. Optimized code does not
  // call it, other code does.
  const __m128d v = _mm_set_sd(x);
  return _mm_cvtsd_f64(_mm_sqrt_sd(v, v));
#else
  return std::sqrt(x);
#endif
}
template <std::integral Integer>
JFPX_INLINE inline Real square_root(Integer x) {
  return square_root(static_cast<Real>(x));
}
JFPX_INLINE inline Real absolute(Real x) {
#if defined(__CUDA_ARCH__)
  return ::fabs(x);
#else
  return std::fabs(x);
#endif
}

/// A vector or point in three dimensions.
struct Vec3 {
  Real x = 0, y = 0, z = 0;

  JFPX_INLINE constexpr Real& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  JFPX_INLINE constexpr const Real& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  JFPX_INLINE constexpr Vec3& operator+=(const Vec3& v) {
    x += v.x, y += v.y, z += v.z;
    return *this;
  }
  JFPX_INLINE constexpr Vec3& operator-=(const Vec3& v) {
    x -= v.x, y -= v.y, z -= v.z;
    return *this;
  }
  JFPX_INLINE constexpr Vec3& operator*=(Real s) {
    x *= s, y *= s, z *= s;
    return *this;
  }
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

JFPX_INLINE constexpr Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
JFPX_INLINE constexpr Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
JFPX_INLINE constexpr Vec3 operator-(const Vec3& v) { return {-v.x, -v.y, -v.z}; }
JFPX_INLINE constexpr Vec3 operator*(Vec3 v, Real s) { return v *= s; }
JFPX_INLINE constexpr Vec3 operator*(Real s, Vec3 v) { return v *= s; }

/// a.x*b.x + a.y*b.y + a.z*b.z, summed from left to right.
JFPX_INLINE constexpr Real dot(const Vec3& a, const Vec3& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
JFPX_INLINE constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
JFPX_INLINE constexpr Vec3 component_product(const Vec3& a, const Vec3& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
/// v + direction * scale
JFPX_INLINE constexpr Vec3 add_scaled(const Vec3& v, const Vec3& direction, Real scale) {
  return v + direction * scale;
}
JFPX_INLINE constexpr Real length_squared(const Vec3& v) { return dot(v, v); }
JFPX_INLINE inline Real length(const Vec3& v) { return square_root(length_squared(v)); }
/// v scaled to length 1. A vector of length kEpsilon or less has no direction and is returned
/// unchanged.
JFPX_HD inline Vec3 normalized(const Vec3& v) {
  const Real n = length(v);
  return n > kEpsilon ? v * (Real(1) / n) : v;
}
JFPX_HD inline bool is_finite(Real x) { return absolute(x) <= kMaxReal; }
JFPX_HD inline bool is_finite(const Vec3& v) {
  return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/// A quaternion w + xi + yj + zk. The default is the identity rotation (erratum E24).
struct Quat {
  Real w = 1, x = 0, y = 0, z = 0;
  friend bool operator==(const Quat&, const Quat&) = default;
};

/// Hamilton product: the rotation b followed by the rotation a.
JFPX_INLINE constexpr Quat operator*(const Quat& a, const Quat& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
JFPX_INLINE constexpr Quat conjugate(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }
JFPX_INLINE constexpr Real length_squared(const Quat& q) {
  return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
}
/// q scaled to length 1; the identity if the length is kEpsilon or less (erratum E24).
JFPX_HD inline Quat normalized(const Quat& q) {
  const Real n2 = length_squared(q);
  if (!(n2 > kEpsilon * kEpsilon)) return {};
  const Real k = Real(1) / square_root(n2);
  return {q.w * k, q.x * k, q.y * k, q.z * k};
}
/// q rotated by the rotation vector `scale * omega` (world frame, [rad]) to first order, not
/// normalised: q + (scale/2) * omega * q (thesis 4.2.2).
JFPX_INLINE constexpr Quat add_scaled(const Quat& q, const Vec3& omega, Real scale) {
  const Quat t = Quat{0, omega.x * scale, omega.y * scale, omega.z * scale} * q;
  const Real half = Real(0.5);
  return {q.w + t.w * half, q.x + t.x * half, q.y + t.y * half, q.z + t.z * half};
}
/// q rotated by the small rotation vector `r` (world frame, [rad]), normalised (erratum E25).
JFPX_HD inline Quat rotated_by(const Quat& q, const Vec3& r) {
  return normalized(add_scaled(q, r, 1));
}
JFPX_HD inline bool is_finite(const Quat& q) {
  return is_finite(q.w) && is_finite(q.x) && is_finite(q.y) && is_finite(q.z);
}
/// Normalized linear interpolation of rotations along the shorter arc: a for t = 0, b for t = 1.
/// The angular velocity is nearly constant for small rotations.
JFPX_HD inline Quat interpolate(const Quat& a, const Quat& b, Real t) {
  const Real s = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0 ? -t : t, r = 1 - t;
  return normalized(
      Quat{a.w * r + b.w * s, a.x * r + b.x * s, a.y * r + b.y * s, a.z * r + b.z * s});
}
/// The unit quaternion that rotates by `angle` [rad] about `axis`, counterclockwise as seen from
/// the tip of the axis. Uses no functions of the C library, so its bits are the same on all
/// machines.
/// @param axis finite and longer than kEpsilon, of any length
/// @param angle from -10^6 to 10^6
/// @throws InvalidArgument
JFPX_API Quat from_axis_angle(const Vec3& axis, Real angle);
/// The shortest rotation of the x axis to the direction of `axis`.
/// @param axis finite and longer than kEpsilon, of any length
/// @throws InvalidArgument
JFPX_API Quat axes_along(const Vec3& axis);
/// A rotation of the x axis to the direction of `x`, and of the y axis as near as possible to `y`.
/// @param x, y finite, of any length, and not parallel
/// @throws InvalidArgument
JFPX_API Quat axes_along(const Vec3& x, const Vec3& y);

/// A 3x3 matrix, stored in row-major order. The default is the identity.
struct Mat3 {
  Vec3 row[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  JFPX_INLINE constexpr Real operator()(int r, int c) const { return row[r][c]; }
  JFPX_INLINE constexpr Real& operator()(int r, int c) { return row[r][c]; }
  JFPX_INLINE constexpr Vec3 column(int c) const { return {row[0][c], row[1][c], row[2][c]}; }
  friend bool operator==(const Mat3&, const Mat3&) = default;
};

JFPX_INLINE constexpr Mat3 diagonal(const Vec3& d) {
  return {{{d.x, 0, 0}, {0, d.y, 0}, {0, 0, d.z}}};
}
JFPX_INLINE constexpr Mat3 from_columns(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {{{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}}};
}
/// The matrix S with S*v = cross(u, v) for every v.
JFPX_INLINE constexpr Mat3 skew_symmetric(const Vec3& u) {
  return {{{0, -u.z, u.y}, {u.z, 0, -u.x}, {-u.y, u.x, 0}}};
}
JFPX_INLINE constexpr Mat3 transposed(const Mat3& m) {
  return {{m.column(0), m.column(1), m.column(2)}};
}
JFPX_INLINE constexpr Vec3 operator*(const Mat3& m, const Vec3& v) {
  return {dot(m.row[0], v), dot(m.row[1], v), dot(m.row[2], v)};
}
/// transposed(m) * v
JFPX_INLINE constexpr Vec3 transform_transpose(const Mat3& m, const Vec3& v) {
  return {dot(m.column(0), v), dot(m.column(1), v), dot(m.column(2), v)};
}
JFPX_INLINE constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
  return from_columns(a * b.column(0), a * b.column(1), a * b.column(2));
}
JFPX_INLINE constexpr Mat3 operator*(const Mat3& m, Real s) {
  return {{m.row[0] * s, m.row[1] * s, m.row[2] * s}};
}
JFPX_INLINE constexpr Mat3 operator+(const Mat3& a, const Mat3& b) {
  return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
}
/// Linear interpolation of each entry: a for t = 0, b for t = 1.
JFPX_INLINE constexpr Mat3 interpolate(const Mat3& a, const Mat3& b, Real t) {
  return a * (Real(1) - t) + b * t;
}
JFPX_INLINE constexpr Real determinant(const Mat3& m) {
  return dot(m.row[0], cross(m.row[1], m.row[2]));
}
/// inverse(m) for device code: writes it to *out. If m is singular, returns false and leaves *out
/// unchanged (erratum E26).
JFPX_HD inline bool invert(const Mat3& m, Mat3* out) {
  const Vec3 c0 = cross(m.row[1], m.row[2]);
  const Vec3 c1 = cross(m.row[2], m.row[0]);
  const Vec3 c2 = cross(m.row[0], m.row[1]);
  const Real det = dot(m.row[0], c0);
  if (!(absolute(det) > 0) || !is_finite(Real(1) / det)) return false;
  *out = from_columns(c0, c1, c2) * (Real(1) / det);
  return true;
}
/// Inverse of a matrix; empty if the matrix is singular.
inline std::optional<Mat3> inverse(const Mat3& m) {
  Mat3 result;
  return invert(m, &result) ? std::optional(result) : std::nullopt;
}
/// Rotation matrix of a unit quaternion: R*v = q v q* (erratum E14 was the transpose).
JFPX_INLINE constexpr Mat3 to_matrix(const Quat& q) {
  const Real x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const Real xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
  const Real xy = q.x * y2, xz = q.x * z2, yz = q.y * z2;
  const Real wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  return {{{1 - (yy + zz), xy - wz, xz + wy},
           {xy + wz, 1 - (xx + zz), yz - wx},
           {xz - wy, yz + wx, 1 - (xx + yy)}}};
}
/// The vector v rotated by the unit quaternion q.
JFPX_INLINE constexpr Vec3 rotate(const Quat& q, const Vec3& v) { return to_matrix(q) * v; }

/// A rigid transform: p -> basis * p + origin, with an orthonormal basis. The default is the
/// identity.
struct Transform {
  Mat3 basis;
  Vec3 origin;
  friend bool operator==(const Transform&, const Transform&) = default;
};
JFPX_INLINE constexpr Transform make_transform(const Quat& q, const Vec3& origin) {
  return {to_matrix(q), origin};
}
JFPX_INLINE constexpr Vec3 transform_point(const Transform& t, const Vec3& p) {
  return t.basis * p + t.origin;
}
JFPX_INLINE constexpr Vec3 inverse_transform_point(const Transform& t, const Vec3& p) {
  return transform_transpose(t.basis, p - t.origin);
}
JFPX_INLINE constexpr Vec3 transform_direction(const Transform& t, const Vec3& d) {
  return t.basis * d;
}
JFPX_INLINE constexpr Vec3 inverse_transform_direction(const Transform& t, const Vec3& d) {
  return transform_transpose(t.basis, d);
}
/// Composition: the transform b followed by the transform a.
JFPX_INLINE constexpr Transform operator*(const Transform& a, const Transform& b) {
  return {a.basis * b.basis, transform_point(a, b.origin)};
}
/// Inverse of a rigid transform.
JFPX_INLINE constexpr Transform inverse(const Transform& t) {
  return {transposed(t.basis), -transform_transpose(t.basis, t.origin)};
}

/// A general 4x4 matrix, stored in row-major order. The default is the identity.
struct Mat4 {
  Real m[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  friend bool operator==(const Mat4&, const Mat4&) = default;
};
JFPX_HD constexpr Mat4 to_mat4(const Transform& t) {
  Mat4 r;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r.m[i][j] = t.basis(i, j);
    r.m[i][3] = t.origin[i];
  }
  return r;
}
JFPX_HD constexpr Mat4 operator*(const Mat4& a, const Mat4& b) {
  Mat4 r;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      r.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j] +
                  a.m[i][3] * b.m[3][j];
    }
  }
  return r;
}
/// Transforms the point p, with w = 1 and without perspective division.
JFPX_HD constexpr Vec3 transform_point(const Mat4& a, const Vec3& p) {
  return {a.m[0][0] * p.x + a.m[0][1] * p.y + a.m[0][2] * p.z + a.m[0][3],
          a.m[1][0] * p.x + a.m[1][1] * p.y + a.m[1][2] * p.z + a.m[1][3],
          a.m[2][0] * p.x + a.m[2][1] * p.y + a.m[2][2] * p.z + a.m[2][3]};
}
/// Column c without its last element: an axis (c = 0 to 2) or the origin (c = 3) of an affine
/// matrix.
JFPX_HD constexpr Vec3 axis(const Mat4& a, int c) { return {a.m[0][c], a.m[1][c], a.m[2][c]}; }
/// Minor: the determinant of the 3x3 matrix that remains without row r and column c.
JFPX_HD constexpr Real minor_determinant(const Mat4& a, int r, int c) {
  Mat3 s;
  for (int i = 0, k = 0; i < 4; ++i) {
    if (i == r) continue;
    for (int j = 0, l = 0; j < 4; ++j) {
      if (j != c) s(k, l++) = a.m[i][j];
    }
    ++k;
  }
  return determinant(s);
}
JFPX_HD constexpr Real determinant(const Mat4& a) {
  return a.m[0][0] * minor_determinant(a, 0, 0) - a.m[0][1] * minor_determinant(a, 0, 1) +
         a.m[0][2] * minor_determinant(a, 0, 2) - a.m[0][3] * minor_determinant(a, 0, 3);
}
/// inverse(a) for device code: writes it to *out. If a is singular, returns false and leaves *out
/// unchanged (erratum E26).
JFPX_HD inline bool invert(const Mat4& a, Mat4* out) {
  const Real det = determinant(a);
  if (!(absolute(det) > 0) || !is_finite(Real(1) / det)) return false;
  const Real k = Real(1) / det;
  Mat4 r;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const Real sign = ((i + j) & 1) != 0 ? Real(-1) : Real(1);
      r.m[j][i] = sign * minor_determinant(a, i, j) * k;
    }
  }
  *out = r;
  return true;
}
/// Inverse of a matrix; empty if the matrix is singular.
inline std::optional<Mat4> inverse(const Mat4& a) {
  Mat4 result;
  return invert(a, &result) ? std::optional(result) : std::nullopt;
}
/// Writes the matrix in the column-major order of OpenGL: out[4*column + row].
JFPX_HD constexpr void fill_column_major(const Mat4& a, Real out[16]) {
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) out[4 * j + i] = a.m[i][j];
  }
}

/// An axis-aligned bounding box. The default is empty.
struct Aabb {
  Vec3 lower{kMaxReal, kMaxReal, kMaxReal};
  Vec3 upper{std::numeric_limits<Real>::lowest(), std::numeric_limits<Real>::lowest(),
             std::numeric_limits<Real>::lowest()};
  friend bool operator==(const Aabb&, const Aabb&) = default;
};
/// True if the boxes overlap or touch.
JFPX_HD constexpr bool overlap(const Aabb& a, const Aabb& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}
/// The smallest box that encloses both.
JFPX_HD constexpr Aabb merged(const Aabb& a, const Aabb& b) {
  Aabb r;
  for (int i = 0; i < 3; ++i) {
    r.lower[i] = a.lower[i] < b.lower[i] ? a.lower[i] : b.lower[i];
    r.upper[i] = a.upper[i] > b.upper[i] ? a.upper[i] : b.upper[i];
  }
  return r;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
