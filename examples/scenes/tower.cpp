/// boxes-and-balls: the thesis' benchmark, a leaning tower of balls over a ground (thesis 5.2).
#include "examples/scenes/makers.hpp"

namespace jfpx::inline JFPX_ABI::scenes {

// Numbers of the original demo; its damping acted twice a step (E18), here once. The ground is one
// half-space; the resolver may take 8 iterations per ball in each loop.
Scene make_boxes_and_balls(std::uint32_t spheres, std::uint64_t) {
  Scene scene;
  scene.name = "boxes-and-balls";
  scene.dt = Real(0.01);
  for (std::uint32_t i = 0; i < spheres; ++i) {
    const Real y = 1 + 3 * static_cast<Real>(i);
    BodyDef ball = sphere_at({Real(0.1) * y, y, 0}, 1, 20);
    ball.acceleration = {0, Real(-9.8), 0};
    ball.linear_damping = Real(0.99);
    ball.angular_damping = Real(0.8);
    ball.friction = Real(0.4);
    ball.restitution = Real(0.0001);
    scene.bodies.push_back(ball);
  }
  BodyDef ground;
  ground.shape = HalfSpace{{0, 1, 0}, 0};
  ground.mass = 0;
  ground.friction = Real(0.4);
  ground.restitution = Real(0.0001);
  scene.bodies.push_back(ground);
  return scene;
}

}  // namespace jfpx::inline JFPX_ABI::scenes
