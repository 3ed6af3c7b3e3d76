/// Example of a native world: bodies, a force, joints, contact events and queries.
#include <jfpx/world.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>
#include <variant>
#include <vector>

namespace {

using jfpx::Real;

jfpx::BodyDef box(const jfpx::Vec3& half_extents, const jfpx::Vec3& position, Real mass) {
  jfpx::BodyDef def;
  def.shape = jfpx::Box{half_extents};
  def.position = position;
  def.mass = mass;
  return def;
}

jfpx::BodyDef ball(const jfpx::Vec3& position, Real radius = Real(0.5), Real mass = 1) {
  jfpx::BodyDef def;
  def.shape = jfpx::Sphere{radius};
  def.position = position;
  def.mass = mass;
  def.restitution = Real(0.3);
  return def;
}

/// Contact generator: the centre of a body stays inside a hollow sphere, which is no shape of jfpx.
struct Dome {
  jfpx::BodyId body, ground;
  jfpx::Vec3 centre;
  Real radius = 1;  ///< [m]

  void operator()(jfpx::ContactContext& context) const {
    const jfpx::Vec3 inwards = centre - context.state(body).position;
    const Real distance = jfpx::length(inwards);
    if (distance < radius) return;
    const jfpx::Vec3 normal = inwards * (1 / distance);
    context.add({.a = body,
                 .b = ground,
                 .normal = normal,
                 .point = centre - normal * radius,
                 .distance = radius - distance});
  }
};

/// Change of the number of bodies in contact.
int change_of_count(const jfpx::ContactEvent& event) {
  if (event.phase == jfpx::ContactPhase::stay) return 0;
  return event.phase == jfpx::ContactPhase::begin ? 1 : -1;
}

}  // namespace

int main() {
  jfpx::Scene scene;
  scene.bodies.push_back(box({4, Real(0.5), 4}, {0, Real(-0.5), 0}, 0));  // mass 0: immovable
  jfpx::World world(scene);

  const jfpx::BodyId crate = world.add(box({1, 1, 1}, {0, 1, 0}, 20));
  for (int i = 0; i < 5; ++i) world.add(ball({Real(i) - 2, 5, Real(i) - 2}));
  world.add_force(jfpx::Drag{.linear = Real(0.5), .wind = {8, 0, 0}});

  const jfpx::BodyId hook = world.add(ball({-3, 6, 3}, Real(0.1), 0));
  const jfpx::BodyId lamp = world.add(ball({-3, 5, 3}, Real(0.2), 10));
  const jfpx::JointId rope =
      world.add_joint(jfpx::DistanceJoint{.a = lamp, .b = hook, .max_length = 1});
  jfpx::DistanceJoint shorter = std::get<jfpx::DistanceJoint>(world.joint(rope));
  shorter.max_length = Real(0.8);
  world.set_joint(rope, shorter);
  const jfpx::BodyId floor = world.bodies()[0];
  const jfpx::BodyId bird = world.add(ball({0, 2, -9}, Real(0.1)));
  world.add_contact_generator(Dome{bird, floor, {0, 2, -9}, 1});
  constexpr std::uint32_t kDecoration = 2;  // a bit of its own
  world.set_filter(lamp, {.category = kDecoration, .mask = 0});

  jfpx::BodyDef zone = box({4, 2, 4}, {0, 2, 0}, 0);
  zone.sensor = true;
  const jfpx::BodyId above_floor = world.add(zone);

  int began = 0, fell = 0, visitors = 0;
  for (int n = 0; n < 600; ++n) {
    const jfpx::StepReport report = world.step();
    // The state of a body was no longer finite; the step and all later ones are undone.
    if (report.non_finite) world.remove(report.non_finite_body);

    for (const jfpx::ContactEvent& event : world.contact_events()) {
      if (event.phase == jfpx::ContactPhase::begin) ++began;
    }
    for (const jfpx::ContactEvent& event : world.contact_events()) {
      if (event.a == above_floor || event.b == above_floor) visitors += change_of_count(event);
    }

    // Iterates over a copy, because removal changes the list.
    const std::span<const jfpx::BodyId> ids = world.bodies();
    for (const jfpx::BodyId id : std::vector(ids.begin(), ids.end())) {
      if (world.state(id).position.y > -20) continue;
      world.remove(id);
      ++fell;
    }
  }
  std::printf("%d touches, %d balls were blown off the floor\n", began, fell);

  std::printf("bodies above the floor: %d\n", visitors);

  const jfpx::JointState taut = world.joint_state(rope);
  std::printf("the rope of %.2f m pulls with %.0f N\n", static_cast<double>(taut.length),
              static_cast<double>(taut.tension));

  const auto is_solid = [&world](jfpx::BodyId id) { return !world.sensor(id); };
  const std::optional<jfpx::RayHit> hit =
      world.cast_ray({.origin = {0, 10, 0}, .direction = {0, -1, 0}}, is_solid);
  if (hit && hit->body == crate) {
    std::printf("the crate's top is at %.2f m\n", static_cast<double>(hit->point.y));
  }

  // How far a ball of 0.3 m can fall.
  const std::optional<jfpx::ShapeHit> below = world.cast_shape(
      {.shape = jfpx::Sphere{Real(0.3)}, .position = {0, 10, 0}, .translation = {0, -10, 0}},
      is_solid);
  if (below) std::printf("a ball falls by %.2f m\n", static_cast<double>(below->fraction * 10));

  // The closest body to a point, up to 5 m.
  const std::optional<jfpx::BodyDistance> closest =
      world.closest_body({.position = {0, 4, 0}, .max_distance = 5}, is_solid);
  if (closest) std::printf("%.2f m to the closest body\n", static_cast<double>(closest->distance));

  for (const jfpx::BodyId id : world.overlapping(jfpx::Sphere{Real(1.5)}, {-3, 6, 3})) {
    if (id == lamp) std::printf("the lamp hangs near its hook\n");
  }
  Real deepest = 0;  // of the contacts of the crate
  for (const jfpx::Contact& contact : world.contacts()) {
    const bool of_crate = contact.a == crate || contact.b == crate;
    if (of_crate && !contact.sensor) deepest = std::min(deepest, contact.distance);
  }
  std::printf("the crate is %s, %.0f mm deep in the floor\n",
              world.awake(crate) ? "awake" : "asleep", static_cast<double>(-deepest) * 1000);

  Real weight = 0;  // [N], on the floor
  for (const jfpx::ContactForce& force : world.contact_forces()) {
    if (force.a == floor) weight -= force.force.y;
    if (force.b == floor) weight += force.force.y;
  }
  std::printf("the floor carries %.0f kg\n", static_cast<double>(weight) / 9.81);

  const auto swing = [&world, lamp] {
    world.apply_force(lamp, {2000, 0, 0});
    for (int n = 0; n < 60; ++n) world.step();
    return world.state_hash();
  };
  const jfpx::Snapshot snapshot = world.snapshot();
  const std::uint64_t hash = swing();
  world.restore(snapshot);
  if (swing() == hash) std::printf("the lamp has swung twice, with the same bits\n");
}
