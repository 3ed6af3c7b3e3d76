/// Scene ragdolls: figures of eleven bodies with ball joints and hinges fall onto the ground.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

/// The body of a figure, whose axes are those of the world before it is turned.
struct Part {
  Shape shape;
  Real mass;
  Vec3 position;  ///< [m], of a figure that stands on the origin with its arms stretched out
  bool lies_along_x = false;  ///< of a capsule, whose axis is otherwise y
};

enum PartIndex : std::uint32_t { kPelvis, kTorso, kHead, kArm, kForearm, kThigh, kShin };

constexpr Real kArmHeight = Real(1.43), kLegAside = Real(0.1);

Part part_of(PartIndex index) {
  switch (index) {
    case kPelvis:
      return {Box{{Real(0.15), Real(0.1), Real(0.1)}}, 10, {0, 1, 0}};
    case kTorso:
      return {Box{{Real(0.17), Real(0.2), Real(0.1)}}, 20, {0, Real(1.3), 0}};
    case kHead:
      return {Sphere{Real(0.12)}, 5, {0, Real(1.66), 0}};
    case kArm:
      return {Capsule{Real(0.05), Real(0.12)}, Real(2.5), {Real(0.37), kArmHeight, 0}, true};
    case kForearm:
      return {Capsule{Real(0.045), Real(0.12)}, Real(1.5), {Real(0.7), kArmHeight, 0}, true};
    case kThigh:
      return {Capsule{Real(0.07), Real(0.15)}, 8, {kLegAside, Real(0.7), 0}};
    default:
      return {Capsule{Real(0.055), Real(0.17)}, 4, {kLegAside, Real(0.25), 0}};
  }
}

/// A figure in its pose at the start.
class Figure {
 public:
  Figure(Scene* scene, const Vec3& position, const Quat& orientation)
      : scene_(scene), pose_(make_transform(orientation, position)), orientation_(orientation) {
    const BodyId pelvis = add(kPelvis, 1), torso = add(kTorso, 1), head = add(kHead, 1);
    const Vec3 up{0, 1, 0};
    socket(torso, pelvis, {0, Real(1.1), 0}, up, {Real(0.4), Real(0.3)});
    socket(head, torso, {0, Real(1.52), 0}, up, {Real(0.5), Real(0.6)});
    for (const Real side : {Real(-1), Real(1)}) {
      const BodyId arm = add(kArm, side), forearm = add(kForearm, side);
      const BodyId thigh = add(kThigh, side), shin = add(kShin, side);
      socket(arm, torso, {side * Real(0.2), kArmHeight, 0}, {side, 0, 0}, {Real(1.3), Real(0.8)});
      // Elbows bend to the front, which is z, and knees to the back.
      bend(forearm, arm, {side * Real(0.54), kArmHeight, 0}, {0, -side, 0}, Real(2.2));
      socket(thigh, pelvis, {side * kLegAside, Real(0.9), 0}, -up, {Real(0.9), Real(0.4)});
      bend(shin, thigh, {side * kLegAside, Real(0.48), 0}, {1, 0, 0}, Real(2));
    }
  }

 private:
  struct Range {
    Real cone, twist;  ///< [rad]
  };

  BodyId add(PartIndex index, Real side) {
    const Part part = part_of(index);
    BodyDef body;
    body.shape = part.shape;
    body.mass = part.mass;
    body.position =
        transform_point(pose_, {side * part.position.x, part.position.y, part.position.z});
    const Real half = Real(0.70710678118654752);
    body.orientation = part.lies_along_x ? orientation_ * Quat{half, 0, 0, -half} : orientation_;
    body.friction = Real(0.6);
    body.rolling_friction = Real(0.01);
    body.linear_damping = body.angular_damping = Real(0.9);
    scene_->bodies.push_back(body);
    return {static_cast<std::uint32_t>(scene_->bodies.size() - 1), 0};
  }

  template <class J>
  void join(J joint, BodyId a, BodyId b, const Vec3& point, const Vec3& axis) {
    const auto state = [&](BodyId id) {
      const BodyDef& body = scene_->bodies[id.index];
      return BodyState{body.position, body.orientation, {}, {}};
    };
    joint.a = a, joint.b = b;
    place_joint(&joint, state(a), state(b), transform_point(pose_, point),
                transform_direction(pose_, axis));
    scene_->joints.push_back(joint);
  }

  void socket(BodyId a, BodyId b, const Vec3& point, const Vec3& axis, const Range& range) {
    BallJoint joint;
    joint.cone_angle = range.cone;
    joint.min_twist = -range.twist, joint.max_twist = range.twist;
    joint.friction_torque = 2;
    join(joint, a, b, point, axis);
  }

  /// A hinge that bends in one direction. Its motor at rest is a brake.
  void bend(BodyId a, BodyId b, const Vec3& point, const Vec3& axis, Real most) {
    HingeJoint joint;
    joint.min_angle = 0, joint.max_angle = most;
    joint.max_motor_torque = 2;
    join(joint, a, b, point, axis);
  }

  Scene* scene_;
  Transform pose_;
  Quat orientation_;
};

}  // namespace

Scene make_ragdolls(const Counts& counts) {
  Scene scene;
  scene.name = "ragdolls";
  Random random(counts.seed);
  add_ground(scene);
  // Layers of a square, of which the upper ones fall on the lower ones.
  constexpr std::uint32_t kMostInARow = 16;
  constexpr Real kSpacing = Real(1.8), kLayer = Real(2.2);
  std::uint32_t row = 1;
  while (row < kMostInARow && row * row < counts.spheres) ++row;
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const Vec3 place{kSpacing * static_cast<Real>(i % row),
                     1 + kLayer * static_cast<Real>(i / (row * row)),
                     kSpacing * static_cast<Real>(i / row % row)};
    const Vec3 axis{random.uniform(Real(-0.3), Real(0.3)), 1,
                    random.uniform(Real(-0.3), Real(0.3))};
    Figure(&scene, place, from_axis_angle(axis, random.uniform(-kPi, kPi)));
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
