/// Kernels for rows of two spheres, for any instruction set. The arithmetic is that of
/// sphere_row.hpp, operation by operation.
#include "src/base/prefetch.hpp"
#include "src/contact_solver/soft_step/cpu/sphere_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/sweep_lanes.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// The bodies of a row. @param k number of the row
struct RowBodies {
  std::uint32_t a, b;
  RowBodies(const SphereSweep& sweep, std::size_t k) {
    std::uint32_t bodies[2];
    __builtin_memcpy(bodies, sweep.rows + k * kSweepStride + sphere_row_quad::kBodies,
                     sizeof bodies);
    a = bodies[0];
    b = bodies[1];
  }
};

template <class S>
class RowLanes {
 public:
  using Vec = typename S::Vec;
  using Vectors = Vec3Lanes<S>;
  using Quads = QuadLanes<S>;
  static constexpr unsigned kLanes = S::kLanes;

  /// @param count number of rows; the other lanes repeat the last row and are not stored
  RowLanes(const SphereSweep& sweep, std::size_t first, unsigned count)
      : sweep_(sweep), used_((1u << count) - 1) {
    for (unsigned k = 0; k < kLanes; ++k) {
      rows_[k] = static_cast<std::uint32_t>(first) + (k < count ? k : count - 1);
      const RowBodies row(sweep, rows_[k]);
      a_[k] = row.a;
      b_[k] = row.b;
    }
  }

  void warm_start() const {
    const Quads impulses = quad(sphere_row_quad::kImpulses);
    const Quads normal = quad(sphere_row_quad::kNormal), arms = quad(sphere_row_quad::kFriction);
    BodyLanes<S> a(sweep_.bodies, a_), b(sweep_.bodies, b_);
    apply(normal.vector, arms.vector,
          normal.vector * S::absolute(impulses.scalar) + impulses.vector, impulses.vector, &a, &b);
    a.store(sweep_.bodies, a_, used_);
    b.store(sweep_.bodies, b_, used_);
  }

  /// @returns one bit per lane: whether the bodies may rebound. These rows are skipped.
  template <bool kUseBias>
  unsigned solve() const {
    const Vec zero = S::set(0);
    Quads impulses = quad(sphere_row_quad::kImpulses);
    const Quads normal_distance = quad(sphere_row_quad::kNormal);
    const Quads friction_arms = quad(sphere_row_quad::kFriction);
    const Vectors& normal = normal_distance.vector;
    const Vec friction_coefficient = friction_arms.vector.x, normal_mass = friction_arms.scalar;
    const Vec arm_a = friction_arms.vector.y, arm_b = friction_arms.vector.z;
    const Vec tangent_mass =
        S::load_column(sweep_.rows + sphere_row_quad::kTangentMass, kSweepStride, rows_);
    const Vec impulse_before = S::absolute(impulses.scalar);
    BodyLanes<S> a(sweep_.bodies, a_), b(sweep_.bodies, b_);
    Quads shift_a = Quads::load(sweep_.bodies + solver_body_quad::kShift, kSweepStride, a_);
    Quads shift_b = Quads::load(sweep_.bodies + solver_body_quad::kShift, kSweepStride, b_);

    const Vec separation =
        normal_distance.scalar + Vectors::dot(shift_a.vector - shift_b.vector, normal);
    const typename S::Mask is_apart = S::less(zero, separation);
    unsigned lanes = used_;
    if constexpr (!kUseBias) {
      lanes &= ~(S::bits(is_apart) & ~S::bits(S::less(zero, impulse_before)));
    }
    const Vectors spin = a.angular_velocity.vector * arm_a + b.angular_velocity.vector * arm_b;
    const Vectors velocity = (a.velocity.vector - b.velocity.vector) - Vectors::cross(spin, normal);
    const Vec closing = Vectors::dot(velocity, normal);
    const Vec left = S::set(kUseBias ? sweep_.constants.h : Real(0));
    const unsigned may_rebound = lanes &
                                 S::bits(S::less(closing, S::set(-sweep_.restitution_threshold))) &
                                 S::bits(S::less_equal(separation + closing * left, zero));
    lanes &= ~may_rebound;
    if (lanes == 0) return may_rebound;

    const Vec radius = S::select(S::less(arm_a, arm_b), arm_a, arm_b);
    const typename S::Mask is_deep =
        S::less(S::set(sweep_.deep_penetration) * radius, S::negate(separation));
    const auto bias = BiasLanes<S>::template of<kUseBias>(
        sweep_.constants, separation, is_apart, [&](Real SweepSoftness::*member) {
          return S::select(is_deep, S::set(sweep_.deep_balls.*member),
                           S::set(sweep_.balls.*member));
        });

    Vectors friction = impulses.vector - (velocity - normal * closing) * tangent_mass;
    const Vec limit = friction_coefficient * impulse_before;
    const Vec size2 = Vectors::dot(friction, friction);
    const typename S::Mask slides = S::less(limit * limit, size2);
    if (S::bits(slides) != 0) {
      friction = Vectors::select(slides, friction * (limit / S::square_root(size2)), friction);
    }
    const Vectors tangential = friction - impulses.vector;
    const Vec change = S::negate(normal_mass * bias.mass_scale) * (closing + bias.velocity) -
                       bias.impulse_scale * impulse_before;
    const Vec wanted = impulse_before + change;
    const typename S::Mask pushes = S::less(zero, wanted);
    const Vec along = S::select(pushes, wanted, zero) - impulse_before;
    impulses = {friction, S::select(pushes, wanted, S::zero_with_sign_of(impulses.scalar))};
    apply(normal, friction_arms.vector, normal * along + tangential, tangential, &a, &b);

    impulses.store(sweep_.rows + sphere_row_quad::kImpulses, kSweepStride, rows_, lanes);
    a.store(sweep_.bodies, a_, lanes);
    b.store(sweep_.bodies, b_, lanes);
    if constexpr (kUseBias) {
      const unsigned projects = lanes & S::bits(S::less(zero, bias.projection));
      if (projects == 0) return may_rebound;
      const Vectors impulse = normal * (bias.projection * normal_mass);
      shift_a.vector = shift_a.vector + impulse * a.velocity.scalar;
      shift_b.vector = shift_b.vector - impulse * b.velocity.scalar;
      shift_a.store(sweep_.bodies + solver_body_quad::kShift, kSweepStride, a_, projects);
      shift_b.store(sweep_.bodies + solver_body_quad::kShift, kSweepStride, b_, projects);
    }
    return may_rebound;
  }

 private:
  Quads quad(std::size_t offset) const {
    return Quads::load(sweep_.rows + offset, kSweepStride, rows_);
  }

  /// @param arms in y and z
  static void apply(const Vectors& normal, const Vectors& arms, const Vectors& impulse,
                    const Vectors& tangential, BodyLanes<S>* a, BodyLanes<S>* b) {
    const Vectors twist = Vectors::cross(tangential, normal);
    a->velocity.vector = a->velocity.vector + impulse * a->velocity.scalar;
    a->angular_velocity.vector =
        a->angular_velocity.vector + twist * (arms.y * a->angular_velocity.scalar);
    b->velocity.vector = b->velocity.vector - impulse * b->velocity.scalar;
    b->angular_velocity.vector =
        b->angular_velocity.vector + twist * (arms.z * b->angular_velocity.scalar);
  }

  const SphereSweep& sweep_;
  unsigned used_;  ///< one bit per lane with a row
  std::uint32_t rows_[kLanes], a_[kLanes], b_[kLanes];
};

/// Prefetches the bodies of at most `count` rows, which other threads may have written in the last
/// color.
void prefetch_bodies(const SphereSweep& sweep, std::size_t first, std::size_t count,
                     std::size_t last) {
  for (std::size_t k = first; k < first + count && k < last; ++k) {
    const RowBodies row(sweep, k);
    prefetch_for_write(sweep.bodies + row.a * kSweepStride);
    prefetch_for_write(sweep.bodies + row.b * kSweepStride);
  }
}

/// Calls one(lanes) for all vectors of rows. @returns as SphereSweepFunction
template <class S, class One>
std::size_t for_each_vector(const SphereSweep& sweep, std::size_t first, std::size_t last,
                            std::uint32_t* left, const One& one) {
  constexpr std::size_t kAhead = 2 * S::kLanes;  // some hundred nanoseconds
  prefetch_bodies(sweep, first, kAhead, last);
  return for_each_vector<S::kLanes>(first, last, left, [&](std::size_t i, unsigned rows) {
    prefetch_bodies(sweep, i + kAhead, S::kLanes, last);
    return one(RowLanes<S>(sweep, i, rows));
  });
}

template <class S>
std::size_t warm_start(const SphereSweep& sweep, std::size_t first, std::size_t last,
                       std::uint32_t* left) {
  return for_each_vector<S>(sweep, first, last, left, [](const RowLanes<S>& lanes) {
    lanes.warm_start();
    return 0u;
  });
}

template <class S, bool kUseBias>
std::size_t solve(const SphereSweep& sweep, std::size_t first, std::size_t last,
                  std::uint32_t* left) {
  return for_each_vector<S>(sweep, first, last, left, [](const RowLanes<S>& lanes) {
    return lanes.template solve<kUseBias>();
  });
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
