/// Sweeps over bundles of manifolds, for any instruction set. The arithmetic is that of
/// manifold_row.hpp, operation by operation.
#include "src/contact_solver/soft_step/cpu/manifold_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/sweep_lanes.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// The rows of a bundle, one in each lane.
template <class S, bool kFixed>
class ManifoldLanes {
 public:
  using Vec = typename S::Vec;
  using Mask = typename S::Mask;
  using Vectors = Vec3Lanes<S>;
  static constexpr unsigned kLanes = S::kLanes;
  static_assert(kLanes == kBundle);

  /// @param lanes one bit per row that is processed
  ManifoldLanes(const ManifoldSweep& sweep, std::size_t bundle, unsigned lanes)
      : sweep_(sweep),
        numbers_(sweep.bundles.numbers[bundle]),
        row_(sweep.bundles.rows + bundle * (bundle_vector::kCount * kBundle)),
        points_(sweep.bundles.points +
                sweep.bundles.first_point[bundle] * (bundle_point::kCount * kBundle)),
        most_(sweep.bundles.first_point[bundle + 1] - sweep.bundles.first_point[bundle]),
        rolls_(lanes & numbers_.used & numbers_.rolls),
        lanes_(lanes & numbers_.used & ~numbers_.rolls),
        mask_(S::mask_of(lanes_)),
        is_jointed_(S::mask_of(numbers_.is_jointed)),
        counts_(vector(bundle_vector::kPointCount)) {}

  /// @returns one bit per row with rolling or spinning friction. These rows are skipped.
  unsigned warm_start() {
    if (lanes_ == 0) return rolls_;
    load_velocities();
    const Vectors normal = vectors(bundle_vector::kNormal);
    for (unsigned i = 0; i < most_; ++i) {
      const PointLanes p(*this, i);
      const Vec impulse = p.get(bundle_point::kImpulse);
      apply(has_point(i), normal * impulse, p.vectors(bundle_point::kSpinA) * impulse,
            p.vectors(bundle_point::kSpinB) * impulse);
    }
    apply_friction(vectors(bundle_vector::kImpulses), mask_);
    store_velocities();
    return rolls_;
  }

  template <bool kUseBias>
  unsigned solve() {
    if (lanes_ == 0) return rolls_;
    load_velocities();
    const Vectors normal = vectors(bundle_vector::kNormal);
    Motion moved{body_quad(numbers_.a, solver_body_quad::kShift),
                 body_quad(numbers_.b, solver_body_quad::kShift),
                 body_quad(numbers_.a, solver_body_quad::kRotation),
                 body_quad(numbers_.b, solver_body_quad::kRotation)};
    unsigned projected = 0;
    const unsigned iterations = most_ > 1 && !kUseBias ? 2 : 1;
    for (unsigned k = 0; k < iterations; ++k) {
      const Mask iterates = k == 0 ? mask_ : S::both(mask_, S::less(S::set(1), counts_));
      for (unsigned i = 0; i < most_; ++i) {
        projected |= solve_normal<kUseBias>(normal, S::both(iterates, has_point(i)), i, &moved);
      }
      if constexpr (!kUseBias) {
        Vec pressure = S::set(0);
        for (unsigned i = 0; i < most_; ++i) {
          const Vec impulse = PointLanes(*this, i).get(bundle_point::kImpulse);
          pressure = S::select(has_point(i), pressure + impulse, pressure);
        }
        solve_friction(iterates, normal, pressure);
      }
    }
    store_velocities();
    if constexpr (kUseBias) {
      if (projected != 0) {
        store_body(moved.shift_a, numbers_.a, solver_body_quad::kShift, projected);
        store_body(moved.rotation_a, numbers_.a, solver_body_quad::kRotation, projected);
        if constexpr (!kFixed) {
          store_body(moved.shift_b, numbers_.b, solver_body_quad::kShift, projected);
          store_body(moved.rotation_b, numbers_.b, solver_body_quad::kRotation, projected);
        }
      }
    }
    return rolls_;
  }

 private:
  static constexpr unsigned kAll = (1u << kLanes) - 1;

  /// Motion of the bodies since the start of the step.
  struct Motion {
    Vectors shift_a, shift_b, rotation_a, rotation_b;
  };

  /// Point i of each row.
  struct PointLanes {
    Real* values;

    PointLanes(const ManifoldLanes& row, unsigned i)
        : values(row.points_ + i * (bundle_point::kCount * kBundle)) {}
    Vec get(std::size_t k) const { return S::load(values + k * kBundle); }
    void set(std::size_t k, Vec v) const { S::store(values + k * kBundle, v); }
    Vectors vectors(std::size_t k) const { return {get(k), get(k + 1), get(k + 2)}; }
  };

  /// Speed along a direction at a lever.
  /// @param lever first vector
  Vec speed(std::size_t lever, const Vectors& u) const {
    return Vectors::dot(body_a_.velocity.vector - body_b_.velocity.vector, u) +
           (Vectors::dot(vectors(lever), body_a_.angular_velocity.vector) -
            Vectors::dot(vectors(lever + 3), body_b_.angular_velocity.vector));
  }

  /// @param change x, y, twist
  void apply_friction(const Vectors& change, Mask mask) {
    using namespace bundle_vector;
    apply(mask, vectors(kTangent) * change.x + vectors(kBitangent) * change.y,
          (vectors(kLeverX + 6) * change.x + vectors(kLeverY + 6) * change.y) +
              vectors(kTwistA) * change.z,
          (vectors(kLeverX + 9) * change.x + vectors(kLeverY + 9) * change.y) +
              vectors(kTwistB) * change.z);
  }

  void solve_friction(Mask mask, const Vectors& normal, Vec pressure) {
    using namespace bundle_vector;
    const Vectors before = vectors(kImpulses);
    const Vectors masses = vectors(kMasses);
    const Vec xx = masses.x, xy = masses.y, yy = masses.z;
    const Vec limit = vector(kFriction) * pressure;
    const Vec vx = speed(kLeverX, vectors(kTangent)), vy = speed(kLeverY, vectors(kBitangent));
    Vec fx = before.x - (xx * vx + xy * vy), fy = before.y - (xy * vx + yy * vy);
    const Vec limit2 = limit * limit;
    const Mask slides = S::less(limit2, fx * fx + fy * fy);
    if (S::bits(slides) != 0) {
      const Vec slip_mass = vector(kSlipMass);
      const Vec sx = before.x - slip_mass * vx, sy = before.y - slip_mass * vy;
      const Vec size2 = sx * sx + sy * sy;
      const Mask exceeds = S::less(limit2, size2);
      const Vec k = limit / S::square_root(size2);
      fx = S::select(slides, S::select(exceeds, sx * k, sx), fx);
      fy = S::select(slides, S::select(exceeds, sy * k, sy), fy);
    }
    const Vec spin =
        Vectors::dot(body_a_.angular_velocity.vector - body_b_.angular_velocity.vector, normal);
    const Vec twist_limit = limit * vector(kTwistArm);
    const Vec wanted = before.z - vector(kTwistMass) * spin;
    const Vec twist = S::select(
        S::less(twist_limit, wanted), twist_limit,
        S::select(S::less(wanted, S::negate(twist_limit)), S::negate(twist_limit), wanted));
    apply_friction({fx - before.x, fy - before.y, twist - before.z}, mask);
    const Vectors now = Vectors::select(mask, {fx, fy, twist}, before);
    S::store(row_ + kImpulses * kBundle, now.x);
    S::store(row_ + (kImpulses + 1) * kBundle, now.y);
    S::store(row_ + (kImpulses + 2) * kBundle, now.z);
  }

  /// @param is_point lanes with point i
  /// @returns one bit per lane: whether the bodies were projected
  template <bool kUseBias>
  unsigned solve_normal(const Vectors& normal, Mask is_point, unsigned i, Motion* moved) {
    using namespace bundle_point;
    const PointLanes p(*this, i);
    const Vec zero = S::set(0);
    const Vec impulse = p.get(kImpulse);
    const Vectors turn_a = p.vectors(kTurnA), turn_b = p.vectors(kTurnB);
    const Vec change =
        Vectors::dot(moved->shift_a - moved->shift_b, normal) +
        (Vectors::dot(turn_a, moved->rotation_a) - Vectors::dot(turn_b, moved->rotation_b));
    const Vec separation = p.get(kDistance) + change;
    const Mask is_apart = S::less(zero, separation);
    Mask active = is_point;
    if constexpr (!kUseBias) {
      const Mask is_idle = S::both(is_apart, S::negate_mask(S::less(zero, impulse)));
      active = S::both(active, S::negate_mask(is_idle));
    }
    if (!S::any(active)) return 0;
    const auto bias = BiasLanes<S>::template of<kUseBias>(
        sweep_.constants, separation, is_apart, [this](Real SweepSoftness::*member) {
          return S::select(is_jointed_, S::set(sweep_.jointed_softness.*member),
                           S::set(sweep_.softness.*member));
        });
    const Vec closing = Vectors::dot(body_a_.velocity.vector - body_b_.velocity.vector, normal) +
                        (Vectors::dot(turn_a, body_a_.angular_velocity.vector) -
                         Vectors::dot(turn_b, body_b_.angular_velocity.vector));
    const Vec mass = p.get(kMass), rebound = p.get(kRebound);
    const Vec wanted = impulse + (S::negate(mass * bias.mass_scale) * (closing + bias.velocity) -
                                  bias.impulse_scale * impulse);
    const Mask pushes = S::less(zero, wanted);
    const Vec next = S::select(pushes, wanted, zero);
    const Vec along = next - impulse;
    const Vectors spin_a = p.vectors(kSpinA), spin_b = p.vectors(kSpinB);
    p.set(kImpulse, S::select(active, next, impulse));
    p.set(kRebound, S::select(S::both(active, pushes), S::absolute(rebound), rebound));
    apply(active, normal * along, spin_a * along, spin_b * along);
    if constexpr (kUseBias) {
      const Mask projects = S::both(active, S::less(zero, bias.projection));
      const unsigned bits = S::bits(projects) & ~numbers_.is_jointed;
      if (bits == 0) return 0;
      const Mask mask = S::mask_of(bits);
      const Vec size = bias.projection * mass;
      const Vectors push = normal * size;
      const auto project = [&](Vectors* value, const Vectors& to) {
        *value = Vectors::select(mask, to, *value);
      };
      project(&moved->shift_a, moved->shift_a + push * body_a_.velocity.scalar);
      project(&moved->rotation_a, moved->rotation_a + spin_a * size);
      if constexpr (!kFixed) {
        project(&moved->shift_b, moved->shift_b - push * body_b_.velocity.scalar);
        project(&moved->rotation_b, moved->rotation_b - spin_b * size);
      }
      return bits;
    }
    return 0;
  }

  /// Changes the velocities of the lanes of a mask.
  void apply(Mask mask, const Vectors& impulse, const Vectors& spin_a, const Vectors& spin_b) {
    const bool is_of_all = S::bits(mask) == kAll;
    const auto change = [&](Vectors* value, const Vectors& to) {
      *value = is_of_all ? to : Vectors::select(mask, to, *value);
    };
    change(&body_a_.velocity.vector, body_a_.velocity.vector + impulse * body_a_.velocity.scalar);
    change(&body_a_.angular_velocity.vector, body_a_.angular_velocity.vector + spin_a);
    if constexpr (!kFixed) {
      change(&body_b_.velocity.vector, body_b_.velocity.vector - impulse * body_b_.velocity.scalar);
      change(&body_b_.angular_velocity.vector, body_b_.angular_velocity.vector - spin_b);
    }
  }

  /// Whether the rows have more than i points.
  Mask has_point(unsigned i) const {
    return S::both(mask_, S::less(S::set(static_cast<Real>(i)), counts_));
  }
  Vec vector(std::size_t k) const { return S::load(row_ + k * kBundle); }
  Vectors vectors(std::size_t k) const { return {vector(k), vector(k + 1), vector(k + 2)}; }
  Vectors body_quad(const std::uint32_t* bodies, std::size_t offset) const {
    return QuadLanes<S>::load(sweep_.bodies + offset, kSweepStride, bodies).vector;
  }
  void store_body(const Vectors& vector, const std::uint32_t* bodies, std::size_t offset,
                  unsigned lanes) const {
    QuadLanes<S>{vector, S::set(0)}.store(sweep_.bodies + offset, kSweepStride, bodies, lanes);
  }
  void load_velocities() {
    body_a_ = BodyLanes<S>(sweep_.bodies, numbers_.a);
    body_b_ = BodyLanes<S>(sweep_.bodies, numbers_.b);
  }
  void store_velocities() const {
    body_a_.store(sweep_.bodies, numbers_.a, lanes_);
    if constexpr (!kFixed) body_b_.store(sweep_.bodies, numbers_.b, lanes_);
  }

  const ManifoldSweep& sweep_;
  const BundleNumbers& numbers_;
  Real* row_;
  Real* points_;
  unsigned most_;  ///< largest number of points
  unsigned rolls_, lanes_;
  Mask mask_;        ///< of lanes_
  Mask is_jointed_;  ///< of rows with a body that has joints
  Vec counts_;       ///< numbers of points
  BodyLanes<S> body_a_, body_b_;
};

/// Calls one(lanes) for all bundles of the rows [first, last). @returns as ManifoldSweepFunction
template <class S, bool kFixed, class One>
std::size_t for_each_manifold_bundle(const ManifoldSweep& sweep, std::size_t first,
                                     std::size_t last, std::uint32_t* left, const One& one) {
  return for_each_bundle(first, last, left, [&](std::size_t bundle, unsigned lanes) {
    ManifoldLanes<S, kFixed> rows(sweep, bundle, lanes);
    return one(&rows);
  });
}

template <class S, bool kFixed>
std::size_t warm_start_manifolds(const ManifoldSweep& sweep, std::size_t first, std::size_t last,
                                 std::uint32_t* left) {
  return for_each_manifold_bundle<S, kFixed>(sweep, first, last, left,
                                             [](auto* rows) { return rows->warm_start(); });
}

template <class S, bool kFixed, bool kUseBias>
std::size_t solve_manifolds(const ManifoldSweep& sweep, std::size_t first, std::size_t last,
                            std::uint32_t* left) {
  return for_each_manifold_bundle<S, kFixed>(
      sweep, first, last, left, [](auto* rows) { return rows->template solve<kUseBias>(); });
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
