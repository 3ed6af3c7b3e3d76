/// A scene with joints of all uses: rods, ropes and springs, at any points, with the world, fixed
/// bodies and movable bodies. One body has more joints than there are colors.
#pragma once

#include <jfpx/random.hpp>
#include <jfpx/scene.hpp>

#include <cstdint>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// The body of a scene with an index.
constexpr BodyId body(std::uint32_t index) { return {index, 0}; }

inline Scene joint_scene() {
  Scene scene;
  scene.name = "joints";
  Random random(7);
  const auto add = [&](const Shape& shape, Real mass, const Vec3& position) {
    BodyDef def;
    def.shape = shape;
    def.mass = mass;
    def.position = position;
    scene.bodies.push_back(def);
    return BodyId{static_cast<std::uint32_t>(scene.bodies.size() - 1), 0};
  };
  add(HalfSpace{{0, 1, 0}, 0}, 0, {});
  // A bridge of planks between two posts, whose ends are held at two points each.
  const Real plank = Real(0.2);
  const auto join_planks = [&](BodyId a, BodyId b, Real end_a, Real end_b) {
    for (const Real side : {Real(-0.4), Real(0.4)}) {
      DistanceJoint joint{.a = a, .b = b};
      joint.anchor_a = {end_a, 0, side};
      joint.anchor_b = {end_b, 0, side};
      joint.max_length = Real(0.06);
      scene.joints.push_back(joint);
    }
  };
  const BodyId post = add(Box{{Real(0.2), 1, Real(0.5)}}, 0, {Real(-4.2), 2, 0});
  BodyId last = post;
  for (int i = 0; i < 16; ++i) {
    const BodyId next = add(Box{{plank, Real(0.05), Real(0.45)}}, 3,
                            {Real(-3.8) + Real(0.45) * static_cast<Real>(i), Real(2.5), 0});
    join_planks(next, last, -plank, plank);
    last = next;
  }
  const BodyId end = add(Box{{Real(0.2), 1, Real(0.5)}}, 0, {Real(3.4), 2, 0});
  join_planks(end, last, -plank, plank);
  // Balls that fall on the bridge, some of them in pairs with a rod or a spring.
  for (int i = 0; i < 30; ++i) {
    const BodyId ball =
        add(Sphere{Real(0.15)}, 1, random.uniform_in_box({-3, 3, Real(-0.3)}, {3, 6, Real(0.3)}));
    if (i % 3 == 0) continue;
    DistanceJoint joint{.a = ball, .b = BodyId{ball.index - 1, 0}};
    joint.anchor_a = {Real(0.1), 0, 0};
    joint.max_length = 1;
    if (i % 3 == 1) joint.min_length = 1;
    joint.rest_length = Real(0.6);
    joint.hertz = 4;
    joint.damping_ratio = Real(0.2);
    scene.joints.push_back(joint);
  }
  // A heavy ball that hangs from the world and carries many balls on ropes.
  const BodyId hub = add(Sphere{Real(0.5)}, 30, {0, 9, 3});
  scene.joints.push_back(
      DistanceJoint{.a = hub, .anchor_b = {0, 11, 3}, .min_length = Real(0.5), .max_length = 2});
  for (int i = 0; i < 70; ++i) {
    const BodyId ball =
        add(Sphere{Real(0.1)}, Real(0.2), random.uniform_in_box({-2, 6, 1}, {2, 8, 5}));
    scene.joints.push_back(DistanceJoint{.a = ball, .b = hub, .max_length = Real(3.2)});
  }
  return scene;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
