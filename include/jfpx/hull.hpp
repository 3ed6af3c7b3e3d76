/// Convex polyhedra as immutable values with shared data.
#pragma once

#include <jfpx/math.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A face of a hull: a convex polygon. All vertices of the hull are on its plane or behind it.
struct HullFace {
  Vec3 normal;      ///< [-], unit, outward
  Real offset = 0;  ///< [m], least value with dot(normal, v) <= offset for every vertex v
  std::uint16_t first_corner = 0;  ///< index of its first vertex in Hull::corners()
  std::uint16_t corner_count = 0;  ///< at least 3
  friend bool operator==(const HullFace&, const HullFace&) = default;
};

/// An edge of a hull: a < b.
struct HullEdge {
  std::uint8_t a = 0, b = 0;    ///< vertices
  std::uint8_t left_face = 0;   ///< the face whose corners have b after a
  std::uint8_t right_face = 0;  ///< the face whose corners have a after b
  friend bool operator==(const HullEdge&, const HullEdge&) = default;
};

namespace detail {

/// The arrays of a hull for contact tests, in host memory or on a device.
struct HullView {
  const Vec3* vertices = nullptr;
  const HullFace* faces = nullptr;
  const std::uint8_t* corners = nullptr;
  const HullEdge* edges = nullptr;
  // For vectors of the CPU, null on a device: see PolyhedronColumns.
  const Real* columns = nullptr;
  const std::uint32_t* packed_edges = nullptr;
  std::uint32_t vertex_count = 0, face_count = 0, edge_count = 0, corner_count = 0;
  std::uint64_t serial = 0;   ///< unique in the process
  Vec3 half_extents;          ///< [m], of a box about the origin that encloses the hull
  Vec3 centre;                ///< [m], centre of mass
  Real outer_radius = 0;      ///< [m], from the origin to the farthest vertex
  Real least_half_width = 0;  ///< [m], from the centre of mass to the nearest face
};

/// The arrays of a hull. Every array has a canonical order; see Hull.
struct HullData {
  std::vector<Vec3> vertices;
  std::vector<HullFace> faces;
  std::vector<std::uint8_t> corners;
  std::vector<HullEdge> edges;
  std::vector<Real> columns;
  std::vector<std::uint32_t> packed_edges;
  Aabb bounds;
  double volume = 0;      ///< [m^3]
  double centre[3] = {};  ///< [m], centre of mass
  double spread[6] = {};  ///< [m^2], mean of xx, yy, zz, xy, yz, zx over the volume, about `centre`
  HullView view;          ///< of the arrays; set once the object is where it remains
};

}  // namespace detail

/// A solid convex polyhedron, not necessarily centred at the origin. Its data are immutable and
/// shared between copies, so that copies are cheap. Concurrent use of copies, and const use of one
/// object, are safe.
///
/// The vertices are in lexicographic order. The corners of a face are counter-clockwise as seen
/// from outside, and begin with the smallest index. Faces are in the lexicographic order of their
/// corners, edges in that of (a, b). A coordinate -0 becomes 0. Equal sets of points have equal
/// hulls, to the last bit, on every machine.
///
/// Tolerances are multiples of the rounding unit u = kEpsilon times the largest absolute
/// coordinate. Points within 64 u of the hull of the others are not vertices, as long as the hull
/// contains all given points up to 140 u. Neighbouring faces are merged if the merged face is
/// convex and its corners are at most 32 u behind its plane. Every vertex has at least 3 faces, and
/// V - E + F = 2.
///
/// The algorithm is Quickhull (Barber, Dobkin and Huhdanpaa 1996, The quickhull algorithm for
/// convex hulls) with exact orientations (Shewchuk 1997, Adaptive precision floating-point
/// arithmetic and fast robust geometric predicates). For these, coordinates are rounded to
/// multiples of 2^-51 times the next power of two above the largest one.
class JFPX_API Hull {
 public:
  static constexpr std::uint32_t kMaxVertices = 128;
  static constexpr std::uint32_t kMaxFaces = 2 * kMaxVertices - 4;
  static constexpr std::uint32_t kMaxEdges = 3 * kMaxVertices - 6;

  /// A cube with half extents of 0.5 m.
  Hull();
  /// The convex hull of points, in O(n log n) expected time for n points.
  /// @param points [m], at least 4, finite and between -1e9 and 1e9, in any order, with duplicates
  /// @throws InvalidArgument for fewer points or other coordinates; if all points are within
  ///         64 u of a plane, a line or a point; if the volume underflows; or if the hull has more
  ///         than kMaxVertices vertices
  explicit Hull(std::span<const Vec3> points);
  /// A convex polyhedron with given faces, for example a triangle mesh. If it has at most
  /// kMaxVertices vertices, corners that are strictly convex, and no two faces that must be merged,
  /// then the hull has these vertices and faces; otherwise it is the hull of the vertices. The
  /// vertices and faces of a hull therefore give an equal hull.
  /// @param vertices [m], at least 4, finite, between -1e9 and 1e9, and distinct
  /// @param faces at least 4, each with the indices of at least 3 vertices, counter-clockwise
  ///        as seen from outside, plane and convex to 64 u; together the boundary of a convex
  ///        polyhedron that has all vertices
  /// @throws InvalidArgument if they are not, and as Hull(points)
  Hull(std::span<const Vec3> vertices, std::span<const std::vector<std::uint32_t>> faces);

  // Copies only: a moved hull would have no data.
  Hull(const Hull&) = default;
  Hull& operator=(const Hull&) = default;
  ~Hull() = default;

  /// [m], at least 4, at most kMaxVertices.
  std::span<const Vec3> vertices() const { return data_->vertices; }
  std::span<const HullFace> faces() const { return data_->faces; }
  /// Vertex indices of all faces, one face after the other; two per edge.
  std::span<const std::uint8_t> corners() const { return data_->corners; }
  /// Vertex indices of a face, counter-clockwise as seen from outside.
  /// @param face one of faces()
  std::span<const std::uint8_t> corners(const HullFace& face) const {
    return corners().subspan(face.first_corner, face.corner_count);
  }
  std::span<const HullEdge> edges() const { return data_->edges; }
  /// The smallest box that contains the vertices.
  const Aabb& bounds() const { return data_->bounds; }
  /// [m^3], > 0.
  double volume() const { return data_->volume; }
  /// [m]
  Vec3 centre_of_mass() const;
  /// [kg m^2], inertia tensor about the origin (not about the centre of mass) for a uniform
  /// density. Not finite if a value overflows. @param mass [kg]
  Mat3 inertia(Real mass) const;
  /// [kg m^2], inertia tensor about the centre of mass. @param mass [kg]
  Mat3 central_inertia(Real mass) const;

  /// The hull with its coordinates multiplied by `factors`, with the same faces if these remain
  /// plane and convex after rounding. An odd number of negative factors mirrors it.
  /// @param factors [-], each finite and not 0
  /// @throws InvalidArgument for other factors, and as Hull(points) for the scaled vertices
  Hull scaled(const Vec3& factors) const;
  /// The hull, translated by `offset`, with the same faces if these remain plane and convex after
  /// rounding.
  /// @param offset [m], finite
  /// @throws InvalidArgument for another offset, and as Hull(points) for the translated vertices
  Hull translated(const Vec3& offset) const;

  /// The arrays, for conversion to flat arrays.
  const detail::HullData& data() const { return *data_; }

  /// Whether vertices and faces are equal.
  friend JFPX_API bool operator==(const Hull& a, const Hull& b);

 private:
  explicit Hull(std::shared_ptr<const detail::HullData> data) : data_(std::move(data)) {}
  template <class Map>
  Hull mapped(const Map& map, bool mirrored) const;

  std::shared_ptr<const detail::HullData> data_;  ///< never null
};

/// The hull, translated so that its centre of mass is the origin, as movable bodies require.
JFPX_API Hull centred(const Hull& hull);

}  // namespace JFPX_ABI
}  // namespace jfpx
