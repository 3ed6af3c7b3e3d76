/// Fields of bodies and scenes, in the order of JSON and snapshots; see field.hpp.
#pragma once

#include <jfpx/scene.hpp>

#include "src/scene/shape_fields.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

void each_field(Is<CollisionFilter> auto& filter, const auto& visit) {
  auto& [category, mask] = filter;
  visit(field("category"), category);
  visit(field("mask"), mask);
}

/// Only the locked axes are in JSON.
void each_field(Is<MotionLocks> auto& locks, const auto& visit) {
  auto& [linear_x, linear_y, linear_z, angular_x, angular_y, angular_z] = locks;
  visit(newer_field("linear_x"), linear_x);
  visit(newer_field("linear_y"), linear_y);
  visit(newer_field("linear_z"), linear_z);
  visit(newer_field("angular_x"), angular_x);
  visit(newer_field("angular_y"), angular_y);
  visit(newer_field("angular_z"), angular_z);
}

void each_field(Is<BodyState> auto& state, const auto& visit) {
  auto& [position, orientation, velocity, angular_velocity] = state;
  visit(field("position", kInWorld), position);
  visit(field("orientation", kUnitQuaternion), orientation);
  visit(field("velocity", kFinite), velocity);
  visit(field("angular_velocity", kFinite), angular_velocity);
}

void each_field(Is<BodyDef> auto& body, const auto& visit) {
  auto& [shape, mass, kinematic, inertia, position, orientation, velocity, angular_velocity,
         acceleration, linear_damping, angular_damping, friction, restitution, rolling_friction,
         spinning_friction, can_sleep, filter, sensor, motion_locks, user_data] = body;
  visit(required_field("shape"), shape);
  visit(field("mass", kNotNegative), mass);
  visit(field("kinematic"), kinematic);
  visit(field("position", kInWorld), position);
  visit(field("orientation", kUnitQuaternion), orientation);
  visit(field("velocity", kFinite), velocity);
  visit(field("angular_velocity", kFinite), angular_velocity);
  visit(field("acceleration", kFinite), acceleration);
  visit(field("linear_damping", kAboveZeroToOne), linear_damping);
  visit(field("angular_damping", kAboveZeroToOne), angular_damping);
  visit(field("friction", kNotNegative), friction);
  visit(field("restitution", kZeroToOne), restitution);
  visit(field("can_sleep"), can_sleep);
  visit(newer_field("inertia"), inertia);
  visit(newer_field("filter"), filter);
  visit(newer_field("rolling_friction", kNotNegative), rolling_friction);
  visit(newer_field("spinning_friction", kNotNegative), spinning_friction);
  visit(newer_field("sensor"), sensor);
  visit(newer_field("motion_locks"), motion_locks);
  visit(newer_field("user_data"), user_data);
}

void each_field(Is<SoftStepSettings> auto& settings, const auto& visit) {
  auto& [substeps, contact_hertz, damping_ratio, push_out_speed, restitution_threshold,
         speculative_margin] = settings;
  visit(field("substeps", Interval{1, kMaxSubsteps, "from 1 to 64"}), substeps);
  visit(field("contact_hertz", kNotNegative), contact_hertz);
  visit(field("damping_ratio", Interval{Real(0.01), 1000, "in [0.01, 1000]"}), damping_ratio);
  visit(field("push_out_speed", kPositive), push_out_speed);
  visit(field("restitution_threshold", kNotNegative), restitution_threshold);
  visit(field("speculative_margin", Interval{0, kMaxCoordinate, "in [0, 1e9]"}),
        speculative_margin);
}

void each_field(Is<ResolverSettings> auto& settings, const auto& visit) {
  auto& [max_iterations, velocity_epsilon, position_epsilon, restitution_velocity, angular_limit] =
      settings;
  visit(field("max_iterations"), max_iterations);
  visit(field("velocity_epsilon", kPositive), velocity_epsilon);
  visit(field("position_epsilon", kPositive), position_epsilon);
  visit(field("restitution_velocity", kNotNegative), restitution_velocity);
  visit(field("angular_limit", kAboveZeroToOne), angular_limit);
}

void each_field(Is<SleepSettings> auto& settings, const auto& visit) {
  auto& [enabled, speed, time, epsilon, bias] = settings;
  visit(field("enabled"), enabled);
  visit(field("speed", kNotNegative), speed);
  visit(field("time", kNotNegative), time);
  visit(field("epsilon", kPositive), epsilon);
  visit(field("bias", kAboveZeroToOne), bias);
}

void each_field(Is<MaterialSettings> auto& settings, const auto& visit) {
  constexpr Enumerator kRule{"one of the rules of CombineRule"};
  auto& [friction, restitution] = settings;
  visit(field("friction", kRule), friction);
  visit(field("restitution", kRule), restitution);
}

/// Name and settings, without the bodies, pairs and joints.
void each_field(Is<Scene> auto& scene, const auto& visit) {
  auto& [name, dt, bodies, solver, soft_step, resolver, sleep, materials, ignored_pairs, joints] =
      scene;
  visit(field("name"), name);
  visit(field("dt", kStepLength), dt);
  visit(field("solver", Enumerator{"one of the values of Solver"}), solver);
  visit(field("soft_step"), soft_step);
  visit(field("resolver"), resolver);
  visit(field("sleep"), sleep);
  visit(field("materials"), materials);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
