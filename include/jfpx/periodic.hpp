/// Contacts among spheres in a periodic cell. Functions that take a SphereCollider must not run
/// concurrently with other calls of that collider.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// An orthogonal cell that repeats along some axes. Positions may lie outside the cell.
struct PeriodicCell {
  Vec3 lengths;  ///< [m], > 0 along repeating axes; otherwise ignored
  std::array<bool, 3> repeats{true, true, true};
};

/// Number of cells by which an image of a sphere is displaced along each axis.
using ImageShift = std::array<std::int32_t, 3>;

/// A touching pair in a periodic cell. The normal and the distance are those of sphere a and the
/// image of sphere b at centre + shift * lengths.
struct PeriodicContact {
  SphereContact contact;
  ImageShift shift{};
  friend bool operator==(const PeriodicContact&, const PeriodicContact&) = default;
};

/// Finds the touching pairs of spheres and images of spheres (minimum image convention), sorted by
/// (a, b), a < b. A pair that touches through two images, which are half a length apart, is listed
/// once, with the lower shift. Contacts are computed from the given centres: a - b - shift *
/// lengths is rounded once per axis, then the contact is that of SphereCollider. So pairs without a
/// shift have the bits of an open search, whatever the lengths are. The bits do not depend on the
/// collider.
/// @throws InvalidArgument like SphereCollider::find_contacts(); for a length that is not > 0,
///   exceeds 2^60 in float or 2^508 in double, or is less than four times the largest radius; for a
///   centre that is 2^20 lengths or more from the origin. std::bad_alloc
JFPX_API std::vector<PeriodicContact> find_periodic_contacts(
    SphereCollider& collider, std::span<const SphereInstance> spheres, const PeriodicCell& cell);

/// Finds the touching pairs of a sphere `a` of `first` and a sphere `b` of `second` or its image,
/// sorted by (a, b). Both indices count from 0 in their own set. Takes as long as a search among
/// the spheres of both sets.
/// @throws the exceptions of find_periodic_contacts(), for the radii of both sets; messages number
///   the spheres of `second` after those of `first`
JFPX_API std::vector<PeriodicContact> find_periodic_contacts_between(
    SphereCollider& collider, std::span<const SphereInstance> first,
    std::span<const SphereInstance> second, const PeriodicCell& cell);

/// Finds the contacts within each of many independent systems, like find_contacts_in_systems().
/// Each system has its own cell.
/// @param offsets ascending, from 0 to the number of spheres
/// @param cells one for each system
/// @throws InvalidArgument for invalid offsets or another number of cells; the exceptions of
///   find_periodic_contacts(); std::bad_alloc
JFPX_API std::vector<PeriodicContact> find_periodic_contacts_in_systems(
    SphereCollider& collider, std::span<const SphereInstance> spheres,
    std::span<const std::uint64_t> offsets, std::span<const PeriodicCell> cells);

/// Adds (b, a) with the opposite normal and shift for each contact. The result is sorted.
/// @param contacts sorted by (a, b), a < b
/// @param spheres number of spheres, greater than every index
/// @throws std::bad_alloc
JFPX_API std::vector<PeriodicContact> in_both_orders(std::span<const PeriodicContact> contacts,
                                                     std::size_t spheres);

}  // namespace JFPX_ABI
}  // namespace jfpx
