/// Scenes of spheres: pile, heap, dam-break, gas, columns, overlap, lattice and polydisperse.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

constexpr Real kRadius = Real(0.5);

Vec3 jitter(Random& random, Real amount) {
  return random.uniform_in_box({-amount, -amount, -amount}, {amount, amount, amount});
}

/// A lattice of spheres above the floor of an open box.
/// @param sphere(site) the sphere at a site of the lattice
/// @param length of the box along x, in widths of the lattice
template <class Sphere>
Scene in_open_box(const char* name, std::uint32_t count, const Sphere& sphere, Real length = 1) {
  constexpr Real kSpacing = Real(1.1), kGap = Real(0.6);
  Scene scene;
  scene.name = name;
  const std::uint32_t side = cube_side(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    scene.bodies.push_back(sphere(lattice_site(i, side) * kSpacing + Vec3{0, Real(0.6), 0}));
  }
  const Real width = static_cast<Real>(side - 1) * kSpacing;
  add_container(scene, {-kGap, 0, -kGap}, {width * length + kGap, 2 * width + 2, width + kGap},
                false, {});
  return scene;
}

/// @param length see in_open_box()
Scene heap(const char* name, const Counts& counts, Real length) {
  Random random(counts.seed);
  const auto ball = [&random](const Vec3& site) {
    const Real scale = random.uniform(Real(0.9), 1);
    BodyDef body =
        sphere_at(site + jitter(random, Real(0.04)), kRadius * scale, scale * scale * scale);
    // Resistance to rolling: otherwise some spheres roll in their hollows without end.
    body.angular_damping = Real(0.5);
    return body;
  };
  return in_open_box(name, counts.spheres, ball, length);
}

}  // namespace

Scene make_pile(const Counts& counts) {
  Random random(counts.seed);
  return in_open_box("pile", counts.spheres, [&random](const Vec3& site) {
    return sphere_at(site + jitter(random, Real(0.04)), kRadius, 1);
  });
}

Scene make_heap(const Counts& counts) { return heap("heap", counts, 1); }

Scene make_dam_break(const Counts& counts) { return heap("dam-break", counts, 4); }

Scene make_gas(const Counts& counts) {
  // Volume fraction 0.30: a sphere of radius 1/2 in a cell of edge cbrt(pi / 6 / 0.30).
  constexpr Real kSpacing = Real(1.2040);
  Scene scene;
  scene.name = "gas";
  Random random(counts.seed);
  const std::uint32_t side = cube_side(counts.spheres);
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const Vec3 site = lattice_site(i, side) * kSpacing;
    BodyDef body = sphere_at(site + jitter(random, Real(0.09)), kRadius, 1);
    body.velocity = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
    body.acceleration = {};
    body.friction = 0;
    body.restitution = Real(0.9);
    body.can_sleep = false;
    scene.bodies.push_back(body);
  }
  const Real width = static_cast<Real>(side - 1) * kSpacing;
  const Real gap = kSpacing * Real(0.5);
  BodyDef smooth;
  smooth.friction = 0;
  smooth.restitution = 1;
  add_container(scene, {-gap, -gap, -gap}, {width + gap, width + gap, width + gap}, true, smooth);
  return scene;
}

Scene make_columns(const Counts& counts) {
  constexpr std::uint32_t kHeight = 32;
  constexpr Real kSpacing = Real(0.75);  // neighbours initially overlap by a quarter of a diameter
  Scene scene;
  scene.name = "columns";
  const std::uint32_t columns = (counts.spheres + kHeight - 1) / kHeight;
  std::uint32_t side = 1;
  while (std::uint64_t{side} * side < columns) ++side;
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const std::uint32_t column = i / kHeight, row = column / side;
    const Vec3 position{static_cast<Real>(column % side) * 4,
                        kRadius + static_cast<Real>(i % kHeight) * kSpacing,
                        static_cast<Real>(row) * 4};
    scene.bodies.push_back(sphere_at(position, kRadius, 1));
  }
  BodyDef ground;
  const Real half_width = static_cast<Real>(side) * 2 + 100;
  ground.shape = Box{{half_width, 1, half_width}};
  ground.position = {static_cast<Real>(side - 1) * 2, -1, static_cast<Real>(side - 1) * 2};
  ground.mass = 0;
  scene.bodies.push_back(ground);
  return scene;
}

Scene make_overlap(const Counts& counts) {
  Scene scene;
  scene.name = "overlap";
  Random random(counts.seed);
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    scene.bodies.push_back(sphere_at(Vec3{0, 10, 0} + jitter(random, Real(0.05)), kRadius, 1));
  }
  return scene;
}

Scene make_lattice(const Counts& counts) {
  constexpr Real kSpacing =
      Real(0.97);  // axis neighbours overlap by 3 %, diagonal neighbours do not
  Scene scene;
  scene.name = "lattice";
  std::uint32_t side = cube_side(counts.spheres);
  if (std::uint64_t{side} * side * side > counts.spheres) --side;
  const std::uint32_t count = side * side * side;
  for (std::uint32_t i = 0; i < count; ++i) {
    BodyDef body = sphere_at(lattice_site(i, side) * kSpacing, kRadius, 1);
    body.acceleration = {};
    scene.bodies.push_back(body);
  }
  return scene;
}

Scene make_polydisperse(const Counts& counts) {
  Scene scene;
  scene.name = "polydisperse";
  Random random(counts.seed);
  // Radii over four decades, with equal expected numbers of spheres per decade. A radius is one of
  // four constants times a uniform factor, so that the bits do not depend on a library function.
  constexpr Real kDecades[] = {Real(5), Real(0.5), Real(0.05), Real(0.005)};
  const Real width = Real(8) * static_cast<Real>(cube_side(counts.spheres));
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const Real radius = kDecades[random.below(4)] * random.uniform(Real(0.1), 1);
    const Vec3 position =
        random.uniform_in_box({0, radius, 0}, {width, width * Real(0.25) + radius, width});
    const Real mass = radius * radius * radius * 8;
    scene.bodies.push_back(sphere_at(position, radius, mass));
  }
  add_container(scene, {-6, 0, -6}, {width + 6, width, width + 6}, false, {});
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
