/// Triangle mesh: a surface for bodies of mass 0.
#pragma once

#include <jfpx/math.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
struct MeshData;
}

/// Indices of the vertices of a triangle. The front is the side from which they are in
/// counterclockwise order.
using Triangle = std::array<std::uint32_t, 3>;

/// The data from which a TriangleMesh is made.
struct TriangleMeshDef {
  std::vector<Vec3> vertices;  ///< [m], body axes, each coordinate between -1e9 and 1e9
  std::vector<Triangle> triangles;
  /// Whether bodies collide with the backs of triangles, too. A body collides with the side on
  /// which the centre of its solid lies. One-sided triangles have no contact with a solid whose
  /// centre is behind them.
  bool two_sided = false;
  friend bool operator==(const TriangleMeshDef&, const TriangleMeshDef&) = default;
};

/// Irregularities of a mesh. Meshes with irregularities work; the numbers help to find faults of
/// exporters.
struct TriangleMeshReport {
  std::size_t degenerate = 0;     ///< triangles without area, which have no contacts
  std::size_t duplicate = 0;      ///< triangles with the vertices of an earlier one; no contacts
  std::size_t open_edges = 0;     ///< edges of one triangle
  std::size_t shared_edges = 0;   ///< edges of three or more triangles; bodies may catch on them
  std::size_t flipped_edges = 0;  ///< edges of two triangles whose fronts are on different sides
};

/// A surface of triangles without volume, the shape of terrain, buildings and machines. Bodies with
/// this shape have mass 0; kinematic bodies move it. Vertices at the same position are joined, so
/// that bodies do not catch on edges between adjacent triangles. Immutable: copies share the data,
/// and may be used by several threads.
class TriangleMesh {
 public:
  /// A mesh without triangles, which is no valid shape of a body.
  TriangleMesh() noexcept = default;
  /// Takes O(n log n) time.
  /// @throws InvalidArgument if a coordinate is out of range, an index is not that of a vertex, or
  ///   there are more than 2^29 triangles
  JFPX_API explicit TriangleMesh(TriangleMeshDef def);
  JFPX_API TriangleMesh(std::vector<Vec3> vertices, std::vector<Triangle> triangles,
                        bool two_sided = false);

  JFPX_API const TriangleMeshDef& def() const noexcept;
  std::span<const Vec3> vertices() const noexcept { return def().vertices; }
  std::span<const Triangle> triangles() const noexcept { return def().triangles; }
  bool two_sided() const noexcept { return def().two_sided; }
  JFPX_API TriangleMeshReport report() const noexcept;

  /// The arrays for contact tests; null without triangles. Internal.
  const std::shared_ptr<const detail::MeshData>& data() const noexcept { return data_; }

  JFPX_API friend bool operator==(const TriangleMesh& a, const TriangleMesh& b);

 private:
  std::shared_ptr<const detail::MeshData> data_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
