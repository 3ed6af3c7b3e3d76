/// Setup of the rows of a soft step from its contacts, and storage of their impulses.
#pragma once

#include <jfpx/material.hpp>

#include "src/collide/contact_basis.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/contact_solver/soft_step/joint_set.hpp"
#include "src/contact_solver/soft_step/row_kinds.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Properties of a body that select the kinds of its rows, as bits of one byte.
struct BodyTraits {
  static constexpr std::uint8_t kMovable = 1;
  static constexpr std::uint8_t kActive = 2;  ///< movable and awake
  /// A movable sphere with the same inertia about every axis, or a body of mass 0 that is at rest.
  static constexpr std::uint8_t kIsRound = 4;
  static constexpr std::uint8_t kRolls = 8;  ///< has rolling or spinning friction
  /// Continuous collision must test the body. Set at the end of the step, while other threads read
  /// the other bits.
  static constexpr std::uint8_t kIsFast = 0x80;
};

/// Values of StepBodies::constrained. A body with joints may have contacts, too; kHasDrive: one of
/// the joints has a spring or a motor.
inline constexpr std::uint8_t kHasContact = 1, kHasJoint = 2, kHasDrive = 3;

/// Properties of the bodies at the start of a step, as arrays by body.
struct BodyProperties {
  const Mat3* inverse_inertia = nullptr;      ///< [1/(kg m^2)], world axes
  const Vec3* acceleration = nullptr;         ///< [m/s^2], of this step
  const Real* radius = nullptr;               ///< [m]; 0: not a sphere
  const std::uint8_t* traits = nullptr;       ///< bits of BodyTraits
  const std::uint8_t* constrained = nullptr;  ///< as StepBodies::constrained
  const Real *friction = nullptr, *restitution = nullptr;
  const Real *rolling_friction = nullptr, *spinning_friction = nullptr;  ///< [m]
  MaterialSettings rules;
  const Vec3* position = nullptr;           ///< [m]
  const Quat* orientation = nullptr;        ///< on the CPU, at the time of the sweep
  const Quat* start_orientation = nullptr;  ///< at the start of the step
};

/// Least weight of a point in the centre of friction of its contact.
inline constexpr Real kLeastWeight = Real(1e-6);

/// Builds rows of contacts and joints. Body a of a row is movable. Contacts and joints are numbered
/// together: first the contacts, then the slots of joints.
struct RowSetup {
  ContactView contacts;
  JointView joints;
  BodyProperties properties;
  /// By body. During fill(), the velocities are those before the accelerations of the step. Later,
  /// the substeps on the CPU change this array.
  const SolverBody* start = nullptr;
  Real restitution_threshold = 0;  ///< StepConstants::restitution_threshold
  Real inverse_friction_gap = 0;   ///< StepConstants::inverse_friction_gap

  /// Number of contacts and slots of joints.
  JFPX_HD std::uint32_t size() const { return contacts.size() + joints.count; }
  JFPX_HD bool is_joint(std::uint32_t i) const { return i >= contacts.size(); }
  JFPX_HD std::uint32_t joint_of(std::uint32_t i) const { return i - contacts.size(); }
  JFPX_HD ContactKey key(std::uint32_t i) const {
    return is_joint(i) ? joints.key(joint_of(i)) : contacts.key(i);
  }
  JFPX_HD void set_color(std::uint32_t i, std::uint8_t color) const {
    if (is_joint(i)) {
      joints.now[joint_of(i)].color = color;
    } else {
      contacts.colors[i] = color;
    }
  }
  /// Sort key of the rows of a body with fixed bodies. Joints precede contacts, which are solved
  /// last, because they must not be violated.
  JFPX_HD std::uint32_t fixed_order(std::uint32_t i) const {
    return is_joint(i) ? joint_of(i) : joints.count + i;
  }

  /// Whether the row exchanges the bodies of a contact or joint, because body a must be movable.
  JFPX_HD bool is_flipped(const ContactKey& key) const { return !is_movable(key.a); }
  /// Body a of the row of a contact or joint.
  JFPX_HD std::uint32_t movable_body(const ContactKey& key) const {
    return is_flipped(key) ? key.b : key.a;
  }

  /// Kind of the row of a contact, which may differ from the kind of the contact: two balls with
  /// rolling friction have a ManifoldRow, and a ball without joints on a fixed box has a SphereRow.
  /// @returns kNoRow if no body is movable and awake, or if a movable body sleeps
  JFPX_HD RowKind kind_of(std::uint32_t contact) const {
    if (is_joint(contact)) return joint_kind(joint_of(contact));
    const ContactKey& key = contacts.key(contact);
    const std::uint8_t a = properties.traits[key.a], b = properties.traits[key.b];
    // A body that is still asleep does not touch the other body: the contact has no effect.
    if (sleeps(a) || sleeps(b) || ((a | b) & BodyTraits::kActive) == 0) return kNoRow;
    // A SphereRow has the material of its bodies, and arms that are multiples of the normal.
    if (contacts.impulse_count(contact) != 1 || contacts.own_material(contact).is_set()) {
      return kKindOf<ManifoldRow>;
    }
    if (((a | b) & BodyTraits::kRolls) != 0) return kKindOf<ManifoldRow>;
    // A SphereRow with a fixed body is as stiff for a body with joints as for any other.
    const bool is_with_fixed = (a & b & BodyTraits::kMovable) == 0;
    if (is_with_fixed && is_jointed(key.a, key.b)) return kKindOf<ManifoldRow>;
    return (a & b & BodyTraits::kIsRound) != 0 ? kKindOf<SphereRow> : kKindOf<ManifoldRow>;
  }

  /// The color of a contact or joint: that of a row, kOverflowColor or kFixedColor.
  JFPX_HD std::uint32_t color_of(std::uint32_t i) const {
    return is_joint(i) ? joints.now[joint_of(i)].color : contacts.colors[i];
  }
  /// Group of a row that is not an inner row.
  JFPX_HD static std::uint32_t group_of(std::uint32_t color) {
    if (color == kFixedColor) return kFixedGroup;
    return color == kOverflowColor ? kOverflowGroup : group_of_crossing(number_in_class(color));
  }

  /// Rebound speed after an impact, or 0. The speed of the impact is that at the start of the step
  /// plus the gain until the impact; impulses end the motion in the middle of a step.
  /// @param velocity of a's point relative to b's, at the start of the step
  JFPX_HD Real rebound_speed(const Vec3& velocity, const Vec3& normal, Real distance,
                             std::uint32_t a, std::uint32_t b, Real restitution) const {
    if (!(restitution > 0)) return 0;
    const Real closing = -dot(velocity, normal);
    if (!(closing > 0)) return 0;
    const auto acceleration = [this](std::uint32_t body) {
      return start[body].inverse_mass > 0 ? properties.acceleration[body] : Vec3{};
    };
    const Real gap = distance > 0 ? distance : Real(0);
    const Real gained = -2 * gap * dot(acceleration(a) - acceleration(b), normal);
    const Real square = closing * closing + gained;
    const Real speed = square > 0 ? square_root(square) : Real(0);
    return speed > restitution_threshold ? restitution * speed : Real(0);
  }

  /// What a SphereRow reads of a body.
  struct SphereProperties {
    Real inverse_mass = 0;     ///< as SolverBody
    Real inverse_inertia = 0;  ///< as SolverBody
    Real radius = 0;           ///< [m]
    Real friction = 0, restitution = 0;
  };
  JFPX_HD SphereProperties sphere(std::uint32_t body) const {
    return {start[body].inverse_mass, start[body].inverse_inertia, properties.radius[body],
            properties.friction[body], properties.restitution[body]};
  }

  template <bool kFixed>
  JFPX_HD void fill(SphereRow* row, NoPart*, std::uint32_t contact) const {
    const ContactKey& key = contacts.key(contact);
    const bool flipped = is_flipped(key);
    row->a = flipped ? key.b : key.a;
    row->b = flipped ? key.a : key.b;
    fill<kFixed>(row, contact, flipped, sphere(row->a), sphere(row->b));
  }
  /// fill() without the numbers of the bodies.
  /// @param flipped is_flipped()
  template <bool kFixed>
  JFPX_HD void fill(SphereRow* row, std::uint32_t contact, bool flipped, const SphereProperties& a,
                    const SphereProperties& b) const {
    const Real distance = contacts.distance(contact, 0);
    const Vec3& normal = contacts.normal(contact);
    const KeptImpulse kept = contacts.impulses[contacts.first_impulse(contact)];
    row->normal = flipped ? -normal : normal;
    row->distance = distance;
    // Penetrating spheres share the middle of the overlap, which conserves angular momentum.
    const Real half_overlap = distance < 0 ? distance * Real(0.5) : Real(0);
    row->arm_a = a.radius + half_overlap;
    row->arm_b = kFixed ? Real(0) : b.radius + half_overlap;
    row->friction = combined(properties.rules.friction, a.friction, b.friction);
    const Vec3 friction = in_tangent_plane(kept.friction, normal);
    row->friction_impulse = flipped ? -friction : friction;
    row->normal_impulse = -kept.normal;
    set_masses<kFixed>(row, a, b);
    row->restitution = combined(properties.rules.restitution, a.restitution, b.restitution);
  }

  /// Writes the members of a row that are independent of its points. @returns the restitution
  JFPX_HD Real set_properties(ManifoldRow* row, std::uint32_t contact) const {
    const ContactKey& key = contacts.key(contact);
    const bool flipped = is_flipped(key);
    const Vec3& normal = contacts.normal(contact);
    row->a = flipped ? key.b : key.a;
    row->b = flipped ? key.a : key.b;
    row->count = contacts.impulse_count(contact);
    row->normal = flipped ? -normal : normal;
    const OwnMaterial own = contacts.own_material(contact);
    Real restitution = own.restitution;
    row->friction = own.friction;
    if (!own.is_set()) {
      row->friction = combined(properties.rules.friction, properties.friction[row->a],
                               properties.friction[row->b]);
      restitution = combined(properties.rules.restitution, properties.restitution[row->a],
                             properties.restitution[row->b]);
    }
    row->rolling_friction = row->spinning_friction = 0;
    if (!key.is_generated()) {
      row->rolling_friction =
          std::max(properties.rolling_friction[row->a], properties.rolling_friction[row->b]);
      row->spinning_friction =
          std::max(properties.spinning_friction[row->a], properties.spinning_friction[row->b]);
    }
    const bool rolls = row->rolling_friction > 0 || row->spinning_friction > 0;
    const Vec3 rolling =
        rolls && contacts.rolling_impulses != nullptr ? contacts.rolling_impulses[contact] : Vec3{};
    row->rolling_impulse = flipped ? -rolling : rolling;
    row->is_jointed = is_jointed(row->a, row->b) ? 1 : 0;
    return restitution;
  }
  template <bool kFixed>
  JFPX_HD void fill(ManifoldRow* row, PointRow* points, std::uint32_t contact) const {
    const Real restitution = set_properties(row, contact);
    const bool flipped = is_flipped(contacts.key(contact));
    const detail::ContactBasis basis = detail::contact_basis(row->normal);
    row->tangent = basis.tangent;
    row->bitangent = basis.bitangent;
    SolverBody a = start[row->a], b = start[row->b];
    const BodyPair pair{&a, &b, &properties.inverse_inertia[row->a],
                        &properties.inverse_inertia[row->b]};
    // The points of a body that cannot tilt have the same effect. Each gets its share of the mass,
    // so that together they are as soft as those of other bodies.
    const bool is_locked =
        locks_rotation(*pair.inertia_a) || (!kFixed && locks_rotation(*pair.inertia_b));
    const FrictionPoints from(*this, *row, contact);
    Vec3 centre_a, centre_b;
    for (std::uint32_t i = 0; i < row->count; ++i) {
      const PointArms arms = from.arms(i);
      const Real share = from.share(i);
      centre_a += arms.a * share;
      centre_b += arms.b * share;
    }
    Vec3 friction;
    row->twist_impulse = row->twist_arm = 0;
    const KeptImpulse* const kept = contacts.impulses + contacts.first_impulse(contact);
    for (std::uint32_t i = 0; i < row->count; ++i) {
      PointRow& p = points[i];
      const PointArms arms = from.arms(i);
      const Vec3 arm = arms.a - centre_a;
      const Vec3 of_point = flipped ? -kept[i].friction : kept[i].friction;
      friction += of_point;
      row->twist_impulse += dot(cross(arm, of_point), row->normal);
      row->twist_arm += length(arm) * from.share(i);
      p.distance = from.distance(i);
      p.normal_impulse = kept[i].normal;
      set_lever<kFixed>(pair, arms.a, arms.b, row->normal, &p);
      const Real linear = linear_response<kFixed>(pair), response = linear + turning(p, p);
      const Real shared = linear * static_cast<Real>(row->count);
      p.normal_mass = 1 / (is_locked && response < shared ? shared : response);
      p.rebound = -rebound_speed(relative_velocity(pair, arms.a, arms.b), row->normal, p.distance,
                                 row->a, row->b, restitution);
    }
    row->friction_x = dot(friction, row->tangent);
    row->friction_y = dot(friction, row->bitangent);
    set_lever<kFixed>(pair, centre_a, centre_b, row->tangent, &row->x);
    set_lever<kFixed>(pair, centre_a, centre_b, row->bitangent, &row->y);
    set_friction_masses<kFixed>(row, pair);
  }

  /// Starts a row that cpu::ManifoldSweepKernels::complete() completes: writes all but the levers,
  /// the masses and the sums over points. Until then, the points have the arms as `turn_a` and
  /// `turn_b`, and the friction impulse of the last step as `spin_a`; `twist_arm` is 1 if the
  /// contact is that of two spheres.
  void start_row(ManifoldRow* row, PointRow* points, std::uint32_t contact) const {
    const Real restitution = set_properties(row, contact);
    const bool flipped = is_flipped(contacts.key(contact));
    const ContactPoints from(*this, *row, contact);
    row->twist_arm = contacts.is_sphere(contact) ? Real(1) : Real(0);
    SolverBody a, b;
    if (restitution > 0) a = start[row->a], b = start[row->b];
    const BodyPair pair{&a, &b, nullptr, nullptr};
    const KeptImpulse* const kept = contacts.impulses + contacts.first_impulse(contact);
    for (std::uint32_t i = 0; i < row->count; ++i) {
      PointRow& p = points[i];
      const PointArms arms = from.arms(i);
      p.turn_a = arms.a;
      p.turn_b = arms.b;
      p.distance = from.distance(i);
      p.normal_impulse = kept[i].normal;
      p.spin_a = flipped ? -kept[i].friction : kept[i].friction;
      p.rebound = -rebound_speed(relative_velocity(pair, arms.a, arms.b), row->normal, p.distance,
                                 row->a, row->b, restitution);
    }
  }

  template <bool kFixed>
  JFPX_HD void fill(DistanceRow* row, NoPart*, std::uint32_t i) const {
    const JointInput& joint = joints.inputs[joint_of(i)];
    const DistanceInput& input = joint.distance;
    const bool flipped = is_flipped(key(i));
    row->a = flipped ? joint.b : joint.a;
    row->b = flipped ? joint.a : joint.b;
    row->anchor_a = flipped ? input.anchor_b : input.anchor_a;
    row->anchor_b = flipped ? input.anchor_a : input.anchor_b;
    Vec3 centre_b = row->anchor_b;
    Quat orientation_b;
    if (row->b == kWorld) {
      row->anchor_b = {};
    } else {
      centre_b = properties.position[row->b];
      orientation_b = properties.orientation[row->b];
    }
    row->centres = properties.position[row->a] - centre_b;
    row->min_length = input.min_length;
    row->max_length = input.max_length;
    row->rest_length = input.rest_length;
    row->spring_rate = input.spring_rate;
    row->damp_rate = input.damp_rate;
    const Real* kept = joints.now[joint_of(i)].impulses;
    row->spring_impulse = kept[0], row->lower_impulse = kept[1], row->upper_impulse = kept[2];
    row->spring_error = 0;
    row->sums =
        sums_of<kFixed>(*row, joint_pair<kFixed>(*row),
                        axis_of(*row, row->centres, properties.orientation[row->a], orientation_b));
  }

  template <bool kFixed>
  JFPX_HD void fill(FrameRow* row, NoPart*, std::uint32_t i) const {
    const JointInput& joint = joints.inputs[joint_of(i)];
    const FrameInput& input = joint.frames;
    const bool flipped = is_flipped(key(i));
    row->a = flipped ? joint.b : joint.a;
    row->b = flipped ? joint.a : joint.b;
    row->is_flipped = flipped ? 1 : 0;
    row->parameters = input.parameters;
    row->anchor_a = flipped ? input.anchor_b : input.anchor_a;
    row->anchor_b = flipped ? input.anchor_a : input.anchor_b;
    row->axes_a = flipped ? input.axes_b : input.axes_a;
    row->axes_b = flipped ? input.axes_a : input.axes_b;
    Vec3 centre_b = row->anchor_b;
    Quat orientation_b;
    if (row->b == kWorld) {
      row->anchor_b = {};
    } else {
      centre_b = properties.position[row->b];
      orientation_b = properties.orientation[row->b];
    }
    row->centres = properties.position[row->a] - centre_b;
    row->impulses = frame_impulses(joints.now[joint_of(i)]);
    row->linear_error = row->angular_error = {};
    row->turned_a = row->turned_b = {};
    row->sums = sums_of<kFixed>(
        *row, joint_pair<kFixed>(*row),
        FramePose::of(*row, row->centres, properties.orientation[row->a], orientation_b));
  }

  /// -1 if the row exchanges the bodies of the contact, otherwise 1.
  JFPX_HD Real side_of(std::uint32_t contact) const {
    return is_flipped(contacts.key(contact)) ? Real(-1) : Real(1);
  }
  JFPX_HD void store_rolling(const ManifoldRow& row, std::uint32_t contact) const {
    contacts.rolling_impulses[contact] = row.rolling_impulse * side_of(contact);
  }
  /// Writes the impulses of a row to its contact or joint. Does not read the bodies of the row.
  JFPX_HD void store(const SphereRow& row, const NoPart*, std::uint32_t contact) const {
    const Real side = side_of(contact);
    const Real impulse = normal_impulse_of(row);
    const bool is_released = !(impulse > 0) && has_pushed(row);
    contacts.impulses[contacts.first_impulse(contact)] = {
        row.friction_impulse * side, is_released ? KeptImpulse::kReleased : impulse};
  }
  JFPX_HD void store(const ManifoldRow& row, const PointRow* points, std::uint32_t contact) const {
    const Real side = side_of(contact);
    if (contacts.rolling_impulses != nullptr) store_rolling(row, contact);
    // The points share the friction. Their sum is that of the row, and so is their torque about the
    // normal if the points are in a plane with this normal. Points that nearly coincide have no
    // torque: their arms are rounding errors.
    const FrictionPoints from(*this, row, contact);
    Vec3 centre;
    for (std::uint32_t i = 0; i < row.count; ++i) centre += from.arms(i).a * from.share(i);
    Real spread = 0;
    for (std::uint32_t i = 0; i < row.count; ++i) {
      spread += length_squared(from.arms(i).a - centre) * from.share(i);
    }
    const bool has_spread = spread > kEpsilon * length_squared(centre);
    const Real twist = has_spread ? row.twist_impulse / spread : Real(0);
    const Vec3 friction = row.tangent * row.friction_x + row.bitangent * row.friction_y;
    KeptImpulse* const kept = contacts.impulses + contacts.first_impulse(contact);
    for (std::uint32_t i = 0; i < row.count; ++i) {
      const Vec3 arm = from.arms(i).a - centre;
      const Vec3 of_point = (friction + cross(row.normal, arm) * twist) * from.share(i);
      const bool is_released = !(points[i].normal_impulse > 0) && has_pushed(points[i]);
      kept[i] = {of_point * side, is_released ? KeptImpulse::kReleased : points[i].normal_impulse};
    }
  }
  JFPX_HD void store(const DistanceRow& row, const NoPart*, std::uint32_t i) const {
    Real* kept = joints.now[joint_of(i)].impulses;
    kept[0] = row.spring_impulse, kept[1] = row.lower_impulse, kept[2] = row.upper_impulse;
  }
  JFPX_HD void store(const FrameRow& row, const NoPart*, std::uint32_t i) const {
    keep_impulses(row.impulses, &joints.now[joint_of(i)]);
  }

 private:
  /// The inertias of the bodies of a joint at the start of the step.
  template <bool kFixed>
  JFPX_HD BodyPair joint_pair(const auto& row) const {
    return {nullptr, nullptr, &properties.inverse_inertia[row.a],
            kFixed ? nullptr : &properties.inverse_inertia[row.b]};
  }
  struct PointArms {
    Vec3 a, b;  ///< [m], from the centres of mass of the bodies of the row
  };
  /// Points of a contact in the row of a manifold.
  struct ContactPoints {
    const PointInput* points;  ///< null for a contact of two spheres
    bool is_flipped;
    PointArms of_sphere;
    Real distance_of_sphere = 0;

    /// @param row its normal is set
    JFPX_HD ContactPoints(const RowSetup& setup, const ManifoldRow& row, std::uint32_t contact)
        : points(nullptr), is_flipped(setup.is_flipped(setup.contacts.key(contact))) {
      if (setup.contacts.is_sphere(contact)) {
        distance_of_sphere = setup.contacts.distance(contact, 0);
        const Real half_overlap = distance_of_sphere < 0 ? distance_of_sphere * Real(0.5) : Real(0);
        const ContactKey& key = setup.contacts.key(contact);
        const Real *radius = setup.properties.radius, a = radius[is_flipped ? key.b : key.a],
                   b = radius[is_flipped ? key.a : key.b];
        of_sphere = {-row.normal * (a + half_overlap), row.normal * (b + half_overlap)};
        return;
      }
      points = setup.contacts.points + setup.contacts.manifold(contact).first;
    }
    JFPX_HD Real distance(std::uint32_t i) const {
      return points == nullptr ? distance_of_sphere : points[i].distance;
    }
    JFPX_HD PointArms arms(std::uint32_t i) const {
      if (points == nullptr) return of_sphere;
      const PointInput& point = points[i];
      if (is_flipped) return {point.arm_b, point.arm_a};
      return {point.arm_a, point.arm_b};
    }
  };
  /// The points with their weights in the centre of friction of the contact.
  struct FrictionPoints : ContactPoints {
    Real inverse_gap, scale = 1;

    /// @param row its normal and number of points are set
    JFPX_HD FrictionPoints(const RowSetup& setup, const ManifoldRow& row, std::uint32_t contact)
        : ContactPoints(setup, row, contact), inverse_gap(setup.inverse_friction_gap) {
      if (this->points == nullptr) return;
      Real sum = 0;
      for (std::uint32_t i = 0; i < row.count; ++i) sum += weight(i);
      scale = 1 / sum;
    }
    /// Share of a point, which changes continuously when it opens or closes a gap.
    JFPX_HD Real share(std::uint32_t i) const {
      return points == nullptr ? Real(1) : weight(i) * scale;
    }

   private:
    JFPX_HD Real weight(std::uint32_t i) const {
      const Real weight = 1 - points[i].distance * inverse_gap;
      return weight > 1 ? Real(1) : weight > kLeastWeight ? weight : kLeastWeight;
    }
  };
  /// kind_of() for joints.
  JFPX_HD RowKind joint_kind(std::uint32_t joint) const {
    if (!joints.is_used(joint)) return kNoRow;
    const ContactKey key = joints.key(joint);
    const std::uint8_t a = properties.traits[key.a];
    const std::uint8_t b = key.b == kWorld ? std::uint8_t{0} : properties.traits[key.b];
    if (sleeps(a) || sleeps(b) || ((a | b) & BodyTraits::kActive) == 0) return kNoRow;
    return kind_of_joint(joints.inputs[joint].type);
  }
  /// Projects the friction impulse of the last step, which had another normal.
  JFPX_HD static Vec3 in_tangent_plane(const Vec3& friction, const Vec3& normal) {
    return friction - normal * dot(friction, normal);
  }
  JFPX_HD bool is_movable(std::uint32_t body) const {
    return (properties.traits[body] & BodyTraits::kMovable) != 0;
  }
  /// Whether one of the bodies of a contact is movable and has joints.
  JFPX_HD bool is_jointed(std::uint32_t a, std::uint32_t b) const {
    const auto is_joined = [this](std::uint32_t body) {
      return is_movable(body) && properties.constrained[body] >= kHasJoint;
    };
    return joints.count > 0 && (is_joined(a) || is_joined(b));
  }
  JFPX_HD static bool sleeps(std::uint8_t traits) {
    return (traits & (BodyTraits::kMovable | BodyTraits::kActive)) == BodyTraits::kMovable;
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
