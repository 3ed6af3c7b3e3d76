/// Example of a user-defined force: two bodies attract each other and circle around their centre.
#include <jfpx/world.hpp>

#include <cstdio>

namespace {

/// Newton's law of gravitation between two bodies.
struct Attraction {
  jfpx::BodyId a, b;
  jfpx::Real constant = 1;  ///< [m^3/(kg s^2)]

  void operator()(jfpx::ForceContext& context) const {
    const jfpx::Vec3 d = context.state(b).position - context.state(a).position;
    const jfpx::Real r2 = length_squared(d), r = jfpx::square_root(r2);
    const jfpx::Vec3 pull = d * (constant * context.mass(a) * context.mass(b) / (r2 * r));
    context.apply_force(a, pull);
    context.apply_force(b, -pull);
  }
};

jfpx::BodyDef star(const jfpx::Vec3& position, const jfpx::Vec3& velocity) {
  jfpx::BodyDef def;
  def.shape = jfpx::Sphere{jfpx::Real(0.1)};
  def.position = position;
  def.velocity = velocity;
  def.acceleration = {};
  def.can_sleep = false;
  return def;
}

}  // namespace

int main() {
  // On a circle of radius 1, the force 1/4 at distance 2 equals v^2: v = 1/2, period 4 pi s.
  jfpx::Scene scene;
  scene.dt = jfpx::Real(0.01);
  scene.bodies = {star({1, 0, 0}, {0, jfpx::Real(0.5), 0}),
                  star({-1, 0, 0}, {0, jfpx::Real(-0.5), 0})};
  jfpx::World world(scene);
  world.add_force(Attraction{world.bodies()[0], world.bodies()[1]});

  for (int quarter = 0; quarter <= 4; ++quarter) {
    const jfpx::Vec3 at = world.states()[0].position;
    std::printf("%5.2f s  (%+.2f, %+.2f)\n", world.time(), static_cast<double>(at.x),
                static_cast<double>(at.y));
    for (int n = 0; n < 314; ++n) world.step();
  }
}
