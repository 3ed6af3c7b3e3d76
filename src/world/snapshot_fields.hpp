/// Fields of the public types that a snapshot consists of. Each function names all members of its
/// type, so that a new member does not compile until it is here.
#pragma once

#include <jfpx/force.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/base/binary_archive.hpp"
#include "src/world/force_fields.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

void serialize(auto& archive, Is<Vec3> auto& v) { archive(v.x, v.y, v.z); }
void serialize(auto& archive, Is<Quat> auto& q) { archive(q.w, q.x, q.y, q.z); }
void serialize(auto& archive, Is<Mat3> auto& m) { archive(m.row[0], m.row[1], m.row[2]); }

void serialize(auto& archive, Is<Sphere> auto& sphere) {
  auto& [radius] = sphere;
  archive(radius);
}
void serialize(auto& archive, Is<Box> auto& box) {
  auto& [half_extents] = box;
  archive(half_extents);
}
void serialize(auto& archive, Is<Plane> auto& plane) {
  auto& [normal, offset] = plane;
  archive(normal, offset);
}
void serialize(auto& archive, Is<CompoundPart> auto& part) {
  auto& [shape, position, orientation, density] = part;
  archive(shape, position, orientation, density);
}
void serialize(auto& archive, Is<Compound> auto& compound) {
  auto& [parts] = compound;
  archive(parts);
}

void serialize(auto& archive, Is<BodyId> auto& id) {
  auto& [index, generation] = id;
  archive(index, generation);
}
void serialize(auto& archive, Is<BodyPair> auto& pair) {
  auto& [a, b] = pair;
  archive(a, b);
}
void serialize(auto& archive, Is<CollisionFilter> auto& filter) {
  auto& [category, mask] = filter;
  archive(category, mask);
}
void serialize(auto& archive, Is<Contact> auto& contact) {
  auto& [a, b, normal, point, distance, friction, restitution, sensor] = contact;
  archive(a, b, normal, point, distance, friction, restitution, sensor);
}

void serialize(auto& archive, Is<SoftStepSettings> auto& settings) {
  auto& [substeps, contact_hertz, damping_ratio, push_out_speed, restitution_threshold,
         speculative_margin] = settings;
  archive(substeps, contact_hertz, damping_ratio, push_out_speed, restitution_threshold,
          speculative_margin);
}
void serialize(auto& archive, Is<ResolverSettings> auto& settings) {
  auto& [max_iterations, velocity_epsilon, position_epsilon, restitution_velocity, angular_limit] =
      settings;
  archive(max_iterations, velocity_epsilon, position_epsilon, restitution_velocity, angular_limit);
}
void serialize(auto& archive, Is<SleepSettings> auto& settings) {
  auto& [enabled, speed, time, epsilon, bias] = settings;
  archive(enabled, speed, time, epsilon, bias);
}
void serialize(auto& archive, Is<MaterialSettings> auto& settings) {
  auto& [friction, restitution] = settings;
  archive(friction, restitution);
}
/// Name and settings, without the bodies and pairs.
void serialize(auto& archive, Is<Scene> auto& scene) {
  auto& [name, dt, bodies, solver, soft_step, resolver, sleep, materials, ignored_pairs] = scene;
  archive(name, dt, solver, soft_step, resolver, sleep, materials);
}

void serialize(auto& archive, Is<ForceId> auto& id) {
  auto& [number] = id;
  archive(number);
}
void serialize(auto& archive, Is<ContactGeneratorId> auto& id) {
  auto& [number] = id;
  archive(number);
}
/// Forces and their parts.
template <class T>
requires requires(T& value) {
  each_field(value, [](const char*, auto&) {});
}
void serialize(auto& archive, T& value) {
  each_field(value, [&](const char*, auto& field) { archive(field); });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
