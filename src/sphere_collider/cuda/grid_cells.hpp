/// Cells of the grid search: a hierarchy of unbounded grids, hashed by row.
#pragma once

#include "src/sphere_collider/periodic_cell.hpp"

#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Finest level. Cells of level l are half as wide as those of level l - 1; cells of level 0 are as
/// wide as the diameter of the largest sphere. A sphere is on the finest level whose cells are not
/// narrower than its diameter; spheres more than 2^31 times smaller than the largest share the last
/// level. A "far" sphere is so far from the origin that its coordinates are too coarse for cells of
/// that level. A far sphere is on a wider level, whose number can be negative.
inline constexpr int kLastLevel = 31;

/// Largest number of cells of one level between the origin and a sphere. In float it has two bits
/// fewer than the significand, so that a cell is at least two units in the last place wide, and
/// neighboring cells are distinct. In double the limit is lower, because cell indices have 32 bits.
inline constexpr Real kMaxCells =
    std::numeric_limits<Real>::digits == 24 ? Real(1 << 22) : Real(1 << 29);
using detail::kShortest;  // no narrower cell is needed

/// Half the cell width that a radius requires.
JFPX_HD inline Real half_cell_for_radius(Real radius) {
  return radius > kShortest ? radius : kShortest;
}
/// Half the cell width that the distance from the origin requires.
JFPX_HD inline Real half_cell_for_position(const Vec3& p) {
  const Real x = absolute(p.x), y = absolute(p.y), z = absolute(p.z);
  const Real xy = x > y ? x : y;
  return (xy > z ? xy : z) * (1 / (2 * kMaxCells));
}

/// The bits of a Real as an integer: adding to the exponent field multiplies by a power of two.
using RealBits = std::conditional_t<sizeof(Real) == 4, std::int32_t, std::int64_t>;
inline constexpr int kMantissaBits = std::numeric_limits<Real>::digits - 1;
JFPX_HD inline int exponent_of(Real x) {
  return static_cast<int>(std::bit_cast<RealBits>(x) >> kMantissaBits);
}

/// Half the cell width of `level`, where level 0 has `half_0`: exactly half_0 / 2^level. All levels
/// in use are between kShortest and the largest Real, so that no value here is subnormal.
JFPX_HD inline Real half_cell_of(Real half_0, int level) {
  return std::bit_cast<Real>(std::bit_cast<RealBits>(half_0) -
                             (static_cast<RealBits>(level) << kMantissaBits));
}

/// Parameters that determine the cells of all levels.
struct GridScale {
  Real half_0;                  ///< half cell width of level 0, which the largest radius requires
  int last_level = kLastLevel;  ///< finest level in use
  Real inverse_x = 0;           ///< inverse cell width in x on all levels; 0: cells are cubes
};

/// The finest level whose half cell width is at least `half`: floor(log2(half_0 / half)), if that
/// level exists, but at most the last level in use.
JFPX_HD inline int level_for(Real half, const GridScale& scale) {
  const int level = exponent_of(scale.half_0) - exponent_of(half);
  if (level > scale.last_level) return scale.last_level;
  return half_cell_of(scale.half_0, level) < half ? level - 1 : level;
}

/// The level of a sphere.
JFPX_HD inline int level_of(const SphereInstance& s, const GridScale& scale) {
  const Real radius = half_cell_for_radius(s.radius), position = half_cell_for_position(s.centre);
  return level_for(radius > position ? radius : position, scale);
}
JFPX_HD inline bool is_far(const SphereInstance& s) {
  return half_cell_for_position(s.centre) > half_cell_for_radius(s.radius);
}

/// The widest level on which `s` can touch a far sphere; kLastLevel if there is none.
///
/// Proof. Consider a far sphere on a wider level than `s`, with half cell width h. The largest
/// magnitude of its coordinates exceeds kMaxCells * h. Both radii are at most h, so the spheres
/// touch only if that magnitude differs by less than 3 h between them. Hence
/// half_cell_for_position() differs by a factor of less than 1 + 2^-20, and the level that it
/// requires by less than two. The far sphere is on that level: finer ones are replaced
/// by the last level, but a level that is wider than another is not the last.
JFPX_HD inline int widest_far_level(const SphereInstance& s, const GridScale& scale) {
  const Real position = half_cell_for_position(s.centre);
  return position > 0 ? level_for(position, {scale.half_0}) - 1 : kLastLevel;
}

/// Inverse cell width of a level.
JFPX_HD inline Real inverse_width(Real half) { return Real(0.5) / half; }

/// Index of the cell that contains the coordinate. The rounded product, floor and saturation are
/// monotone: x <= y implies cell_of(x) <= cell_of(y). The search depends on no other property.
JFPX_HD inline std::int32_t cell_of(Real x, Real inverse_cell_width) {
  constexpr Real kLimit = 1 << 30;
  Real cell = x * inverse_cell_width;
  cell = cell < kLimit ? cell : kLimit;
  cell = cell > -kLimit ? cell : -kLimit;
#if defined(__CUDA_ARCH__)
  return static_cast<std::int32_t>(::floor(cell));
#else
  return static_cast<std::int32_t>(std::floor(cell));
#endif
}

/// Search radius: upper bound, along one axis, of the distance between the centre of `s` and the
/// centre of a touching sphere of a level with half cell width `half`.
///
/// Proof, with u and t of sphere_filter.hpp. Such a sphere has a radius <= half, so that the sum of
/// the radii, as computed, is s <= fl(r + half). Step 1 there gives dx^2 <= s^2 (1+8u) + 4t for
/// touching spheres, hence |dx| <= s (1+4u) + 2 sqrt(t), and 2 sqrt(t) < kShortest. The search
/// radius is larger. A coordinate y <= x + search_radius, in real numbers, is also <= fl(x +
/// search_radius), because y is a Real and rounding is monotone.
JFPX_HD inline Real search_radius_of(Real radius, Real half) {
  return (radius + half) * (1 + 8 * std::numeric_limits<Real>::epsilon()) + kShortest;
}

/// x + distance, clamped to finite values.
JFPX_HD inline Real moved(Real x, Real distance) {
  constexpr Real kMax = std::numeric_limits<Real>::max();
  const Real y = x + distance;
  return y > kMax ? kMax : y < -kMax ? -kMax : y;
}

/// Key of the row of cells (y, z) of a level. Cell x of the row has bucket key + x, modulo the size
/// of the hash table, so that neighbors in x are adjacent in memory.
inline constexpr std::uint32_t kRowY = 0x9e3779b1u, kRowZ = 0x85ebca77u, kRowLevel = 0xc2b2ae3du;
JFPX_HD inline std::uint32_t row_of(std::int32_t y, std::int32_t z, int level) {
  // Finalizer of MurmurHash3 (Appleby), a bijection: each input bit affects each output bit.
  std::uint32_t h = static_cast<std::uint32_t>(y) * kRowY + static_cast<std::uint32_t>(z) * kRowZ +
                    static_cast<std::uint32_t>(level) * kRowLevel;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

/// Rows of one level have different keys if their y and z differ by no more than this.
inline constexpr int kRowsApart = 8;
constexpr bool rows_have_different_keys() {
  for (int y = -kRowsApart; y <= kRowsApart; ++y) {
    for (int z = -kRowsApart; z <= kRowsApart; ++z) {
      const std::uint32_t difference =
          static_cast<std::uint32_t>(y) * kRowY + static_cast<std::uint32_t>(z) * kRowZ;
      if ((y != 0 || z != 0) && difference == 0) return false;
    }
  }
  return true;
}
static_assert(rows_have_different_keys());

/// Inverse cell width in x of a level whose inverse cell width in y and z is `inverse`.
JFPX_HD inline Real inverse_x_of(Real inverse, const GridScale& scale) {
  return scale.inverse_x > 0 ? scale.inverse_x : inverse;
}

/// The cell of a sphere on its own level.
struct GridCell {
  std::int32_t x, y, z;
  int level;
};
JFPX_HD inline GridCell grid_cell_of(const SphereInstance& s, const GridScale& scale) {
  const int level = level_of(s, scale);
  const Real inverse = inverse_width(half_cell_of(scale.half_0, level));
  return {cell_of(s.centre.x, inverse_x_of(inverse, scale)), cell_of(s.centre.y, inverse),
          cell_of(s.centre.z, inverse), level};
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
