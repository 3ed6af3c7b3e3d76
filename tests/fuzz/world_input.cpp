/// Bodies, forces and settings drawn from the bytes of a fuzzer.
#include "tests/fuzz/world_input.hpp"

#include <jfpx/error.hpp>

#include <optional>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace fuzz {
namespace {

using test::Bytes;

Quat draw_orientation(Bytes& bytes) {
  if (bytes.chance(Real(0.4))) return {};
  const Real w = bytes.number(-1, 1);
  const Vec3 v = bytes.vector(-1, 1);
  const Quat q{w, v.x, v.y, v.z};
  return bytes.chance(Real(0.9)) ? normalized(q) : q;
}

Vec3 draw_direction(Bytes& bytes) {
  constexpr Vec3 kAxes[] = {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}, {0, -1, 0}};
  if (bytes.chance(Real(0.5))) return kAxes[bytes.below(4)];
  const Vec3 v = bytes.vector(-1, 1);
  return bytes.chance(Real(0.9)) ? v * (Real(1) / length(v)) : v;
}

Sphere draw_sphere(Bytes& bytes) { return {bytes.number(Real(0.1), Real(1.5))}; }
Box draw_box(Bytes& bytes) { return {bytes.vector(Real(0.1), Real(1.5))}; }

Cylinder draw_cylinder(Bytes& bytes) {
  const Real radius = bytes.number(Real(0.01), 1);
  return {radius, bytes.number(Real(0.01), 1)};
}

Cone draw_cone(Bytes& bytes) {
  const Real radius = bytes.number(Real(0.01), 1);
  return {radius, bytes.number(Real(0.01), 1)};
}

Compound draw_compound(Bytes& bytes) {
  Compound compound;
  for (std::uint64_t n = bytes.below(4); n > 0; --n) {
    CompoundPart part;
    if (bytes.chance(Real(0.5))) {
      part.shape = draw_sphere(bytes);
    } else if (bytes.chance(Real(0.7))) {
      part.shape = draw_box(bytes);
    } else if (bytes.chance(Real(0.5))) {
      part.shape = draw_cone(bytes);
    } else {
      part.shape = draw_cylinder(bytes);
    }
    part.position = bytes.vector(-2, 2);
    part.orientation = draw_orientation(bytes);
    part.density = bytes.number(Real(0.1), 3);
    compound.parts.push_back(part);
  }
  return bytes.chance(Real(0.9)) ? centred(std::move(compound)) : compound;
}

/// A hull of up to twelve points. @throws InvalidArgument if they have none
Hull draw_hull(Bytes& bytes) {
  std::vector<Vec3> points;
  for (std::uint64_t n = 4 + bytes.below(9); n > 0; --n) points.push_back(bytes.vector(-1, 1));
  const Hull hull(points);
  return bytes.chance(Real(0.9)) ? centred(hull) : hull;
}

/// Triangles of any vertices. @throws InvalidArgument for a coordinate that is out of range
TriangleMesh draw_mesh(Bytes& bytes) {
  TriangleMeshDef def;
  for (std::uint64_t n = 3 + bytes.below(6); n > 0; --n) {
    def.vertices.push_back(bytes.vector(-4, 4));
  }
  const auto vertex = [&] { return static_cast<std::uint32_t>(bytes.below(def.vertices.size())); };
  for (std::uint64_t n = bytes.below(10); n > 0; --n) {
    const std::uint32_t a = vertex(), b = vertex();
    def.triangles.push_back({a, b, vertex()});
  }
  def.two_sided = bytes.chance(Real(0.5));
  return TriangleMesh(std::move(def));
}

/// @throws InvalidArgument for a number that is out of range
Heightfield draw_heightfield(Bytes& bytes) {
  HeightfieldDef def;
  def.columns = static_cast<std::uint32_t>(2 + bytes.below(4));
  def.rows = static_cast<std::uint32_t>(2 + bytes.below(4));
  def.spacing_x = bytes.number(Real(0.2), 2);
  def.spacing_z = bytes.number(Real(0.2), 2);
  for (std::uint32_t i = 0; i < def.columns * def.rows; ++i) {
    def.heights.push_back(bytes.number(-1, 1));
  }
  if (bytes.chance(Real(0.5))) def.holes.push_back(static_cast<std::uint32_t>(bytes.below(8)));
  def.two_sided = bytes.chance(Real(0.5));
  return Heightfield(std::move(def));
}

Shape draw_shape(Bytes& bytes) {
  switch (bytes.below(15)) {
    case 0:
    case 1:
      return draw_box(bytes);
    case 2:
      return HalfSpace{draw_direction(bytes), bytes.number(-2, 2)};
    case 3:
      return Plane{draw_direction(bytes), bytes.number(-2, 2)};
    case 4:
      return draw_compound(bytes);
    case 8:
      return Capsule{bytes.number(Real(0.1), 1), bytes.number(Real(0.1), 1)};
    case 9:
    case 10:
      try {
        return draw_hull(bytes);
      } catch (const InvalidArgument&) {
        return draw_sphere(bytes);
      }
    case 11:
      try {
        return draw_mesh(bytes);
      } catch (const InvalidArgument&) {
        return draw_box(bytes);
      }
    case 12:
      try {
        return draw_heightfield(bytes);
      } catch (const InvalidArgument&) {
        return draw_box(bytes);
      }
    case 13:
      return draw_cylinder(bytes);
    case 14:
      return draw_cone(bytes);
    default:
      return draw_sphere(bytes);
  }
}

Attachment draw_attachment(Bytes& bytes, std::span<const BodyId> bodies) {
  Attachment attachment;
  if (bytes.chance(Real(0.7))) attachment.body = draw_id(bytes, bodies);
  attachment.point = bytes.vector(-1, 1);
  return attachment;
}

Mat3 draw_matrix(Bytes& bytes) {
  Mat3 m;
  for (Vec3& row : m.row) row = bytes.vector(-2, 2);
  return m;
}

}  // namespace

BodyId draw_id(Bytes& bytes, std::span<const BodyId> bodies) {
  if (bodies.empty() || bytes.chance(Real(0.06))) {
    const auto index = static_cast<std::uint32_t>(bytes.below(32));
    return {index, static_cast<std::uint32_t>(bytes.below(4))};
  }
  return bodies[bytes.below(bodies.size())];
}

BodyDef draw_body(Bytes& bytes) {
  BodyDef def;
  def.shape = draw_shape(bytes);
  const bool wall = std::holds_alternative<HalfSpace>(def.shape) ||
                    std::holds_alternative<Plane>(def.shape) ||
                    std::holds_alternative<TriangleMesh>(def.shape) ||
                    std::holds_alternative<Heightfield>(def.shape);
  def.mass = bytes.chance(wall ? Real(0.95) : Real(0.15)) ? Real(0) : bytes.number(Real(0.1), 5);
  def.kinematic = def.mass == 0 && bytes.chance(Real(0.3));
  if (bytes.chance(Real(0.1))) def.inertia = draw_matrix(bytes);
  if (bytes.chance(Real(0.1))) def.inertia = diagonal(bytes.vector(1, 2));
  def.position = bytes.vector(-3, 3);
  def.orientation = draw_orientation(bytes);
  if (bytes.chance(Real(0.5))) {
    def.velocity = bytes.vector(-5, 5);
    def.angular_velocity = bytes.vector(-5, 5);
  }
  if (bytes.chance(Real(0.3))) {
    def.acceleration = bytes.vector(-10, 10);
    def.linear_damping = bytes.number(Real(0.5), 1);
    def.angular_damping = bytes.number(Real(0.5), 1);
    def.friction = bytes.number(0, 2);
    def.restitution = bytes.number(0, 1);
  }
  def.can_sleep = bytes.chance(Real(0.8));
  return def;
}

MotionLocks draw_locks(Bytes& bytes) {
  MotionLocks locks;
  for (bool* lock : {&locks.linear_x, &locks.linear_y, &locks.linear_z, &locks.angular_x,
                     &locks.angular_y, &locks.angular_z}) {
    *lock = bytes.chance(Real(0.5));
  }
  return locks;
}

CollisionFilter draw_filter(Bytes& bytes) {
  CollisionFilter filter;
  if (bytes.chance(Real(0.6))) filter.category = static_cast<std::uint32_t>(bytes.below(8));
  if (bytes.chance(Real(0.6))) filter.mask = ~static_cast<std::uint32_t>(bytes.below(8));
  return filter;
}

BodyState draw_state(Bytes& bytes) {
  BodyState state;
  state.position = bytes.vector(-3, 3);
  state.orientation = draw_orientation(bytes);
  state.velocity = bytes.vector(-5, 5);
  state.angular_velocity = bytes.vector(-5, 5);
  return state;
}

Scene draw_scene(Bytes& bytes) {
  Scene scene;
  if (bytes.chance(Real(0.3))) {
    scene.dt = bytes.number(Real(0.001), Real(0.1));
    scene.resolver.velocity_epsilon = bytes.number(Real(1e-5), Real(0.1));
    scene.resolver.position_epsilon = bytes.number(Real(1e-5), Real(0.1));
    scene.resolver.restitution_velocity = bytes.number(0, 1);
    scene.resolver.angular_limit = bytes.number(Real(0.01), 1);
    scene.sleep.epsilon = bytes.number(Real(0.001), 1);
    scene.sleep.bias = bytes.number(Real(0.01), 1);
    scene.sleep.enabled = bytes.chance(Real(0.8));
    scene.materials.friction = CombineRule{static_cast<std::uint8_t>(bytes.below(6))};
    scene.materials.restitution = CombineRule{static_cast<std::uint8_t>(bytes.below(6))};
  }
  scene.resolver.max_iterations = static_cast<std::uint32_t>(bytes.below(200));
  for (std::uint64_t n = bytes.below(8); n > 0; --n) scene.bodies.push_back(draw_body(bytes));
  return scene;
}

WorldSettings draw_settings(Bytes& bytes) {
  WorldSettings settings;
  settings.collider.backend = Backend::cpu;
  settings.collider.algorithm = SphereAlgorithm{static_cast<std::uint8_t>(bytes.below(3))};
  settings.collider.simd = SimdLevel{static_cast<std::uint8_t>(bytes.below(5))};
  settings.threads = bytes.chance(Real(0.05)) ? 2 : 1;
  settings.broad_phase = BroadPhase{static_cast<std::uint8_t>(bytes.below(3))};
  return settings;
}

GeneratedContact draw_contact(Bytes& bytes, std::span<const BodyId> bodies) {
  GeneratedContact contact;
  contact.a = draw_id(bytes, bodies);
  contact.b = draw_id(bytes, bodies);
  contact.normal = draw_direction(bytes);
  contact.point = bytes.vector(-3, 3);
  contact.distance = bytes.number(Real(-0.5), 0);
  contact.friction = bytes.number(0, 1);
  contact.restitution = bytes.number(0, 1);
  return contact;
}

namespace {

template <class J>
J draw_frames(Bytes& bytes, std::span<const BodyId> bodies) {
  J joint;
  joint.a = draw_id(bytes, bodies);
  if (bytes.chance(Real(0.7))) joint.b = draw_id(bytes, bodies);
  joint.anchor_a = bytes.vector(-1, 1);
  joint.anchor_b = bytes.vector(-2, 2);
  if (bytes.chance(Real(0.5))) joint.axes_a = draw_orientation(bytes);
  if (bytes.chance(Real(0.5))) joint.axes_b = draw_orientation(bytes);
  joint.collide_connected = bytes.chance(Real(0.3));
  return joint;
}

HingeJoint draw_hinge(Bytes& bytes, std::span<const BodyId> bodies) {
  auto joint = draw_frames<HingeJoint>(bytes, bodies);
  if (bytes.chance(Real(0.5))) joint.min_angle = bytes.number(-kPi, 0);
  if (bytes.chance(Real(0.5))) joint.max_angle = bytes.number(0, kPi);
  if (bytes.chance(Real(0.3))) joint.hertz = bytes.number(0, 10);
  joint.target_angle = bytes.number(-3, 3);
  joint.motor_speed = bytes.number(-10, 10);
  if (bytes.chance(Real(0.3))) joint.max_motor_torque = bytes.number(0, 100);
  return joint;
}

BallJoint draw_ball_joint(Bytes& bytes, std::span<const BodyId> bodies) {
  auto joint = draw_frames<BallJoint>(bytes, bodies);
  if (bytes.chance(Real(0.5))) joint.cone_angle = bytes.number(0, kPi);
  if (bytes.chance(Real(0.5))) joint.min_twist = bytes.number(-kPi, 0);
  if (bytes.chance(Real(0.5))) joint.max_twist = bytes.number(0, kPi);
  if (bytes.chance(Real(0.3))) joint.hertz = bytes.number(0, 10);
  joint.damping_ratio = bytes.number(0, 2);
  if (bytes.chance(Real(0.3))) joint.friction_torque = bytes.number(0, 10);
  return joint;
}

SliderJoint draw_slider(Bytes& bytes, std::span<const BodyId> bodies) {
  auto joint = draw_frames<SliderJoint>(bytes, bodies);
  if (bytes.chance(Real(0.5))) joint.min_position = bytes.number(-2, 0);
  if (bytes.chance(Real(0.5))) joint.max_position = bytes.number(0, 2);
  if (bytes.chance(Real(0.3))) joint.hertz = bytes.number(0, 10);
  joint.target_position = bytes.number(-1, 1);
  joint.motor_speed = bytes.number(-10, 10);
  if (bytes.chance(Real(0.3))) joint.max_motor_force = bytes.number(0, 100);
  return joint;
}

FixedJoint draw_fixed(Bytes& bytes, std::span<const BodyId> bodies) {
  auto joint = draw_frames<FixedJoint>(bytes, bodies);
  if (bytes.chance(Real(0.5))) joint.linear_hertz = bytes.number(0, 10);
  if (bytes.chance(Real(0.5))) joint.angular_hertz = bytes.number(0, 10);
  joint.damping_ratio = bytes.number(0, 2);
  return joint;
}

WheelJoint draw_wheel(Bytes& bytes, std::span<const BodyId> bodies) {
  auto joint = draw_frames<WheelJoint>(bytes, bodies);
  if (bytes.chance(Real(0.5))) joint.min_position = bytes.number(-2, 0);
  if (bytes.chance(Real(0.5))) joint.max_position = bytes.number(0, 2);
  if (bytes.chance(Real(0.7))) joint.hertz = bytes.number(0, 10);
  joint.damping_ratio = bytes.number(0, 2);
  joint.steering_angle = bytes.number(-1, 1);
  joint.motor_speed = bytes.number(-10, 10);
  if (bytes.chance(Real(0.3))) joint.max_motor_torque = bytes.number(0, 100);
  return joint;
}

}  // namespace

Joint draw_joint(Bytes& bytes, std::span<const BodyId> bodies) {
  switch (bytes.below(8)) {
    case 0:
      return draw_hinge(bytes, bodies);
    case 1:
      return draw_ball_joint(bytes, bodies);
    case 2:
      return draw_slider(bytes, bodies);
    case 3:
      return draw_fixed(bytes, bodies);
    case 4:
      return draw_wheel(bytes, bodies);
    default:
      break;
  }
  DistanceJoint joint{.a = draw_id(bytes, bodies)};
  if (bytes.chance(Real(0.7))) joint.b = draw_id(bytes, bodies);
  joint.anchor_a = bytes.vector(-1, 1);
  joint.anchor_b = bytes.vector(-2, 2);
  if (bytes.chance(Real(0.7))) joint.max_length = bytes.number(0, 3);
  if (bytes.chance(Real(0.3))) joint.min_length = joint.max_length;
  if (bytes.chance(Real(0.5))) joint.hertz = bytes.number(0, 10);
  joint.rest_length = bytes.number(0, 3);
  joint.damping_ratio = bytes.number(0, 2);
  joint.collide_connected = bytes.chance(Real(0.3));
  return joint;
}

/// A spring or a bungee.
template <class Elastic>
Elastic draw_elastic(Bytes& bytes, std::span<const BodyId> bodies) {
  Elastic elastic{.a = draw_attachment(bytes, bodies), .b = draw_attachment(bytes, bodies)};
  elastic.stiffness = bytes.number(0, 100);
  elastic.damping = bytes.number(0, 5);
  elastic.rest_length = bytes.number(0, 3);
  return elastic;
}

ForceId add_drawn_force(Bytes bytes, World& world) {
  const std::span<const BodyId> bodies = world.bodies();
  std::optional<BodyId> body;
  if (bytes.chance(Real(0.6))) body = draw_id(bytes, bodies);
  switch (bytes.below(9)) {
    case 0:
      return world.add_force(Gravity{bytes.vector(-10, 10), body});
    case 1: {
      Drag drag{.linear = bytes.number(0, 2), .quadratic = bytes.number(0, 2), .body = body};
      drag.wind = bytes.vector(-5, 5);
      return world.add_force(drag);
    }
    case 2:
      return world.add_force(draw_elastic<Spring>(bytes, bodies));
    case 3:
      return world.add_force(draw_elastic<Bungee>(bytes, bodies));
    case 4: {
      Aero aero{.body = draw_id(bytes, bodies), .tensor = draw_matrix(bytes)};
      aero.point = bytes.vector(-1, 1);
      aero.wind = bytes.vector(-5, 5);
      return world.add_force(aero);
    }
    case 5: {
      AeroControl aero{.body = draw_id(bytes, bodies), .lowest = draw_matrix(bytes)};
      aero.highest = draw_matrix(bytes);
      aero.point = bytes.vector(-1, 1);
      aero.control = bytes.number(-2, 2);
      return world.add_force(aero);
    }
    case 6: {
      Buoyancy buoyancy{.liquid = {draw_direction(bytes), bytes.number(-2, 2)}, .body = body};
      buoyancy.density = bytes.number(0, 2000);
      buoyancy.gravity = bytes.number(0, 20);
      return world.add_force(buoyancy);
    }
    case 7: {
      Explosion explosion{.centre = bytes.vector(-3, 3), .start = bytes.number(0, 1)};
      explosion.peak_force = bytes.number(0, 1000);
      explosion.speed = bytes.number(1, 340);
      explosion.thickness = bytes.number(Real(0.1), 10);
      explosion.duration = bytes.number(Real(0.1), 2);
      return world.add_force(explosion);
    }
    default: {
      // A user-defined force without validation.
      const BodyId id = draw_id(bytes, bodies);
      const Vec3 force = bytes.vector(-50, 50), point = bytes.vector(-3, 3);
      return world.add_force([id, force, point](ForceContext& context) {
        if (!context.contains(id)) return;
        context.wake(id);
        context.apply_force_at_point(id, force, point);
        context.link(id, context.bodies().front());
      });
    }
  }
}

}  // namespace fuzz
}  // namespace JFPX_ABI
}  // namespace jfpx
