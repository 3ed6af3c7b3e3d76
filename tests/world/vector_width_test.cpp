/// Worlds have the same bits for all vector widths of the processor.
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <variant>

namespace jfpx {
namespace {

using test::operator""_r;

/// Balls, boxes and hulls that overlap, slide, rebound and roll in a room.
Scene random_bodies(Random* random, bool any_boxes) {
  Scene scene;
  scene.soft_step.substeps = 1 + static_cast<std::uint32_t>(random->below(5));
  const std::uint64_t count = 1 + random->below(any_boxes ? 150 : 300);
  const bool rebounds = random->below(2) == 0, rolls = random->below(4) == 0;
  const bool any_locks = random->below(3) == 0;
  const bool any_hulls = any_boxes && random->below(2) == 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    BodyDef def = test::heavy(random->uniform_in_box({-3, 0, -3}, {3, 8, 3}));
    def.shape = Sphere{random->uniform(0.2_r, 0.9_r)};
    if (any_boxes && random->below(3) != 0) {
      def.shape = Box{random->uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {0.8_r, 0.8_r, 0.8_r})};
    }
    if (any_hulls && random->below(2) == 0) def.shape = test::random_hull(random);
    def.mass = random->below(30) == 0 ? 0 : random->uniform(0.1_r, 10);
    def.friction = random->below(3) == 0 ? 0 : random->uniform(0, 1);
    if (def.mass > 0) {
      // Slow and fast rotations have different methods for their gyroscopic terms.
      const Real spin = random->below(2) == 0 ? 0.5_r : 12;
      def.velocity = random->uniform_in_box({-6, -6, -6}, {6, 6, 6});
      def.angular_velocity = random->uniform_in_box({-spin, -spin, -spin}, {spin, spin, spin});
      def.angular_damping = random->below(2) == 0 ? 1 : random->uniform(0.5_r, 1);
    }
    if (any_locks) def.motion_locks = test::random_locks(random);
    if (rebounds) def.restitution = random->uniform(0, 1);
    if (rolls && random->below(2) == 0) def.rolling_friction = 0.02_r;
    scene.bodies.push_back(def);
  }
  if (any_boxes && random->below(2) == 0) {
    BodyDef moving = test::heavy({0, 0.5_r, 0});
    moving.shape = Box{{2, 0.5_r, 2}};
    moving.mass = 0;
    moving.kinematic = true;
    moving.velocity = {0.5_r, 0, 0.2_r};
    moving.angular_velocity = {0, 1, 0};
    scene.bodies.push_back(moving);
  }
  scene.bodies.push_back(test::ground());
  for (const Vec3& normal : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
    scene.bodies.push_back(test::half_space(normal, -4));
  }
  return scene;
}

/// Adds joints of all types, and ball joints that only hold two points together, which have vectors
/// of their own.
void add_joints(Random* random, Scene* scene) {
  test::add_random_joints(random, scene);
  for (Joint& joint : scene->joints) {
    auto* ball = std::get_if<BallJoint>(&joint);
    if (ball == nullptr || random->below(2) == 0) continue;
    joint = BallJoint{
        .a = ball->a, .b = ball->b, .anchor_a = ball->anchor_a, .anchor_b = ball->anchor_b};
  }
}

// The snapshots contain the impulses of contacts and joints.
TEST(VectorWidths, HaveEqualSnapshotsOfRandomBodies) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 45; ++k) {
    Scene scene = random_bodies(&random, k % 3 != 0);
    if (k % 3 == 2) add_joints(&random, &scene);
    World scalar(scene, {.collider = {.backend = Backend::cpu, .simd = SimdLevel::scalar}});
    World vectors(scene, {.collider = {.backend = Backend::cpu, .simd = SimdLevel::automatic}});
    const std::span<const BodyId> ids = scalar.bodies();
    for (int n = 0; n < 25; ++n) {
      const BodyId pushed = ids[random.below(ids.size())];
      for (World* world : {&scalar, &vectors}) {
        world->apply_force(pushed, {1, 2, 3});
        world->apply_torque(pushed, {0.1_r, 0.2_r, 0.3_r});
      }
      scalar.step();
      vectors.step();
      ASSERT_EQ(scalar.snapshot(), vectors.snapshot()) << "scene " << k << ", step " << n;
    }
  }
}

}  // namespace
}  // namespace jfpx
