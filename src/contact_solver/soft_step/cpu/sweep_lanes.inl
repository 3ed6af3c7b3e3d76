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
};

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
