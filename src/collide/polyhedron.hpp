/// Boxes and hulls as polyhedra with vertices, faces and edges, for tests of any two of them.
#pragma once

#include <jfpx/hull.hpp>
#include <jfpx/shape.hpp>

#include "src/collide/box_pair.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Ends and faces of an edge of a polyhedron.
struct PolyhedronEdge {
  int a = 0, b = 0;
  int face = 0, other_face = 0;
};

/// A hull.
struct HullPolyhedron {
  const HullView* hull = nullptr;

  JFPX_HD int vertex_count() const { return static_cast<int>(hull->vertex_count); }
  JFPX_HD Vec3 vertex(int i) const { return hull->vertices[i]; }
  JFPX_HD int face_count() const { return static_cast<int>(hull->face_count); }
  JFPX_HD Vec3 face_normal(int i) const { return hull->faces[i].normal; }
  JFPX_HD Real face_offset(int i) const { return hull->faces[i].offset; }
  JFPX_HD int corner_count(int face) const { return hull->faces[face].corner_count; }
  JFPX_HD Vec3 corner(int face, int k) const {
    return hull->vertices[hull->corners[hull->faces[face].first_corner + k]];
  }
  JFPX_HD int edge_count() const { return static_cast<int>(hull->edge_count); }
  JFPX_HD PolyhedronEdge edge(int i) const {
    const HullEdge& e = hull->edges[i];
    return {e.a, e.b, e.left_face, e.right_face};
  }
  /// [m], from the origin to the farthest vertex in a direction.
  JFPX_HD Real support(const Vec3& direction) const {
    Real most = dot(direction, hull->vertices[0]);
    for (std::uint32_t i = 1; i < hull->vertex_count; ++i) {
      const Real reach = dot(direction, hull->vertices[i]);
      most = reach > most ? reach : most;
    }
    return most;
  }
  JFPX_HD Real size() const { return hull->outer_radius; }
  /// A ball inside the polyhedron.
  JFPX_HD Vec3 centre() const { return hull->centre; }
  JFPX_HD Real inner_radius() const { return hull->least_half_width; }
};

/// A box. Bit i of the number of a vertex is the sign of coordinate i; face 2 i + s is that of
/// axis i, in its positive direction if s = 1; the edges of axis i are 4 i to 4 i + 3.
struct BoxPolyhedron {
  Vec3 half;

  JFPX_HD int vertex_count() const { return 8; }
  JFPX_HD Vec3 vertex(int i) const {
    return {(i & 1) != 0 ? half.x : -half.x, (i & 2) != 0 ? half.y : -half.y,
            (i & 4) != 0 ? half.z : -half.z};
  }
  JFPX_HD int face_count() const { return 6; }
  JFPX_HD Vec3 face_normal(int i) const {
    const Vec3 axis = unit_axis(i / 2);
    return i % 2 != 0 ? axis : -axis;
  }
  JFPX_HD Real face_offset(int i) const { return half[i / 2]; }
  JFPX_HD int corner_count(int) const { return 4; }
  JFPX_HD Vec3 corner(int face, int k) const {
    const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    // Counterclockwise around the axis, and clockwise for the negative face.
    const int at = face % 2 != 0 ? k : 3 - k;
    Vec3 p;
    p[axis] = face % 2 != 0 ? half[axis] : -half[axis];
    p[u] = at == 1 || at == 2 ? half[u] : -half[u];
    p[v] = at >= 2 ? half[v] : -half[v];
    return p;
  }
  JFPX_HD int edge_count() const { return 12; }
  JFPX_HD PolyhedronEdge edge(int i) const {
    const int axis = i / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const int su = i & 1, sv = i >> 1 & 1;
    const int a = su << u | sv << v;
    return {a, a | 1 << axis, 2 * u + su, 2 * v + sv};
  }
  JFPX_HD Real support(const Vec3& direction) const {
    return projected_half_length(half, direction);
  }
  JFPX_HD Real size() const { return length(half); }
  JFPX_HD Vec3 centre() const { return {}; }
  JFPX_HD Real inner_radius() const {
    const Real xy = half.x < half.y ? half.x : half.y;
    return half.z < xy ? half.z : xy;
  }
};

/// The face of a polyhedron whose outward normal is most opposite to a direction.
template <class P>
JFPX_HD int facing_face(const P& polyhedron, const Vec3& direction) {
  int face = 0;
  Real least = dot(direction, polyhedron.face_normal(0));
  for (int i = 1; i < polyhedron.face_count(); ++i) {
    const Real cosine = dot(direction, polyhedron.face_normal(i));
    if (cosine < least) least = cosine, face = i;
  }
  return face;
}

/// Among the faces at the vertex that is farthest against a direction, that whose outward normal is
/// most opposite to the direction. The most opposite of all faces need not have this vertex.
template <class P>
JFPX_HD int incident_face(const P& polyhedron, const Vec3& direction) {
  int deepest = 0;
  Real lowest = dot(direction, polyhedron.vertex(0));
  for (int i = 1; i < polyhedron.vertex_count(); ++i) {
    const Real height = dot(direction, polyhedron.vertex(i));
    if (height < lowest) lowest = height, deepest = i;
  }
  int face = -1;
  Real least = 0;
  const auto consider = [&](int i) {
    const Real cosine = dot(direction, polyhedron.face_normal(i));
    if (face < 0 || cosine < least || (cosine == least && i < face)) least = cosine, face = i;
  };
  for (int i = 0; i < polyhedron.edge_count(); ++i) {
    const PolyhedronEdge edge = polyhedron.edge(i);
    if (edge.a != deepest && edge.b != deepest) continue;
    consider(edge.face);
    consider(edge.other_face);
  }
  return face;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
