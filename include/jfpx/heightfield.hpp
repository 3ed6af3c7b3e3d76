/// Heightfield: a surface over a regular grid, for bodies of mass 0.
#pragma once

#include <jfpx/math.hpp>
#include <jfpx/triangle_mesh.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
struct HeightfieldData;
}

/// The data from which a Heightfield is made. The vertex with the number n = row * columns + column
/// has, in body axes, the coordinates
///   x = (column - (columns - 1) / 2) * spacing_x,
///   y = heights[n],
///   z = (row - (rows - 1) / 2) * spacing_z.
/// A cell has the number of its vertex with the least row and column. It has two triangles, whose
/// fronts are above: 2 n with the vertices (n, n + columns, n + 1), and 2 n + 1 with the vertices
/// (n + 1, n + columns, n + columns + 1).
struct HeightfieldDef {
  std::uint32_t columns = 0;  ///< number of vertices along x, 2 to 65,536
  std::uint32_t rows = 0;     ///< number of vertices along z, 2 to 65,536
  Real spacing_x = 1;         ///< [m], > 0; the width is at most 2e9
  Real spacing_z = 1;         ///< [m], > 0; the length is at most 2e9
  std::vector<Real> heights;  ///< [m], rows * columns, at most 2^28, each between -1e9 and 1e9
  std::vector<std::uint32_t> holes;  ///< numbers of cells without triangles
  /// Whether bodies collide with the backs of triangles, too. See TriangleMeshDef::two_sided.
  bool two_sided = false;
  friend bool operator==(const HeightfieldDef&, const HeightfieldDef&) = default;
};

/// A surface over a regular grid in the plane of the body's x and z axes, the shape of terrain.
/// Contacts, rays and overlaps are those of a TriangleMesh with the same triangles, but they are
/// computed from the heights: a vertex takes sizeof(Real) + 1 bytes instead of about 250. Bodies
/// with this shape have mass 0; kinematic bodies move it. Triangles that are steeper than one in
/// 1e5 may be without contacts. Immutable: copies share the data, and may be used by several
/// threads.
class Heightfield {
 public:
  /// A heightfield without vertices, which is no valid shape of a body.
  Heightfield() noexcept = default;
  /// Takes O(n) time.
  /// @throws InvalidArgument if a member is out of range, or the number of heights is not
  ///   rows * columns
  JFPX_API explicit Heightfield(HeightfieldDef def);

  JFPX_API const HeightfieldDef& def() const noexcept;
  std::uint32_t columns() const noexcept { return def().columns; }
  std::uint32_t rows() const noexcept { return def().rows; }
  std::span<const Real> heights() const noexcept { return def().heights; }
  bool two_sided() const noexcept { return def().two_sided; }
  /// [m], body axes. @param row,column below rows() and columns()
  JFPX_API Vec3 vertex(std::uint32_t row, std::uint32_t column) const noexcept;

  /// The arrays for contact tests; null without vertices. Internal.
  const std::shared_ptr<const detail::HeightfieldData>& data() const noexcept { return data_; }

  JFPX_API friend bool operator==(const Heightfield& a, const Heightfield& b);

 private:
  std::shared_ptr<const detail::HeightfieldData> data_;
};

/// A mesh of the triangles of a heightfield in the order of their numbers, without those of holes.
/// @throws InvalidArgument if there are more than 2^29 triangles
JFPX_API TriangleMesh to_triangle_mesh(const Heightfield& heightfield);

}  // namespace JFPX_ABI
}  // namespace jfpx
