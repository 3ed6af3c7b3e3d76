/// Names and members of the forces of force.hpp and of their parts, for recordings and snapshots.
/// Each function names all members of its type, so that a new member does not compile until it is
/// here.
#pragma once

#include <jfpx/force.hpp>

#include "src/base/binary_archive.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

// Each calls visit(name, member) for each field.
void each_field(Is<Attachment> auto& attachment, const auto& visit) {
  auto& [body, point] = attachment;
  visit("body", body);
  visit("point", point);
}
void each_field(Is<HalfSpace> auto& half_space, const auto& visit) {
  auto& [normal, offset] = half_space;
  visit("normal", normal);
  visit("offset", offset);
}
void each_field(Is<Gravity> auto& force, const auto& visit) {
  auto& [acceleration, body] = force;
  visit("acceleration", acceleration);
  visit("body", body);
}
void each_field(Is<Drag> auto& force, const auto& visit) {
  auto& [linear, quadratic, wind, body] = force;
  visit("linear", linear);
  visit("quadratic", quadratic);
  visit("wind", wind);
  visit("body", body);
}
template <class T>
concept Elastic = Is<T, Spring> || Is<T, Bungee>;
void each_field(Elastic auto& force, const auto& visit) {
  auto& [a, b, stiffness, damping, rest_length] = force;
  visit("a", a);
  visit("b", b);
  visit("stiffness", stiffness);
  visit("damping", damping);
  visit("rest_length", rest_length);
}
void each_field(Is<Aero> auto& force, const auto& visit) {
  auto& [body, tensor, point, wind] = force;
  visit("body", body);
  visit("tensor", tensor);
  visit("point", point);
  visit("wind", wind);
}
void each_field(Is<AeroControl> auto& force, const auto& visit) {
  auto& [body, lowest, base, highest, point, wind, control] = force;
  visit("body", body);
  visit("lowest", lowest);
  visit("base", base);
  visit("highest", highest);
  visit("point", point);
  visit("wind", wind);
  visit("control", control);
}
void each_field(Is<Buoyancy> auto& force, const auto& visit) {
  auto& [liquid, density, gravity, body] = force;
  visit("liquid", liquid);
  visit("density", density);
  visit("gravity", gravity);
  visit("body", body);
}
void each_field(Is<Explosion> auto& force, const auto& visit) {
  auto& [centre, start, peak_force, speed, thickness, duration] = force;
  visit("centre", centre);
  visit("start", start);
  visit("peak_force", peak_force);
  visit("speed", speed);
  visit("thickness", thickness);
  visit("duration", duration);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
