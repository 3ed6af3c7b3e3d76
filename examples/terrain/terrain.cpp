/// Example of a terrain: stones roll down a hill of triangles into a valley, and a ray finds the
/// ground.
#include <jfpx/world.hpp>

#include <cstdint>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

namespace {

using jfpx::Real;

constexpr std::uint32_t kRows = 41;
constexpr Real kCell = Real(0.5);  // [m]

/// [m], height of the ground: a valley along x = 0.
Real height(Real x) { return Real(0.05) * x * x; }

/// A grid of vertices, two triangles for each cell.
jfpx::TriangleMesh make_ground() {
  std::vector<jfpx::Vec3> vertices;
  std::vector<jfpx::Triangle> triangles;
  for (std::uint32_t i = 0; i < kRows * kRows; ++i) {
    const Real x = (static_cast<Real>(i % kRows) - kRows / 2) * kCell;
    const Real z = (static_cast<Real>(i / kRows) - kRows / 2) * kCell;
    vertices.push_back({x, height(x), z});
    if (i % kRows + 1 == kRows || i / kRows + 1 == kRows) continue;
    triangles.push_back({i, i + kRows, i + 1});  // counterclockwise seen from above
    triangles.push_back({i + 1, i + kRows, i + kRows + 1});
  }
  return jfpx::TriangleMesh(std::move(vertices), std::move(triangles));
}

}  // namespace

int main() {
  jfpx::Scene scene;
  jfpx::BodyDef ground;
  ground.shape = make_ground();
  ground.mass = 0;
  scene.bodies.push_back(ground);

  // The hull of seven points, with its centre of mass at the origin.
  const std::vector<jfpx::Vec3> points{{-1, 0, -1}, {1, 0, -1}, {1, 0, 1},        {-1, 0, 1},
                                       {0, 2, 0},   {0, -1, 0}, {0, 1, Real(0.9)}};
  const jfpx::Hull stone =
      jfpx::centred(jfpx::Hull(points)).scaled({Real(0.3), Real(0.3), Real(0.3)});
  jfpx::BodyDef body;
  body.shape = stone;  // copies share the data
  body.mass = Real(2500 * stone.volume());
  for (int i = 0; i < 20; ++i) {
    const Real x = Real(i % 2 == 0 ? 6 : -6);
    body.position = {x, height(x) + 1, static_cast<Real>(i) * Real(0.8) - 8};
    scene.bodies.push_back(body);
  }

  jfpx::World world(scene);
  for (int step = 0; step < 600; ++step) world.step();
  int in_valley = 0;
  for (const jfpx::BodyId id : world.bodies().subspan(1)) {
    const Real x = world.state(id).position.x;
    if (x > -6 && x < 6) ++in_valley;
  }
  const auto hit = world.cast_ray({{4, 10, Real(-9.9)}, {0, -1, 0}});
  std::printf("stones that have moved down: %d of 20\n", in_valley);
  std::printf("height of the ground at x = 4: %.2f m\n", hit ? double(hit->point.y) : 0.0);
  return in_valley == 20 && hit ? 0 : 1;
}
