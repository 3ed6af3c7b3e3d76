/// Contact lists for array-based programs: between two sets of spheres, of many systems in one
/// call, with every contact in both orders, and as compressed rows. Functions that take a
/// SphereCollider must not run concurrently with other calls of that collider; all others are
/// thread-safe.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Finds the touching pairs of a sphere `a` of `first` and a sphere `b` of `second`, sorted by
/// (a, b). Both indices count from 0 in their own set. The normal points from b to a. Takes as long
/// as a search among the spheres of both sets.
/// @throws the exceptions of SphereCollider::find_contacts(), whose messages number the spheres of
///   `second` after those of `first`; std::bad_alloc
JFPX_API std::vector<SphereContact> find_contacts_between(SphereCollider& collider,
                                                          std::span<const SphereInstance> first,
                                                          std::span<const SphereInstance> second);

/// Finds the contacts within each of many independent systems: system i consists of the spheres
/// offsets[i] to offsets[i + 1] - 1. Spheres of different systems do not touch, wherever they are.
/// Indices count all spheres; the contacts are sorted by (a, b).
/// @param offsets ascending, from 0 to the number of spheres
/// @throws InvalidArgument for bad offsets, and as SphereCollider::find_contacts(); std::bad_alloc
JFPX_API std::vector<SphereContact> find_contacts_in_systems(
    SphereCollider& collider, std::span<const SphereInstance> spheres,
    std::span<const std::uint64_t> offsets);

/// Adds (b, a) with the opposite normal for each contact (a, b). The result is sorted.
/// @param contacts sorted by (a, b), a < b
/// @param spheres number of spheres, greater than every index
/// @throws std::bad_alloc
JFPX_API std::vector<SphereContact> in_both_orders(ContactSpan contacts, std::size_t spheres);

/// Adds (b, a) for each pair (a, b). The result is sorted. Parameters as above.
JFPX_API std::vector<SpherePair> in_both_orders(std::span<const SpherePair> pairs,
                                                std::size_t spheres);

/// Offsets of compressed rows (CSR): the contacts of sphere i as `a` are those from offsets[i] to
/// offsets[i + 1] - 1.
/// @param contacts sorted by a
/// @param rows number of rows, greater than every index a
/// @throws std::bad_alloc
JFPX_API std::vector<std::uint64_t> row_offsets(ContactSpan contacts, std::size_t rows);
/// Offsets of compressed rows (CSR) for pairs. Parameters as above.
JFPX_API std::vector<std::uint64_t> row_offsets(std::span<const SpherePair> pairs,
                                                std::size_t rows);

}  // namespace JFPX_ABI
}  // namespace jfpx
