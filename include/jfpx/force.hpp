/// Forces that act on the bodies of a World in every step: the forces of the thesis (4.4.3) and the
/// interface of user-defined forces. Aero and AeroControl are used by the demos of the thesis only.
#pragma once

#include <jfpx/step_view.hpp>

#include <concepts>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {

/// Identifies a force of one World. Never reused.
struct ForceId {
  std::uint64_t number = 0;
  friend bool operator==(const ForceId&, const ForceId&) = default;
};

/// Read access to the world for a force at the start of a step, and recipient of its contributions.
/// Contributions affect awake bodies only: a body that is at rest under its forces stays asleep,
/// and gravity wakes no body. A force that must affect sleeping bodies calls wake() or link().
/// Valid during the call, in the calling thread.
/// @throws InvalidArgument, in all functions, for an id of no living body; the step is then undone
class JFPX_API ForceContext : public StepView {
 public:
  ForceContext(BodyStore& bodies, double time) : StepView(bodies, time), bodies_(&bodies) {}

  /// Adds to the force [N] at the centre of mass, and to the torque [N m], in world axes. Has no
  /// effect on sleeping and immovable bodies.
  void apply_force(BodyId id, const Vec3& force);
  void apply_torque(BodyId id, const Vec3& torque);
  /// Applies the force at a point of the world [m].
  void apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point);

  /// Wakes a movable body.
  void wake(BodyId id);
  /// If one of the two bodies is awake, wakes the other movable body, so that both fall asleep
  /// together.
  void link(BodyId a, BodyId b);

 private:
  BodyStore* bodies_;
};

/// Any object callable with a ForceContext, for example a lambda. Calls in the same state must have
/// the same result, because a failed step is repeated; a force that depends on time must read it
/// from the context. An exception undoes the step and propagates to the caller of World::step().
template <class F>
concept Force = std::copy_constructible<F> && std::invocable<const F&, ForceContext&>;

/// A force that World::add_force() can validate.
/// @throws InvalidArgument with the names of the force and the field
template <class F>
concept CheckedForce = Force<F> && requires(const F& force, const ForceContext& context) {
  force.validate(context);
};

/// Force mass * acceleration on one body or on all bodies. Adds to BodyDef::acceleration, whose
/// default is gravity.
struct JFPX_API Gravity {
  Vec3 acceleration{0, Real(-9.81), 0};  ///< [m/s^2], finite
  std::optional<BodyId> body = {};       ///< all bodies if absent
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Drag of a medium: -(linear + quadratic * |u|) * u, where u is the velocity relative to the
/// medium. Steps must be short compared with mass / (linear + quadratic * |u|); in longer steps the
/// drag reverses the velocity.
struct JFPX_API Drag {
  Real linear = 0;                  ///< [kg/s], >= 0
  Real quadratic = 0;               ///< [kg/m], >= 0
  Vec3 wind = {};                   ///< [m/s], velocity of the medium
  std::optional<BodyId> body = {};  ///< all bodies if absent
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Attachment point of a spring: a point of a body, or of the world if `body` is absent.
struct Attachment {
  std::optional<BodyId> body = {};
  Vec3 point = {};  ///< [m], in body axes from the centre of mass; without a body in world axes
};

/// Spring between two attachments, with equal and opposite forces along the line between them
/// (errata E20, E21). At zero length the line is undefined and the force is zero. Steps must be
/// short compared with sqrt(mass / stiffness).
struct JFPX_API Spring {
  Attachment a = {}, b = {};  ///< at least one has a body; the bodies differ
  Real stiffness = 0;         ///< [N/m], >= 0
  Real damping = 0;           ///< [N s/m], >= 0, times the rate of change of the length
  Real rest_length = 0;       ///< [m], >= 0
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// A spring without force while it is shorter than its rest length.
struct JFPX_API Bungee {
  Attachment a = {}, b = {};
  Real stiffness = 0, damping = 0, rest_length = 0;  ///< as in Spring
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Aerodynamic surface: force = tensor * airspeed, both in body axes, at a point of the body. The
/// airspeed is v + omega x r - wind (erratum E27), so that wings damp rolling.
struct JFPX_API Aero {
  BodyId body = {};
  Mat3 tensor = diagonal({});  ///< [kg/s], body axes
  Vec3 point = {};             ///< [m], body axes, from the centre of mass
  Vec3 wind = {};              ///< [m/s], world axes
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Aerodynamic control surface that interpolates between three tensors.
struct JFPX_API AeroControl {
  BodyId body = {};
  Mat3 lowest = diagonal({}), base = diagonal({}), highest = diagonal({});  ///< [kg/s]
  Vec3 point = {};   ///< [m], body axes, from the centre of mass
  Vec3 wind = {};    ///< [m/s], world axes
  Real control = 0;  ///< [-]: lowest at -1, base at 0, highest at 1; clamped to [-1, 1]
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
  /// The tensor at `control`.
  Mat3 tensor() const;
};

/// Exact buoyancy of spheres, boxes and compounds: the weight of the displaced liquid, against
/// gravity, at the centroid of the displaced volume. Overlapping parts of a compound count twice.
struct JFPX_API Buoyancy {
  HalfSpace liquid = {};            ///< its solid side is the liquid; the normal points up
  Real density = 1000;              ///< [kg/m^3], >= 0
  Real gravity = Real(9.81);        ///< [m/s^2], >= 0
  std::optional<BodyId> body = {};  ///< all bodies if absent
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Pressure wave: a spherical shell that expands from a point. It wakes the bodies in the shell,
/// pushes them outwards and fades with time, not with distance. The force rises linearly to the
/// middle of the shell and falls. Like all forces, it wakes all bodies when it is added and
/// removed; remove it after its duration. A blast within one step is an impulse on the bodies of
/// World::bodies_within().
struct JFPX_API Explosion {
  Vec3 centre = {};     ///< [m]
  Real start = 0;       ///< [s], of the world's time
  Real peak_force = 0;  ///< [N], >= 0, in the middle of the shell at the start time
  Real speed = 340;     ///< [m/s], > 0, of the shell
  Real thickness = 10;  ///< [m], > 0, of the shell
  Real duration = 1;    ///< [s], > 0: time of the linear fading to 0
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
