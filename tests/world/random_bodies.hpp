/// Random bodies of every shape, close enough to touch.
#pragma once

#include "tests/world/support.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline Quat random_rotation(Random* random) {
  Quat q;
  do {
    q = {random->uniform(-1, 1), random->uniform(-1, 1), random->uniform(-1, 1),
         random->uniform(-1, 1)};
  } while (!(length_squared(q) > 0.01_r));
  return normalized(q);
}

/// A unit vector.
inline Vec3 random_direction(Random* random) {
  return normalized(rotate(random_rotation(random), {1, 0, 0}));
}

/// The hull of four to twelve points, with its centre of mass at the origin.
inline Hull random_hull(Random* random) {
  for (;;) {
    // A tetrahedron, so that the points are not in a plane, and up to eight points.
    std::vector<Vec3> points{
        {0.2_r, 0, -0.1_r}, {-0.2_r, 0, -0.1_r}, {0, 0.2_r, -0.1_r}, {0, 0.1_r, 0.2_r}};
    for (std::uint64_t left = random->below(9); left > 0; --left) {
      points.push_back(random->uniform_in_box({-0.5_r, -0.7_r, -0.4_r}, {0.5_r, 0.7_r, 0.4_r}));
    }
    const Hull hull(points);
    if (hull.volume() > 0.02) return centred(hull);
  }
}

inline SolidShape random_sub_shape(Random* random) {
  const std::uint64_t kind = random->below(8);
  if (kind == 7) return Cone{random->uniform(0.1_r, 0.5_r), random->uniform(0.1_r, 0.6_r)};
  if (kind == 6) return Cylinder{random->uniform(0.1_r, 0.5_r), random->uniform(0.1_r, 0.6_r)};
  if (kind == 5) return random_hull(random);
  if (kind < 2) return Sphere{random->uniform(0.1_r, 0.6_r)};
  if (kind == 2) return Capsule{random->uniform(0.1_r, 0.4_r), random->uniform(0.1_r, 0.6_r)};
  return Box{random->uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {0.5_r, 0.7_r, 0.9_r})};
}

/// One to five parts of any kind.
inline Compound random_compound(Random* random) {
  Compound compound;
  for (std::uint64_t left = 1 + random->below(5); left > 0; --left) {
    CompoundPart part;
    part.shape = random_sub_shape(random);
    part.position = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    part.orientation = random_rotation(random);
    part.density = random->uniform(0.5_r, 2);
    compound.parts.push_back(part);
  }
  return centred(compound);
}

/// Whether a body with the shape may be movable.
inline bool has_volume(const Shape& shape) {
  return !std::holds_alternative<HalfSpace>(shape) && !std::holds_alternative<Plane>(shape) &&
         !std::holds_alternative<TriangleMesh>(shape) &&
         !std::holds_alternative<Heightfield>(shape);
}

/// A sheet of triangles, with holes.
inline TriangleMesh random_mesh(Random* random) {
  const auto columns = static_cast<std::uint32_t>(2 + random->below(4));
  const auto rows = static_cast<std::uint32_t>(2 + random->below(4));
  const Real size = random->uniform(0.3_r, 2);
  const Real roughness = random->below(3) == 0 ? Real(0) : random->uniform(0, 1);
  TriangleMeshDef def;
  for (std::uint32_t i = 0; i < rows * columns; ++i) {
    const auto x = static_cast<Real>(i % columns), z = static_cast<Real>(i / columns);
    def.vertices.push_back(Vec3{x, roughness * random->uniform(-1, 1), z} * size);
  }
  for (std::uint32_t i = 0; i + columns + 1 < rows * columns; ++i) {
    if (i % columns == columns - 1) continue;
    if (random->below(8) != 0) def.triangles.push_back({i, i + columns, i + 1});
    if (random->below(8) != 0) def.triangles.push_back({i + 1, i + columns, i + columns + 1});
  }
  def.triangles.push_back({0, columns, 1});
  def.two_sided = random->below(2) == 0;
  return TriangleMesh(std::move(def));
}

/// A heightfield of up to `most` rows and columns, often rough, often with holes.
inline HeightfieldDef random_heightfield(Random* random, std::uint32_t most) {
  HeightfieldDef def;
  def.columns = static_cast<std::uint32_t>(2 + random->below(most - 1));
  def.rows = static_cast<std::uint32_t>(2 + random->below(most - 1));
  def.spacing_x = random->uniform(0.3_r, 2);
  def.spacing_z = random->below(2) == 0 ? def.spacing_x : random->uniform(0.3_r, 2);
  const std::uint64_t kind = random->below(4);
  const Real roughness = kind == 0 ? Real(0) : random->uniform(0, 1);
  for (std::uint32_t i = 0; i < def.rows * def.columns; ++i) {
    // Steps have flat parts.
    Real height = random->uniform(-1, 1);
    if (kind == 1) height = random->below(4) == 0 ? Real(1) : Real(0);
    def.heights.push_back(roughness * height);
  }
  const std::uint64_t holes = random->below(2) == 0 ? 0 : random->below(4);
  for (std::uint64_t left = holes; left > 0; --left) {
    const std::uint64_t row = random->below(def.rows - 1), column = random->below(def.columns - 1);
    def.holes.push_back(static_cast<std::uint32_t>(row * def.columns + column));
  }
  def.two_sided = random->below(2) == 0;
  return def;
}

/// A sphere, another solid or a compound with a probability of about a third each, sometimes
/// immovable; rarely a mesh, a heightfield or a wall.
inline BodyDef random_body(Random* random, Real room) {
  BodyDef def;
  const std::uint64_t kind = random->below(33);
  if (kind == 0) def.shape = HalfSpace{rotate(random_rotation(random), {1, 0, 0}), -room};
  if (kind == 1)
    def.shape = Plane{rotate(random_rotation(random), {1, 0, 0}), random->uniform(-1, 1)};
  if (kind > 1) def.shape = std::visit([](auto s) -> Shape { return s; }, random_sub_shape(random));
  if (kind > 20) def.shape = random_compound(random);
  if (kind > 30) def.shape = random_mesh(random);
  if (kind == 32) def.shape = Heightfield(random_heightfield(random, 6));
  def.mass = kind < 2 || kind > 30 || random->below(6) == 0 ? Real(0) : random->uniform(0.5_r, 2);
  def.position = random->uniform_in_box({-room, -room, -room}, {room, room, room});
  def.orientation = random_rotation(random);
  return def;
}

/// No locks, those of a character or of a plane, or any.
inline MotionLocks random_locks(Random* random) {
  const std::uint64_t kind = random->below(8);
  if (kind < 4) return {};
  if (kind == 4) return kFixedRotation;
  if (kind == 5) return kPlanarMotion;
  const auto any = [random] { return random->below(2) == 0; };
  MotionLocks locks;
  locks.angular_x = any(), locks.angular_y = any(), locks.angular_z = any();
  if (kind == 6) return locks;
  locks.linear_x = any(), locks.linear_y = any(), locks.linear_z = any();
  return locks;
}

inline DistanceJoint random_distance_joint(Random* random, BodyId a, std::optional<BodyId> b) {
  DistanceJoint joint{.a = a, .b = b};
  const auto anchor = [&]() -> Vec3 {
    if (random->below(3) == 0) return {};
    return random->uniform_in_box({-0.5_r, -0.5_r, -0.5_r}, {0.5_r, 0.5_r, 0.5_r});
  };
  joint.anchor_a = anchor();
  joint.anchor_b = anchor();
  const std::uint64_t kind = random->below(4);
  joint.max_length = kind == 0 ? Real(1e9) : random->uniform(0, 3);
  joint.min_length = kind == 1 ? joint.max_length : kind == 2 ? joint.max_length / 2 : Real(0);
  if (kind == 0 || random->below(3) == 0) {
    joint.rest_length = random->uniform(0, 2);
    joint.hertz = random->uniform(0, random->below(5) == 0 ? Real(60) : Real(5));
    joint.damping_ratio = random->uniform(0, 1);
  }
  joint.collide_connected = random->below(3) == 0;
  return joint;
}

/// Sets what joints with frames have in common.
template <class J>
J random_frames(Random* random, BodyId a, std::optional<BodyId> b) {
  J joint;
  joint.a = a, joint.b = b;
  joint.anchor_a = random->uniform_in_box({-0.5_r, -0.5_r, -0.5_r}, {0.5_r, 0.5_r, 0.5_r});
  joint.anchor_b = random->uniform_in_box({-0.5_r, -0.5_r, -0.5_r}, {0.5_r, 0.5_r, 0.5_r});
  if (random->below(2) == 0) joint.axes_a = random_rotation(random);
  if (random->below(2) == 0) joint.axes_b = random_rotation(random);
  joint.collide_connected = random->below(3) == 0;
  return joint;
}

/// A joint of any type and with any parameters, of two given bodies.
/// @param b absent: the world
inline Joint random_joint(Random* random, BodyId a, std::optional<BodyId> b) {
  const auto spring = [&](Real* hertz, Real* damping_ratio) {
    if (random->below(2) == 0) return;
    *hertz = random->uniform(0, random->below(5) == 0 ? Real(60) : Real(5));
    *damping_ratio = random->uniform(0, 1);
  };
  const auto limits = [&](Real* least, Real* most, Real size) {
    if (random->below(2) == 0) *least = -random->uniform(0, size);
    if (random->below(2) == 0) *most = random->uniform(0, size);
  };
  const auto motor = [&](Real* speed, Real* limit) {
    if (random->below(2) == 0) return;
    *speed = random->uniform(-5, 5);
    *limit = random->uniform(0, 50);
  };
  switch (random->below(8)) {
    case 0: {
      auto joint = random_frames<BallJoint>(random, a, b);
      if (random->below(2) == 0) joint.cone_angle = random->uniform(0, 3);
      limits(&joint.min_twist, &joint.max_twist, 3);
      spring(&joint.hertz, &joint.damping_ratio);
      if (random->below(2) == 0) joint.friction_torque = random->uniform(0, 10);
      return joint;
    }
    case 1: {
      auto joint = random_frames<HingeJoint>(random, a, b);
      limits(&joint.min_angle, &joint.max_angle, 3);
      spring(&joint.hertz, &joint.damping_ratio);
      joint.target_angle = random->uniform(-3, 3);
      motor(&joint.motor_speed, &joint.max_motor_torque);
      return joint;
    }
    case 2: {
      auto joint = random_frames<SliderJoint>(random, a, b);
      limits(&joint.min_position, &joint.max_position, 2);
      spring(&joint.hertz, &joint.damping_ratio);
      joint.target_position = random->uniform(-1, 1);
      motor(&joint.motor_speed, &joint.max_motor_force);
      return joint;
    }
    case 3: {
      auto joint = random_frames<FixedJoint>(random, a, b);
      spring(&joint.linear_hertz, &joint.damping_ratio);
      spring(&joint.angular_hertz, &joint.damping_ratio);
      return joint;
    }
    case 4: {
      auto joint = random_frames<WheelJoint>(random, a, b);
      limits(&joint.min_position, &joint.max_position, 2);
      spring(&joint.hertz, &joint.damping_ratio);
      joint.steering_angle = random->uniform(-1, 1);
      motor(&joint.motor_speed, &joint.max_motor_torque);
      return joint;
    }
    default:
      return random_distance_joint(random, a, b);
  }
}

/// Adds joints to a scene: some between random bodies, and some at one body, up to more than there
/// are colors.
inline void add_random_joints(Random* random, Scene* scene) {
  const std::uint64_t bodies = scene->bodies.size();
  const auto add = [&](std::uint64_t a, std::uint64_t b) {
    const bool has_b = b < bodies;
    const auto movable = [&](std::uint64_t i) { return scene->bodies[i].mass > 0; };
    if (a == b || !(movable(a) || (has_b && movable(b)))) return;
    const BodyId id_a{static_cast<std::uint32_t>(a), 0}, id_b{static_cast<std::uint32_t>(b), 0};
    scene->joints.push_back(random_joint(random, id_a, has_b ? std::optional(id_b) : std::nullopt));
  };
  const std::uint64_t count = random->below(bodies + 1);
  for (std::uint64_t k = 0; k < count; ++k) add(random->below(bodies), random->below(bodies + 2));
  const std::uint64_t hub = random->below(bodies);
  if (random->below(4) == 0) {
    const std::size_t first = scene->joints.size();
    for (int k = 0; k < 70; ++k) add(hub, random->below(bodies));
    // This many springs would throw the bodies apart.
    for (Joint& joint : std::span(scene->joints).subspan(first)) {
      if (auto* distance = std::get_if<DistanceJoint>(&joint)) distance->hertz = 0;
    }
  }
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
