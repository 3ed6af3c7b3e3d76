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
  // Joints with frames: a ragdoll's chain, a wheel, a door and a lift.
  const auto place = [&](auto joint, BodyId a, std::optional<BodyId> b, const Vec3& point,
                         const Vec3& axis) {
    joint.a = a, joint.b = b;
    const auto pose = [&](BodyId id) {
      const BodyDef& def = scene.bodies[id.index];
      return BodyState{def.position, def.orientation, {}, {}};
    };
    place_joint(&joint, pose(a), b ? pose(*b) : BodyState{}, point, axis);
    scene.joints.push_back(joint);
  };
  BodyId link = hub;
  for (int i = 0; i < 6; ++i) {
    const Real x = Real(5 + i);
    const BodyId next = add(Capsule{Real(0.2), Real(0.3)}, 2, {x, 4, -2});
    std::optional<BodyId> base = i == 0 ? std::nullopt : std::optional(link);
    place(BallJoint{.cone_angle = Real(0.8),
                    .min_twist = Real(-0.3),
                    .max_twist = Real(0.3),
                    .hertz = i % 2 == 0 ? Real(2) : Real(0),
                    .damping_ratio = Real(0.5),
                    .friction_torque = i % 3 == 0 ? Real(0.5) : Real(0)},
          next, base, {x - Real(0.5), 4, -2}, {1, 0, 0});
    link = next;
  }
  const BodyId chassis = add(Box{{1, Real(0.2), Real(0.5)}}, 20, {8, 1, 4});
  for (int i = 0; i < 4; ++i) {
    const Real x = i < 2 ? Real(-0.8) : Real(0.8), z = i % 2 == 0 ? Real(-0.8) : Real(0.8);
    const BodyId wheel = add(Sphere{Real(0.35)}, 2, {8 + x, Real(0.6), 4 + z});
    // The x axis of the joint is the axle, its y axis the suspension.
    place(WheelJoint{.min_position = Real(-0.2),
                     .max_position = Real(0.2),
                     .hertz = 3,
                     .damping_ratio = Real(0.7),
                     .steering_angle = i < 2 ? Real(0.2) : Real(0),
                     .motor_speed = 8,
                     .max_motor_torque = i < 2 ? Real(0) : Real(10)},
          wheel, chassis, scene.bodies[wheel.index].position, {0, 0, 1});
  }
  const BodyId door = add(Box{{Real(0.5), 1, Real(0.05)}}, 5, {-8, 2, 0});
  place(HingeJoint{.min_angle = -1, .max_angle = 1, .target_angle = Real(0.5), .hertz = 1}, door,
        std::nullopt, {Real(-8.5), 2, 0}, {0, 1, 0});
  const BodyId lift = add(Box{{Real(0.5), Real(0.1), Real(0.5)}}, 5, {-8, 1, 4});
  place(SliderJoint{.min_position = 0, .max_position = 2, .motor_speed = 1, .max_motor_force = 100},
        lift, std::nullopt, {-8, 1, 4}, {0, 1, 0});
  const BodyId load = add(Box{{Real(0.2), Real(0.2), Real(0.2)}}, 1, {-8, Real(1.3), 4});
  place(FixedJoint{.angular_hertz = 5, .damping_ratio = Real(0.2)}, load, lift, {-8, Real(1.1), 4},
        {0, 1, 0});
  return scene;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
