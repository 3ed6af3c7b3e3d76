/// Scene terrain: stones, balls, boxes and capsules fall into a hilly bowl of triangles.
#include "src/scenes/makers.hpp"

#include <algorithm>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

constexpr std::uint32_t kCells = 40;
constexpr Real kCell = Real(0.6);  // [m]

/// Smooth hills: random heights on a lattice of every fourth vertex, interpolated with zero slope.
class Hills {
 public:
  explicit Hills(Random* random) {
    for (Real& height : heights_) height = random->uniform(Real(-0.5), Real(0.5));
  }
  Real at(std::uint32_t x, std::uint32_t z) const {
    const auto smooth = [](std::uint32_t k) {
      const Real t = static_cast<Real>(k % kStep) / kStep;
      return t * t * (3 - 2 * t);
    };
    const Real u = smooth(x), v = smooth(z);
    const auto height = [&](std::uint32_t i, std::uint32_t k) {
      return heights_[(z / kStep + k) * kSide + x / kStep + i];
    };
    const Real near = height(0, 0) + (height(1, 0) - height(0, 0)) * u;
    const Real far = height(0, 1) + (height(1, 1) - height(0, 1)) * u;
    return near + (far - near) * v;
  }

 private:
  static constexpr std::uint32_t kStep = 4, kSide = kCells / kStep + 2;
  Real heights_[kSide * kSide];
};

/// The hills in a bowl, so that nothing rolls away.
TriangleMesh make_ground(Random* random) {
  const Hills hills(random);
  TriangleMeshDef def;
  for (std::uint32_t z = 0; z <= kCells; ++z) {
    for (std::uint32_t x = 0; x <= kCells; ++x) {
      const Real across = (static_cast<Real>(x) - kCells / 2) * kCell;
      const Real along = (static_cast<Real>(z) - kCells / 2) * kCell;
      const Real rim = (across * across + along * along) * Real(0.03);
      def.vertices.push_back({across, hills.at(x, z) + rim, along});
    }
  }
  for (std::uint32_t z = 0; z < kCells; ++z) {
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const std::uint32_t a = z * (kCells + 1) + x, c = a + kCells + 1;
      def.triangles.push_back({a, c, a + 1});
      def.triangles.push_back({a + 1, c, c + 1});
    }
  }
  return TriangleMesh(std::move(def));
}

/// The hull of twelve points around a tetrahedron.
Hull make_stone(Random* random) {
  const Real size = random->uniform(Real(0.2), Real(0.4));
  std::vector<Vec3> points{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  for (Vec3& point : points) point *= Real(0.45);
  for (int i = 0; i < 12; ++i) {
    const Vec3 p = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    if (length(p) > Real(0.1)) points.push_back(normalized(p) * random->uniform(Real(0.8), 1));
  }
  for (Vec3& point : points) point *= size;
  return centred(Hull(points));
}

}  // namespace

/// A quarter of the bodies each are stones, balls, boxes and capsules. They start on a lattice.
Scene make_terrain(const Counts& counts) {
  constexpr Real kSpacing = Real(1.3);
  Scene scene;
  scene.name = "terrain";
  Random random(counts.seed);
  BodyDef ground;
  ground.shape = make_ground(&random);
  ground.mass = 0;
  ground.friction = Real(0.7);
  scene.bodies.push_back(ground);
  const std::uint64_t bodies = 4 * std::uint64_t{counts.spheres};
  std::uint32_t side = 1;
  while (std::uint64_t{side} * side * side < bodies) ++side;
  side = std::min(side, kCells / 4);
  const Real width = static_cast<Real>(side - 1) * kSpacing;
  for (std::uint64_t i = 0; i < bodies; ++i) {
    BodyDef body;
    if (i % 4 == 0) body.shape = make_stone(&random);
    if (i % 4 == 1) body.shape = Sphere{random.uniform(Real(0.15), Real(0.3))};
    if (i % 4 == 2) {
      body.shape = Box{random.uniform_in_box({Real(0.15), Real(0.15), Real(0.15)},
                                             {Real(0.35), Real(0.35), Real(0.35)})};
    }
    if (i % 4 == 3) {
      body.shape =
          Capsule{random.uniform(Real(0.1), Real(0.2)), random.uniform(Real(0.1), Real(0.3))};
    }
    body.orientation = random_orientation(random);
    body.position = lattice_site(static_cast<std::uint32_t>(i), side) * kSpacing +
                    Vec3{width * Real(-0.5), Real(2.5), width * Real(-0.5)};
    body.rolling_friction = Real(0.01);
    scene.bodies.push_back(body);
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
