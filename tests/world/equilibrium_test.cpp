/// Bodies under forces, and compounds, come to rest where forces balance.
#include "tests/world/quality.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;

TEST(Equilibrium, ABoxOnADampedSpringSleepsAtItsEquilibrium) {
  Scene scene;
  scene.bodies = {test::crate({}, {0.5_r, 0.5_r, 0.5_r})};
  World world(scene);
  Spring spring;
  spring.a.body = world.body_at(0);
  spring.b.point = {0, 3, 0};
  spring.stiffness = 20;
  spring.damping = 1.5_r;
  spring.rest_length = 1;
  world.add_force(spring);
  ASSERT_LT(test::time_to_sleep(&world, 60), 60);
  EXPECT_NEAR(static_cast<double>(world.states()[0].position.y), 2 - test::kGravity / 20, 0.005);
}

TEST(Equilibrium, CompoundsRest) {
  Compound hammer;
  hammer.parts = {{Box{{0.5_r, 0.1_r, 0.1_r}}, {}, {}, 1},
                  {Box{{0.1_r, 0.15_r, 0.3_r}}, {0.5_r, 0, 0}, {}, 1}};
  Scene scene;
  for (int i = 0; i < 6; ++i) {
    BodyDef body;
    body.shape = centred(hammer);
    body.position = {static_cast<Real>(2 * i), 1, 0};
    scene.bodies.push_back(body);
  }
  scene.bodies.push_back(test::ground());
  World world(scene);
  EXPECT_LT(test::time_to_sleep(&world, 10), 10);
  EXPECT_LE(test::penetration(world).largest, 0.002);
}

}  // namespace
}  // namespace jfpx
