/// Collision of two polyhedra: the separating-axis test over the normals of faces and the cross
/// products of edges whose arcs cross on the Gauss map (Gregorius, The separating axis test between
/// convex polyhedra, 2013), and the contact points from two faces or two edges.
#pragma once

#include "src/collide/face_points.hpp"
#include "src/collide/polyhedron.hpp"
#if !defined(__CUDACC__)
#include "src/collide/polyhedron_columns.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Two polyhedra in the axes of the first. The columns of `rotation` are the axes of b.
template <class A, class B>
struct PolyhedronPair {
  A a;
  B b;
  Mat3 rotation;
  Vec3 offset;  ///< [m], of b
  Real size;    ///< [m], the scale of the rounding errors

  JFPX_HD Vec3 vertex_of_b(int i) const { return rotation * b.vertex(i) + offset; }
  /// The centre of b in the axes of a.
  JFPX_HD Vec3 centre_of_b() const { return rotation * b.centre() + offset; }
  /// The centre of a in the axes of b.
  JFPX_HD Vec3 centre_of_a() const { return transform_transpose(rotation, a.centre() - offset); }
};

/// [m], height of a point above the plane of a face.
template <class P>
JFPX_HD Real height_above(const P& polyhedron, int face, const Vec3& point) {
  return dot(polyhedron.face_normal(face), point) - polyhedron.face_offset(face);
}

/// The axis of a contact: a face of a, a face of b, or an edge of each.
struct PolyhedronAxis {
  enum Kind : std::uint8_t { none, face_of_a, face_of_b, edges };
  Kind kind = none;
  int first = 0, second = 0;  ///< face, or edges of a and b
  LeastOverlap overlap;       ///< the normal is from b to a, in the axes of a
};

/// As preferred() for overlaps.
JFPX_HD inline const PolyhedronAxis& preferred(const PolyhedronAxis& first,
                                               const PolyhedronAxis& later) {
  if (later.kind == PolyhedronAxis::none) return first;
  return &preferred(first.overlap, later.overlap) == &first.overlap ? first : later;
}

/// Whether the polyhedra are farther apart than `limit` along the line of their centres, which
/// separates most polyhedra that are not close.
template <class A, class B>
JFPX_HD bool are_far_apart(const PolyhedronPair<A, B>& pair, Real limit) {
  const Vec3 line = pair.centre_of_b() - pair.a.centre();
  const Real distance = length(line);
  if (!(distance > 0)) return false;
  const Vec3 n = line * (Real(1) / distance);
  const Real reach_b = pair.b.support(-transform_transpose(pair.rotation, n));
  return dot(n, pair.offset) - reach_b - pair.a.support(n) > limit;
}

/// Whether a face can't have a larger separation than the best one, because the other polyhedron
/// reaches back at least to its inner ball.
/// @param height [m], of the centre of the other polyhedron above the face
JFPX_HD inline bool is_beaten(const PolyhedronAxis& best, Real height, Real inner_radius,
                              Real error) {
  return best.kind != PolyhedronAxis::none &&
         height - inner_radius + error <= best.overlap.distance;
}

/// Replaces *best by the face with the largest separation, if this is larger. Of equal faces of
/// `kind`, the first counts. The face that is farthest below the centre of the other polyhedron is
/// tested first, because it beats most of the others.
/// @param height_of     function of a face: [m], height of the centre of the other polyhedron
/// @param separation_of function of a face: LeastOverlap
/// @returns false if a separation is above `limit`
template <class HeightOf, class SeparationOf>
JFPX_HD bool test_faces(PolyhedronAxis::Kind kind, int count, Real inner_radius, Real error,
                        Real limit, const HeightOf& height_of, const SeparationOf& separation_of,
                        PolyhedronAxis* best) {
  int first = 0;
  Real highest = -kMaxReal;
  for (int i = 0; i < count; ++i) {
    const Real height = height_of(i);
    if (height > highest) highest = height, first = i;
  }
  const auto test = [&](int i) {
    const LeastOverlap overlap = separation_of(i);
    const Real most = best->overlap.distance;
    if (best->kind == PolyhedronAxis::none || overlap.distance > most ||
        (overlap.distance == most && best->kind == kind && i < best->first)) {
      *best = {kind, i, 0, overlap};
    }
    return !(overlap.distance > limit);
  };
  if (is_beaten(*best, highest, inner_radius, error)) return true;
  if (!test(first)) return false;
  for (int i = 0; i < count; ++i) {
    if (i == first || is_beaten(*best, height_of(i), inner_radius, error)) continue;
    if (!test(i)) return false;
  }
  return true;
}
template <class A, class B>
JFPX_HD bool test_faces_of_a(const PolyhedronPair<A, B>& pair, Real error, Real limit,
                             PolyhedronAxis* best) {
  const Vec3 centre_b = pair.centre_of_b();
  const auto height_of = [&](int i) { return height_above(pair.a, i, centre_b); };
  const auto separation_of = [&](int i) -> LeastOverlap {
    const Vec3 n = pair.a.face_normal(i);
    const Real reach = pair.b.support(-transform_transpose(pair.rotation, n));
    return {0, dot(n, pair.offset) - reach - pair.a.face_offset(i), error, -n};
  };
  return test_faces(PolyhedronAxis::face_of_a, pair.a.face_count(), pair.b.inner_radius(), error,
                    limit, height_of, separation_of, best);
}
template <class A, class B>
JFPX_HD bool test_faces_of_b(const PolyhedronPair<A, B>& pair, Real error, Real limit,
                             PolyhedronAxis* best) {
  const Vec3 centre_a = pair.centre_of_a();
  const auto height_of = [&](int i) { return height_above(pair.b, i, centre_a); };
  const auto separation_of = [&](int i) -> LeastOverlap {
    const Vec3 n = pair.rotation * pair.b.face_normal(i);
    return {0, -dot(n, pair.offset) - pair.a.support(-n) - pair.b.face_offset(i), error, n};
  };
  return test_faces(PolyhedronAxis::face_of_b, pair.b.face_count(), pair.a.inner_radius(), error,
                    limit, height_of, separation_of, best);
}

/// Whether an edge cannot belong to an axis with a separation above `least`: along every outward
/// normal n of the edge, the other polyhedron reaches back at least to its inner ball. The normals
/// are on the arc between those of the two faces, whose largest product with a vector exceeds those
/// of its ends by at most 1 / cos(half the angle). The vertices of a hull are at most
/// 32 kEpsilon times its size, which is less than 4 * error, behind the planes of their faces.
/// @param centre of the other polyhedron, in the axes of the first
template <class P>
JFPX_HD bool faces_away(const P& polyhedron, const PolyhedronEdge& edge, const Vec3& centre,
                        Real inner_radius, Real least, Real error) {
  const Real reach = least + inner_radius - 4 * error;
  if (!(reach > 0)) return false;
  const Real p = height_above(polyhedron, edge.face, centre);
  const Real q = height_above(polyhedron, edge.other_face, centre);
  const Real most = (p > q ? p : q) + 4 * error;
  const Vec3 u = polyhedron.face_normal(edge.face), v = polyhedron.face_normal(edge.other_face);
  const Real cosine2 = (1 + dot(u, v)) * Real(0.5);  // of half the angle
  return most < 0 || most * most < reach * reach * cosine2 * (1 - 16 * kEpsilon);
}

/// The pair of edges with the largest separation above `least`. Only pairs whose arcs cross on the
/// Gauss map are edges of the Minkowski difference.
/// @returns false if the separation is above `limit`
template <class A, class B>
JFPX_HD bool test_edges(const PolyhedronPair<A, B>& pair, Real error, Real least, Real limit,
                        PolyhedronAxis* best) {
  std::uint16_t edges_of_a[Hull::kMaxEdges];
  int count = 0;
  const Vec3 centre_b = pair.centre_of_b(), centre_a = pair.centre_of_a();
  for (int i = 0; i < pair.a.edge_count(); ++i) {
    if (faces_away(pair.a, pair.a.edge(i), centre_b, pair.b.inner_radius(), least, error)) continue;
    edges_of_a[count++] = static_cast<std::uint16_t>(i);
  }
  for (int k = 0; k < pair.b.edge_count(); ++k) {
    const PolyhedronEdge eb = pair.b.edge(k);
    if (faces_away(pair.b, eb, centre_a, pair.a.inner_radius(), least, error)) continue;
    const Vec3 pb = pair.vertex_of_b(eb.a);
    const Vec3 c = -(pair.rotation * pair.b.face_normal(eb.face));
    const Vec3 d = -(pair.rotation * pair.b.face_normal(eb.other_face));
    const Vec3 along_b = pair.vertex_of_b(eb.b) - pb, dc = cross(d, c);
    const Real size_b = length_squared(along_b);
    for (int m = 0; m < count; ++m) {
      const int i = edges_of_a[m];
      const PolyhedronEdge ea = pair.a.edge(i);
      const Vec3 u = pair.a.face_normal(ea.face), v = pair.a.face_normal(ea.other_face);
      const Real udc = dot(u, dc), vdc = dot(v, dc);
      if (!(udc * vdc < 0)) continue;
      const Vec3 vu = cross(v, u);
      const Real cvu = dot(c, vu), dvu = dot(d, vu);
      if (!(cvu * dvu < 0 && cvu * vdc > 0)) continue;
      const Vec3 pa = pair.a.vertex(ea.a), along_a = pair.a.vertex(ea.b) - pa;
      Vec3 n = cross(along_a, along_b);
      const Real across2 = length_squared(n), sizes = length_squared(along_a) * size_b;
      if (!(across2 > 4 * kEpsilon * sizes)) continue;
      n = n * (Real(1) / square_root(across2));
      if (dot(n, u + v) < 0) n = -n;
      const Real distance = dot(n, pb - pa);
      if (distance > limit) return false;
      if (best->kind == PolyhedronAxis::none || distance > best->overlap.distance) {
        const Real sine = square_root(across2 / sizes);
        *best = {PolyhedronAxis::edges, i, k, {0, distance, error / sine, -n}};
      }
    }
  }
  return true;
}

/// The axes that are found by tests.
struct TestedAxes {
  PolyhedronAxis of_a;
  PolyhedronAxis widest;  ///< of_a, or a face of b with a larger separation
  PolyhedronAxis edges;
};

/// False if an axis separates the polyhedra by more than `limit`.
template <class A, class B>
JFPX_HD bool test_axes(const PolyhedronPair<A, B>& pair, Real error, Real limit, TestedAxes* axes) {
  if (are_far_apart(pair, limit)) return false;
  if (!test_faces_of_a(pair, error, limit, &axes->of_a)) return false;
  axes->widest = axes->of_a;
  if (!test_faces_of_b(pair, error, limit, &axes->widest)) return false;
  return test_edges(pair, error, axes->widest.overlap.distance, limit, &axes->edges);
}

#if !defined(__CUDACC__)
/// The same by kernels with vectors.
template <class A, class B>
bool test_axes(const PolyhedronPair<A, B>& pair, Real error, Real limit,
               const cpu::HullKernels& kernels, TestedAxes* axes) {
  const KernelInput<A> a(pair.a);
  const KernelInput<B> b(pair.b);
  const Vec3 *row = pair.rotation.row, &offset = pair.offset;
  cpu::HullAxes found;
  const bool may_meet = kernels.test_axes({a.input(),
                                           b.input(),
                                           {{row[0].x, row[0].y, row[0].z},
                                            {row[1].x, row[1].y, row[1].z},
                                            {row[2].x, row[2].y, row[2].z}},
                                           {offset.x, offset.y, offset.z},
                                           error,
                                           limit},
                                          &found);
  if (!may_meet) return false;
  const auto axis_of = [](const cpu::HullAxis& axis) -> PolyhedronAxis {
    if (axis.kind == PolyhedronAxis::none) return {};
    const Real* const n = axis.normal;
    return {static_cast<PolyhedronAxis::Kind>(axis.kind),
            axis.first,
            axis.second,
            {0, axis.distance, axis.error, {n[0], n[1], n[2]}}};
  };
  *axes = {axis_of(found.of_a), axis_of(found.widest), axis_of(found.edges)};
  return true;
}
#endif

/// The axes of a contact.
struct PolyhedronAxes {
  PolyhedronAxis preferred;  ///< faces precede edges; steady for resting polyhedra
  PolyhedronAxis widest;     ///< of the largest separation, or of least overlap
};

/// False if an axis separates the polyhedra by more than `limit`.
/// @param kernels null for the scalar tests, which have the same results
template <class A, class B>
JFPX_HD bool find_axes(const PolyhedronPair<A, B>& pair, Real limit,
                       const cpu::HullKernels* kernels, PolyhedronAxes* axes) {
  const Real error = 8 * kEpsilon * pair.size;
  TestedAxes tested;
#if defined(__CUDACC__)
  static_cast<void>(kernels);
  const bool may_meet = test_axes(pair, error, limit, &tested);
#else
  const bool may_meet = kernels != nullptr ? test_axes(pair, error, limit, *kernels, &tested)
                                           : test_axes(pair, error, limit, &tested);
#endif
  if (!may_meet) return false;
  // A face of b that is not wider than the face of a is not preferred to it.
  axes->widest = tested.widest;
  const PolyhedronAxis& edges = tested.edges;
  const PolyhedronAxis& face = preferred(tested.of_a, tested.widest);
  const bool is_face = &preferred_to_edges(face.overlap, edges.overlap) == &face.overlap;
  axes->preferred = edges.kind == PolyhedronAxis::none || is_face ? face : edges;
  if (edges.kind != PolyhedronAxis::none &&
      edges.overlap.distance > axes->widest.overlap.distance) {
    axes->widest = edges;
  }
  return true;
}

/// The closest points of two edges that are not parallel (Goldman 1990).
JFPX_HD inline EdgePoints closest_of_edges(const Vec3& a, const Vec3& along_a, const Vec3& b,
                                           const Vec3& along_b) {
  const auto clamp = [](Real x) { return x > 1 ? Real(1) : x < 0 ? Real(0) : x; };
  const Vec3 common = cross(along_a, along_b);
  const Real scale = Real(1) / length_squared(common);
  const Real s = clamp(dot(cross(b - a, along_b), common) * scale);
  const Real t = clamp(dot(cross(b - a, along_a), common) * scale);
  return {add_scaled(a, along_a, s), add_scaled(b, along_b, t)};
}

/// Calls add(point, distance, feature) for the points of the contact, in the axes of a; the point
/// is in the middle of the overlap.
/// @param margin largest distance of a point
template <class A, class B, class Add>
JFPX_HD void visit_contact_points(const PolyhedronPair<A, B>& pair, const PolyhedronAxis& axis,
                                  Real margin, const Add& add) {
  if (axis.kind == PolyhedronAxis::edges) {
    const PolyhedronEdge ea = pair.a.edge(axis.first), eb = pair.b.edge(axis.second);
    const Vec3 pa = pair.a.vertex(ea.a), pb = pair.vertex_of_b(eb.a);
    const auto first = static_cast<std::uint32_t>(axis.first);
    const auto second = static_cast<std::uint32_t>(axis.second);
    constexpr std::uint32_t kEdges = 0x80000000u, kMostEdges = 512;
    const EdgePoints closest =
        closest_of_edges(pa, pair.a.vertex(ea.b) - pa, pb, pair.vertex_of_b(eb.b) - pb);
    // Rounding may select edges of solids in contact that do not cross.
    if (axis.overlap.distance > 0 || closest.are_on(axis.overlap)) {
      add(closest.middle(), axis.overlap.distance, kEdges + first * kMostEdges + second);
    }
    return;
  }
  // The normal of the reference face points to the other polyhedron.
  const bool is_of_a = axis.kind == PolyhedronAxis::face_of_a;
  const Vec3 n = is_of_a ? -axis.overlap.normal : axis.overlap.normal;
  const int face_a = is_of_a ? axis.first : incident_face(pair.a, n);
  const int face_b =
      is_of_a ? incident_face(pair.b, transform_transpose(pair.rotation, n)) : axis.first;
  const auto of_a = make_face(
      pair.a.corner_count(face_a), [&](int k) { return pair.a.corner(face_a, k); },
      pair.a.face_normal(face_a));
  const auto of_b = make_face(
      pair.b.corner_count(face_b),
      [&](int k) { return pair.rotation * pair.b.corner(face_b, k) + pair.offset; },
      pair.rotation * pair.b.face_normal(face_b));
  // Unique for the faces up to a collision of the products, which only moves impulses.
  const std::uint32_t faces =
      (static_cast<std::uint32_t>(face_a) * 256 + static_cast<std::uint32_t>(face_b)) *
          PointFeature::kCount * 2 +
      (is_of_a ? 0 : PointFeature::kCount);
  const auto keep = [&](const Vec3& p, Real distance, std::uint32_t feature) {
    if (!(distance <= margin)) return;
    add(add_scaled(p, n, distance * Real(-0.5)), distance, (faces + feature) & 0x7fffffffu);
  };
  const auto all = [](int) { return true; };
  if (is_of_a) {
    visit_face_points(of_a, of_b, all, 0, keep);
  } else {
    visit_face_points(of_b, of_a, all, 0, keep);
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
