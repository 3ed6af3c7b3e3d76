/// Sweeps over bundles of joints with frames, for any instruction set. The arithmetic is that of
/// frame_row.hpp, operation by operation; functions have the names that they have there.
#include "src/contact_solver/soft_step/cpu/frame_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/sweep_lanes.inl"

#include <array>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// The rows of a bundle, one in each lane.
/// @tparam kHasAxes whether any row is not plain
template <class S, bool kFixed, bool kHasAxes>
class FrameLanes {
 public:
  using Vec = typename S::Vec;
  using Mask = typename S::Mask;
  using Vectors = Vec3Lanes<S>;
  using Matrix = Mat3Lanes<S>;
  using Orientation = OrientationLanes<S>;
  static constexpr unsigned kLanes = S::kLanes;
  static_assert(kLanes == kBundle);

  /// @param lanes one bit per row that is processed
  FrameLanes(const FrameSweep& sweep, std::size_t bundle, unsigned lanes)
      : sweep_(sweep),
        numbers_(sweep.numbers[bundle]),
        row_(sweep.rows + bundle * (frame_vector::kCount * kBundle)),
        lanes_(lanes),
        mask_(S::mask_of(lanes_)) {}

  void start() {
    const auto body_a = BodyLanes<S>(sweep_.bodies, numbers_.a);
    if constexpr (kFixed) {
      start(body_a.angular_velocity.scalar, S::set(0));
    } else {
      const auto body_b = BodyLanes<S>(sweep_.bodies, numbers_.b);
      start(body_a.angular_velocity.scalar, body_b.angular_velocity.scalar);
    }
  }

  void warm_start() {
    load_velocities();
    load_sums();
    apply(mask_, impulse_, spun_a_, spun_b_);
    store_velocities();
  }

  /// @param starts whether it is the first sweep of a substep
  template <bool kUseBias>
  void solve(bool starts) {
    load_bodies();
    load_sums();
    if constexpr (!kUseBias) {  // the bodies have moved
      start(a_.angular_velocity.scalar, b_.angular_velocity.scalar);
      put(frame_vector::kTurnedA, rotation_a_.vector);
      if constexpr (!kFixed) put(frame_vector::kTurnedB, rotation_b_.vector);
    }
    inertia_a_ = matrix(frame_vector::kInertiaA);
    if constexpr (!kFixed) inertia_b_ = matrix(frame_vector::kInertiaB);
    set_pose();
    set_responses();
    if (starts) turn_impulse();
    if constexpr (kHasAxes) {
      const auto locked = locked_angular();
      const Mask has_locked = S::either(S::either(locked[0], locked[1]), locked[2]);
      const Mask has_points = S::both(mask_, S::negate_mask(has_locked));
      const Mask has_motor = S::both(mask_, S::mask_of(numbers_.has_motor));
      const Mask has_friction = S::both(mask_, S::mask_of(numbers_.has_friction));
      const Mask has_limits = S::both(mask_, S::mask_of(numbers_.has_limits));
      const Mask has_cone = S::both(mask_, S::mask_of(numbers_.has_cone));
      if (S::any(has_points)) solve_points<kUseBias>(has_points);
      const Mask has_block = S::both(mask_, has_locked);
      if (S::any(has_block)) solve_block<kUseBias>(has_block);
      if (lanes_sprung() != 0) solve_springs();
      if (S::any(has_motor)) solve_motor(has_motor);
      if (S::any(has_friction)) solve_friction(has_friction);
      if (S::any(has_limits)) solve_limits<kUseBias>(has_limits);
      if (S::any(has_cone)) solve_cone<kUseBias>(has_cone);
      if (kUseBias && S::any(has_block)) project_locked(has_block);
    } else {
      solve_points<kUseBias>(mask_);
    }
    if constexpr (kUseBias) project(bounded(offset_) + moved_);
    put(frame_vector::kImpulse, impulse_);
    put(frame_vector::kSpunA, spun_a_);
    if constexpr (!kFixed) put(frame_vector::kSpunB, spun_b_);
    store_velocities();
    if constexpr (kUseBias) store_motion();
  }

 private:
  static constexpr unsigned kAll = (1u << kLanes) - 1;
  static Vectors zeros() { return {S::set(0), S::set(0), S::set(0)}; }
  static Vec one() { return S::set(1); }
  Vec tiny() const { return S::set(16 * sweep_.epsilon); }
  static Vec square(const Vectors& v) { return Vectors::dot(v, v); }
  static Mask greater(Vec a, Vec b) { return S::less(b, a); }
  /// Of vectors of the frame and of the base, from those of bodies a and b, and the reverse.
  Vectors of_frame(const Vectors& a, const Vectors& b) const {
    return kFixed ? Vectors::select(is_flipped(), b, a) : a;
  }
  Vectors of_base(const Vectors& a, const Vectors& b) const {
    return kFixed ? Vectors::select(is_flipped(), a, b) : b;
  }
  Vectors flipped(const Vectors& v) const {
    return kFixed ? Vectors::select(is_flipped(), v.negated(), v) : v;
  }
  Mask is_flipped() const { return S::mask_of(numbers_.is_flipped); }

  /// Computes the vectors that depend on the orientations of the bodies.
  /// @param inverse_inertia_a, inverse_inertia_b of isotropic bodies, otherwise 0
  void start(Vec inverse_inertia_a, Vec inverse_inertia_b) {
    using namespace frame_vector;
    start_body(numbers_.a, inverse_inertia_a, {kOrientationA, kAnchorA, kArmA, kInertiaA}, 0);
    start_body(numbers_.b, inverse_inertia_b, {kOrientationB, kAnchorB, kArmB, kInertiaB},
               numbers_.is_of_world);
  }
  struct BodyVectors {
    std::size_t orientation, anchor, arm, inertia;
  };
  void start_body(const std::uint32_t* bodies, Vec inverse_inertia, const BodyVectors& to,
                  unsigned are_world) {
    Orientation now = Orientation::load(sweep_.orientation, bodies);
    if (are_world != 0)
      now = Orientation::select(S::mask_of(are_world), Orientation::identity(), now);
    put(to.orientation, now);
    put(to.arm, to_matrix(now) * vectors(to.anchor));
    if (kFixed && bodies == numbers_.b) return;
    Matrix inertia = Matrix::load(sweep_.inverse_inertia, bodies);
    const Orientation start = Orientation::load(sweep_.start_orientation, bodies);
    const Vec zero = S::set(0);
    const Mask is_isotropic = greater(inverse_inertia, zero);
    const Mask keeps_inertia = S::either(is_isotropic, locks_rotation(inertia));
    const Mask turns = S::both(S::negate_mask(keeps_inertia), now.differs(start));
    if (S::any(turns)) {
      const Matrix turn = to_matrix(now * start.conjugate());
      inertia = Matrix::select(turns, turn * (inertia * turn.transposed()), inertia);
    }
    put(to.inertia, inertia);
  }

  /// FramePose::of()
  void set_pose() {
    using namespace frame_vector;
    Orientation now_a = orientation(kOrientationA), now_b = orientation(kOrientationB);
    Vectors arm_a = vectors(kArmA), arm_b = vectors(kArmB);
    project_orientation(rotation_a_.vector - vectors(kTurnedA), kAnchorA, &now_a, &arm_a);
    if constexpr (!kFixed) {
      project_orientation(rotation_b_.vector - vectors(kTurnedB), kAnchorB, &now_b, &arm_b);
    }
    const Vectors centres = vectors(kCentres) + (shift_a_.vector - shift_b_.vector);
    offset_ = flipped(centres + (arm_a - arm_b));
    arm_frame_ = of_frame(arm_a, arm_b);
    arm_base_ = of_base(arm_a, arm_b) + offset_;
    moved_ = zeros();
    if constexpr (!kHasAxes) return;
    const Orientation axes_a = now_a * orientation(kAxesA), axes_b = now_b * orientation(kAxesB);
    const Orientation base = kFixed ? Orientation::select(is_flipped(), axes_a, axes_b) : axes_b;
    const Orientation frame = kFixed ? Orientation::select(is_flipped(), axes_b, axes_a) : axes_a;
    axes_ = to_matrix(base);
    axes_transposed_ = axes_.transposed();
    set_rotation(base.conjugate() * frame);
  }
  /// projected(), and the arm of the anchor in the new orientation.
  void project_orientation(const Vectors& rotation, std::size_t anchor, Orientation* now,
                           Vectors* arm) const {
    const Mask turns = rotation.differs(zeros());
    if (!S::any(turns)) return;
    const Vec shortest2 = S::set(sweep_.epsilon * sweep_.epsilon);
    *now = Orientation::select(turns, now->add_scaled(rotation, one()).normalized(shortest2), *now);
    *arm = Vectors::select(turns, to_matrix(*now) * vectors(anchor), *arm);
  }
  void set_rotation(Orientation q) {
    const Vec zero = S::set(0), two = S::set(2);
    q = Orientation::select(S::less(q.w, zero), q.negated(), q);
    const Vec size = S::square_root(q.w * q.w + q.v.x * q.v.x);
    swing_cosine_ = size;
    const Mask has_twist = greater(size, S::set(sweep_.epsilon));
    twist_ = Orientation::select(has_twist, {q.w / size, {q.v.x / size, zero, zero}},
                                 Orientation::identity());
    const Orientation swing = q * twist_.conjugate();
    angular_ = {two * twist_.v.x, two * swing.v.y, two * swing.v.z};
    const Matrix columns = to_matrix(q).transposed();
    tilted_ = columns.row[0];
  }
  Vec swing_sine() const {
    return S::set(Real(0.5)) * S::square_root(angular_.y * angular_.y + angular_.z * angular_.z);
  }
  Vectors twist_axis() const {
    const Vec least = S::set(Real(0.02)), sum = one() + tilted_.x;
    return Vectors{sum, tilted_.y, tilted_.z} *
           (one() / S::select(greater(sum, least), sum, least));
  }
  Vectors swing_axis() const {
    const Vec zero = S::set(0);
    const Vec size = S::square_root(tilted_.y * tilted_.y + tilted_.z * tilted_.z);
    return Vectors::select(greater(size, S::set(sweep_.epsilon)),
                           Vectors{zero, S::negate(tilted_.z), tilted_.y} * (one() / size),
                           {zero, one(), zero});
  }

  /// FrameSum, sums_of()
  void turn_impulse() {
    using namespace frame_vector;
    const Vectors linear = vectors(kLinear);
    Vectors turn = zeros();
    if constexpr (kHasAxes) {
      const Vec zero = S::set(0);
      Vectors torque = vectors(kAngular);
      const Vectors motor = vectors(kMotor);
      const Vec limit = vector(kLower) - vector(kUpper), cone = vector(kCone);
      const Mask has_limits = S::mask_of(numbers_.has_limits);
      torque = Vectors::select(has_limits, torque + twist_axis() * limit, torque);
      torque.x = S::select(S::mask_of(numbers_.has_motor), torque.x + motor.x, torque.x);
      torque = Vectors::select(S::mask_of(numbers_.has_friction), torque + motor, torque);
      torque = Vectors::select(greater(cone, zero), torque - swing_axis() * cone, torque);
      turn = Vectors::select(S::mask_of(numbers_.has_axes), axes_ * torque, turn);
    }
    const Sums now = sums_of(linear, Vectors::cross(arm_frame_, linear) + turn,
                             Vectors::cross(arm_base_, linear) + turn);
    apply(mask_, now.impulse - impulse_, now.spun_a - spun_a_, now.spun_b - spun_b_);
    impulse_ = Vectors::select(mask_, now.impulse, impulse_);
    spun_a_ = Vectors::select(mask_, now.spun_a, spun_a_);
    spun_b_ = Vectors::select(mask_, now.spun_b, spun_b_);
    if constexpr (kHasAxes) {
      if (lanes_sprung() != 0) set_angular_error();
    }
  }
  unsigned lanes_sprung() const {
    return lanes_ & (numbers_.sprung[0] | numbers_.sprung[1] | numbers_.sprung[2]);
  }
  void set_angular_error() {
    const Vec zero = S::set(0);
    const Orientation to_target = orientation(frame_vector::kTargetTwist).conjugate() * twist_;
    const Mask is_back = S::less(to_target.w, zero);
    const auto forward = [&](Vec v) { return S::select(is_back, S::negate(v), v); };
    const Vec sine = swing_sine();
    const Vec scale = S::select(greater(sine, S::set(sweep_.epsilon)),
                                angle_of_half(sine, swing_cosine_) / (S::set(2) * sine), one());
    put(frame_vector::kAngularError,
        Vectors{angle_of_half(forward(to_target.v.x), forward(to_target.w)), angular_.y * scale,
                angular_.z * scale});
  }
  static Vec angle_of_half(Vec sine, Vec cosine) {
    const Vec quarter = sine / (one() + cosine);
    const Vec t = quarter / (one() + S::square_root(one() + quarter * quarter));
    constexpr int kTerms = sizeof(Real) == 4 ? 9 : 20;
    const Vec square2 = t * t;
    Vec sum = S::set(0);
    for (int k = kTerms; k-- > 0;) {
      sum = S::set(Real(1) / static_cast<Real>(2 * k + 1)) - square2 * sum;
    }
    return S::set(8) * t * sum;
  }
  struct Sums {
    Vectors impulse, spun_a, spun_b;
  };
  Sums sums_of(const Vectors& impulse, const Vectors& twist_frame,
               const Vectors& twist_base) const {
    if constexpr (kFixed) {
      const Vectors twist = Vectors::select(is_flipped(), twist_base.negated(), twist_frame);
      return {flipped(impulse), inertia_a_ * twist, zeros()};
    } else {
      return {impulse, inertia_a_ * twist_frame, inertia_b_ * twist_base};
    }
  }
  void push_sum(Mask mask, const Vectors& impulse, const Vectors& twist_frame,
                const Vectors& twist_base) {
    const Sums pushed = sums_of(impulse, twist_frame, twist_base);
    apply(mask, pushed.impulse, pushed.spun_a, pushed.spun_b);
    change(mask, &impulse_, impulse_ + pushed.impulse);
    change(mask, &spun_a_, spun_a_ + pushed.spun_a);
    if constexpr (!kFixed) change(mask, &spun_b_, spun_b_ + pushed.spun_b);
  }
  void push(Mask mask, const Vectors& impulse) {
    push_sum(mask, impulse, Vectors::cross(arm_frame_, impulse),
             Vectors::cross(arm_base_, impulse));
  }
  struct FrameImpulse {
    Vectors linear, angular;
  };
  void push(Mask mask, const FrameImpulse& pushed) {
    const Vectors torque = axes_ * pushed.angular;
    push_sum(mask, pushed.linear, Vectors::cross(arm_frame_, pushed.linear) + torque,
             Vectors::cross(arm_base_, pushed.linear) + torque);
  }

  Vectors in_base(const Vectors& world) const { return axes_transposed_ * world; }
  Matrix in_base(const Matrix& world) const { return axes_transposed_ * (world * axes_); }

  static Matrix regular_response(Matrix response) {
    const Vec zero = S::set(0);
    Vec& x = response.row[0].x;
    Vec& y = response.row[1].y;
    Vec& z = response.row[2].z;
    const Mask has_x = greater(x, zero), has_y = greater(y, zero), has_z = greater(z, zero);
    if (S::bits(S::both(S::both(has_x, has_y), has_z)) == kAll) return response;
    const Vec free = (S::keep(has_x, one()) + S::keep(has_y, one())) + S::keep(has_z, one());
    const Mask has_free = greater(free, zero);
    const Vec mean = ((x + y) + z) / free;
    const auto regular = [&](Mask has, Vec value) {
      return S::select(S::both(has_free, S::negate_mask(has)), mean, value);
    };
    x = regular(has_x, x), y = regular(has_y, y), z = regular(has_z, z);
    return response;
  }

  static Matrix arm_coupling(const Vectors& arm, const Matrix& inertia) {
    return {{Vectors::cross(arm, inertia.row[0]), Vectors::cross(arm, inertia.row[1]),
             Vectors::cross(arm, inertia.row[2])}};
  }
  static Matrix arm_response(const Vectors& arm, const Matrix& coupling) {
    const Matrix columns = coupling.transposed();
    return {{Vectors::cross(arm, columns.row[0]), Vectors::cross(arm, columns.row[1]),
             Vectors::cross(arm, columns.row[2])}};
  }
  Matrix linear_response(Matrix* coupling) const {
    const Vectors arm_a = kFixed ? of_frame(arm_frame_, arm_base_) : arm_frame_;
    *coupling = arm_coupling(arm_a, inertia_a_);
    Matrix response = arm_response(arm_a, *coupling);
    Vec inverse_mass = a_.velocity.scalar;
    if constexpr (!kFixed) {
      const Matrix of_base = arm_coupling(arm_base_, inertia_b_);
      response = response + arm_response(arm_base_, of_base);
      *coupling = *coupling + of_base;
      inverse_mass = inverse_mass + b_.velocity.scalar;
    }
    response.row[0].x = response.row[0].x + inverse_mass;
    response.row[1].y = response.row[1].y + inverse_mass;
    response.row[2].z = response.row[2].z + inverse_mass;
    return response;
  }

  Vectors turning(const Vectors& w, const Vectors& arm) const {
    const Vec half = S::set(sweep_.h) * S::set(Real(0.5)), square2 = square(w) * (half * half);
    const Vectors first = Vectors::cross(w, arm);
    return (Vectors::cross(w, first) * half - first * square2) *
           (bound_of(square2) / (one() + square2));
  }
  Vec bound_of(Vec square2) const {
    const Vec most = S::set(sweep_.most_turn);
    return S::select(greater(square2, most), most / square2, one());
  }
  template <bool kUseBias>
  Vectors linear_velocity() const {
    const Vectors &va = a_.velocity.vector, &vb = b_.velocity.vector;
    const Vectors frame_turn = frame_angular_velocity(), base_turn = base_angular_velocity();
    Vectors velocity = (of_frame(va, vb) + Vectors::cross(frame_turn, arm_frame_)) -
                       (of_base(va, vb) + Vectors::cross(base_turn, arm_base_));
    if constexpr (kUseBias) {
      velocity = velocity + (turning(frame_turn, arm_frame_) - turning(base_turn, arm_base_));
    }
    return velocity;
  }
  Vectors frame_angular_velocity() const {
    return of_frame(a_.angular_velocity.vector, b_.angular_velocity.vector);
  }
  Vectors base_angular_velocity() const {
    return of_base(a_.angular_velocity.vector, b_.angular_velocity.vector);
  }
  template <bool kUseBias>
  Vectors angular_velocity() const {
    const Vectors frame = in_base(frame_angular_velocity());
    const Vectors base = in_base(base_angular_velocity());
    Vectors velocity = frame - base;
    if constexpr (kUseBias) {
      const Vec half = S::set(sweep_.h) * S::set(Real(0.5));
      const Vec square2 = (square(frame) + square(base)) * (half * half);
      velocity = velocity - Vectors::cross(base, frame) * (half * bound_of(square2));
    }
    return velocity;
  }

  /// @param tiny 16 * kEpsilon
  struct LockedFactors {
    Vec inverse_x, inverse_y, inverse_z, yx, zx, zy;
    LockedFactors() = default;
    /// @param locked by component
    LockedFactors(const Matrix& m, const std::array<Mask, 3>& locked, Vec tiny,
                  const Matrix& whole) {
      const auto is_regular = [&](unsigned i, Vec pivot, Vec response) {
        return S::both(locked[i], greater(pivot, tiny * response));
      };
      const Mask has_x = is_regular(0, m.row[0].x, whole.row[0].x);
      const Vec dx = S::keep(has_x, m.row[0].x);
      inverse_x = S::keep(has_x, one() / m.row[0].x);
      yx = S::keep(has_x, m.row[1].x * inverse_x);
      zx = S::keep(has_x, m.row[2].x * inverse_x);
      const Vec pivot_y = m.row[1].y - yx * yx * dx;
      const Mask has_y = is_regular(1, pivot_y, whole.row[1].y);
      const Vec dy = S::keep(has_y, pivot_y);
      inverse_y = S::keep(has_y, one() / pivot_y);
      zy = S::keep(has_y, (m.row[2].y - zx * yx * dx) * inverse_y);
      const Vec pivot_z = (m.row[2].z - zx * zx * dx) - zy * zy * dy;
      const Mask has_z = is_regular(2, pivot_z, whole.row[2].z);
      inverse_z = S::keep(has_z, one() / pivot_z);
    }
    LockedFactors(const Matrix& m, const std::array<Mask, 3>& locked, Vec tiny)
        : LockedFactors(m, locked, tiny, m) {}
    Vectors solve(const Vectors& v) const {
      const Vec zero = S::set(0);
      const Mask is_x = S::differs(inverse_x, zero), is_y = S::differs(inverse_y, zero);
      const Mask is_z = S::differs(inverse_z, zero);
      Vec x = S::keep(is_x, v.x);
      Vec y = S::keep(is_y, v.y - yx * x);
      Vec z = S::keep(is_z, (v.z - zx * x) - zy * y);
      z = z * inverse_z;
      y = y * inverse_y;
      y = S::select(is_y, y - zy * z, y);
      x = x * inverse_x;
      x = S::select(is_x, (x - yx * y) - zx * z, x);
      return {x, y, z};
    }
  };
  static std::array<Mask, 3> all() { return {S::always(), S::always(), S::always()}; }

  /// Computes the members of FrameSolver.
  void set_responses() {
    Matrix coupling;
    linear_factors_ = {linear_response(&coupling), all(), tiny()};
    if constexpr (!kHasAxes) return;
    Matrix inertia = inertia_a_;
    if constexpr (!kFixed) inertia = inertia + inertia_b_;
    rotation_response_ = in_base(regular_response(inertia));
    const Matrix columns = coupling.transposed();
    Matrix held;  // transposed
    for (unsigned i = 0; i < 3; ++i) {
      coupling_.row[i] = (columns * axes_transposed_.row[i]).negated();
      held.row[i] = linear_factors_.solve(coupling_.row[i]).negated();
    }
    hold_ = held.transposed();
    angular_response_ = rotation_response_ + coupling_ * hold_;
    angular_factors_ = {angular_response_, locked_angular(), tiny(), rotation_response_};
  }
  std::array<Mask, 3> locked_angular() const {
    return {S::mask_of(numbers_.locked[0]), S::mask_of(numbers_.locked[1]),
            S::mask_of(numbers_.locked[2])};
  }

  struct AxisImpulse {
    FrameImpulse own, held;
    Vec mass;
  };
  AxisImpulse about(const Vectors& axis) const {
    const Vectors velocity = angular_response_ * axis;
    const Vectors held = angular_factors_.solve(velocity).negated(), torque = axis + held;
    return {
        {zeros(), axis},
        {hold_ * torque, held},
        inverse_of(Vectors::dot(velocity, torque), Vectors::dot(axis, rotation_response_ * axis))};
  }
  void push(Mask mask, const AxisImpulse& axis, Vec size) {
    const FrameImpulse held{axis.held.linear * size, axis.held.angular * size};
    put(mask, frame_vector::kLinear, vectors(frame_vector::kLinear) + held.linear);
    put(mask, frame_vector::kAngular, vectors(frame_vector::kAngular) + held.angular);
    push(mask, FrameImpulse{axis.own.linear * size + held.linear,
                            axis.own.angular * size + held.angular});
  }
  static Vectors unit(unsigned i) { return {S::set(i == 0), S::set(i == 1), S::set(i == 2)}; }

  void solve_springs() {
    using namespace frame_vector;
    const Vec stiffness = vector(kStiffness), damping = vector(kDamping);
    const Matrix& response = angular_response_;
    const Mask has_all = S::mask_of(numbers_.sprung[0] & numbers_.sprung[1] & numbers_.sprung[2]);
    const Vec of_all =
        S::set(3) *
        inverse_of((response.row[0].x + response.row[1].y) + response.row[2].z, S::set(0));
    for (unsigned i = 0; i < 3; ++i) {
      const Mask mask = S::both(mask_, S::mask_of(numbers_.sprung[i]));
      if (!S::any(mask)) continue;
      const AxisImpulse axis = about(unit(i));
      const Vec mass = S::select(has_all, of_all, axis.mass);
      const Vec ratio =
          S::select(has_all, of_all * Vectors::dot(unit(i), angular_response_ * unit(i)), one());
      const Vectors velocities = angular_velocity<false>();
      const Vec velocity = i == 0 ? velocities.x : i == 1 ? velocities.y : velocities.z;
      const Vec impulse = vector(kAngular + i);
      const Vec pull = mass * (stiffness * vector(kAngularError + i) + damping * velocity);
      const Vec change = S::negate(pull + impulse) / (one() + damping * ratio);
      put(mask, kAngular + i, impulse + change);
      push(mask, axis, change);
    }
  }
  Vectors bounded(const Vectors& error) const {
    const Vectors way = error * S::set(sweep_.correction);
    const Vec most = S::set(sweep_.most_correction), size2 = square(way);
    const Mask is_far = greater(size2, most * most);
    if (!S::any(is_far)) return way;
    return Vectors::select(is_far, way * (most / S::square_root(size2)), way);
  }

  Vec inverse_of(Vec response, Vec free) const {
    const Vec least = tiny() * free, used = S::select(greater(response, least), response, least);
    return S::keep(greater(used, S::set(0)), one() / used);
  }
  void solve_motor(Mask mask) {
    using namespace frame_vector;
    const Vec most = vector(kMotorLimit) * S::set(sweep_.h);
    const AxisImpulse axis = about(unit(0));
    const Vec before = vector(kMotor), speed = angular_velocity<false>().x;
    const Vec wanted = before - axis.mass * (speed - vector(kMotorSpeed));
    const Vec least = S::negate(most);
    const Vec after =
        S::select(greater(wanted, most), most, S::select(S::less(wanted, least), least, wanted));
    put(mask, kMotor, after);
    push(mask, axis, after - before);
  }
  void solve_friction(Mask mask) {
    using namespace frame_vector;
    const Vec most = vector(kFrictionTorque) * S::set(sweep_.h);
    const Vectors before = vectors(kMotor);
    const LockedFactors factors(angular_response_, all(), tiny());
    Vectors after = before - factors.solve(angular_velocity<false>());
    const Vec size2 = square(after);
    after =
        Vectors::select(greater(size2, most * most), after * (most / S::square_root(size2)), after);
    put(mask, kMotor, after);
    const Vectors torque = after - before;
    push(mask, AxisImpulse{{zeros(), torque}, {hold_ * torque, zeros()}, S::set(0)}, one());
  }

  template <bool kUseBias>
  Mask acts(Vec gap, Vec* speed, Vec impulse) const {
    const Vec zero = S::set(0);
    const Mask is_slack = greater(gap, zero), is_active = greater(impulse, zero);
    if constexpr (kUseBias) {
      *speed = S::select(is_slack, *speed + gap * S::set(sweep_.inverse_h), *speed);
      return S::either(is_active, S::less(*speed, zero));
    } else {
      return S::either(is_active, S::both(S::negate_mask(is_slack), S::less(*speed, zero)));
    }
  }
  /// @param side 1: the angle increases the gap, -1: it decreases the gap
  /// @param impulse number of the vector
  template <bool kUseBias>
  void solve_angle_limit(Mask mask, const Vectors& axis, Vec gap, Real side, std::size_t impulse) {
    const Vec sign = S::set(side), before = vector(impulse);
    Vec speed = sign * Vectors::dot(axis, angular_velocity<kUseBias>());
    const Mask active = S::both(mask, acts<kUseBias>(gap, &speed, before));
    if (S::any(active)) {
      const AxisImpulse turn = about(axis);
      const Vec wanted = before - turn.mass * speed;
      const Vec after = S::keep(greater(wanted, S::set(0)), wanted);
      put(active, impulse, after);
      push(active, turn, sign * (after - before));
    }
    if constexpr (kUseBias) {
      const Mask overlaps = S::both(mask, S::less(gap, S::set(0)));
      if (S::any(overlaps)) {
        project_rotation(overlaps, bounded(axis * (sign * gap)),
                         inverse_of(Vectors::dot(axis, rotation_response_ * axis), S::set(0)));
      }
    }
  }
  template <bool kUseBias>
  void solve_limits(Mask mask) {
    using namespace frame_vector;
    const Vec zero = S::set(0), opposite = S::set(2);
    const Vec lower = vector(kLowerSine), upper = vector(kUpperSine);
    const Vec lower_cosine = vector(kLowerCosine), upper_cosine = vector(kUpperCosine);
    Vec s = twist_.v.x, c = twist_.w;
    const Mask is_back = S::less(s * (lower + upper) + c * (lower_cosine + upper_cosine), zero);
    s = S::select(is_back, S::negate(s), s), c = S::select(is_back, S::negate(c), c);
    const auto gap_to = [&](Vec sine, Vec cosine, Real side) {
      return S::select(S::less(c * cosine + s * sine, zero), opposite,
                       S::set(2 * side) * (s * cosine - c * sine));
    };
    const Vectors axis = twist_axis();
    solve_angle_limit<kUseBias>(mask, axis, gap_to(lower, lower_cosine, 1), 1, kLower);
    solve_angle_limit<kUseBias>(mask, axis, gap_to(upper, upper_cosine, -1), -1, kUpper);
  }
  template <bool kUseBias>
  void solve_cone(Mask mask) {
    using namespace frame_vector;
    const Vec gap =
        S::set(2) * (vector(kConeSine) * swing_cosine_ - vector(kConeCosine) * swing_sine());
    solve_angle_limit<kUseBias>(mask, swing_axis(), gap, -1, kCone);
  }
  template <bool kUseBias>
  void solve_block(Mask mask) {
    using namespace frame_vector;
    const Vectors held = linear_factors_.solve(linear_velocity<kUseBias>()).negated();
    const Vectors torque =
        angular_factors_.solve(angular_velocity<kUseBias>() + coupling_ * held).negated();
    const FrameImpulse change{held + hold_ * torque, torque};
    put(mask, kLinear, vectors(kLinear) + change.linear);
    put(mask, kAngular, vectors(kAngular) + change.angular);
    push(mask, change);
  }
  template <bool kUseBias>
  void solve_points(Mask mask) {
    using namespace frame_vector;
    const Vectors change = linear_factors_.solve(linear_velocity<kUseBias>()).negated();
    put(mask, kLinear, vectors(kLinear) + change);
    push(mask, change);
  }

  void project_locked(Mask mask) {
    const auto locked = locked_angular();
    const Vectors part{S::keep(locked[0], angular_.x), S::keep(locked[1], angular_.y),
                       S::keep(locked[2], angular_.z)};
    const LockedFactors factors(rotation_response_, locked, tiny());
    project_rotation(mask, factors.solve(bounded(part)), one());
  }
  /// separate()
  void project(const Vectors& way) {
    Vec inverse_mass = a_.velocity.scalar;
    if constexpr (!kFixed) inverse_mass = inverse_mass + b_.velocity.scalar;
    const Vec side = kFixed ? S::select(is_flipped(), S::set(-1), one()) : one();
    const Vectors impulse = way * (side / inverse_mass);
    change(mask_, &shift_a_.vector, shift_a_.vector - impulse * a_.velocity.scalar);
    if constexpr (!kFixed) {
      change(mask_, &shift_b_.vector, shift_b_.vector + impulse * b_.velocity.scalar);
    }
  }
  void project_rotation(Mask mask, const Vectors& error, Vec mass) {
    const Vec signed_mass = kFixed ? S::select(is_flipped(), S::negate(mass), mass) : mass;
    const Vectors torque = axes_ * (error * signed_mass);
    const Vectors turn_a = inertia_a_ * torque;
    change(mask, &rotation_a_.vector, rotation_a_.vector - turn_a);
    Vectors moved = Vectors::cross(turn_a, of_frame(arm_frame_, arm_base_));
    if constexpr (!kFixed) {
      const Vectors turn_b = inertia_b_ * torque;
      change(mask, &rotation_b_.vector, rotation_b_.vector + turn_b);
      moved = moved + Vectors::cross(turn_b, arm_base_);
    }
    // A flipped row has the opposite sign.
    const Vectors way =
        kFixed ? Vectors::select(is_flipped(), moved, moved.negated()) : moved.negated();
    change(mask, &moved_, moved_ + way);
  }

  /// Changes the velocities of the lanes of a mask.
  void apply(Mask mask, const Vectors& impulse, const Vectors& spun_a, const Vectors& spun_b) {
    change(mask, &a_.velocity.vector, a_.velocity.vector + impulse * a_.velocity.scalar);
    change(mask, &a_.angular_velocity.vector, a_.angular_velocity.vector + spun_a);
    if constexpr (!kFixed) {
      change(mask, &b_.velocity.vector, b_.velocity.vector - impulse * b_.velocity.scalar);
      change(mask, &b_.angular_velocity.vector, b_.angular_velocity.vector - spun_b);
    }
  }
  static void change(Mask mask, Vectors* value, const Vectors& to) {
    *value = Vectors::select(mask, to, *value);
  }

  Vec vector(std::size_t k) const { return S::load(row_ + k * kBundle); }
  Vectors vectors(std::size_t k) const { return {vector(k), vector(k + 1), vector(k + 2)}; }
  Orientation orientation(std::size_t k) const { return {vector(k), vectors(k + 1)}; }
  Matrix matrix(std::size_t k) const { return {{vectors(k), vectors(k + 3), vectors(k + 6)}}; }
  void put(Mask mask, std::size_t k, Vec v) const {
    S::store(row_ + k * kBundle, S::select(mask, v, vector(k)));
  }
  void put(Mask mask, std::size_t k, const Vectors& v) const {
    put(mask, k, v.x), put(mask, k + 1, v.y), put(mask, k + 2, v.z);
  }
  void put(std::size_t k, const Vectors& v) const { put(mask_, k, v); }
  void put(std::size_t k, const Orientation& q) const { put(mask_, k, q.w), put(k + 1, q.v); }
  void put(std::size_t k, const Matrix& m) const {
    put(k, m.row[0]), put(k + 3, m.row[1]), put(k + 6, m.row[2]);
  }

  void load_velocities() {
    a_ = BodyLanes<S>(sweep_.bodies, numbers_.a);
    b_ = BodyLanes<S>(sweep_.bodies, numbers_.b);
    if (kFixed && numbers_.is_of_world != 0) {
      const Mask is_world = S::mask_of(numbers_.is_of_world);
      b_.velocity.vector = Vectors::select(is_world, zeros(), b_.velocity.vector);
      b_.angular_velocity.vector = Vectors::select(is_world, zeros(), b_.angular_velocity.vector);
    }
  }
  void load_bodies() {
    load_velocities();
    using namespace solver_body_quad;
    const auto load = [&](const std::uint32_t* bodies, std::size_t offset) {
      return QuadLanes<S>::load(sweep_.bodies + offset, kSweepStride, bodies);
    };
    shift_a_ = load(numbers_.a, kShift), shift_b_ = load(numbers_.b, kShift);
    if (kFixed && numbers_.is_of_world != 0) {
      shift_b_.vector = Vectors::select(S::mask_of(numbers_.is_of_world), zeros(), shift_b_.vector);
    }
    rotation_a_ = load(numbers_.a, kRotation);
    if constexpr (!kFixed) rotation_b_ = load(numbers_.b, kRotation);
  }
  void load_sums() {
    impulse_ = vectors(frame_vector::kImpulse);
    spun_a_ = vectors(frame_vector::kSpunA);
    spun_b_ = kFixed ? zeros() : vectors(frame_vector::kSpunB);
  }
  void store_velocities() const {
    a_.store(sweep_.bodies, numbers_.a, lanes_);
    if constexpr (!kFixed) b_.store(sweep_.bodies, numbers_.b, lanes_);
  }
  void store_motion() const {
    using namespace solver_body_quad;
    const auto store = [&](const QuadLanes<S>& quad, const std::uint32_t* bodies,
                           std::size_t offset) {
      quad.store(sweep_.bodies + offset, kSweepStride, bodies, lanes_);
    };
    store(shift_a_, numbers_.a, kShift);
    if constexpr (!kFixed) store(shift_b_, numbers_.b, kShift);
    if constexpr (!kHasAxes) return;
    store(rotation_a_, numbers_.a, kRotation);
    if constexpr (!kFixed) store(rotation_b_, numbers_.b, kRotation);
  }

  const FrameSweep& sweep_;
  const FrameNumbers& numbers_;
  Real* row_;
  unsigned lanes_;
  Mask mask_;  ///< of lanes_
  BodyLanes<S> a_, b_;
  QuadLanes<S> shift_a_, shift_b_, rotation_a_, rotation_b_;
  Vectors impulse_, spun_a_, spun_b_;  ///< JointSums
  Matrix inertia_a_, inertia_b_;
  // FramePose.
  Vectors arm_frame_, arm_base_, offset_, angular_, tilted_;
  Matrix axes_, axes_transposed_;
  Orientation twist_;
  Vec swing_cosine_;
  // FrameSolver.
  Vectors moved_;
  Matrix rotation_response_, angular_response_, coupling_, hold_;
  LockedFactors linear_factors_, angular_factors_;
};

/// Calls one(rows) for the rows of a bundle. @returns one bit per row that is skipped
template <class S, bool kFixed, class One>
unsigned for_frames(const FrameSweep& sweep, std::size_t bundle, unsigned lanes, const One& one) {
  const FrameNumbers& numbers = sweep.numbers[bundle];
  const unsigned solved = lanes & numbers.used & ~numbers.left;
  if ((solved & numbers.has_axes) != 0) {
    FrameLanes<S, kFixed, true> rows(sweep, bundle, solved);
    one(&rows);
  } else if (solved != 0) {
    FrameLanes<S, kFixed, false> rows(sweep, bundle, solved);
    one(&rows);
  }
  return lanes & numbers.left;
}

/// Calls one(rows) for all bundles of the rows [first, last). @returns as FrameSweepFunction
template <class S, bool kFixed, class One>
std::size_t for_each_frame_bundle(const FrameSweep& sweep, std::size_t first, std::size_t last,
                                  std::uint32_t* left, const One& one) {
  return for_each_bundle(first, last, left, [&](std::size_t bundle, unsigned lanes) {
    return for_frames<S, kFixed>(sweep, bundle, lanes, one);
  });
}

template <class S, bool kFixed>
void start_frames(const FrameSweep& sweep, std::size_t first, std::size_t last) {
  for (std::size_t bundle = first; bundle < last; ++bundle) {
    for_frames<S, kFixed>(sweep, bundle, ~0u, [](auto* rows) { rows->start(); });
  }
}

template <class S, bool kFixed>
std::size_t warm_start_frames(const FrameSweep& sweep, std::size_t first, std::size_t last,
                              std::uint32_t* left) {
  return for_each_frame_bundle<S, kFixed>(sweep, first, last, left,
                                          [](auto* rows) { rows->warm_start(); });
}

// Inlined completely: most functions have one caller, and calls would pass vectors in memory.
template <class S, bool kFixed, bool kUseBias>
[[gnu::flatten]] std::size_t solve_frames(const FrameSweep& sweep, std::size_t first,
                                          std::size_t last, std::uint32_t* left) {
  return for_each_frame_bundle<S, kFixed>(sweep, first, last, left, [&sweep](auto* rows) {
    rows->template solve<kUseBias>(kUseBias && sweep.starts);
  });
}

template <class S, bool kFixed>
constexpr FrameSweepKernels frame_kernels() {
  return {start_frames<S, kFixed>,
          warm_start_frames<S, kFixed>,
          {solve_frames<S, kFixed, false>, solve_frames<S, kFixed, true>}};
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
