/// Kernels for bodies, for any instruction set. The arithmetic is that of StepBodies and of Quat,
/// operation by operation.
#include "src/contact_solver/soft_step/cpu/body_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/sweep_lanes.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// @param items   numbers of the bodies, kLanes
/// @param changed lanes to be stored
template <class S>
void move_lanes(const BodySweep& sweep, const std::uint32_t* items, unsigned changed) {
  using Quads = QuadLanes<S>;
  const auto h = S::set(sweep.h);
  const BodyLanes<S> body(sweep.bodies, items);
  const auto advance = [&](std::size_t offset, const Vec3Lanes<S>& velocity) {
    Quads quads = Quads::load(sweep.bodies + offset, kSweepStride, items);
    quads.vector = quads.vector + velocity * h;
    quads.store(sweep.bodies + offset, kSweepStride, items, changed);
  };
  const Vec3Lanes<S>& turning = body.angular_velocity.vector;
  advance(solver_body_quad::kShift, body.velocity.vector);
  const auto before = OrientationLanes<S>::load(sweep.orientations, items);
  before.add_scaled(turning, h)
      .normalized(S::set(sweep.shortest2))
      .store(sweep.orientations, items, changed & ~before.are_zero());
  advance(solver_body_quad::kRotation, turning);
}

/// BodyView::turn_gyroscopically() of slow rotations.
/// @returns one bit per lane: whether its rotation is fast, so that it needs another method
template <class S>
unsigned turn_gyroscopically(const BodySweep& sweep, const std::uint32_t* items,
                             Vec3Lanes<S>* angular_velocity) {
  using Vec = typename S::Vec;
  using Vec3 = Vec3Lanes<S>;
  const auto axes = to_matrix(OrientationLanes<S>::load(sweep.orientations, items));
  const auto inertia = Mat3Lanes<S>::load(sweep.inertia, items);
  const auto inverse = Mat3Lanes<S>::load(sweep.inverse_inertia, items);
  const Vec3 w = axes.transposed() * *angular_velocity;
  const Vec dt = S::set(sweep.substep), half = dt * S::set(Real(0.5)), quarter2 = half * half;
  const auto quadratic = [&](const Vec3& v, const Vec3& momentum, Real side) {
    return v * (Vec3::dot(v, momentum) * quarter2) +
           Vec3::cross(v, momentum) * (half * S::set(side));
  };
  const Vec turned2 = Vec3::dot(w, w) * dt * dt;
  const Vec3 momentum = inertia * w, before = quadratic(w, momentum, -1);
  const Vec factor = S::set(1) / Vec3::dot(inertia.row[0], inverse.transposed().row[0]);
  const Vec rate2 = turned2 * (inverse.row[0].x + inverse.row[1].y + inverse.row[2].z) * factor;
  const auto is_slow = S::both(S::less_equal(S::set(0), rate2),
                               S::less_equal(rate2, S::set(sweep.three_iterations)));
  const auto iterate = [&](const Vec3& now, const Vec3& of_now) {
    return inverse * ((before - quadratic(now, of_now, 1)) * factor);
  };
  const auto next = [&](const Vec3& change) {
    const Vec3 now = w + change;
    return iterate(now, inertia * now);
  };
  Vec3 change = next(iterate(w, momentum));
  const auto needs_third = S::less(S::set(sweep.two_iterations), rate2);
  if (S::any(needs_third)) change = Vec3::select(needs_third, next(change), change);
  *angular_velocity = *angular_velocity + axes * change;
  return ~S::bits(is_slow);
}

/// Two Vec3 of each lane that follow each other.
template <class S>
struct FreeLanes {
  Vec3Lanes<S> velocity, angular_velocity;

  static FreeLanes load(const Real* all, const std::uint32_t* items) {
    const auto first = QuadLanes<S>::load(all, kFreeStride, items);
    const auto last = QuadLanes<S>::load(all + 2, kFreeStride, items);
    return {first.vector, {first.scalar, last.vector.z, last.scalar}};
  }
  void store(Real* all, const std::uint32_t* items, unsigned lanes) const {
    const Vec3Lanes<S>&v = velocity, &w = angular_velocity;
    QuadLanes<S>{v, w.x}.store(all, kFreeStride, items, lanes);
    QuadLanes<S>{{v.z, w.x, w.y}, w.z}.store(all + 2, kFreeStride, items, lanes);
  }
};

/// @param items   numbers of the bodies, kLanes
/// @param changed lanes to be stored
/// @returns the lanes that are left as they are
template <class S, bool kIsFree>
unsigned accelerate_lanes(const BodySweep& sweep, const std::uint32_t* items, unsigned changed) {
  using Quads = QuadLanes<S>;
  using Vec3 = Vec3Lanes<S>;
  const auto h = S::set(sweep.h), zero = S::set(0);
  const auto accelerated = [&](const Vec3& before, std::size_t offset) {
    const auto constants = Quads::load(sweep.constants + offset, kConstantsStride, items);
    return (before + constants.vector * h) * constants.scalar;
  };
  BodyLanes<S> body(sweep.bodies, items);
  FreeLanes<S> now;
  now.velocity = accelerated(body.velocity.vector, 0);
  now.angular_velocity = accelerated(body.angular_velocity.vector, 4);
  const unsigned left = changed & turn_gyroscopically<S>(sweep, items, &now.angular_velocity);
  changed &= ~left;
  if constexpr (kIsFree) {
    Real* shifts = sweep.bodies + solver_body_quad::kShift;
    Quads shift = Quads::load(shifts, kSweepStride, items);
    const Vec3 lost = body.velocity.vector - now.velocity;
    shift.vector = shift.vector + lost * (h * S::set(Real(0.5)));
    shift.store(shifts, kSweepStride, items, changed);
  }
  FreeLanes<S> gained{{zero, zero, zero}, {zero, zero, zero}};
  if (!sweep.is_first) {
    const auto before = FreeLanes<S>::load(sweep.free, items);
    gained = {body.velocity.vector - before.velocity,
              body.angular_velocity.vector - before.angular_velocity};
  }
  now.store(sweep.free, items, changed);
  body.velocity.vector = now.velocity + gained.velocity;
  body.angular_velocity.vector = now.angular_velocity + gained.angular_velocity;
  body.store(sweep.bodies, items, changed);
  return left;
}

/// Calls one(items, lanes) for all vectors of bodies. The last vector may be incomplete: the other
/// lanes repeat the last body.
template <class S, class One>
void for_each_vector_of(const std::uint32_t* items, std::size_t count, const One& one) {
  constexpr std::size_t kLanes = S::kLanes;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) one(items + i, (1u << kLanes) - 1);
  if (i == count) return;
  std::uint32_t last[kLanes];
  for (std::size_t k = 0; k < kLanes; ++k) last[k] = items[i + k < count ? i + k : count - 1];
  one(last, (1u << (count - i)) - 1);
}

template <class S>
void move_bodies(const BodySweep& sweep, const std::uint32_t* items, std::size_t count) {
  for_each_vector_of<S>(items, count, [&](const std::uint32_t* some, unsigned lanes) {
    move_lanes<S>(sweep, some, lanes);
  });
}

template <class S, bool kIsFree>
std::size_t accelerate_bodies(const BodySweep& sweep, const std::uint32_t* items, std::size_t count,
                              std::uint32_t* left) {
  std::size_t size = 0;
  for_each_vector_of<S>(items, count, [&](const std::uint32_t* some, unsigned lanes) {
    unsigned skipped = accelerate_lanes<S, kIsFree>(sweep, some, lanes);
    for (; skipped != 0; skipped &= skipped - 1) left[size++] = some[__builtin_ctz(skipped)];
  });
  return size;
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
