/// A world of jfpx's own: bodies come and go, contacts are heard, a force acts, a ray is cast.
#include <jfpx/world.hpp>

#include <cstdio>
#include <optional>
#include <span>
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

jfpx::BodyDef ball(const jfpx::Vec3& position) {
  jfpx::BodyDef def;
  def.shape = jfpx::Sphere{Real(0.5)};
  def.position = position;
  def.restitution = Real(0.3);
  return def;
}

}  // namespace

int main() {
  // y is up by convention: BodyDef::acceleration is (0, -9.81, 0) unless a body says otherwise.
  jfpx::Scene scene;
  scene.bodies.push_back(box({4, Real(0.5), 4}, {0, Real(-0.5), 0}, 0));  // mass 0: never moves
  jfpx::World world(scene);

  const jfpx::BodyId crate = world.add(box({1, 1, 1}, {0, 1, 0}, 20));
  for (int i = 0; i < 5; ++i) world.add(ball({Real(i) - 2, 5, Real(i) - 2}));
  world.add_force(jfpx::Drag{.linear = Real(0.5), .wind = {8, 0, 0}});

  int began = 0, fell = 0;
  for (int n = 0; n < 600; ++n) {
    const jfpx::StepReport report = world.step();
    // A body that has left the finite numbers: the step has not happened, nor will the next ones.
    if (report.non_finite) world.remove(report.non_finite_body);

    for (const jfpx::ContactEvent& event : world.contact_events()) {
      if (event.phase == jfpx::ContactPhase::begin) ++began;
    }

    // A copy of the list, because it changes with each body that goes.
    const std::span<const jfpx::BodyId> ids = world.bodies();
    for (const jfpx::BodyId id : std::vector(ids.begin(), ids.end())) {
      if (world.state(id).position.y > -20) continue;
      world.remove(id);
      ++fell;
    }
  }
  std::printf("%d touches, %d balls were blown off the floor\n", began, fell);

  const std::optional<jfpx::RayHit> hit =
      world.cast_ray({.origin = {0, 10, 0}, .direction = {0, -1, 0}});
  if (hit && hit->body == crate) {
    std::printf("the crate's top is at %.2f m\n", static_cast<double>(hit->point.y));
  }
}
