/// Random solids and poses for tests of contacts.
#pragma once

#include <jfpx/collide.hpp>

#include "tests/world/meshes.hpp"
#include "tests/world/random_bodies.hpp"

namespace jfpx {
namespace test {

/// A cone or a cylinder.
inline SolidShape round_solid(Random* random) {
  const Real radius = random->uniform(0.05_r, 0.8_r), half_height = random->uniform(0.05_r, 0.8_r);
  if (random->below(2) == 0) return Cone{radius, half_height};
  return Cylinder{radius, half_height};
}
/// Number of kinds of partner(). The last one is round.
inline constexpr int kPartners = 5;
/// A ball, a box, a capsule, a hull, or a round solid.
/// @param kind < kPartners
inline SolidShape partner(std::uint64_t kind, Random* random) {
  if (kind == 0) return Sphere{random->uniform(0.1_r, 0.8_r)};
  if (kind == 1) return Box{random->uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {0.7_r, 0.7_r, 0.7_r})};
  if (kind == 2) return Capsule{random->uniform(0.05_r, 0.5_r), random->uniform(0.05_r, 0.9_r)};
  if (kind == 3) return random_hull(random);
  return round_solid(random);
}
/// A pose of box b in the axes of box a for which a face of a and a face of b, maybe turned about
/// its normal, are in the same plane: they overlap, or touch along edges or at corners up to
/// rounding.
inline Transform touching_pose(const Vec3& half_a, const Vec3& half_b, Random* random) {
  const auto face = static_cast<int>(random->below(3));
  Quat turn{1, 0, 0, 0};
  if (random->below(2) == 0) {
    const Real angle = random->uniform(-1, 1);
    turn = normalized(Quat{1, face == 0 ? angle : 0, face == 1 ? angle : 0, face == 2 ? angle : 0});
  }
  Transform pose = make_transform(turn, {});
  for (int i = 0; i < 3; ++i) {
    Real reach = half_a[i];
    for (int j = 0; j < 3; ++j) reach += absolute(pose.basis(i, j)) * half_b[j];
    pose.origin[i] = i == face || random->below(4) == 0 ? reach : reach * random->uniform(-1, 1);
  }
  return pose;
}

/// A random rotation, or one of an axis near an axis of the world.
inline Quat random_tilt(Random* random) {
  if (random->below(2) == 0) return random_rotation(random);
  const Quat quarters[] = {{}, {1, 1, 0, 0}, {1, 0, 0, 1}};
  const Quat q = normalized(quarters[random->below(3)]);
  const Real angle = random->below(3) == 0 ? Real(0) : random->uniform(0, 0.08_r);
  return normalized(add_scaled(q, random_direction(random), angle));
}

inline detail::PairManifold contact_between(const SolidShape& a, const Transform& pose_a,
                                            const SolidShape& b, const Transform& pose_b,
                                            const detail::PairMotion& pair = {}) {
  detail::PairManifold found;
  const auto find = [&](const auto& x, const auto& y) {
    detail::find_contact_of_any(detail::instance(x, pose_a), detail::instance(y, pose_b), pair,
                                &found);
  };
  std::visit(find, a, b);
  return found;
}

}  // namespace test
}  // namespace jfpx
