/// Bodies that never come to rest, for soak tests.
#pragma once

#include "tests/world/random_bodies.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Walls of a box, as half-spaces.
inline std::vector<BodyDef> walls(Real room) {
  std::vector<BodyDef> bodies;
  for (const Real side : {Real(1), Real(-1)}) {
    for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
      bodies.push_back(half_space(axis * side, -room));
    }
  }
  return bodies;
}

/// A body that does not come to rest.
inline BodyDef bouncing_body(Random* random, Real room) {
  BodyDef def;
  do {
    def = random_body(random, room);
  } while (def.mass == 0);
  def.restitution = 1;
  def.friction = Real(0.1);
  def.velocity = random->uniform_in_box({-3, -3, -3}, {3, 3, 3});
  return def;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
