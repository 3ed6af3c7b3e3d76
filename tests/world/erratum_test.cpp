/// Tests of errata that concern several parts of the engine; the tests of a part contain its own.
#include <jfpx/collide.hpp>
#include <jfpx/error.hpp>
#include <jfpx/thesis/particle.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <type_traits>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kNan;
using ::testing::HasSubstr;

TEST(Erratum, E08_a_position_that_is_no_number_is_refused_and_reaches_no_other_body) {
  Scene scene;
  scene.bodies = {test::ball({0, 0, 0}), test::ball({5, 0, 0})};
  World world(scene);
  const std::uint64_t before = world.state_hash();
  for (int axis = 0; axis < 3; ++axis) {
    for (const Real bad : {kNan, std::numeric_limits<Real>::infinity()}) {
      BodyState state = world.states()[0];
      state.position[axis] = bad;
      EXPECT_THROW(world.set_state(world.bodies()[0], state), InvalidArgument);
      scene.bodies[0].position = state.position;
      EXPECT_THROW(World{scene}, InvalidScene);
      const SphereInstance spheres[] = {{{1, 2, 3}, 1}, {state.position, 1}};
      try {
        make_sphere_collider()->find_contacts(spheres);
        ADD_FAILURE() << "the original makes a contact of NaNs";
      } catch (const InvalidArgument& error) {
        EXPECT_THAT(error.what(), HasSubstr("sphere 1"));
      }
    }
  }
  EXPECT_EQ(world.state_hash(), before);
  EXPECT_FALSE(world.step().non_finite);
}

// The early-out of the original subtracts the radius from each coordinate.
TEST(Erratum, E15b_half_spaces_at_any_angle_meet_spheres_by_their_distance) {
  EXPECT_FALSE(collide(SphereInstance{{0.72_r, 0.96_r, 0}, 1}, HalfSpace{{0.6_r, 0.8_r, 0}, 0})
                   .touching);  // 1.2 away
  EXPECT_TRUE(collide(SphereInstance{{0, -0.5_r, 0}, 1}, HalfSpace{{0, -1, 0}, 0}).touching);
  Scene scene;  // the same in a world
  scene.bodies = {test::ball({0.72_r, 0.96_r, 0}), test::ball({0, -0.5_r, 20}),
                  test::half_space({0.6_r, 0.8_r, 0}, 0)};
  World world(scene);
  world.step();
  ASSERT_EQ(world.contacts().size(), 1u);
  EXPECT_EQ(world.contacts()[0].a.index, 1u);
  EXPECT_NEAR(world.contacts()[0].distance, -0.4 - 1, 1e-6);
}

// In the original, fabs and literals such as 0.5 compute in double within float code.
TEST(Erratum, E28_arithmetic_on_reals_stays_in_reals) {
  const Vec3 v{1, 2, 3};
  static_assert(std::is_same_v<decltype(absolute(v.x)), Real>);
  static_assert(std::is_same_v<decltype(square_root(v.x)), Real>);
  static_assert(std::is_same_v<decltype(dot(v, v)), Real>);
  static_assert(std::is_same_v<decltype(length(v)), Real>);
  static_assert(std::is_same_v<decltype(determinant(Mat3{})), Real>);
  static_assert(std::is_same_v<decltype(determinant(Mat4{})), Real>);
  static_assert(std::is_same_v<decltype(add_scaled(Quat{}, v, 1).w), Real>);
  EXPECT_EQ(absolute(-std::numeric_limits<Real>::denorm_min()),
            std::numeric_limits<Real>::denorm_min());
}

// The original deletes objects of five classes through bases without a virtual destructor, and
// prints in its box tests, which takes most of their time.
TEST(Erratum, E31_what_is_deleted_through_a_base_has_a_virtual_destructor) {
  static_assert(std::has_virtual_destructor_v<SphereCollider>);
  static_assert(std::has_virtual_destructor_v<Error>);
  static_assert(!std::is_polymorphic_v<World> && !std::is_polymorphic_v<ParticleWorld>);
  static_assert(!std::is_copy_constructible_v<World> &&
                std::is_nothrow_move_constructible_v<World>);
  static_assert(std::is_trivially_copyable_v<Contact>, "contacts own nothing");
}

TEST(Erratum, E47_the_engine_prints_nothing) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  World world(scenes::make("mixed", {.spheres = 30}));
  std::uint64_t contacts = 0;
  for (int n = 0; n < 120; ++n) contacts += world.step().contacts;
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(contacts, 1000u);
}

}  // namespace
}  // namespace jfpx
