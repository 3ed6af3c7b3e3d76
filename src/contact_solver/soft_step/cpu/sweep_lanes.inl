/// Vectors of several rows and bodies for the kernels of the sweeps, for any instruction set.
#pragma once

#include "src/contact_solver/soft_step/cpu/sweep_layout.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

template <class S>
struct Vec3Lanes {
  using Vec = typename S::Vec;
  Vec x, y, z;

  Vec3Lanes operator+(const Vec3Lanes& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec3Lanes operator-(const Vec3Lanes& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec3Lanes operator*(Vec k) const { return {x * k, y * k, z * k}; }
  static Vec dot(const Vec3Lanes& a, const Vec3Lanes& b) {
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
  }
  static Vec3Lanes cross(const Vec3Lanes& a, const Vec3Lanes& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
  static Vec3Lanes select(typename S::Mask mask, const Vec3Lanes& a, const Vec3Lanes& b) {
    return {S::select(mask, a.x, b.x), S::select(mask, a.y, b.y), S::select(mask, a.z, b.z)};
  }
  Vec3Lanes negated() const { return {S::negate(x), S::negate(y), S::negate(z)}; }
  /// Whether any component differs.
  typename S::Mask differs(const Vec3Lanes& o) const {
    return S::either(S::either(S::differs(x, o.x), S::differs(y, o.y)), S::differs(z, o.z));
  }
};

/// Four numbers of each lane: a vector and a scalar.
template <class S>
struct QuadLanes {
  Vec3Lanes<S> vector;
  typename S::Vec scalar;

  /// @param base   first quadruple of item 0
  /// @param stride Reals per item
  static QuadLanes load(const Real* base, std::size_t stride, const std::uint32_t* items) {
    typename S::Vec columns[4];
    S::load_quads(base, stride, items, columns);
    return {{columns[0], columns[1], columns[2]}, columns[3]};
  }
  /// Stores the lanes whose bits are set.
  void store(Real* base, std::size_t stride, const std::uint32_t* items, unsigned lanes) const {
    const typename S::Vec columns[4] = {vector.x, vector.y, vector.z, scalar};
    S::store_quads(base, stride, items, columns, lanes);
  }
};

/// A Mat3 of each lane.
template <class S>
struct Mat3Lanes {
  using Vec = typename S::Vec;
  Vec3Lanes<S> row[3];

  static Mat3Lanes load(const Real* all, const std::uint32_t* items) {
    const auto first = QuadLanes<S>::load(all, kMatrixStride, items);
    const auto second = QuadLanes<S>::load(all + 4, kMatrixStride, items);
    const auto last = QuadLanes<S>::load(all + 5, kMatrixStride, items);
    return {{first.vector,
             {first.scalar, second.vector.x, second.vector.y},
             {last.vector.y, last.vector.z, last.scalar}}};
  }
  Vec3Lanes<S> operator*(const Vec3Lanes<S>& v) const {
    return {Vec3Lanes<S>::dot(row[0], v), Vec3Lanes<S>::dot(row[1], v),
            Vec3Lanes<S>::dot(row[2], v)};
  }
  Mat3Lanes transposed() const {
    return {{{row[0].x, row[1].x, row[2].x},
             {row[0].y, row[1].y, row[2].y},
             {row[0].z, row[1].z, row[2].z}}};
  }
  Mat3Lanes operator*(const Mat3Lanes& o) const {
    const Mat3Lanes columns = o.transposed();
    return Mat3Lanes{{*this * columns.row[0], *this * columns.row[1], *this * columns.row[2]}}
        .transposed();
  }
  Mat3Lanes operator+(const Mat3Lanes& o) const {
    return {{row[0] + o.row[0], row[1] + o.row[1], row[2] + o.row[2]}};
  }
  static Mat3Lanes select(typename S::Mask mask, const Mat3Lanes& a, const Mat3Lanes& b) {
    return {{Vec3Lanes<S>::select(mask, a.row[0], b.row[0]),
             Vec3Lanes<S>::select(mask, a.row[1], b.row[1]),
             Vec3Lanes<S>::select(mask, a.row[2], b.row[2])}};
  }
};

/// soft_step::locks_rotation()
template <class S>
typename S::Mask locks_rotation(const Mat3Lanes<S>& inertia) {
  const auto zero = S::set(0);
  return S::negate_mask(
      S::both(S::both(S::less(zero, inertia.row[0].x), S::less(zero, inertia.row[1].y)),
              S::less(zero, inertia.row[2].z)));
}

/// A Quat of each lane.
template <class S>
struct OrientationLanes {
  using Vec = typename S::Vec;
  static constexpr std::size_t kStride = 4;
  Vec w;
  Vec3Lanes<S> v;

  static OrientationLanes load(const Real* all, const std::uint32_t* items) {
    const auto quad = QuadLanes<S>::load(all, kStride, items);
    return {quad.vector.x, {quad.vector.y, quad.vector.z, quad.scalar}};
  }
  void store(Real* all, const std::uint32_t* items, unsigned lanes) const {
    QuadLanes<S>{{w, v.x, v.y}, v.z}.store(all, kStride, items, lanes);
  }

  static OrientationLanes identity() {
    const Vec zero = S::set(0);
    return {S::set(1), {zero, zero, zero}};
  }
  static OrientationLanes select(typename S::Mask mask, const OrientationLanes& a,
                                 const OrientationLanes& b) {
    return {S::select(mask, a.w, b.w), Vec3Lanes<S>::select(mask, a.v, b.v)};
  }
  OrientationLanes operator*(const OrientationLanes& o) const {
    return {w * o.w - v.x * o.v.x - v.y * o.v.y - v.z * o.v.z,
            {w * o.v.x + v.x * o.w + v.y * o.v.z - v.z * o.v.y,
             w * o.v.y - v.x * o.v.z + v.y * o.w + v.z * o.v.x,
             w * o.v.z + v.x * o.v.y - v.y * o.v.x + v.z * o.w}};
  }
  OrientationLanes conjugate() const { return {w, v.negated()}; }
  OrientationLanes negated() const { return {S::negate(w), v.negated()}; }
  /// Whether any component differs.
  typename S::Mask differs(const OrientationLanes& o) const {
    return S::either(S::differs(w, o.w), v.differs(o.v));
  }

  /// add_scaled(q, omega, scale) for a Quat.
  OrientationLanes add_scaled(const Vec3Lanes<S>& omega, Vec scale) const {
    const Vec3Lanes<S> r = omega * scale;
    const Vec zero = S::set(0), half = S::set(Real(0.5));
    const Vec tw = zero * w - r.x * v.x - r.y * v.y - r.z * v.z;
    const Vec tx = zero * v.x + r.x * w + r.y * v.z - r.z * v.y;
    const Vec ty = zero * v.y - r.x * v.z + r.y * w + r.z * v.x;
    const Vec tz = zero * v.z + r.x * v.y - r.y * v.x + r.z * w;
    return {w + tw * half, {v.x + tx * half, v.y + ty * half, v.z + tz * half}};
  }
  OrientationLanes normalized(Vec shortest2) const {
    const Vec one = S::set(1), zero = S::set(0);
    const Vec n2 = w * w + v.x * v.x + v.y * v.y + v.z * v.z;
    const typename S::Mask is_long = S::less(shortest2, n2);
    const Vec k = one / S::square_root(n2);
    return {S::select(is_long, w * k, one),
            Vec3Lanes<S>::select(is_long, v * k, {zero, zero, zero})};
  }
  /// One bit per lane: whether all components are 0.
  unsigned are_zero() const {
    const Vec zero = S::set(0);
    return ~S::bits(differs({zero, {zero, zero, zero}}));
  }
};

/// to_matrix(q)
template <class S>
Mat3Lanes<S> to_matrix(const OrientationLanes<S>& q) {
  const auto one = S::set(1);
  const auto x2 = q.v.x + q.v.x, y2 = q.v.y + q.v.y, z2 = q.v.z + q.v.z;
  const auto xx = q.v.x * x2, yy = q.v.y * y2, zz = q.v.z * z2;
  const auto xy = q.v.x * y2, xz = q.v.x * z2, yz = q.v.y * z2;
  const auto wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  return {{{one - (yy + zz), xy - wz, xz + wy},
           {xy + wz, one - (xx + zz), yz - wx},
           {xz - wy, yz + wx, one - (xx + yy)}}};
}

/// Velocities of the bodies of each lane.
template <class S>
struct BodyLanes {
  QuadLanes<S> velocity, angular_velocity;

  BodyLanes() = default;
  BodyLanes(const Real* all, const std::uint32_t* bodies)
      : velocity(QuadLanes<S>::load(all + solver_body_quad::kVelocity, kSweepStride, bodies)),
        angular_velocity(
            QuadLanes<S>::load(all + solver_body_quad::kAngularVelocity, kSweepStride, bodies)) {}
  [[gnu::always_inline]] void store(Real* all, const std::uint32_t* bodies, unsigned lanes) const {
    velocity.store(all + solver_body_quad::kVelocity, kSweepStride, bodies, lanes);
    angular_velocity.store(all + solver_body_quad::kAngularVelocity, kSweepStride, bodies, lanes);
  }
};

/// Lanes of soft_step::Bias.
template <class S>
struct BiasLanes {
  using Vec = typename S::Vec;
  Vec velocity, mass_scale, impulse_scale, projection;

  /// The arithmetic of bias_of().
  /// @param is_apart whether the separation is > 0
  /// @param softness function from a member of SweepSoftness to its lanes
  template <bool kUseBias, class Softness>
  static BiasLanes of(const SweepConstants& constants, Vec separation, typename S::Mask is_apart,
                      const Softness& softness) {
    const Vec zero = S::set(0), gap_velocity = separation * S::set(constants.inverse_h);
    if constexpr (!kUseBias) {
      return {S::select(is_apart, gap_velocity, zero), S::set(1), zero, zero};
    }
    const Vec push_out_speed = S::set(constants.push_out_speed);
    const Vec max_bias_velocity = S::set(constants.max_bias_velocity);
    const Vec wanted = S::negate(softness(&SweepSoftness::bias_rate)) * separation;
    const Vec push = S::select(S::less(wanted, push_out_speed), wanted, push_out_speed);
    const Vec speed = S::select(S::less(push, max_bias_velocity), push, max_bias_velocity);
    return {S::select(is_apart, gap_velocity, S::negate(speed)),
            S::select(is_apart, S::set(1), softness(&SweepSoftness::mass_scale)),
            S::select(is_apart, zero, softness(&SweepSoftness::impulse_scale)),
            S::select(is_apart, zero, (push - speed) * S::set(constants.h))};
  }
};

/// Calls one(bundle, lanes) for all bundles of the rows [first, last), where `lanes` has one bit
/// per row. It returns one bit for each row that it has skipped.
/// @param left receives the skipped rows. @returns their number
template <class One>
std::size_t for_each_bundle(std::size_t first, std::size_t last, std::uint32_t* left,
                            const One& one) {
  constexpr unsigned kAll = (1u << kBundle) - 1;
  std::size_t skipped = 0;
  for (std::size_t bundle = first / kBundle; bundle * kBundle < last; ++bundle) {
    const std::size_t begin = bundle * kBundle;
    unsigned lanes = kAll;
    if (begin < first) lanes &= kAll << (first - begin);
    if (last - begin < kBundle) lanes &= (1u << (last - begin)) - 1;
    for (unsigned bits = one(bundle, lanes); bits != 0; bits &= bits - 1) {
      left[skipped++] =
          static_cast<std::uint32_t>(begin) + static_cast<unsigned>(__builtin_ctz(bits));
    }
  }
  return skipped;
}

/// Calls one(first, count) for all vectors of the rows [first, last), of which the last may be
/// incomplete. It returns one bit for each row that it has skipped.
/// @param left receives the skipped rows. @returns their number
template <unsigned kLanes, class One>
std::size_t for_each_vector(std::size_t first, std::size_t last, std::uint32_t* left,
                            const One& one) {
  std::size_t skipped = 0;
  for (std::size_t i = first; i < last; i += kLanes) {
    const std::size_t count = last - i < kLanes ? last - i : kLanes;
    for (unsigned lanes = one(i, static_cast<unsigned>(count)); lanes != 0; lanes &= lanes - 1) {
      left[skipped++] = static_cast<std::uint32_t>(i) + static_cast<unsigned>(__builtin_ctz(lanes));
    }
  }
  return skipped;
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
