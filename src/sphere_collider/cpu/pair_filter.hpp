/// Sphere pairs in vectors, with instructions that every processor supports: a filter for lists,
/// and the transposition of spheres and contacts.
#pragma once

#include <jfpx/contact.hpp>

#include "src/base/real_lanes.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// The first or the second spheres of kRealLanes pairs.
struct SphereLanes {
  RealLanes x, y, z, radius;
};
/// Reads the spheres and transposes them.
inline SphereLanes gather_spheres(const SphereInstance* spheres, const SpherePair* pairs,
                                  SphereIndex SpherePair::*which) {
  const auto load = [&](std::size_t i, std::size_t field) {
    return load_lanes(&spheres[pairs[i].*which].centre.x + field);
  };
#if defined(JFPX_DOUBLE_PRECISION)
  const RealLanes xy0 = load(0, 0), zr0 = load(0, 2), xy1 = load(1, 0), zr1 = load(1, 2);
  return {__builtin_shufflevector(xy0, xy1, 0, 2), __builtin_shufflevector(xy0, xy1, 1, 3),
          __builtin_shufflevector(zr0, zr1, 0, 2), __builtin_shufflevector(zr0, zr1, 1, 3)};
#else
  const RealLanes s0 = load(0, 0), s1 = load(1, 0), s2 = load(2, 0), s3 = load(3, 0);
  const RealLanes xy01 = __builtin_shufflevector(s0, s1, 0, 4, 1, 5);
  const RealLanes zr01 = __builtin_shufflevector(s0, s1, 2, 6, 3, 7);
  const RealLanes xy23 = __builtin_shufflevector(s2, s3, 0, 4, 1, 5);
  const RealLanes zr23 = __builtin_shufflevector(s2, s3, 2, 6, 3, 7);
  return {__builtin_shufflevector(xy01, xy23, 0, 1, 4, 5),
          __builtin_shufflevector(xy01, xy23, 2, 3, 6, 7),
          __builtin_shufflevector(zr01, zr23, 0, 1, 4, 5),
          __builtin_shufflevector(zr01, zr23, 2, 3, 6, 7)};
#endif
}

/// Writes a normal and a distance to each of kRealLanes contacts.
inline void scatter_contacts(RealLanes x, RealLanes y, RealLanes z, RealLanes distance,
                             SphereContact* contacts) {
  const auto store = [&](std::size_t i, std::size_t field, RealLanes v) {
    store_lanes(&contacts[i].normal.x + field, v);
  };
#if defined(JFPX_DOUBLE_PRECISION)
  store(0, 0, __builtin_shufflevector(x, y, 0, 2));
  store(0, 2, __builtin_shufflevector(z, distance, 0, 2));
  store(1, 0, __builtin_shufflevector(x, y, 1, 3));
  store(1, 2, __builtin_shufflevector(z, distance, 1, 3));
#else
  const RealLanes xy01 = __builtin_shufflevector(x, y, 0, 4, 1, 5);
  const RealLanes xy23 = __builtin_shufflevector(x, y, 2, 6, 3, 7);
  const RealLanes zd01 = __builtin_shufflevector(z, distance, 0, 4, 1, 5);
  const RealLanes zd23 = __builtin_shufflevector(z, distance, 2, 6, 3, 7);
  store(0, 0, __builtin_shufflevector(xy01, zd01, 0, 1, 4, 5));
  store(1, 0, __builtin_shufflevector(xy01, zd01, 2, 3, 6, 7));
  store(2, 0, __builtin_shufflevector(xy23, zd23, 0, 1, 4, 5));
  store(3, 0, __builtin_shufflevector(xy23, zd23, 2, 3, 6, 7));
#endif
}

/// Returns one bit per pair: set unless the distance of the centres exceeds the sum of the radii.
inline unsigned touching_lanes(const SphereInstance* spheres, const SpherePair* pairs) {
  const SphereLanes a = gather_spheres(spheres, pairs, &SpherePair::a);
  const SphereLanes b = gather_spheres(spheres, pairs, &SpherePair::b);
  const RealLanes x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return bits(not_greater(square_root(x * x + y * y + z * z), a.radius + b.radius));
}
static_assert(sizeof(SphereInstance) == 4 * sizeof(Real));

/// Writes the ascending indices of all touching pairs to `found`, possibly with a few further
/// indices from the end of the list. `found` must have room for `count` indices. The filter
/// compares the same values as the exact test, with the same roundings. It does not branch on the
/// result, which is unpredictable in lists that mix touching and separated pairs.
/// @return the number of indices
inline std::size_t find_candidates(const SphereInstance* spheres, const SpherePair* pairs,
                                   std::size_t count, std::uint32_t* found) {
  constexpr std::size_t kAhead = 16;  // prefetch distance: accesses to spheres are random
  std::size_t kept = 0, i = 0;
  for (; i + kRealLanes <= count; i += kRealLanes) {
    if (i + kAhead + kRealLanes <= count) {
      for (std::size_t k = i + kAhead; k < i + kAhead + kRealLanes; ++k) {
        __builtin_prefetch(&spheres[pairs[k].a]);
        __builtin_prefetch(&spheres[pairs[k].b]);
      }
    }
    const unsigned mask = touching_lanes(spheres, pairs + i);
    for (std::size_t k = 0; k < kRealLanes; ++k) {
      found[kept] = static_cast<std::uint32_t>(i + k);
      kept += mask >> k & 1;
    }
  }
  for (; i < count; ++i) found[kept++] = static_cast<std::uint32_t>(i);
  return kept;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
