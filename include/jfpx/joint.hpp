/// Joints: constraints of two bodies that act in every step until they are removed.
#pragma once

#include <jfpx/body.hpp>

#include <cstdint>
#include <optional>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {

/// Identifies a joint of one World for the lifetime of the joint. The id of a removed joint is
/// never reused.
struct JointId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;
  friend bool operator==(const JointId&, const JointId&) = default;
};

/// Keeps the distance of two points of two bodies in a range: a rod if both lengths are equal, a
/// rope if min_length is 0. A spring may act between the limits. The limits are soft like contacts:
/// they yield slightly under load, less with more substeps.
struct DistanceJoint {
  /// In a Scene, only the index is used: the index in Scene::bodies. At least one of the two bodies
  /// must be movable.
  BodyId a{};
  std::optional<BodyId> b{};  ///< absent: the world
  /// [m], points of the bodies in body axes, from the centre of mass; if `b` is absent, anchor_b is
  /// in world coordinates. At most 1e9 each.
  Vec3 anchor_a{}, anchor_b{};
  Real min_length = 0;          ///< [m], in [0, max_length]
  Real max_length = Real(1e9);  ///< [m], at most 1e9
  Real rest_length = 0;         ///< [m], in [0, 1e9], of the spring
  /// [Hz], in [0, 1e6], frequency of the spring with the masses of the two bodies; 0: no spring.
  /// Ignored by a rod. Above 0.04 divided by the substep, the spring loses energy.
  Real hertz = 0;
  Real damping_ratio = 0;          ///< [-], in [0, 1000], of the spring; 1: critical
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const DistanceJoint&, const DistanceJoint&) = default;
};

/// A joint of any type.
using Joint = std::variant<DistanceJoint>;

/// A joint after the last step.
struct JointState {
  Vec3 point_a, point_b;  ///< [m], anchors in world coordinates
  Real length = 0;        ///< [m], their distance
  /// [N], along the line of the anchors, mean over the last substep; > 0: pulls the bodies together
  Real force = 0;
  friend bool operator==(const JointState&, const JointState&) = default;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
