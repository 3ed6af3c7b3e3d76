/// Setup of bundles of manifolds from started rows, for any instruction set. The arithmetic is that
/// of RowSetup::fill(), operation by operation.
#include "src/contact_solver/soft_step/cpu/manifold_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/sweep_lanes.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Rows of a bundle, one in each lane. A lane without a row repeats the first one, and is not
/// stored.
template <class S, bool kFixed>
class StartedLanes {
 public:
  using Vec = typename S::Vec;
  using Mask = typename S::Mask;
  using Vectors = Vec3Lanes<S>;
  using Quads = QuadLanes<S>;
  static constexpr unsigned kLanes = S::kLanes;
  static_assert(kLanes == kBundle);

  StartedLanes(const ManifoldSetup& setup, std::size_t bundle)
      : setup_(setup),
        numbers_(setup.bundles.numbers + bundle),
        row_(setup.bundles.rows + bundle * (bundle_vector::kCount * kBundle)),
        first_of_bundle_(setup.bundles.first_point[bundle]),
        points_(setup.bundles.points + first_of_bundle_ * (bundle_point::kCount * kBundle)),
        most_(setup.bundles.first_point[bundle + 1] - setup.bundles.first_point[bundle]) {
    Real counts[kLanes];
    for (unsigned k = 0; k < kLanes; ++k) {
      const std::size_t number = bundle * kBundle + k;
      std::uint32_t numbers[4];  // a, b, first point, number of points
      const auto read = [&] {
        __builtin_memcpy(
            numbers,
            setup.rows + rows_[k] * manifold_row_offset::kStride + manifold_row_offset::kNumbers,
            sizeof numbers);
      };
      rows_[k] = static_cast<std::uint32_t>(number);
      read();
      if (numbers[3] > 0) {
        used_ |= 1u << k;
      } else {
        rows_[k] = static_cast<std::uint32_t>(bundle * kBundle);
        read();
      }
      std::uint32_t is_jointed = 0;
      __builtin_memcpy(
          &is_jointed,
          setup.rows + rows_[k] * manifold_row_offset::kStride + manifold_row_offset::kIsJointed,
          sizeof is_jointed);
      is_jointed_ |= is_jointed << k;
      a_[k] = numbers[0], b_[k] = numbers[1], first_[k] = numbers[2];
      last_[k] = numbers[2] + numbers[3] - 1;
      counts[k] = static_cast<Real>(numbers[3]);
    }
    counts_ = S::load(counts);
  }

  void complete() {
    const Vec zero = S::set(0), one = S::set(1);
    const Quads normal_quad = quad(manifold_row_offset::kNormal);
    const Vectors& normal = normal_quad.vector;
    const Basis basis(normal);
    const Mask is_of_spheres = S::less(zero, quad(manifold_row_offset::kTangent).scalar);
    const Vec mass_a = inverse_mass(a_);
    const Vec linear = kFixed ? mass_a : mass_a + inverse_mass(b_);
    const auto inertia_a = Mat3Lanes<S>::load(setup_.inverse_inertia, a_);
    const auto inertia_b = kFixed ? inertia_a : Mat3Lanes<S>::load(setup_.inverse_inertia, b_);
    const Mask is_locked = kFixed ? locks_rotation(inertia_a)
                                  : S::either(locks_rotation(inertia_a), locks_rotation(inertia_b));
    const Vec shared = linear * counts_;
    const auto lever = [&](const Vectors& arm_a, const Vectors& arm_b, const Vectors& u) {
      Lever result;
      result.turn_a = Vectors::cross(arm_a, u);
      result.turn_b = Vectors::cross(arm_b, u);
      result.spin_a = inertia_a * result.turn_a;
      result.spin_b = kFixed ? Vectors{zero, zero, zero} : inertia_b * result.turn_b;
      return result;
    };
    const auto turning = [](const Lever& u, const Lever& v) {
      return Vectors::dot(u.turn_a, v.spin_a) + Vectors::dot(u.turn_b, v.spin_b);
    };

    // RowSetup::FrictionPoints
    Point points[kMostPoints];
    Vec sum = zero;
    for (unsigned i = 0; i < most_; ++i) {
      points[i].load(*this, i);
      sum = S::select(has_point(i), sum + points[i].share, sum);
    }
    const Vec scale = one / sum;
    Vectors centre_a{zero, zero, zero}, centre_b = centre_a;
    for (unsigned i = 0; i < most_; ++i) {
      Point& p = points[i];
      p.share = S::select(is_of_spheres, one, p.share * scale);
      centre_a = Vectors::select(has_point(i), centre_a + p.arm_a * p.share, centre_a);
      centre_b = Vectors::select(has_point(i), centre_b + p.arm_b * p.share, centre_b);
    }
    Vectors friction{zero, zero, zero};
    Vec twist_impulse = zero, twist_arm = zero, spread = zero;
    for (unsigned i = 0; i < most_; ++i) {
      const Point& p = points[i];
      const Mask is_point = has_point(i);
      const Vectors arm = p.arm_a - centre_a;
      const Vec twist = Vectors::dot(Vectors::cross(arm, p.friction), normal);
      const Vec length2 = Vectors::dot(arm, arm), length = S::square_root(length2);
      spread = S::select(is_point, spread + length2 * p.share, spread);
      p.store_share(*this, i, arm);
      friction = Vectors::select(is_point, friction + p.friction, friction);
      twist_impulse = S::select(is_point, twist_impulse + twist, twist_impulse);
      twist_arm = S::select(is_point, twist_arm + length * p.share, twist_arm);
      const Lever along = lever(p.arm_a, p.arm_b, normal);
      const Vec response = linear + turning(along, along);
      const Mask is_shared = S::both(is_locked, S::less(response, shared));
      p.store(*this, i, along, one / S::select(is_shared, shared, response));
    }
    const Lever x = lever(centre_a, centre_b, basis.tangent);
    const Lever y = lever(centre_a, centre_b, basis.bitangent);

    // set_friction_masses()
    const Vec xx = linear + turning(x, x), yy = linear + turning(y, y), xy = turning(x, y);
    const Vec half = S::set(Real(0.5)), half_difference = (xx - yy) * half;
    const Vec slip_mass =
        one / ((xx + yy) * half + S::square_root(half_difference * half_difference + xy * xy));
    const Vec determinant = xx * yy - xy * xy;
    const Mask is_regular = S::less(S::set(setup_.least_determinant) * xx * yy, determinant);
    const Vec k = one / determinant;
    const Vectors masses{S::select(is_regular, yy * k, slip_mass),
                         S::select(is_regular, S::negate(xy) * k, zero),
                         S::select(is_regular, xx * k, slip_mass)};
    const Vectors twist_a = inertia_a * normal;
    const Vectors twist_b = kFixed ? Vectors{zero, zero, zero} : inertia_b * normal;
    const Vec twist = Vectors::dot(twist_a, normal) + Vectors::dot(twist_b, normal);
    const Vec twist_mass = S::select(S::less(zero, twist), one / twist, zero);
    const Vectors impulses{Vectors::dot(friction, basis.tangent),
                           Vectors::dot(friction, basis.bitangent), twist_impulse};

    // The row, for sweeps without a kernel and for RowSetup::store().
    store_quad({basis.tangent, twist_arm}, manifold_row_offset::kTangent);
    store_quad({basis.bitangent, twist_mass}, manifold_row_offset::kBitangent);
    x.store(*this, manifold_row_offset::kLeverX);
    y.store(*this, manifold_row_offset::kLeverY);
    store_quad({twist_a, twist_b.x}, manifold_row_offset::kTwist);
    store_quad({{twist_b.y, twist_b.z, masses.x}, masses.y}, manifold_row_offset::kTwist + 4);
    store_quad({impulses, masses.z}, manifold_row_offset::kFrictionImpulses);
    Quads rolling = quad(manifold_row_offset::kRolling);
    rolling.vector.x = slip_mass;
    store_quad(rolling, manifold_row_offset::kRolling);

    // The bundle.
    for (unsigned lane = 0; lane < kLanes; ++lane) {
      numbers_->a[lane] = a_[lane], numbers_->b[lane] = b_[lane];
    }
    numbers_->used = used_;
    numbers_->is_jointed = is_jointed_;
    numbers_->rolls =
        S::bits(S::either(S::less(zero, rolling.vector.y), S::less(zero, rolling.vector.z)));
    put(bundle_vector::kNormal, normal);
    put(bundle_vector::kFriction, normal_quad.scalar);
    put(bundle_vector::kTangent, basis.tangent);
    put(bundle_vector::kTwistArm, twist_arm);
    put(bundle_vector::kBitangent, basis.bitangent);
    put(bundle_vector::kTwistMass, twist_mass);
    x.put(*this, bundle_vector::kLeverX);
    y.put(*this, bundle_vector::kLeverY);
    put(bundle_vector::kTwistA, twist_a);
    put(bundle_vector::kTwistB, twist_b);
    put(bundle_vector::kMasses, masses);
    put(bundle_vector::kSlipMass, slip_mass);
    put(bundle_vector::kImpulses, impulses);
    put(bundle_vector::kPointCount, counts_);
    const Vec least = S::set(setup_.epsilon) * Vectors::dot(centre_a, centre_a);
    put(bundle_vector::kSpread, S::select(S::less(least, spread), spread, zero));
  }

  void unpack() const {
    const unsigned lanes = used_ & ~numbers_->rolls;
    const auto vector = [&](std::size_t k) { return S::load(row_ + k * kBundle); };
    using namespace bundle_vector;
    Quads{{vector(kImpulses), vector(kImpulses + 1), vector(kImpulses + 2)}, vector(kMasses + 2)}
        .store(setup_.rows + manifold_row_offset::kFrictionImpulses, manifold_row_offset::kStride,
               rows_, lanes);
    for (unsigned i = 0; i < most_; ++i) {
      const Real* const values = points_ + i * (bundle_point::kCount * kBundle);
      for (unsigned k = 0; k < kLanes; ++k) {
        const std::uint32_t point = first_[k] + i;
        if ((lanes >> k & 1) == 0 || point > last_[k]) continue;
        Real* const to = setup_.points + std::size_t{point} * kSweepStride;
        to[point_row_quad::kSpinA + 3] = values[bundle_point::kImpulse * kBundle + k];
        to[point_row_quad::kSpinB + 3] = values[bundle_point::kRebound * kBundle + k];
      }
    }
  }

 private:
  /// detail::contact_basis()
  struct Basis {
    Vectors tangent, bitangent;

    explicit Basis(const Vectors& n) {
      const Vec zero = S::set(0);
      const Mask is_x = S::less(S::absolute(n.y), S::absolute(n.x));
      const Vec other = S::select(is_x, n.x, n.y);
      const Vec k = S::set(1) / S::square_root(n.z * n.z + other * other);
      tangent = Vectors::select(is_x, {n.z * k, zero, S::negate(n.x) * k},
                                {zero, S::negate(n.z) * k, n.y * k});
      bitangent = Vectors::cross(n, tangent);
    }
  };

  struct Lever {
    Vectors turn_a, turn_b, spin_a, spin_b;

    void store(const StartedLanes& row, std::size_t offset) const {
      row.store_quad({turn_a, turn_b.x}, offset);
      row.store_quad({{turn_b.y, turn_b.z, spin_a.x}, spin_a.y}, offset + 4);
      row.store_quad({{spin_a.z, spin_b.x, spin_b.y}, spin_b.z}, offset + 8);
    }
    void put(const StartedLanes& row, std::size_t k) const {
      row.put(k, turn_a);
      row.put(k + 3, turn_b);
      row.put(k + 6, spin_a);
      row.put(k + 9, spin_b);
    }
  };

  /// Point i of each row.
  struct Point {
    Vectors arm_a, arm_b, friction;
    Vec distance, impulse;
    Vec share;  ///< first its weight

    void load(const StartedLanes& row, unsigned i) {
      std::uint32_t numbers[kLanes];
      row.point_numbers(i, numbers);
      const Quads q0 = row.point_quad(numbers, point_row_quad::kTurnA);
      const Quads q2 = row.point_quad(numbers, point_row_quad::kSpinA);
      arm_a = q0.vector, distance = q0.scalar;
      arm_b = row.point_quad(numbers, point_row_quad::kTurnB).vector;
      friction = q2.vector, impulse = q2.scalar;
      const Vec one = S::set(1), least = S::set(row.setup_.least_weight);
      const Vec weight = one - distance * S::set(row.setup_.inverse_friction_gap);
      share =
          S::select(S::less(one, weight), one, S::select(S::less(least, weight), weight, least));
    }
    /// @param arm from the centre of friction
    void store_share(const StartedLanes& row, unsigned i, const Vectors& arm) const {
      Real* const to =
          row.setup_.bundles.shares + (row.first_of_bundle_ + i) * (bundle_share::kCount * kBundle);
      const auto put = [to](std::size_t k, Vec v) { S::store(to + k * kBundle, v); };
      put(bundle_share::kArm, arm.x), put(bundle_share::kArm + 1, arm.y);
      put(bundle_share::kArm + 2, arm.z), put(bundle_share::kShare, share);
    }
    void store(const StartedLanes& row, unsigned i, const Lever& lever, Vec mass) const {
      std::uint32_t numbers[kLanes];
      row.point_numbers(i, numbers);
      const Vec rebound =
          S::load_column(row.setup_.points + point_row_quad::kSpinB + 3, kSweepStride, numbers);
      const auto write = [&](const Vectors& vector, Vec scalar, std::size_t offset) {
        Quads{vector, scalar}.store(row.setup_.points + offset, kSweepStride, numbers,
                                    row.used_ & S::bits(row.has_point(i)));
      };
      write(lever.turn_a, distance, point_row_quad::kTurnA);
      write(lever.turn_b, mass, point_row_quad::kTurnB);
      write(lever.spin_a, impulse, point_row_quad::kSpinA);
      write(lever.spin_b, rebound, point_row_quad::kSpinB);
      Real* const values = row.points_ + i * (bundle_point::kCount * kBundle);
      const auto put = [&](std::size_t k, Vec v) { S::store(values + k * kBundle, v); };
      const auto put_all = [&](std::size_t k, const Vectors& v) {
        put(k, v.x), put(k + 1, v.y), put(k + 2, v.z);
      };
      put_all(bundle_point::kTurnA, lever.turn_a);
      put_all(bundle_point::kTurnB, lever.turn_b);
      put_all(bundle_point::kSpinA, lever.spin_a);
      put_all(bundle_point::kSpinB, lever.spin_b);
      put(bundle_point::kDistance, distance);
      put(bundle_point::kMass, mass);
      put(bundle_point::kImpulse, impulse);
      put(bundle_point::kRebound, rebound);
    }
  };

  Mask has_point(unsigned i) const { return S::less(S::set(static_cast<Real>(i)), counts_); }
  void point_numbers(unsigned i, std::uint32_t* points) const {
    for (unsigned k = 0; k < kLanes; ++k) {
      points[k] = first_[k] + i < last_[k] ? first_[k] + i : last_[k];
    }
  }
  Quads quad(std::size_t offset) const {
    return Quads::load(setup_.rows + offset, manifold_row_offset::kStride, rows_);
  }
  void store_quad(const Quads& quads, std::size_t offset) const {
    quads.store(setup_.rows + offset, manifold_row_offset::kStride, rows_, used_);
  }
  Quads point_quad(const std::uint32_t* points, std::size_t offset) const {
    return Quads::load(setup_.points + offset, kSweepStride, points);
  }
  Vec inverse_mass(const std::uint32_t* bodies) const {
    return S::load_column(setup_.bodies + solver_body_quad::kVelocity + 3, kSweepStride, bodies);
  }
  void put(std::size_t k, Vec v) const { S::store(row_ + k * kBundle, v); }
  void put(std::size_t k, const Vectors& v) const { put(k, v.x), put(k + 1, v.y), put(k + 2, v.z); }

  const ManifoldSetup& setup_;
  BundleNumbers* numbers_;
  Real* row_;
  std::size_t first_of_bundle_;  ///< point
  Real* points_;
  unsigned most_;  ///< largest number of points
  unsigned used_ = 0, is_jointed_ = 0;
  std::uint32_t rows_[kLanes], a_[kLanes], b_[kLanes];
  std::uint32_t first_[kLanes], last_[kLanes];  ///< points
  Vec counts_;                                  ///< numbers of points
};

template <class S, bool kFixed>
void complete_manifolds(const ManifoldSetup& setup, std::size_t first, std::size_t last) {
  for (; first < last; ++first) StartedLanes<S, kFixed>(setup, first).complete();
}
/// RowSetup::store()
template <class S>
void keep_manifold(const ManifoldSetup& setup, std::size_t bundle, const KeptLanes& kept) {
  using Vec = typename S::Vec;
  using Vectors = Vec3Lanes<S>;
  using namespace bundle_vector;
  const BundleNumbers& numbers = setup.bundles.numbers[bundle];
  const Real* const row = setup.bundles.rows + bundle * (bundle_vector::kCount * kBundle);
  const auto vector = [row](std::size_t k) { return S::load(row + k * kBundle); };
  const auto vectors = [&](std::size_t k) {
    return Vectors{vector(k), vector(k + 1), vector(k + 2)};
  };
  const Vec zero = S::set(0), counts = vector(kPointCount), spread = vector(kSpread);
  const Vectors normal = vectors(kNormal), impulses = vectors(kImpulses);
  const Vectors friction = vectors(kTangent) * impulses.x + vectors(kBitangent) * impulses.y;
  const Vec twist = S::select(S::less(zero, spread), impulses.z / spread, zero);
  const Vec side = S::load(kept.side);
  const std::size_t first = setup.bundles.first_point[bundle];
  const std::size_t last = setup.bundles.first_point[bundle + 1];
  for (std::size_t point = first; point < last; ++point) {
    const Real* const values = setup.bundles.points + point * (bundle_point::kCount * kBundle);
    const Real* const shared = setup.bundles.shares + point * (bundle_share::kCount * kBundle);
    const auto share = [shared](std::size_t k) { return S::load(shared + k * kBundle); };
    using namespace bundle_share;
    const Vectors arm{share(kArm), share(kArm + 1), share(kArm + 2)};
    const Vectors of_point = (friction + Vectors::cross(normal, arm) * twist) * share(kShare);
    const Real* const normal_impulses = values + bundle_point::kImpulse * kBundle;
    const Real* const rebounds = values + bundle_point::kRebound * kBundle;
    unsigned released = 0;
    std::uint32_t items[kBundle];
    for (unsigned k = 0; k < kBundle; ++k) {
      const bool has_pushed = !__builtin_signbit(rebounds[k]);
      released |= !(normal_impulses[k] > 0) && has_pushed ? 1u << k : 0;
      items[k] = kept.first[k] + static_cast<std::uint32_t>(point - first);
    }
    const Vec impulse =
        S::select(S::mask_of(released), S::set(setup.released), S::load(normal_impulses));
    const auto has_point = S::less(S::set(static_cast<Real>(point - first)), counts);
    QuadLanes<S>{of_point * side, impulse}.store(
        kept.impulses, 4, items, numbers.used & ~numbers.rolls & S::bits(has_point));
  }
}
template <class S>
void unpack_manifolds(const ManifoldSetup& setup, std::size_t first, std::size_t last) {
  for (; first < last; ++first) StartedLanes<S, false>(setup, first).unpack();
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
