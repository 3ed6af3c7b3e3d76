/// Closed rooms with fast bodies, for the tests of continuous collision.
#pragma once

#include "src/scene/compound.hpp"
#include "tests/world/random_bodies.hpp"

#include <cmath>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// The fixed shapes of which the six walls of a room consist.
inline constexpr const char* kRooms[] = {"half-spaces", "planes", "boxes",   "capsules",    "hulls",
                                         "compound",    "mesh",   "slivers", "sided meshes"};
inline constexpr int kRoomCount = 9;
/// The shapes of the bodies in a room.
inline constexpr const char* kThrown[] = {"sphere", "box", "capsule", "hull", "compound"};
inline constexpr int kThrownCount = 5;

/// [m], half the width of the space between the walls
inline constexpr Real kRoom = Real(0.5);

/// A cube of triangles whose fronts are inside.
/// @param rows,columns of each wall
inline TriangleMesh room_mesh(std::uint32_t rows, std::uint32_t columns, bool two_sided) {
  TriangleMeshDef def;
  def.two_sided = two_sided;
  for (int wall = 0; wall < 6; ++wall) {
    const int axis = wall / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto base = static_cast<std::uint32_t>(def.vertices.size());
    for (std::uint32_t i = 0; i <= rows; ++i) {
      for (std::uint32_t k = 0; k <= columns; ++k) {
        Vec3 p;
        p[axis] = wall % 2 == 0 ? -kRoom : kRoom;
        p[u] = kRoom * (2 * static_cast<Real>(i) / static_cast<Real>(rows) - 1);
        p[v] = kRoom * (2 * static_cast<Real>(k) / static_cast<Real>(columns) - 1);
        def.vertices.push_back(p);
      }
    }
    for (std::uint32_t i = 0; i < rows; ++i) {
      for (std::uint32_t k = 0; k < columns; ++k) {
        const std::uint32_t a = base + i * (columns + 1) + k, b = a + columns + 1;
        Triangle first{a, b, b + 1}, second{a, b + 1, a + 1};
        if (wall % 2 != 0) {
          std::swap(first[1], first[2]);
          std::swap(second[1], second[2]);
        }
        def.triangles.push_back(first);
        def.triangles.push_back(second);
      }
    }
  }
  return TriangleMesh(std::move(def));
}

/// A slab of a wall, between the inner sides of its neighbors and a little more.
inline Vec3 slab(int axis, Real half_thickness) {
  Vec3 half{kRoom, kRoom, kRoom};
  half = half + Vec3{half_thickness, half_thickness, half_thickness} * 2;
  half[axis] = half_thickness;
  return half;
}

/// Adds parallel capsules that overlap, so that no ball passes between them.
inline void add_capsules(int axis, Real side, const BodyDef& wall, Scene* scene) {
  constexpr Real kRadius = Real(0.08), kDistance = Real(0.1);
  const int u = (axis + 1) % 3, along = (axis + 2) % 3;
  for (Real at = -kRoom - kRadius; at < kRoom + 2 * kRadius; at += kDistance) {
    BodyDef def = wall;
    def.shape = Capsule{kRadius, kRoom + kRadius};
    def.position[axis] = side * (kRoom + kRadius);
    def.position[u] = at;
    const Real half = square_root(0.5_r);
    if (along == 0) def.orientation = {half, 0, 0, half};
    if (along == 2) def.orientation = {half, half, 0, 0};
    scene->bodies.push_back(def);
  }
}

/// Adds the walls of a room. @param wall the properties of the fixed bodies
inline void add_room(Random* random, int kind, const BodyDef& wall, Scene* scene) {
  const Real half_thickness = 0.0005_r * std::pow(Real(100), random->uniform());
  Compound compound;
  const auto add = [&](Shape shape, const Vec3& position = {}) {
    BodyDef def = wall;
    def.shape = std::move(shape);
    def.position = position;
    scene->bodies.push_back(def);
  };
  if (kind >= 6) {
    return add(kind == 6   ? room_mesh(1, 1, false)
               : kind == 7 ? room_mesh(200, 1, false)
                           : room_mesh(3, 4, true));
  }
  for (int i = 0; i < 6; ++i) {
    const int axis = i / 2;
    const Real side = i % 2 == 0 ? Real(-1) : Real(1);
    Vec3 normal, centre;
    normal[axis] = -side;
    centre[axis] = side * (kRoom + half_thickness);
    const Box box{slab(axis, half_thickness)};
    if (kind == 0) add(HalfSpace{normal, -kRoom});
    if (kind == 1) add(random->below(2) == 0 ? Plane{normal, -kRoom} : Plane{-normal, kRoom});
    if (kind == 2) add(box, centre);
    if (kind == 3) add_capsules(axis, side, wall, scene);
    if (kind == 4) {
      std::vector<Vec3> corners;
      for (int k = 0; k < 8; ++k) {
        const Vec3& h = box.half_extents;
        corners.push_back(
            {(k & 1) != 0 ? h.x : -h.x, (k & 2) != 0 ? h.y : -h.y, (k & 4) != 0 ? h.z : -h.z});
      }
      add(Hull(corners), centre);
    }
    if (kind == 5) compound.parts.push_back({box, centre, {}, 1});
  }
  if (kind == 5) add(compound);
}

/// [m], the largest coordinate of a body that is inside of the walls of a room
inline Real inside_of(int kind) {
  return kind == 3 ? kRoom + 0.02_r : kRoom;  // capsules form grooves
}

/// A solid inside of a ball. @param kind index in kThrown
inline SolidShape thrown_solid(Random* random, int kind, Real radius) {
  const auto half = [&] { return radius * random->uniform(0.15_r, 0.55_r); };
  if (kind == 0) return Sphere{radius};
  if (kind == 1) return Box{{half(), half(), half()}};
  if (kind == 2) return Capsule{half() * 0.8_r, half()};
  std::vector<Vec3> points = {{radius, 0, 0}, {-radius, 0, 0}, {0, radius, 0}, {0, 0, radius}};
  for (std::uint64_t left = 2 + random->below(12); left > 0; --left) {
    points.push_back(random_direction(random) * radius);
  }
  return centred(Hull(points));
}
inline Shape thrown_shape(Random* random, int kind, Real radius) {
  if (kind < 4) {
    return std::visit([](auto s) -> Shape { return s; }, thrown_solid(random, kind, radius));
  }
  Compound compound;
  for (std::uint64_t left = 2 + random->below(3); left > 0; --left) {
    CompoundPart part;
    part.shape = thrown_solid(random, static_cast<int>(random->below(4)), radius * 0.6_r);
    part.position = random_direction(random) * (radius * 0.4_r);
    part.orientation = random_rotation(random);
    compound.parts.push_back(part);
  }
  return centred(compound);
}

/// A room with two to seven bodies that are thrown at up to 200 m/s. They hit each other and the
/// walls several times in a step.
/// @param thrown index in kThrown; negative: random
struct ThrowScene {
  Scene scene;
  std::vector<int> thrown;       ///< of the last bodies of the scene: their indices in kThrown
  std::size_t first_thrown = 0;  ///< index of their first body
};
inline ThrowScene throw_scene(Random* random, int room, int thrown = -1) {
  ThrowScene result;
  Scene& scene = result.scene;
  scene.sleep.enabled = false;
  BodyDef wall;
  wall.mass = 0;
  wall.restitution = random->below(2) == 0 ? Real(1) : random->uniform();
  wall.friction = random->below(2) == 0 ? Real(0) : random->uniform();
  add_room(random, room, wall, &scene);
  result.first_thrown = scene.bodies.size();
  const Real radius = 0.02_r * std::pow(5.0_r, random->uniform()), most = kRoom - 1.5_r * radius;
  for (std::uint64_t left = 2 + random->below(6); left > 0; --left) {
    const int kind = thrown >= 0 ? thrown : static_cast<int>(random->below(kThrownCount));
    BodyDef def = wall;
    def.shape = thrown_shape(random, kind, radius);
    def.mass = std::pow(10.0_r, random->uniform(-1, 1));
    def.position = random->uniform_in_box({-most, -most, -most}, {most, most, most});
    def.orientation = random_rotation(random);
    const Real speed = random->below(3) == 0 ? Real(0) : 2 * std::pow(100.0_r, random->uniform());
    def.velocity = random_direction(random) * speed;
    def.angular_velocity = random_direction(random) * (speed * random->uniform(0, 0.1_r) / radius);
    if (random->below(2) == 0) def.acceleration = {0, -9.81_r, 0};
    scene.bodies.push_back(def);
    result.thrown.push_back(kind);
  }
  return result;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
