/// The soft step against an oracle: rigid contacts of small systems, solved to convergence in
/// double.
#include "tests/world/quality.hpp"

#include <gtest/gtest.h>

#include <array>

namespace jfpx {
namespace {

using test::operator""_r;

using Vec = std::array<double, 3>;

Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec operator*(const Vec& a, double k) { return {a[0] * k, a[1] * k, a[2] * k}; }
Vec& operator+=(Vec& a, const Vec& b) {
  for (std::size_t i = 0; i < 3; ++i) a[i] += b[i];
  return a;
}
double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vec& a) { return std::sqrt(dot(a, a)); }
Vec to_double(const Vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// Balls without friction and restitution, and half-spaces. As in the soft step, normals are those
/// at the start of a step; in short substeps, the contacts are rigid, and projected Gauss-Seidel
/// solves all of them together.
class RigidContacts {
 public:
  explicit RigidContacts(const Scene& scene) {
    for (const BodyDef& body : scene.bodies) {
      if (const auto* sphere = std::get_if<Sphere>(&body.shape)) {
        balls_.push_back({to_double(body.position),
                          {},
                          {},
                          static_cast<double>(sphere->radius),
                          1 / static_cast<double>(body.mass)});
      } else {
        const HalfSpace& wall = std::get<HalfSpace>(body.shape);
        walls_.push_back({to_double(wall.normal), static_cast<double>(wall.offset)});
      }
    }
  }

  void step(double dt) {
    constexpr int kSubsteps = 200;
    find_contacts();
    for (int n = 0; n < kSubsteps; ++n) substep(dt / kSubsteps);
    for (Ball& ball : balls_) {
      ball.position += ball.shift;
      ball.shift = {};
    }
  }
  const Vec& position(std::size_t ball) const { return balls_[ball].position; }

 private:
  struct Ball {
    Vec position, velocity, shift;
    double radius, inverse_mass;
  };
  struct Wall {
    Vec normal;
    double offset;
  };
  struct RigidContact {
    Vec normal;  ///< from b to a
    double gap;  ///< [m], at the start of the step
    double mass;
    Ball *a, *b;  ///< b is null for a wall
    double impulse = 0;
  };

  void find_contacts() {
    constexpr double kReach = 0.3;
    contacts_.clear();
    for (std::size_t i = 0; i < balls_.size(); ++i) {
      Ball& a = balls_[i];
      for (const Wall& wall : walls_) {
        const double gap = dot(wall.normal, a.position) - wall.offset - a.radius;
        if (gap < kReach) contacts_.push_back({wall.normal, gap, 1 / a.inverse_mass, &a, nullptr});
      }
      for (std::size_t j = i + 1; j < balls_.size(); ++j) {
        Ball& b = balls_[j];
        const Vec d = a.position - b.position;
        const double distance = length(d), gap = distance - a.radius - b.radius;
        if (gap > kReach) continue;
        contacts_.push_back(
            {d * (1 / distance), gap, 1 / (a.inverse_mass + b.inverse_mass), &a, &b});
      }
    }
  }

  void substep(double h) {
    for (Ball& ball : balls_) ball.velocity[1] -= test::kGravity * h;
    for (RigidContact& c : contacts_) c.impulse = 0;
    double largest = 1;  // [m/s], change of a relative velocity
    for (int n = 0; n < 100000 && largest > 1e-12; ++n) {
      largest = 0;
      for (RigidContact& c : contacts_) {
        Vec velocity = c.a->velocity, shift = c.a->shift;
        if (c.b != nullptr) velocity += c.b->velocity * -1, shift += c.b->shift * -1;
        const double gap = std::max(0.0, c.gap + dot(c.normal, shift));
        const double wanted = c.impulse - c.mass * (dot(c.normal, velocity) + gap / h);
        const double change = std::max(0.0, wanted) - c.impulse;
        c.impulse += change;
        c.a->velocity += c.normal * (change * c.a->inverse_mass);
        if (c.b != nullptr) c.b->velocity += c.normal * (-change * c.b->inverse_mass);
        largest = std::max(largest, std::abs(change) / c.mass);
      }
    }
    EXPECT_LE(largest, 1e-12);
    for (Ball& ball : balls_) ball.shift += ball.velocity * h;
  }

  std::vector<Ball> balls_;
  std::vector<Wall> walls_;
  std::vector<RigidContact> contacts_;
};

/// A tetrahedron of 20 touching balls with random masses.
Scene tetrahedron(std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  const Real height = std::sqrt(2.0_r / 3), row = std::sqrt(3.0_r) / 2;
  for (int layer = 0; layer < 4; ++layer) {
    const int side = 4 - layer;
    for (int i = 0; i < side; ++i) {
      for (int j = 0; j < side - i; ++j) {
        const Real x = static_cast<Real>(j) + 0.5_r * static_cast<Real>(i + layer);
        const Real z = row * (static_cast<Real>(i) + static_cast<Real>(layer) / 3);
        BodyDef ball = test::heavy_ball({x, 0.5_r + height * static_cast<Real>(layer), z}, 0.5_r,
                                        random.uniform(1, 3));
        ball.friction = 0;
        scene.bodies.push_back(ball);
      }
    }
  }
  scene.bodies.push_back(test::ground());
  return scene;
}

TEST(Oracle, TheSoftStepTendsToRigidContactsAsSubstepsGrow) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const Scene scene = tetrahedron(seed);
  constexpr int kSteps = 24;  // the balls move by up to a radius
  RigidContacts oracle(scene);
  for (int n = 0; n < kSteps; ++n) oracle.step(static_cast<double>(scene.dt));
  for (const std::uint32_t substeps : {2u, 8u, 32u}) {
    Scene soft = scene;
    soft.soft_step.substeps = substeps;
    World world(test::awake(soft));
    for (int n = 0; n < kSteps; ++n) world.step();
    double error = 0, moved = 0;  // [m]
    for (std::size_t i = 0; i + 1 < scene.bodies.size(); ++i) {
      const Vec position = to_double(world.states()[i].position);
      error = std::max(error, length(position - oracle.position(i)));
      moved = std::max(moved, length(position - to_double(scene.bodies[i].position)));
    }
    EXPECT_GT(moved, 0.2);  // or the balls stay where they are
    EXPECT_LT(error, 0.004 + 0.04 / substeps) << substeps << " substeps";
  }
}

}  // namespace
}  // namespace jfpx
