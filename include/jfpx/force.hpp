/// Forces that act on the bodies of a World in every step: those of the thesis (4.4.3), and the
/// way to write one's own.
#pragma once

#include <jfpx/step_view.hpp>

#include <concepts>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {

/// Names a force of one World. Never used twice.
struct ForceId {
  std::uint64_t number = 0;
  friend bool operator==(const ForceId&, const ForceId&) = default;
};

/// What a force sees of a world at the start of a step, and where it leaves its push. What a force
/// adds reaches awake bodies only: a body that came to rest under its forces sleeps on, and gravity
/// wakes nobody. Forces that must affect sleeping bodies call wake() or link(). An id that is not
/// of a living body is an InvalidArgument, and the step is undone.
class JFPX_API ForceContext : public StepView {
 public:
  ForceContext(BodyStore& bodies, double time) : StepView(bodies, time), bodies_(&bodies) {}

  /// Adds to the force [N] at the centre of mass, and to the torque [N m], in world axes. Nothing
  /// happens to sleeping and immovable bodies.
  void apply_force(BodyId id, const Vec3& force);
  void apply_torque(BodyId id, const Vec3& torque);
  /// The force attacks at a point of the world [m].
  void apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point);

  /// Wakes a movable body.
  void wake(BodyId id);
  /// If one of two bodies is awake, so is the other, if movable: they fall asleep together.
  void link(BodyId a, BodyId b);

 private:
  BodyStore* bodies_;
};

/// Anything that can be called with a ForceContext, a lambda for example. It must do the same when
/// called again in the same state, for a failed step is repeated: what depends on time takes it
/// from the context. Exceptions undo the step and reach the caller of World::step().
template <class F>
concept Force = std::copy_constructible<F> && std::invocable<const F&, ForceContext&>;

/// A force that World::add_force() can check. @throws InvalidArgument naming force and field
template <class F>
concept CheckedForce = Force<F> && requires(const F& force, const ForceContext& context) {
  force.validate(context);
};

/// mass * acceleration on one body or on all, on top of BodyDef::acceleration, which is gravity
/// already unless a body says otherwise.
struct JFPX_API Gravity {
  Vec3 acceleration{0, Real(-9.81), 0};  ///< [m/s^2], finite
  std::optional<BodyId> body = {};       ///< all bodies if absent
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Resistance of a medium: -(linear + quadratic * |u|) * u, where u is the velocity relative to
/// the medium. Steps must be short against mass / (linear + quadratic * |u|), or it turns bodies
/// around.
struct JFPX_API Drag {
  Real linear = 0;     ///< [kg/s], >= 0
  Real quadratic = 0;  ///< [kg/m], >= 0
  Vec3 wind = {};      ///< [m/s], velocity of the medium
  std::optional<BodyId> body = {};
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// Where a spring is fixed: to a point of a body, or of the world where there is no body.
struct Attachment {
  std::optional<BodyId> body = {};
  Vec3 point = {};  ///< [m], in body axes from the centre of mass; without a body in world axes
};

/// Pushes and pulls two attachments towards a distance, with equal and opposite forces along the
/// line between them (errata E20, E21). Where the attachments meet there is no line and no force.
/// Steps must be short against sqrt(mass / stiffness).
struct JFPX_API Spring {
  Attachment a = {}, b = {};  ///< at least one has a body; not both the same
  Real stiffness = 0;         ///< [N/m], >= 0
  Real damping = 0;           ///< [N s/m], >= 0, of the change of length
  Real rest_length = 0;       ///< [m], >= 0
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// A spring that hangs slack when it is shorter than its rest length.
struct JFPX_API Bungee {
  Attachment a = {}, b = {};
  Real stiffness = 0, damping = 0, rest_length = 0;  ///< as of Spring
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// A surface in the air: force = tensor * velocity through the air, both in body axes, at a point
/// of the body. The air passes with v + omega x r - wind (erratum E27), so wings damp rolling.
struct JFPX_API Aero {
  BodyId body = {};
  Mat3 tensor = diagonal({});  ///< [kg/s], body axes
  Vec3 point = {};             ///< [m], body axes, from the centre of mass
  Vec3 wind = {};              ///< [m/s], world axes
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// An aerodynamic surface that can be steered between three tensors.
struct JFPX_API AeroControl {
  BodyId body = {};
  Mat3 lowest = diagonal({}), base = diagonal({}), highest = diagonal({});  ///< [kg/s]
  Vec3 point = {};   ///< [m], body axes, from the centre of mass
  Vec3 wind = {};    ///< [m/s], world axes
  Real control = 0;  ///< [-]: lowest at -1, base at 0, highest at 1; beyond, as at the end
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
  /// The tensor that `control` chooses.
  Mat3 tensor() const;
};

/// The weight of the liquid that a sphere, a box or an compound displaces, exactly, against
/// gravity, in the middle of the displaced liquid. What compounds displace twice counts twice.
struct JFPX_API Buoyancy {
  HalfSpace liquid = {};      ///< the solid side is liquid; the normal points up
  Real density = 1000;        ///< [kg/m^3], >= 0
  Real gravity = Real(9.81);  ///< [m/s^2], >= 0
  std::optional<BodyId> body = {};
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

/// A pressure wave: a shell that grows from a point, pushes outwards what it passes, wakes it, and
/// fades. Across the shell the push rises linearly to its middle and falls again.
struct JFPX_API Explosion {
  Vec3 centre = {};     ///< [m]
  Real start = 0;       ///< [s], of the world's time
  Real peak_force = 0;  ///< [N], >= 0, in the middle of the shell at the start
  Real speed = 340;     ///< [m/s], > 0, of the shell
  Real thickness = 10;  ///< [m], > 0, of the shell
  Real duration = 1;    ///< [s], > 0: by then the push has faded to 0, linearly
  void validate(const ForceContext& context) const;
  void operator()(ForceContext& context) const;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
