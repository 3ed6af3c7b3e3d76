/// Kernels for rows of manifolds, for any instruction set. The arithmetic is that of
/// manifold_row.hpp, operation by operation.
#include "src/contact_solver/soft_step/cpu/manifold_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/sweep_lanes.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// The numbers in a row. @param k number of the row
struct ManifoldNumbers {
  std::uint32_t a, b, first, count;
  ManifoldNumbers(const ManifoldSweep& sweep, std::size_t k) {
    std::uint32_t numbers[4];
    __builtin_memcpy(numbers,
                     sweep.rows + k * manifold_row_offset::kStride + manifold_row_offset::kNumbers,
                     sizeof numbers);
    a = numbers[0], b = numbers[1], first = numbers[2], count = numbers[3];
  }
};

/// Several rows of manifolds, one in each lane.
template <class S, bool kFixed>
class ManifoldLanes {
 public:
  using Vec = typename S::Vec;
  using Mask = typename S::Mask;
  using Vectors = Vec3Lanes<S>;
  using Quads = QuadLanes<S>;
  static constexpr unsigned kLanes = S::kLanes;

  /// @param count number of rows; the other lanes repeat the last row and are not stored
  ManifoldLanes(const ManifoldSweep& sweep, std::size_t first, unsigned count)
      : sweep_(sweep), used_((1u << count) - 1) {
    Real counts[kLanes];
    for (unsigned k = 0; k < kLanes; ++k) {
      rows_[k] = static_cast<std::uint32_t>(first) + (k < count ? k : count - 1);
      const ManifoldNumbers row(sweep, rows_[k]);
      a_[k] = row.a, b_[k] = row.b, first_[k] = row.first, last_[k] = row.first + row.count - 1;
      counts[k] = static_cast<Real>(row.count);
      if (row.count > most_) most_ = row.count;
    }
    counts_ = S::load(counts);
  }

  /// @returns one bit per lane: whether the row has rolling or spinning friction. These rows are
  /// skipped.
  unsigned warm_start() {
    const unsigned rolls = rolling_rows();
    const unsigned lanes = used_ & ~rolls;
    if (lanes == 0) return rolls;
    load_velocities();
    const Quads normal = quad(manifold_row_offset::kNormal);
    for (unsigned i = 0; i < most_; ++i) {
      std::uint32_t points[kLanes];
      point_numbers(i, points);
      const Mask has_point = S::less(S::set(static_cast<Real>(i)), counts_);
      const Quads a = point_quad(points, point_row_quad::kSpinA);
      const Quads b = kFixed ? a : point_quad(points, point_row_quad::kSpinB);
      const Vec impulse = a.scalar;
      apply(has_point, normal.vector * impulse, a.vector * impulse, b.vector * impulse);
    }
    FrictionLanes friction(*this);
    friction.apply(this, friction.impulses.vector);
    store_velocities(lanes);
    return rolls;
  }

  template <bool kUseBias>
  unsigned solve() {
    const unsigned rolls = rolling_rows();
    const unsigned lanes = used_ & ~rolls;
    if (lanes == 0) return rolls;
    load_velocities();
    const Quads normal = quad(manifold_row_offset::kNormal);
    PointLanes points[kMostPoints];
    for (unsigned i = 0; i < most_; ++i) points[i].load(*this, i);
    Vectors shift_a = body_quad(a_, solver_body_quad::kShift).vector;
    Vectors shift_b = body_quad(b_, solver_body_quad::kShift).vector;
    Vectors rotation_a = body_quad(a_, solver_body_quad::kRotation).vector;
    Vectors rotation_b = body_quad(b_, solver_body_quad::kRotation).vector;
    unsigned projected = 0;
    FrictionLanes friction;
    if constexpr (!kUseBias) friction = FrictionLanes(*this);

    const unsigned iterations = most_ > 1 && !kUseBias ? 2 : 1;
    for (unsigned k = 0; k < iterations; ++k) {
      const Mask iterates = k == 0 ? S::always() : S::less(S::set(1), counts_);
      for (unsigned i = 0; i < most_; ++i) {
        PointLanes& p = points[i];
        const Mask has_point = S::both(iterates, S::less(S::set(static_cast<Real>(i)), counts_));
        const Vec moved = Vectors::dot(shift_a - shift_b, normal.vector) +
                          (Vectors::dot(p.turn_a, rotation_a) - Vectors::dot(p.turn_b, rotation_b));
        const Vec separation = p.distance + moved;
        projected |= solve_normal<kUseBias>(normal.vector, separation, has_point, &p, &shift_a,
                                            &shift_b, &rotation_a, &rotation_b);
      }
      if constexpr (!kUseBias) {
        Vec pressure = S::set(0);
        for (unsigned i = 0; i < most_; ++i) {
          const Mask has_point = S::less(S::set(static_cast<Real>(i)), counts_);
          pressure = S::select(has_point, pressure + points[i].impulse, pressure);
        }
        friction.solve(this, iterates, normal, pressure);
      }
    }
    for (unsigned i = 0; i < most_; ++i) points[i].store(*this, i, lanes);
    if constexpr (!kUseBias) friction.store(*this, lanes);
    store_velocities(lanes);
    if constexpr (kUseBias) {
      projected &= lanes;
      if (projected != 0) {
        store_body(shift_a, a_, solver_body_quad::kShift, projected);
        store_body(rotation_a, a_, solver_body_quad::kRotation, projected);
        if constexpr (!kFixed) {
          store_body(shift_b, b_, solver_body_quad::kShift, projected);
          store_body(rotation_b, b_, solver_body_quad::kRotation, projected);
        }
      }
    }
    return rolls;
  }

 private:
  static constexpr unsigned kAll = (1u << kLanes) - 1;

  /// Point i of each row.
  struct PointLanes {
    Vectors turn_a, turn_b, spin_a, spin_b;
    Vec distance, mass, impulse, rebound;

    void load(const ManifoldLanes& row, unsigned i) {
      std::uint32_t points[kLanes];
      row.point_numbers(i, points);
      const Quads q0 = row.point_quad(points, point_row_quad::kTurnA);
      const Quads q1 = row.point_quad(points, point_row_quad::kTurnB);
      const Quads q2 = row.point_quad(points, point_row_quad::kSpinA);
      const Quads q3 = row.point_quad(points, point_row_quad::kSpinB);
      turn_a = q0.vector, distance = q0.scalar;
      turn_b = q1.vector, mass = q1.scalar;
      spin_a = q2.vector, impulse = q2.scalar;
      spin_b = q3.vector, rebound = q3.scalar;
    }
    void store(const ManifoldLanes& row, unsigned i, unsigned lanes) const {
      Real impulses[kLanes], rebounds[kLanes];
      S::store(impulses, impulse);
      S::store(rebounds, rebound);
      for (unsigned k = 0; k < kLanes; ++k) {
        const std::uint32_t point = row.first_[k] + i;
        if ((lanes >> k & 1) == 0 || point > row.last_[k]) continue;
        Real* const values = row.sweep_.points + std::size_t{point} * kSweepStride;
        values[point_row_quad::kSpinA + 3] = impulses[k];
        values[point_row_quad::kSpinB + 3] = rebounds[k];
      }
    }
  };

  struct LeverLanes {
    Vectors turn_a, turn_b, spin_a, spin_b;

    void load(const ManifoldLanes& row, std::size_t offset) {
      const Quads q0 = row.quad(offset), q1 = row.quad(offset + 4), q2 = row.quad(offset + 8);
      turn_a = q0.vector;
      turn_b = {q0.scalar, q1.vector.x, q1.vector.y};
      spin_a = {q1.vector.z, q1.scalar, q2.vector.x};
      spin_b = {q2.vector.y, q2.vector.z, q2.scalar};
    }
    Vec speed(const ManifoldLanes& row, const Vectors& u) const {
      return Vectors::dot(row.body_a_.velocity.vector - row.body_b_.velocity.vector, u) +
             (Vectors::dot(turn_a, row.body_a_.angular_velocity.vector) -
              Vectors::dot(turn_b, row.body_b_.angular_velocity.vector));
    }
  };

  /// Friction of each row.
  struct FrictionLanes {
    Quads tangent, bitangent, impulses;  ///< impulses: x, y, twist, then the mass yy
    LeverLanes x, y;
    Vectors twist_a, twist_b;
    Vec xx, xy, slip_mass;

    FrictionLanes() = default;
    explicit FrictionLanes(const ManifoldLanes& row)
        : tangent(row.quad(manifold_row_offset::kTangent)),
          bitangent(row.quad(manifold_row_offset::kBitangent)),
          impulses(row.quad(manifold_row_offset::kFrictionImpulses)),
          slip_mass(S::load_column(row.sweep_.rows + manifold_row_offset::kRolling,
                                   manifold_row_offset::kStride, row.rows_)) {
      x.load(row, manifold_row_offset::kLeverX);
      y.load(row, manifold_row_offset::kLeverY);
      const Quads q0 = row.quad(manifold_row_offset::kTwist);
      const Quads q1 = row.quad(manifold_row_offset::kTwist + 4);
      twist_a = q0.vector;
      twist_b = {q0.scalar, q1.vector.x, q1.vector.y};
      xx = q1.vector.z, xy = q1.scalar;
    }

    /// @param change x, y, twist
    void apply(ManifoldLanes* row, const Vectors& change, Mask mask = S::always()) const {
      row->apply(mask, tangent.vector * change.x + bitangent.vector * change.y,
                 (x.spin_a * change.x + y.spin_a * change.y) + twist_a * change.z,
                 (x.spin_b * change.x + y.spin_b * change.y) + twist_b * change.z);
    }

    void solve(ManifoldLanes* row, Mask mask, const Quads& normal, Vec pressure) {
      const Vectors before = impulses.vector;
      const Vec yy = impulses.scalar;
      const Vec limit = normal.scalar * pressure;
      const Vec vx = x.speed(*row, tangent.vector), vy = y.speed(*row, bitangent.vector);
      Vec fx = before.x - (xx * vx + xy * vy), fy = before.y - (xy * vx + yy * vy);
      const Vec limit2 = limit * limit;
      const Mask slides = S::less(limit2, fx * fx + fy * fy);
      if (S::bits(slides) != 0) {
        const Vec sx = before.x - slip_mass * vx, sy = before.y - slip_mass * vy;
        const Vec size2 = sx * sx + sy * sy;
        const Mask exceeds = S::less(limit2, size2);
        const Vec k = limit / S::square_root(size2);
        fx = S::select(slides, S::select(exceeds, sx * k, sx), fx);
        fy = S::select(slides, S::select(exceeds, sy * k, sy), fy);
      }
      const Vec spin =
          Vectors::dot(row->body_a_.angular_velocity.vector - row->body_b_.angular_velocity.vector,
                       normal.vector);
      const Vec twist_limit = limit * tangent.scalar;
      const Vec wanted = before.z - bitangent.scalar * spin;
      const Vec twist = S::select(
          S::less(twist_limit, wanted), twist_limit,
          S::select(S::less(wanted, S::negate(twist_limit)), S::negate(twist_limit), wanted));
      apply(row, {fx - before.x, fy - before.y, twist - before.z}, mask);
      impulses.vector = Vectors::select(mask, {fx, fy, twist}, before);
    }

    void store(const ManifoldLanes& row, unsigned lanes) const {
      impulses.store(row.sweep_.rows + manifold_row_offset::kFrictionImpulses,
                     manifold_row_offset::kStride, row.rows_, lanes);
    }
  };

  /// @returns one bit per lane: whether the bodies were projected
  template <bool kUseBias>
  unsigned solve_normal(const Vectors& normal, Vec separation, Mask has_point, PointLanes* point,
                        Vectors* shift_a, Vectors* shift_b, Vectors* rotation_a,
                        Vectors* rotation_b) {
    const Vec zero = S::set(0);
    PointLanes& p = *point;
    const Mask is_apart = S::less(zero, separation);
    Mask active = has_point;
    if constexpr (!kUseBias) {
      const Mask is_idle = S::both(is_apart, S::negate_mask(S::less(zero, p.impulse)));
      active = S::both(active, S::negate_mask(is_idle));
    }
    if (!S::any(active)) return 0;
    const auto bias = BiasLanes<S>::template of<kUseBias>(
        sweep_.constants, separation, is_apart,
        [this](Real SweepSoftness::*member) { return S::set(sweep_.softness.*member); });
    const Vec closing = Vectors::dot(body_a_.velocity.vector - body_b_.velocity.vector, normal) +
                        (Vectors::dot(p.turn_a, body_a_.angular_velocity.vector) -
                         Vectors::dot(p.turn_b, body_b_.angular_velocity.vector));
    const Vec change = S::negate(p.mass * bias.mass_scale) * (closing + bias.velocity) -
                       bias.impulse_scale * p.impulse;
    const Vec wanted = p.impulse + change;
    const Mask pushes = S::less(zero, wanted);
    const Vec impulse = S::select(pushes, wanted, zero);
    const Vec along = impulse - p.impulse;
    p.impulse = S::select(active, impulse, p.impulse);
    p.rebound = S::select(S::both(active, pushes), S::absolute(p.rebound), p.rebound);
    apply(active, normal * along, p.spin_a * along, p.spin_b * along);
    if constexpr (kUseBias) {
      const Mask projects = S::both(active, S::less(zero, bias.projection));
      const unsigned bits = S::bits(projects);
      if (bits == 0) return 0;
      const Vec size = bias.projection * p.mass;
      const Vectors push = normal * size;
      *shift_a = Vectors::select(projects, *shift_a + push * body_a_.velocity.scalar, *shift_a);
      *rotation_a = Vectors::select(projects, *rotation_a + p.spin_a * size, *rotation_a);
      if constexpr (!kFixed) {
        *shift_b = Vectors::select(projects, *shift_b - push * body_b_.velocity.scalar, *shift_b);
        *rotation_b = Vectors::select(projects, *rotation_b - p.spin_b * size, *rotation_b);
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

  unsigned rolling_rows() const {
    const Quads q = quad(manifold_row_offset::kRolling);
    const Vec zero = S::set(0);
    return used_ & S::bits(S::either(S::less(zero, q.vector.y), S::less(zero, q.vector.z)));
  }
  void point_numbers(unsigned i, std::uint32_t* points) const {
    for (unsigned k = 0; k < kLanes; ++k) {
      points[k] = first_[k] + i < last_[k] ? first_[k] + i : last_[k];
    }
  }
  Quads quad(std::size_t offset) const {
    return Quads::load(sweep_.rows + offset, manifold_row_offset::kStride, rows_);
  }
  Quads point_quad(const std::uint32_t* points, std::size_t offset) const {
    return Quads::load(sweep_.points + offset, kSweepStride, points);
  }
  Quads body_quad(const std::uint32_t* bodies, std::size_t offset) const {
    return Quads::load(sweep_.bodies + offset, kSweepStride, bodies);
  }
  void store_body(const Vectors& vector, const std::uint32_t* bodies, std::size_t offset,
                  unsigned lanes) const {
    Quads{vector, S::set(0)}.store(sweep_.bodies + offset, kSweepStride, bodies, lanes);
  }
  void load_velocities() {
    body_a_ = BodyLanes<S>(sweep_.bodies, a_);
    body_b_ = BodyLanes<S>(sweep_.bodies, b_);
  }
  void store_velocities(unsigned lanes) const {
    body_a_.store(sweep_.bodies, a_, lanes);
    if constexpr (!kFixed) body_b_.store(sweep_.bodies, b_, lanes);
  }

  const ManifoldSweep& sweep_;
  unsigned used_;      ///< one bit per lane with a row
  unsigned most_ = 0;  ///< largest number of points
  std::uint32_t rows_[kLanes], a_[kLanes], b_[kLanes];
  std::uint32_t first_[kLanes], last_[kLanes];  ///< points
  Vec counts_;                                  ///< numbers of points
  BodyLanes<S> body_a_, body_b_;
};

/// Calls one(lanes) for all vectors of rows. @returns as ManifoldSweepFunction
template <class S, bool kFixed, class One>
std::size_t for_each_vector(const ManifoldSweep& sweep, std::size_t first, std::size_t last,
                            std::uint32_t* left, const One& one) {
  return for_each_vector<S::kLanes>(first, last, left, [&](std::size_t i, unsigned rows) {
    ManifoldLanes<S, kFixed> lanes(sweep, i, rows);
    return one(&lanes);
  });
}

template <class S, bool kFixed>
std::size_t warm_start_manifolds(const ManifoldSweep& sweep, std::size_t first, std::size_t last,
                                 std::uint32_t* left) {
  return for_each_vector<S, kFixed>(sweep, first, last, left,
                                    [](auto* lanes) { return lanes->warm_start(); });
}

template <class S, bool kFixed, bool kUseBias>
std::size_t solve_manifolds(const ManifoldSweep& sweep, std::size_t first, std::size_t last,
                            std::uint32_t* left) {
  return for_each_vector<S, kFixed>(sweep, first, last, left,
                                    [](auto* lanes) { return lanes->template solve<kUseBias>(); });
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
