/// The sphere: mass, bounds, ray, submerged volume, and contacts with spheres and half-spaces.
#pragma once

#include <jfpx/collide.hpp>

#include "src/collide/pair_manifold.hpp"
#include "src/collide/ray.hpp"
#include "src/collide/solid.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/collide/submerged.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
inline constexpr const char* kShapeName<Sphere> = "sphere";

JFPX_HD inline Solid to_solid(const Sphere& sphere) { return {{}, sphere.radius}; }
JFPX_HD inline Sphere from_solid(const Solid& solid, std::type_identity<Sphere>) {
  return {solid.radius};
}

/// [m^3], in double, because the cube of a small float may underflow.
inline double volume(const Sphere& sphere) {
  const auto r = static_cast<double>(sphere.radius);
  return 4.0 / 3.0 * 3.14159265358979323846 * r * r * r;
}
/// [kg m^2], principal moments of a solid sphere.
JFPX_HD constexpr Vec3 moments_of_inertia(const Sphere& sphere, Real mass) {
  const Real i = Real(0.4) * mass * sphere.radius * sphere.radius;
  return {i, i, i};
}

inline Real outer_radius(const Sphere& sphere) { return sphere.radius; }
inline Real bounding_radius(const Sphere& sphere) { return sphere.radius; }
JFPX_HD inline Real least_half_width(const Sphere& sphere) { return sphere.radius; }
JFPX_HD inline Vec3 half_extents(const Sphere& sphere, const Transform&) {
  return {sphere.radius, sphere.radius, sphere.radius};
}

/// The half chord is computed from the distance between the centre and the line instead of the
/// difference of two large squares, which would be inaccurate for small distant spheres. Lengths
/// are divided by the radius, because the square of a small radius may underflow.
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction,
                              const SphereInstance& sphere) {
  const Real r = sphere.radius;
  const Vec3 from_centre = origin - sphere.centre;
  if (!(length_squared(from_centre) > r * r)) return {true, 0, -direction};
  const Real ahead = -dot(from_centre, direction);
  if (!(ahead > 0)) return {};
  const Vec3 beside = add_scaled(from_centre, direction, ahead);
  const Vec3 in_radii{beside.x / r, beside.y / r, beside.z / r};
  const Real half_chord2 = 1 - length_squared(in_radii);
  if (!(half_chord2 >= 0)) return {};
  const Real half_chord = square_root(half_chord2);
  const Real distance = ahead - half_chord * r;
  return {true, distance > 0 ? distance : Real(0),
          normalized(add_scaled(in_radii, direction, -half_chord))};
}
JFPX_HD inline RayEntry enter(const Vec3& origin, const Vec3& direction, const Sphere& sphere,
                              const Transform& pose) {
  return enter(origin, direction, SphereInstance{pose.origin, sphere.radius});
}

/// Volume of the spherical cap below a plane at `height` above the centre.
JFPX_HD constexpr Real submerged_volume(Real radius, Real height) {
  if (!(height > -radius)) return 0;
  const Real depth = height < radius ? height + radius : 2 * radius;
  return kPi / 3 * depth * depth * (3 * radius - depth);
}
/// Buoyancy acts through the centre of a sphere, so the moment is zero.
JFPX_HD inline Submerged submerged(const Sphere& sphere, const Mat3&, const HalfSpace& liquid) {
  return {submerged_volume(sphere.radius, liquid.offset), {}};
}

/// A contact along one normal. If the shapes will touch during the step, the normal is that at the
/// time of impact: the gap along the normal is zero then. A pair that passes by has no contact.
struct SpeculativeContact {
  bool found = false;
  Vec3 normal;        ///< unit, from b to a
  Real distance = 0;  ///< [m], gap at the start of the step along the normal; <= 0: penetration
};

/// Two spheres. Contacts at the start of the step use the arithmetic of SphereCollider.
/// @param motion [m], of a relative to b during the step
/// @param margin [m], >= 0
JFPX_HD inline SpeculativeContact find_speculative(const SphereInstance& a, const SphereInstance& b,
                                                   const Vec3& motion, Real margin) {
  const PairResult now = test_sphere_pair(a, b, margin);
  if (now.touching != 0) return {true, now.normal, now.distance};
  const Vec3 d = a.centre - b.centre;
  const Real closing = -dot(d, motion);
  if (!(closing > 0)) return {};
  // |d + motion * t| = sum, the smaller root in the form without cancellation.
  const Real sum = a.radius + b.radius, len = length(d);
  const Real excess = (len - sum) * (len + sum);
  const Real discriminant = closing * closing - length_squared(motion) * excess;
  if (!(discriminant >= 0)) return {};
  const Real t = excess / (closing + square_root(discriminant));
  if (!(t <= 1)) return {};
  const Vec3 normal = normalized(add_scaled(d, motion, t));
  return {true, normal, -t * dot(motion, normal)};
}

JFPX_HD inline void find_contact(const SphereInstance& a, const SphereInstance& b,
                                 const PairMotion& pair, PairManifold* manifold) {
  const SpeculativeContact c = find_speculative(a, b, pair.motion, pair.margin);
  if (!c.found) return;
  const Real overlap = c.distance < 0 ? c.distance * Real(0.5) : Real(0);
  manifold->normal = c.normal;
  manifold->add(a.centre - c.normal * (a.radius + overlap) - pair.origin_a,
                b.centre + c.normal * (b.radius + overlap) - pair.origin_b, c.distance, 0,
                middle_point(c.normal, c.distance, b));
}

/// A ball, or a rounded corner of a solid, on a half-space.
JFPX_HD inline void add_corner(const Vec3& corner, Real radius, const HalfSpace& wall,
                               std::uint32_t feature, const PairMotion& pair,
                               PairManifold* manifold) {
  const Vec3& n = wall.normal;
  const Real distance = (dot(n, corner) - wall.offset) - radius;
  const Real closing = -dot(n, pair.motion);
  if (!(distance <= pair.margin + (closing > 0 ? closing : Real(0)))) return;
  const Real overlap = distance < 0 ? distance : Real(0);
  const Vec3 point = corner - n * (radius + overlap * Real(0.5));
  manifold->normal = n;
  manifold->add(point - pair.origin_a, point - pair.origin_b, distance, feature, point);
}
JFPX_HD inline void find_contact(const SphereInstance& a, const HalfSpace& wall,
                                 const PairMotion& pair, PairManifold* manifold) {
  add_corner(a.centre, a.radius, wall, 0, pair, manifold);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
