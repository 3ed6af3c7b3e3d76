/// Scene boxes-and-balls: the thesis' benchmark, a leaning tower of balls above the ground (thesis
/// 5.2).
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

namespace {

void set_material(BodyDef* body) {
  body->linear_damping = Real(0.99);
  body->angular_damping = Real(0.8);
  body->friction = Real(0.4);
  body->restitution = Real(0.0001);
}

}  // namespace

// The numbers of the original demo. The original applies damping twice per step (E18), jfpx once.
// The ground is one half-space, and the resolver is limited to 8 iterations per body in each loop.
// The thesis timed the demo without boxes. Optional boxes fall in a second column beside the tower,
// as in the original.
Scene make_boxes_and_balls(const Counts& counts) {
  Scene scene;
  scene.name = "boxes-and-balls";
  scene.solver = Solver::worst_first;
  scene.dt = Real(0.01);
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const Real y = 1 + 3 * static_cast<Real>(i);
    BodyDef ball = sphere_at({Real(0.1) * y, y, 0}, 1, 20);
    ball.acceleration = {0, Real(-9.8), 0};
    set_material(&ball);
    scene.bodies.push_back(ball);
  }
  BodyDef ground;
  ground.shape = HalfSpace{{0, 1, 0}, 0};
  ground.mass = 0;
  set_material(&ground);
  scene.bodies.push_back(ground);
  for (std::uint32_t j = 0; j < counts.boxes; ++j) {
    BodyDef box;
    box.shape = Box{{1, 1, 1}};
    box.position = {0, 10 + 3 * static_cast<Real>(j), 3};
    set_material(&box);
    scene.bodies.push_back(box);
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
