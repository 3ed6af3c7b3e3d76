/// Fields of the forces of force.hpp and of their parts; see field.hpp.
#pragma once

#include <jfpx/force.hpp>

#include "src/scene/shape_fields.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

void each_field(Is<Attachment> auto& attachment, const auto& visit) {
  auto& [body, point] = attachment;
  visit(field("body"), body);
  visit(field("point", kFinite), point);
}
void each_field(Is<Gravity> auto& force, const auto& visit) {
  auto& [acceleration, body] = force;
  visit(field("acceleration", kFinite), acceleration);
  visit(field("body"), body);
}
void each_field(Is<Drag> auto& force, const auto& visit) {
  auto& [linear, quadratic, wind, body] = force;
  visit(field("linear", kNotNegative), linear);
  visit(field("quadratic", kNotNegative), quadratic);
  visit(field("wind", kFinite), wind);
  visit(field("body"), body);
}
template <class T>
concept Elastic = Is<T, Spring> || Is<T, Bungee>;
void each_field(Elastic auto& force, const auto& visit) {
  auto& [a, b, stiffness, damping, rest_length] = force;
  visit(field("a"), a);
  visit(field("b"), b);
  visit(field("stiffness", kNotNegative), stiffness);
  visit(field("damping", kNotNegative), damping);
  visit(field("rest_length", kNotNegative), rest_length);
}
void each_field(Is<Aero> auto& force, const auto& visit) {
  auto& [body, tensor, point, wind] = force;
  visit(field("body"), body);
  visit(field("tensor", kFinite), tensor);
  visit(field("point", kFinite), point);
  visit(field("wind", kFinite), wind);
}
void each_field(Is<AeroControl> auto& force, const auto& visit) {
  auto& [body, lowest, base, highest, point, wind, control] = force;
  visit(field("body"), body);
  visit(field("lowest", kFinite), lowest);
  visit(field("base", kFinite), base);
  visit(field("highest", kFinite), highest);
  visit(field("point", kFinite), point);
  visit(field("wind", kFinite), wind);
  visit(field("control", kFinite), control);
}
void each_field(Is<Buoyancy> auto& force, const auto& visit) {
  auto& [liquid, density, gravity, body] = force;
  visit(field("liquid", CheckedByCode{}), liquid);
  visit(field("density", kNotNegative), density);
  visit(field("gravity", kNotNegative), gravity);
  visit(field("body"), body);
}
void each_field(Is<Explosion> auto& force, const auto& visit) {
  auto& [centre, start, peak_force, speed, thickness, duration] = force;
  visit(field("centre", kFinite), centre);
  visit(field("start", kFinite), start);
  visit(field("peak_force", kNotNegative), peak_force);
  visit(field("speed", kPositive), speed);
  visit(field("thickness", kPositive), thickness);
  visit(field("duration", kPositive), duration);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
