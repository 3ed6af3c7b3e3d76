/// Collision shapes as plain values. A shape is centred at the origin of the body axes unless
/// documented otherwise.
#pragma once

#include <jfpx/heightfield.hpp>
#include <jfpx/hull.hpp>
#include <jfpx/math.hpp>
#include <jfpx/triangle_mesh.hpp>

#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A solid sphere.
struct Sphere {
  Real radius = Real(0.5);  ///< [m], > 0
  friend bool operator==(const Sphere&, const Sphere&) = default;
};

/// A solid box, aligned with the axes of its body.
struct Box {
  Vec3 half_extents{Real(0.5), Real(0.5), Real(0.5)};  ///< [m], each > 0
  friend bool operator==(const Box&, const Box&) = default;
};

/// A solid capsule: all points within `radius` of a segment on the y axis of its body.
struct Capsule {
  Real radius = Real(0.5);       ///< [m], > 0
  Real half_height = Real(0.5);  ///< [m], > 0, half the length of the segment
  friend bool operator==(const Capsule&, const Capsule&) = default;
};

/// A solid cylinder: all points within `radius` of the y axis of its body, and within `half_height`
/// of its middle.
struct Cylinder {
  Real radius = Real(0.5);       ///< [m], > 0
  Real half_height = Real(0.5);  ///< [m], > 0
  friend bool operator==(const Cylinder&, const Cylinder&) = default;
};

/// A solid cone about the y axis of its body, whose origin is the centre of mass: the base is at
/// y = -half_height / 2, and the apex at y = 3/2 half_height.
struct Cone {
  Real radius = Real(0.5);       ///< [m], > 0, of the base
  Real half_height = Real(0.5);  ///< [m], > 0, half the distance of apex and base
  friend bool operator==(const Cone&, const Cone&) = default;
};

/// A solid half-space: all points p with dot(normal, p) <= offset, in world coordinates. It ignores
/// the pose of its body.
struct HalfSpace {
  Vec3 normal{0, 1, 0};  ///< [-], unit
  Real offset = 0;       ///< [m]
  friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

/// A two-sided wall without thickness: all points p with dot(normal, p) = offset, in world
/// coordinates. It ignores the pose of its body. A body collides with the side on which its centre
/// of mass lies, at any depth of penetration; a centre on the plane counts as on the front.
struct Plane {
  Vec3 normal{0, 1, 0};  ///< [-], unit, points to the front
  Real offset = 0;       ///< [m]
  friend bool operator==(const Plane&, const Plane&) = default;
};

/// The shapes that have a volume, and that can be parts of compounds.
using SolidShape = std::variant<Sphere, Box, Capsule, Hull, Cylinder, Cone>;

/// A solid of a compound, with its pose in the axes of the body.
struct CompoundPart {
  SolidShape shape = Sphere{};
  Vec3 position = {};  ///< [m], body axes, origin of the part
  Quat orientation = {};
  Real density = 1;  ///< [-], in (0, 1e9], relative to the other parts
  friend bool operator==(const CompoundPart&, const CompoundPart&) = default;
};

/// Solids that move as one body (thesis 4.4.5) and do not collide with each other. The mass of the
/// body is distributed in proportion to density times volume; overlapping volume counts for each
/// part. The centre of mass of a movable body must be the origin of its axes, to a thousandth of
/// its bounding radius, because engines use the origin as the centre of mass. See centred().
struct Compound {
  std::vector<CompoundPart> parts;  ///< at least one
  friend bool operator==(const Compound&, const Compound&) = default;
};

/// The compound, translated so that its centre of mass is the origin.
/// @param compound each part must be in the ranges that validate() requires
JFPX_API Compound centred(Compound compound);

using Shape = std::variant<Sphere, Box, HalfSpace, Plane, Compound, Capsule, TriangleMesh, Hull,
                           Heightfield, Cylinder, Cone>;

/// A sphere in world coordinates, the input of SphereCollider. The layout is that of four Reals.
struct alignas(4 * sizeof(Real)) SphereInstance {
  Vec3 centre;      ///< [m]
  Real radius = 0;  ///< [m], > 0
  friend bool operator==(const SphereInstance&, const SphereInstance&) = default;
};
static_assert(sizeof(SphereInstance) == 4 * sizeof(Real));

}  // namespace JFPX_ABI
}  // namespace jfpx
