/// Definitions of the kernels of hulls, as templates over a vector type S. The operations, their
/// order, and all decisions are those of polyhedron_pair.hpp.
#include "src/collide/cpu/hull_kernels.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

// A vector type S has the members of Avx2Lanes that are used here, and
//   larger(a, b)         a > b ? a : b in each lane
//   largest(v)           the largest lane
//   Words                vector of one 32-bit word for each lane
//   load_words(p)        read these
//   get_byte<k>(words)   byte k of each word
//   gather(base, words)  base[word] of each lane

constexpr std::uint32_t kLanes = kHullLanes;
#if defined(JFPX_DOUBLE_PRECISION)
constexpr Real kEps = __DBL_EPSILON__, kMost = __DBL_MAX__;
#else
constexpr Real kEps = __FLT_EPSILON__, kMost = __FLT_MAX__;
#endif
constexpr std::uint32_t kMostFaces = 256, kMostEdges = 384;  // whole blocks
enum : std::uint8_t { kNone, kFaceOfA, kFaceOfB, kEdges };   // PolyhedronAxis::Kind

struct Point {
  Real x, y, z;
};
inline Point operator-(const Point& p) { return {-p.x, -p.y, -p.z}; }
inline Point operator+(const Point& p, const Point& q) { return {p.x + q.x, p.y + q.y, p.z + q.z}; }
inline Point operator-(const Point& p, const Point& q) { return {p.x - q.x, p.y - q.y, p.z - q.z}; }
inline Point operator*(const Point& p, Real s) { return {p.x * s, p.y * s, p.z * s}; }
inline Real dot(const Point& p, const Point& q) { return (p.x * q.x + p.y * q.y) + p.z * q.z; }
inline Point point_of(const Real (&v)[3]) { return {v[0], v[1], v[2]}; }
inline Point rotated(const Real (&m)[3][3], const Point& p) {
  return {dot(point_of(m[0]), p), dot(point_of(m[1]), p), dot(point_of(m[2]), p)};
}
inline Point rotated_back(const Real (&m)[3][3], const Point& p) {
  return {dot({m[0][0], m[1][0], m[2][0]}, p), dot({m[0][1], m[1][1], m[2][1]}, p),
          dot({m[0][2], m[1][2], m[2][2]}, p)};
}
/// Element i of three columns.
inline Point point_at(const Real* column, std::uint32_t size, std::uint32_t i) {
  return {column[i], column[size + i], column[2 * size + i]};
}

/// A point of each lane.
template <class S>
struct Points {
  using Vec = typename S::Vec;
  Vec x, y, z;

  static Points set(const Point& p) { return {S::set(p.x), S::set(p.y), S::set(p.z)}; }
  /// @param size of each of three columns
  static Points load(const Real* column, std::uint32_t size) {
    return {S::load(column), S::load(column + size), S::load(column + 2 * size)};
  }
  static Points gather(const Real* column, std::uint32_t size, typename S::Words elements) {
    return {S::gather(column, elements), S::gather(column + size, elements),
            S::gather(column + 2 * size, elements)};
  }
  void store(Real* column) const {
    S::store(column, x), S::store(column + kLanes, y), S::store(column + 2 * kLanes, z);
  }
  Points operator-() const { return {S::negate(x), S::negate(y), S::negate(z)}; }
  Points negated(typename S::Mask mask) const {
    return {S::select(mask, S::negate(x), x), S::select(mask, S::negate(y), y),
            S::select(mask, S::negate(z), z)};
  }
  Points operator+(const Points& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Points operator-(const Points& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Points operator*(Vec s) const { return {x * s, y * s, z * s}; }
  static Vec dot(const Points& a, const Points& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
  static Points cross(const Points& a, const Points& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
};

/// A rotation in all lanes.
template <class S>
struct Rotation {
  Points<S> row[3];

  explicit Rotation(const Real (&m)[3][3])
      : row{Points<S>::set(point_of(m[0])), Points<S>::set(point_of(m[1])),
            Points<S>::set(point_of(m[2]))} {}
  Points<S> operator*(const Points<S>& p) const {
    return {Points<S>::dot(row[0], p), Points<S>::dot(row[1], p), Points<S>::dot(row[2], p)};
  }
};

/// The lanes from `first` on that have elements, one bit each.
inline unsigned lanes_from(std::uint32_t first, std::uint32_t count) {
  const std::uint32_t left = count - first;
  return left < kLanes ? (1u << left) - 1 : (1u << kLanes) - 1;
}
inline std::uint32_t first_lane(unsigned lanes) {
  return static_cast<std::uint32_t>(__builtin_ctz(lanes));
}

/// HullPolyhedron::support(), which decides the sign of 0.
inline Real support_in_order(const HullInput& hull, const Point& direction) {
  const std::uint32_t size = hull.vertex_size;
  Real most = dot(direction, point_at(hull.vertices, size, 0));
  for (std::uint32_t i = 1; i < hull.vertex_count; ++i) {
    const Real reach = dot(direction, point_at(hull.vertices, size, i));
    most = reach > most ? reach : most;
  }
  return most;
}
template <class S>
inline Real support(const HullInput& hull, const Point& direction) {
  const auto along = Points<S>::set(direction);
  const std::uint32_t size = hull.vertex_size;
  typename S::Vec most = Points<S>::dot(along, Points<S>::load(hull.vertices, size));
  for (std::uint32_t i = kLanes; i < size; i += kLanes) {
    most = S::larger(Points<S>::dot(along, Points<S>::load(hull.vertices + i, size)), most);
  }
  const Real result = S::largest(most);
  return result == 0 ? support_in_order(hull, direction) : result;
}

template <class S>
bool are_far_apart(const HullPairInput& pair, const Point& centre_a, const Point& centre_b) {
  const Point line = centre_b - centre_a;
  const Real distance = S::square_root(dot(line, line));
  if (!(distance > 0)) return false;
  const Point n = line * (Real(1) / distance);
  const Real reach_b = support<S>(pair.b, -rotated_back(pair.rotation, n));
  return dot(n, point_of(pair.offset)) - reach_b - support<S>(pair.a, n) > pair.limit;
}

struct Separation {
  Real distance;
  Point normal;  ///< from b to a
};

/// Heights of the centre of the other hull above the faces of a hull.
template <class S>
class Heights {
 public:
  /// @param centre in the axes of the hull
  Heights(const HullInput& hull, const Point& centre) {
    const auto point = Points<S>::set(centre);
    const std::uint32_t size = hull.face_size;
    typename S::Vec most = S::set(-kMost);
    for (std::uint32_t i = 0; i < size; i += kLanes) {
      const typename S::Vec height = Points<S>::dot(Points<S>::load(hull.faces + i, size), point) -
                                     S::load(hull.faces + 3 * size + i);
      S::store(heights_ + i, height);
      most = S::larger(height, most);
    }
    highest_ = S::largest(most);
    for (std::uint32_t i = 0; i < size; i += kLanes) {
      const unsigned lanes = S::bits(S::less_equal(S::set(highest_), S::load(heights_ + i)));
      if (lanes == 0) continue;
      first_ = i + first_lane(lanes);
      break;
    }
  }
  const Real* data() const { return heights_; }
  Real highest() const { return highest_; }
  /// The first face with the largest height.
  std::uint32_t first() const { return first_; }

 private:
  alignas(32) Real heights_[kMostFaces];
  Real highest_;
  std::uint32_t first_ = 0;
};

/// @param separation_of function of a face: Separation
template <class S, class SeparationOf>
bool test_faces(std::uint8_t kind, std::uint32_t count, const Heights<S>& heights,
                Real inner_radius, Real error, Real limit, const SeparationOf& separation_of,
                HullAxis* best) {
  const auto is_beaten = [&](Real height) {
    return best->kind != kNone && height - inner_radius + error <= best->distance;
  };
  const auto test = [&](std::uint32_t i) {
    const Separation found = separation_of(i);
    const auto face = static_cast<std::int32_t>(i);
    if (best->kind == kNone || found.distance > best->distance ||
        (found.distance == best->distance && best->kind == kind && face < best->first)) {
      const Point& n = found.normal;
      *best = {kind, face, 0, found.distance, error, {n.x, n.y, n.z}};
    }
    return !(found.distance > limit);
  };
  if (is_beaten(heights.highest())) return true;
  if (!test(heights.first())) return false;
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    const typename S::Vec bound =
        S::load(heights.data() + i) - S::set(inner_radius) + S::set(error);
    unsigned lanes = ~S::bits(S::less_equal(bound, S::set(best->distance))) & lanes_from(i, count);
    for (; lanes != 0; lanes &= lanes - 1) {
      const std::uint32_t face = i + first_lane(lanes);
      if (face == heights.first() || is_beaten(heights.data()[face])) continue;
      if (!test(face)) return false;
    }
  }
  return true;
}

template <class S>
bool test_faces_of_a(const HullPairInput& pair, const Heights<S>& heights, HullAxis* best) {
  const Point offset = point_of(pair.offset);
  const std::uint32_t size = pair.a.face_size;
  const auto separation_of = [&](std::uint32_t i) -> Separation {
    const Point n = point_at(pair.a.faces, size, i);
    const Real reach = support<S>(pair.b, -rotated_back(pair.rotation, n));
    return {dot(n, offset) - reach - pair.a.faces[3 * size + i], -n};
  };
  return test_faces(kFaceOfA, pair.a.face_count, heights, pair.b.inner_radius, pair.error,
                    pair.limit, separation_of, best);
}
template <class S>
bool test_faces_of_b(const HullPairInput& pair, const Heights<S>& heights, HullAxis* best) {
  const Point offset = point_of(pair.offset);
  const std::uint32_t size = pair.b.face_size;
  const auto separation_of = [&](std::uint32_t i) -> Separation {
    const Point n = rotated(pair.rotation, point_at(pair.b.faces, size, i));
    return {-dot(n, offset) - support<S>(pair.a, -n) - pair.b.faces[3 * size + i], n};
  };
  return test_faces(kFaceOfB, pair.b.face_count, heights, pair.a.inner_radius, pair.error,
                    pair.limit, separation_of, best);
}

/// The edges of a hull that may belong to an axis: those for which faces_away() is false.
template <class S>
class KeptEdges {
 public:
  using Vec = typename S::Vec;

  /// @param inner_radius of the other hull
  KeptEdges(const HullInput& hull, const Heights<S>& heights, Real inner_radius, Real least,
            Real error) {
    const Real reach = least + inner_radius - 4 * error;
    const bool can_face_away = reach > 0;
    const Vec reach2 = S::set(reach * reach), slack = S::set(4 * error), zero = S::set(0);
    for (std::uint32_t i = 0; i < hull.edge_count; i += kLanes) {
      unsigned lanes = lanes_from(i, hull.edge_count);
      if (can_face_away) {
        const auto edges = S::load_words(hull.edges + i);
        const Vec p = S::gather(heights.data(), S::template get_byte<2>(edges));
        const Vec q = S::gather(heights.data(), S::template get_byte<3>(edges));
        const Vec most = S::larger(p, q) + slack;
        const Vec bound = reach2 * S::load(hull.cosines2 + i) * S::set(1 - 16 * kEps);
        lanes &= ~S::bits(S::either(S::less(most, zero), S::less(most * most, bound)));
      }
      for (; lanes != 0; lanes &= lanes - 1) {
        edge_[count_] = i + first_lane(lanes);
        words_[count_] = hull.edges[edge_[count_]];
        ++count_;
      }
    }
    for (std::uint32_t i = 0; i < kLanes; ++i) words_[count_ + i] = 0;
  }
  /// Fills the columns, for edges of a.
  void fill(const HullInput& hull) {
    for (std::uint32_t i = 0; i < count_; i += kLanes) {
      const Ends ends(hull, S::load_words(words_ + i));
      fill(i, ends.u, ends.v, ends.from, ends.to);
    }
  }
  /// Fills the columns, for edges of b in the axes of a, with the normals of -b.
  void fill(const HullInput& hull, const Rotation<S>& rotation, const Points<S>& offset) {
    for (std::uint32_t i = 0; i < count_; i += kLanes) {
      const Ends ends(hull, S::load_words(words_ + i));
      fill(i, -(rotation * ends.u), -(rotation * ends.v), rotation * ends.from + offset,
           rotation * ends.to + offset);
    }
  }
  std::uint32_t count() const { return count_; }
  /// Number of an edge in the hull.
  std::int32_t edge(std::uint32_t i) const { return static_cast<std::int32_t>(edge_[i]); }
  /// Values of the edges from i on, a multiple of kLanes.
  Points<S> points(std::uint32_t i, std::uint32_t column) const {
    return Points<S>::load(columns_[i / kLanes] + column * kLanes, kLanes);
  }
  Vec load(std::uint32_t i, std::uint32_t column) const {
    return S::load(columns_[i / kLanes] + column * kLanes);
  }
  /// Values of an edge in all lanes.
  Points<S> spread_points(std::uint32_t i, std::uint32_t column) const {
    return Points<S>::set(point_at(columns_[i / kLanes] + column * kLanes, kLanes, i % kLanes));
  }
  Vec spread(std::uint32_t i, std::uint32_t column) const {
    return S::set(columns_[i / kLanes][column * kLanes + i % kLanes]);
  }

  /// Normals of the faces and their cross product; the first end, the vector to the second, and its
  /// square.
  static constexpr std::uint32_t kFace = 0, kOtherFace = 3, kCross = 6, kFrom = 9, kAlong = 12,
                                 kSize = 15, kColumns = 16;

 private:
  struct Ends {
    Ends(const HullInput& hull, typename S::Words edges)
        : u(Points<S>::gather(hull.faces, hull.face_size, S::template get_byte<2>(edges))),
          v(Points<S>::gather(hull.faces, hull.face_size, S::template get_byte<3>(edges))),
          from(Points<S>::gather(hull.vertices, hull.vertex_size, S::template get_byte<0>(edges))),
          to(Points<S>::gather(hull.vertices, hull.vertex_size, S::template get_byte<1>(edges))) {}
    Points<S> u, v, from, to;
  };
  void fill(std::uint32_t i, const Points<S>& u, const Points<S>& v, const Points<S>& from,
            const Points<S>& to) {
    Real* const columns = columns_[i / kLanes];
    const auto along = to - from;
    u.store(columns + kFace * kLanes);
    v.store(columns + kOtherFace * kLanes);
    Points<S>::cross(v, u).store(columns + kCross * kLanes);
    from.store(columns + kFrom * kLanes);
    along.store(columns + kAlong * kLanes);
    S::store(columns + kSize * kLanes, Points<S>::dot(along, along));
  }

  std::uint32_t count_ = 0;
  std::uint32_t edge_[kMostEdges], words_[kMostEdges + kLanes];
  alignas(32) Real columns_[kMostEdges / kLanes][kColumns * kLanes];
};

/// Tests edge k of b with the edges of a. @returns false if a separation is above the limit
template <class S>
bool test_edge(const HullPairInput& pair, const KeptEdges<S>& of_a, const KeptEdges<S>& of_b,
               std::uint32_t k, HullAxis* best) {
  using Vec = typename S::Vec;
  using Kept = KeptEdges<S>;
  const Vec zero = S::set(0);
  const auto c = of_b.spread_points(k, Kept::kFace), d = of_b.spread_points(k, Kept::kOtherFace);
  const auto dc = of_b.spread_points(k, Kept::kCross);
  for (std::uint32_t m = 0; m < of_a.count(); m += kLanes) {
    const auto u = of_a.points(m, Kept::kFace), v = of_a.points(m, Kept::kOtherFace);
    const auto vu = of_a.points(m, Kept::kCross);
    const Vec udc = Points<S>::dot(u, dc), vdc = Points<S>::dot(v, dc);
    const Vec cvu = Points<S>::dot(c, vu), dvu = Points<S>::dot(d, vu);
    auto crosses = S::both(S::less(udc * vdc, zero), S::less(cvu * dvu, zero));
    crosses = S::both(crosses, S::less(zero, cvu * vdc));
    const unsigned filled = lanes_from(m, of_a.count());
    if ((S::bits(crosses) & filled) == 0) continue;
    auto n = Points<S>::cross(of_a.points(m, Kept::kAlong), of_b.spread_points(k, Kept::kAlong));
    const Vec across2 = Points<S>::dot(n, n);
    const Vec sizes = of_a.load(m, Kept::kSize) * of_b.spread(k, Kept::kSize);
    crosses = S::both(crosses, S::less(S::set(4 * kEps) * sizes, across2));
    n = n * (S::set(1) / S::square_root(across2));
    n = n.negated(S::less(Points<S>::dot(n, u + v), zero));
    const Vec distance =
        Points<S>::dot(n, of_b.spread_points(k, Kept::kFrom) - of_a.points(m, Kept::kFrom));
    unsigned lanes = S::bits(crosses) & filled;
    if ((S::bits(S::less(S::set(pair.limit), distance)) & lanes) != 0) return false;
    if (best->kind != kNone) lanes &= S::bits(S::less(S::set(best->distance), distance));
    if (lanes == 0) continue;
    alignas(32) Real distances[kLanes], sines[kLanes], normals[3 * kLanes];
    S::store(distances, distance);
    S::store(sines, S::square_root(across2 / sizes));
    (-n).store(normals);
    for (; lanes != 0; lanes &= lanes - 1) {
      const std::uint32_t lane = first_lane(lanes);
      if (best->kind != kNone && !(distances[lane] > best->distance)) continue;
      const Point normal = point_at(normals, kLanes, lane);
      *best = {kEdges,          of_a.edge(m + lane),      of_b.edge(k),
               distances[lane], pair.error / sines[lane], {normal.x, normal.y, normal.z}};
    }
  }
  return true;
}

template <class S>
bool test_edges(const HullPairInput& pair, const Heights<S>& heights_a, const Heights<S>& heights_b,
                Real least, HullAxis* best) {
  KeptEdges<S> of_a(pair.a, heights_a, pair.b.inner_radius, least, pair.error);
  if (of_a.count() == 0) return true;
  KeptEdges<S> of_b(pair.b, heights_b, pair.a.inner_radius, least, pair.error);
  if (of_b.count() == 0) return true;
  of_a.fill(pair.a);
  of_b.fill(pair.b, Rotation<S>(pair.rotation), Points<S>::set(point_of(pair.offset)));
  for (std::uint32_t k = 0; k < of_b.count(); ++k) {
    if (!test_edge(pair, of_a, of_b, k, best)) return false;
  }
  return true;
}

template <class S>
bool test_axes(const HullPairInput& pair, HullAxes* axes) {
  const Point centre_a = point_of(pair.a.centre), offset = point_of(pair.offset);
  const Point centre_b = rotated(pair.rotation, point_of(pair.b.centre)) + offset;
  if (are_far_apart<S>(pair, centre_a, centre_b)) return false;
  axes->of_a.kind = axes->edges.kind = kNone;
  const Heights<S> heights_a(pair.a, centre_b);
  if (!test_faces_of_a(pair, heights_a, &axes->of_a)) return false;
  axes->widest = axes->of_a;
  const Heights<S> heights_b(pair.b, rotated_back(pair.rotation, centre_a - offset));
  if (!test_faces_of_b(pair, heights_b, &axes->widest)) return false;
  return test_edges(pair, heights_a, heights_b, axes->widest.distance, &axes->edges);
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
