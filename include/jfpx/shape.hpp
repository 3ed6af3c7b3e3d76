/// Collision shapes as plain values.
#pragma once

#include <jfpx/math.hpp>

#include <variant>

namespace jfpx::inline JFPX_ABI {

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

/// All points p with dot(normal, p) = offset: a wall without thickness. Not yet a shape of bodies.
struct Plane {
  Vec3 normal{0, 1, 0};  ///< [-], unit
  Real offset = 0;       ///< [m]
  friend bool operator==(const Plane&, const Plane&) = default;
};

using Shape = std::variant<Sphere, Box, HalfSpace>;

/// A sphere placed in the world: what the collider works on. Laid out as four Reals.
struct alignas(4 * sizeof(Real)) SphereInstance {
  Vec3 centre;      ///< [m]
  Real radius = 0;  ///< [m], > 0
  friend bool operator==(const SphereInstance&, const SphereInstance&) = default;
};
static_assert(sizeof(SphereInstance) == 4 * sizeof(Real));

}  // namespace jfpx::inline JFPX_ABI
