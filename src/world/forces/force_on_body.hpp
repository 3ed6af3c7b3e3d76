/// The forces of force.hpp on one body, for the CPU and for devices.
///
/// A Body has `state()`; `mass()`; `apply(force)`, at the centre of mass; `apply_at(force, point)`;
/// `wake()`; and `for_each_part(visit)`, which calls visit(SolidPart) for its solids in order.
#pragma once

#include <jfpx/force.hpp>

#include "src/world/bodies/solid_part.hpp"
#include "src/world/forces/force_laws.hpp"

#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Position and velocity of a point of a body or of the world.
struct MovingPoint {
  Vec3 position, velocity;
};
JFPX_HD inline MovingPoint moving_point(const BodyState& body, const Vec3& point) {
  const Vec3 arm = rotate(body.orientation, point);
  return {body.position + arm, body.velocity + cross(body.angular_velocity, arm)};
}

/// Force of a Spring or a Bungee on its end a; end b receives the opposite.
template <class S>
JFPX_HD Vec3 force_on_end_a(const S& spring, const MovingPoint& a, const MovingPoint& b) {
  constexpr bool kSlack = std::is_same_v<S, Bungee>;
  return spring_force(a.position - b.position, a.velocity - b.velocity, spring.stiffness,
                      spring.damping, spring.rest_length, kSlack);
}

JFPX_HD inline Mat3 tensor_at_control(const AeroControl& force) {
  const Real size = absolute(force.control);
  return interpolate(force.base, force.control < 0 ? force.lowest : force.highest,
                     Real(1) < size ? Real(1) : size);
}

template <class Body>
JFPX_HD void act_on_surface(const Mat3& tensor, const Vec3& point, const Vec3& wind, Body* body) {
  const BodyState state = body->state();
  const Mat3 axes = to_matrix(state.orientation);
  const MovingPoint surface = moving_point(state, point);
  const Vec3 airspeed = transform_transpose(axes, surface.velocity - wind);
  body->apply_at(axes * (tensor * airspeed), surface.position);
}

// Each function applies a force to an awake body. Springs, which have two ends, are separate.
template <class Body>
JFPX_HD void act_on(const Gravity& force, Body* body) {
  body->apply(force.acceleration * body->mass());
}
template <class Body>
JFPX_HD void act_on(const Drag& force, Body* body) {
  const Vec3 velocity = body->state().velocity - force.wind;
  body->apply(drag_force(velocity, force.linear, force.quadratic));
}
template <class Body>
JFPX_HD void act_on(const Aero& force, Body* body) {
  act_on_surface(force.tensor, force.point, force.wind, body);
}
template <class Body>
JFPX_HD void act_on(const AeroControl& force, Body* body) {
  act_on_surface(tensor_at_control(force), force.point, force.wind, body);
}
template <class Body>
JFPX_HD void act_on(const Buoyancy& force, Body* body) {
  const HalfSpace& liquid = force.liquid;
  const Vec3 weight = normalized(liquid.normal) * (force.density * force.gravity);  // [N/m^3]
  const BodyState state = body->state();
  const Transform whole = make_transform(state.orientation, state.position);
  body->for_each_part([&](const SolidPart& part) {
    const Transform pose = part.in_compound != 0 ? whole * part.local : whole;
    // Relative to the centre of the solid, so that the centroid keeps its precision far from the
    // origin.
    const HalfSpace below{liquid.normal, liquid.offset - dot(liquid.normal, pose.origin)};
    part.visit([&](const auto& solid) {
      const Submerged displaced = submerged(solid, pose.basis, below);
      if (!(displaced.volume > 0)) return;
      body->apply_at(weight * displaced.volume,
                     pose.origin + displaced.moment * (1 / displaced.volume));
    });
  });
}
/// Also acts on sleeping bodies.
/// @param time [s], start of the step
template <class Body>
JFPX_HD void act_on(const Explosion& force, double time, Body* body) {
  const auto age = static_cast<Real>(time - static_cast<double>(force.start));
  const Vec3 away = body->state().position - force.centre;
  const Real distance = length(away);
  const Real share = blast(distance, age, force.speed, force.thickness, force.duration);
  if (!(share > 0 && distance > kEpsilon)) return;
  body->wake();
  body->apply(away * (force.peak_force * share / distance));
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
