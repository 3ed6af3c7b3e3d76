/// Sweeps over one contact of two spheres, against closed forms.
#include "src/contact_solver/soft_step/sphere_row.hpp"

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using namespace soft_step;  // NOLINT: the namespace under test
using test::operator""_r;

constexpr double kTolerance = sizeof(Real) == 4 ? 2e-6 : 1e-14;

/// Two balls of unequal mass whose line of centres is oblique.
class SphereRowTest : public testing::Test {
 protected:
  SphereRowTest() {
    a.inverse_mass = 0.5_r, b.inverse_mass = 2;
    a.inverse_inertia = 1.25_r, b.inverse_inertia = 20;
    row.normal = normalized(Vec3{1, 2, -2});
    row.a = 0, row.b = 1;
    row.arm_a = 1, row.arm_b = 0.5_r;
    row.normal_impulse = -0.0_r;
    row.restitution = 0;
    set_masses<false>(&row, a, b);
    bodies = {accelerations, free};
  }
  void solve(bool use_bias) { soft_step::solve<false>(&row, &a, &b, constants, bodies, use_bias); }
  /// [m/s], along the normal; > 0: the balls separate.
  double opening() const { return static_cast<double>(dot(a.velocity - b.velocity, row.normal)); }
  Vec3 momentum() const {
    return a.velocity * (1 / a.inverse_mass) + b.velocity * (1 / b.inverse_mass);
  }

  StepConstants constants = make_step_constants({}, 1 / 60.0_r);
  SolverBody a, b;
  SphereRow row;
  Vec3 accelerations[2];
  FreeMotion free[2];
  ImpactBodies bodies;
};

TEST_F(SphereRowTest, ARelaxSweepEndsTheApproach) {
  a.velocity = row.normal * -0.2_r;
  const Vec3 before = momentum();
  solve(false);
  EXPECT_NEAR(opening(), 0, kTolerance);
  EXPECT_NEAR(length(momentum() - before), 0, kTolerance);
  EXPECT_NEAR(normal_impulse_of(row), 0.2 / 2.5, kTolerance) << "the reduced mass is 0.4 kg";
  EXPECT_TRUE(has_pushed(row));
}

TEST_F(SphereRowTest, ABiasSweepPushesAPenetrationOut) {
  row.distance = -0.001_r;
  solve(true);
  const Softness& s = constants.balls;
  EXPECT_NEAR(opening(), static_cast<double>(s.mass_scale * s.bias_rate) * 0.001, kTolerance);
  solve(false);
  EXPECT_NEAR(opening(), 0, kTolerance) << "the relax sweep removes the velocity of the push-out";
  EXPECT_TRUE(has_pushed(row)) << "also if the impulse is 0 again";
}

TEST_F(SphereRowTest, ADeepPenetrationIsAlsoProjected) {
  row.distance = -0.4_r;
  solve(true);
  const double push = std::min(static_cast<double>(constants.deep_balls.bias_rate) * 0.4,
                               static_cast<double>(constants.push_out_speed));
  EXPECT_LE(opening(), static_cast<double>(constants.max_bias_velocity) + kTolerance);
  EXPECT_NEAR(
      dot(a.shift - b.shift, row.normal),
      (push - static_cast<double>(constants.max_bias_velocity)) * static_cast<double>(constants.h),
      kTolerance);
}

TEST_F(SphereRowTest, ASpeculativeContactLetsTheBallsMeetAndNoMore) {
  row.distance = 0.5_r * constants.h;
  constants.restitution_threshold = 10;
  a.velocity = row.normal * -2;
  solve(true);
  EXPECT_NEAR(opening(), -0.5, 4 * kTolerance) << "the gap is closed at the end of the substep";
  row.normal_impulse = -0.0_r;
  a.velocity = row.normal * -2, b.velocity = {};
  solve(false);
  EXPECT_EQ(a.velocity, row.normal * -2) << "a relax sweep skips it";
  EXPECT_FALSE(has_pushed(row));
}

TEST_F(SphereRowTest, FrictionStaysWithinCoulombsCone) {
  row.friction = 0.25_r;
  const Vec3 tangent = normalized(Vec3{2, -2, -1});
  ASSERT_NEAR(dot(tangent, row.normal), 0, kTolerance);
  a.velocity = row.normal * -0.2_r + tangent * 5;
  for (int n = 0; n < 3; ++n) solve(false);
  EXPECT_NEAR(length(row.friction_impulse), 0.25 * static_cast<double>(normal_impulse_of(row)),
              kTolerance);
  EXPECT_LT(dot(row.friction_impulse, tangent), 0);
}

TEST_F(SphereRowTest, AnImpactFasterThanTheThresholdReboundsOnce) {
  row.restitution = 0.5_r;
  a.velocity = row.normal * -2;
  solve(true);
  EXPECT_NEAR(opening(), 1, kTolerance);
  EXPECT_EQ(rebounds_of(row), 1);
  EXPECT_TRUE(has_pushed(row));
  EXPECT_EQ(normal_impulse_of(row), 0) << "the impulse of a rebound is not kept";
  EXPECT_EQ(free[0].velocity, a.velocity - row.normal * -2) << "nor applied again";
}

TEST_F(SphereRowTest, TheImpulseOfTheLastStepIsNoPushOfThisOne) {
  row.normal_impulse = -0.3_r;
  warm_start<false>(row, &a, &b);
  EXPECT_NEAR(opening(), 0.3 * 2.5, kTolerance);
  EXPECT_FALSE(has_pushed(row));
  a.velocity += row.normal * 0.1_r;
  solve(false);
  EXPECT_NEAR(opening(), 0.1, kTolerance);
  EXPECT_FALSE(has_pushed(row)) << "the sweep has taken all of it back";
}

}  // namespace
}  // namespace jfpx
