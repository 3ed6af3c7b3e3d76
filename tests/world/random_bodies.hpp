/// Random bodies of every shape, close enough to touch.
#pragma once

#include "tests/world/support.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline Quat random_rotation(Random* random) {
  Quat q;
  do {
    q = {random->uniform(-1, 1), random->uniform(-1, 1), random->uniform(-1, 1),
         random->uniform(-1, 1)};
  } while (!(length_squared(q) > 0.01_r));
  return normalized(q);
}

/// A unit vector.
inline Vec3 random_direction(Random* random) {
  return normalized(rotate(random_rotation(random), {1, 0, 0}));
}

inline SolidShape random_sub_shape(Random* random) {
  const std::uint64_t kind = random->below(5);
  if (kind < 2) return Sphere{random->uniform(0.1_r, 0.6_r)};
  if (kind == 2) return Capsule{random->uniform(0.1_r, 0.4_r), random->uniform(0.1_r, 0.6_r)};
  return Box{random->uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {0.5_r, 0.7_r, 0.9_r})};
}

/// One to five parts of any kind.
inline Compound random_compound(Random* random) {
  Compound compound;
  for (std::uint64_t left = 1 + random->below(5); left > 0; --left) {
    CompoundPart part;
    part.shape = random_sub_shape(random);
    part.position = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    part.orientation = random_rotation(random);
    part.density = random->uniform(0.5_r, 2);
    compound.parts.push_back(part);
  }
  return centred(compound);
}

/// A sphere, another solid or a compound with a probability of about a third each, sometimes
/// immovable; rarely a wall.
inline BodyDef random_body(Random* random, Real room) {
  BodyDef def;
  const std::uint64_t kind = random->below(31);
  if (kind == 0) def.shape = HalfSpace{rotate(random_rotation(random), {1, 0, 0}), -room};
  if (kind == 1)
    def.shape = Plane{rotate(random_rotation(random), {1, 0, 0}), random->uniform(-1, 1)};
  if (kind > 1) def.shape = std::visit([](auto s) -> Shape { return s; }, random_sub_shape(random));
  if (kind > 20) def.shape = random_compound(random);
  def.mass = kind < 2 || random->below(6) == 0 ? Real(0) : random->uniform(0.5_r, 2);
  def.position = random->uniform_in_box({-room, -room, -room}, {room, room, room});
  def.orientation = random_rotation(random);
  return def;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
