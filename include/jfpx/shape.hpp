/// Collision shapes as plain values.
#pragma once

#include <jfpx/math.hpp>

#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

struct Sphere {
  Real radius = Real(0.5);  ///< [m], > 0
  friend bool operator==(const Sphere&, const Sphere&) = default;
};

struct Box {
  Vec3 half_extents{Real(0.5), Real(0.5), Real(0.5)};  ///< [m], each > 0
  friend bool operator==(const Box&, const Box&) = default;
};

/// All points p with dot(normal, p) <= offset are solid. In world coordinates: it does not follow
/// its body's pose.
struct HalfSpace {
  Vec3 normal{0, 1, 0};  ///< [-], unit
  Real offset = 0;       ///< [m]
  friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

/// All points p with dot(normal, p) = offset: a wall without thickness. A body is pushed to the
/// side where its centre of mass is, all parts of it, however far they reach through; to the front
/// if it is on the plane. In world coordinates, as a half-space.
struct Plane {
  Vec3 normal{0, 1, 0};  ///< [-], unit, to the front
  Real offset = 0;       ///< [m]
  friend bool operator==(const Plane&, const Plane&) = default;
};

/// A sphere or a box that belongs to an compound, placed in the axes of the body.
struct CompoundPart {
  std::variant<Sphere, Box> shape = Sphere{};
  Vec3 position = {};  ///< [m], body axes, of the part's centre
  Quat orientation = {};
  Real density = 1;  ///< [-], in (0, 1e9], relative to the other parts
  friend bool operator==(const CompoundPart&, const CompoundPart&) = default;
};

/// Spheres and boxes that move as one body (thesis 4.4.5) and never touch each other. The body's
/// mass is shared out by density times volume; where parts overlap it counts for both. The centre
/// of mass of a movable body must be the origin of its axes, to a thousandth of its reach; engines
/// take the origin for it. See centred().
struct Compound {
  std::vector<CompoundPart> parts;  ///< at least one
  friend bool operator==(const Compound&, const Compound&) = default;
};

/// The compound moved in its axes so that the centre of mass is the origin.
/// @param compound each part in the ranges that validate() asks for
JFPX_API Compound centred(Compound compound);

using Shape = std::variant<Sphere, Box, HalfSpace, Plane, Compound>;

/// A sphere placed in the world: what the collider works on. Laid out as four Reals.
struct alignas(4 * sizeof(Real)) SphereInstance {
  Vec3 centre;      ///< [m]
  Real radius = 0;  ///< [m], > 0
  friend bool operator==(const SphereInstance&, const SphereInstance&) = default;
};
static_assert(sizeof(SphereInstance) == 4 * sizeof(Real));

}  // namespace JFPX_ABI
}  // namespace jfpx
