/// Construction of hulls from points, or from vertices and faces, with checks of all arguments.
#include <jfpx/error.hpp>
#include <jfpx/hull.hpp>
#include <jfpx/scene.hpp>

#include "src/base/hash64.hpp"
#include "src/collide/hull/hull_data.hpp"
#include "src/collide/hull/reduction.hpp"
#include "src/collide/polyhedron_columns.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using detail::Extent;
using detail::FaceCorners;
using detail::GridPoint;
using detail::HullData;
using detail::HullGrid;
using detail::HullView;
using detail::Polyhedron;
using detail::Quickhull;

constexpr int kMostHullVertices = static_cast<int>(Hull::kMaxVertices);
using HullFaceLists = std::span<const std::vector<std::uint32_t>>;

std::string decimal(Real value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}
std::string decimal(const Vec3& v) {
  return "(" + decimal(v.x) + ", " + decimal(v.y) + ", " + decimal(v.z) + ")";
}
std::string item(const char* list, std::size_t index) {
  return list + ("[" + std::to_string(index) + "]");
}

void check_coordinates(const char* name, std::span<const Vec3> points) {
  if (points.size() < 4) {
    throw InvalidArgument(name + (" has " + std::to_string(points.size())) +
                          " points; it must have at least 4");
  }
  const auto is_valid = [](Real x) { return absolute(x) <= kMaxCoordinate; };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i];
    if (is_valid(p.x) && is_valid(p.y) && is_valid(p.z)) continue;
    throw InvalidArgument(item(name, i) + " is " + decimal(p) +
                          "; it must be finite and between -1e9 and 1e9");
  }
}

[[noreturn]] void throw_flat(const char* name, Extent extent, const HullGrid& grid) {
  const char* where = extent == Extent::point  ? "a point"
                      : extent == Extent::line ? "a line"
                                               : "a plane";
  throw InvalidArgument(std::string(name) + " is within " +
                        decimal(static_cast<Real>(grid.metres(grid.vertex_tolerance()))) +
                        " m of " + where + "; it must have points on both sides of every plane");
}

/// Points on a grid, in lexicographic order, without duplicates.
struct SortedPoints {
  HullGrid grid;
  std::vector<Vec3> given;
  std::vector<GridPoint> rounded;

  explicit SortedPoints(std::span<const Vec3> points) : grid(points) {
    std::vector<std::pair<GridPoint, Vec3>> pairs;
    pairs.reserve(points.size());
    for (const Vec3& p : points) pairs.emplace_back(grid.rounded(p), p);
    // Of several points that are rounded to the same, the first in lexicographic order remains.
    std::ranges::sort(pairs, {}, [](const auto& pair) {
      const auto& [g, v] = pair;
      return std::tuple(g.x, g.y, g.z, v.x, v.y, v.z);
    });
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    pairs.erase(std::unique(pairs.begin(), pairs.end(), same), pairs.end());
    for (const auto& [g, v] : pairs) {
      given.push_back(v);
      rounded.push_back(g);
    }
  }
  std::vector<Vec3> chosen(std::span<const int> indices) const {
    std::vector<Vec3> result;
    for (const int i : indices) result.push_back(given[static_cast<std::size_t>(i)]);
    return result;
  }
};

void check_solid(const char* name, const SortedPoints& points) {
  const Extent extent = Quickhull(points.rounded, points.grid.vertex_tolerance()).extent();
  if (extent != Extent::solid) throw_flat(name, extent, points.grid);
}

HullView view_of(const HullData& data) {
  static std::atomic<std::uint64_t> serial{0};
  HullView view;
  view.serial = ++serial;
  view.vertices = data.vertices.data();
  view.faces = data.faces.data();
  view.corners = data.corners.data();
  view.edges = data.edges.data();
  view.vertex_count = static_cast<std::uint32_t>(data.vertices.size());
  view.face_count = static_cast<std::uint32_t>(data.faces.size());
  view.edge_count = static_cast<std::uint32_t>(data.edges.size());
  view.corner_count = static_cast<std::uint32_t>(data.corners.size());
  for (int i = 0; i < 3; ++i) {
    view.half_extents[i] = std::max(absolute(data.bounds.lower[i]), absolute(data.bounds.upper[i]));
    view.centre[i] = static_cast<Real>(data.centre[i]);
  }
  for (const Vec3& vertex : data.vertices) {
    view.outer_radius = std::max(view.outer_radius, length(vertex));
  }
  view.least_half_width = view.outer_radius;
  for (const HullFace& face : data.faces) {
    const Real height = face.offset - dot(face.normal, view.centre);
    view.least_half_width = std::min(view.least_half_width, height);
  }
  return view;
}

std::shared_ptr<const HullData> shared(const HullData& data) {
  auto hull = std::make_shared<HullData>(data);
  hull->view = view_of(*hull);
  detail::PolyhedronColumns columns(detail::HullPolyhedron{&hull->view});
  hull->columns = std::move(columns.columns);
  hull->packed_edges = std::move(columns.edges);
  hull->view.columns = hull->columns.data();
  hull->view.packed_edges = hull->packed_edges.data();
  return hull;
}

bool are_equal(const HullData& a, const HullData& b) {
  return a.vertices == b.vertices && a.faces == b.faces && a.corners == b.corners &&
         a.volume == b.volume && std::ranges::equal(a.centre, b.centre) &&
         std::ranges::equal(a.spread, b.spread);
}

/// The hulls that exist. Equal hulls share their data, so that tests of many equal bodies find the
/// data in the cache. Threads may use an object concurrently.
class ExistingHulls {
 public:
  /// Returns the hull with these data, which is made if there is none.
  std::shared_ptr<const HullData> get(const HullData& data) {
    Hash64 hash;
    hash.add_bytes(data.vertices.data(), data.vertices.size() * sizeof(Vec3));
    const std::lock_guard lock(mutex_);
    const auto [first, last] = hulls_.equal_range(hash.value());
    for (auto i = first; i != last; ++i) {
      if (auto hull = i->second.lock(); hull != nullptr && are_equal(*hull, data)) return hull;
    }
    if (hulls_.size() >= most_) {
      std::erase_if(hulls_, [](const auto& item) { return item.second.expired(); });
      most_ = std::max(most_, 2 * hulls_.size());
    }
    auto made = shared(data);
    hulls_.emplace(hash.value(), made);
    return made;
  }

 private:
  std::mutex mutex_;
  std::multimap<std::uint64_t, std::weak_ptr<const HullData>> hulls_;  ///< by hash
  std::size_t most_ = 64;  ///< size at which hulls that exist no longer are removed
};

std::shared_ptr<const HullData> checked(const char* name, const HullData& data) {
  constexpr double kLeast = std::numeric_limits<double>::min();
  if (!(data.volume >= kLeast)) {
    throw InvalidArgument(std::string(name) + " has bounds from " + decimal(data.bounds.lower) +
                          " to " + decimal(data.bounds.upper) +
                          "; it must be larger, so that its volume is a normal double");
  }
  static ExistingHulls hulls;
  return hulls.get(data);
}

/// The hull of vertices that are all significant, on the grid of these alone. Because the grid of
/// more points can differ, a vertex may not be extreme on it; it is then omitted.
std::shared_ptr<const HullData> make_hull(const char* name, std::vector<Vec3> vertices) {
  for (;;) {
    const SortedPoints points(vertices);
    check_solid(name, points);
    const Quickhull hull(points.rounded);
    const std::vector<int> used = hull.vertices();
    if (used.size() < vertices.size()) {
      vertices = points.chosen(used);
      continue;
    }
    Polyhedron polyhedron;
    polyhedron.points = points.rounded;
    for (const Quickhull::Corners& corners : hull.triangles()) {
      polyhedron.faces.emplace_back(corners.begin(), corners.end());
    }
    for (FaceCorners& face : polyhedron.faces) face = detail::canonical_cycle(face);
    std::ranges::sort(polyhedron.faces);
    detail::merge_faces(&polyhedron, points.grid.face_tolerance());
    return checked(name, detail::make_hull_data(points.given, points.grid, polyhedron));
  }
}

std::shared_ptr<const HullData> make_hull_of_points(const char* name,
                                                    std::span<const Vec3> points) {
  check_coordinates(name, points);
  const SortedPoints sorted(points);
  const auto [extent, vertices] =
      detail::select_vertices(sorted.rounded, sorted.grid.vertex_tolerance(), kMostHullVertices);
  if (extent != Extent::solid) throw_flat(name, extent, sorted.grid);
  if (vertices.size() > Hull::kMaxVertices) {
    throw InvalidArgument(name + (" has a hull with " + std::to_string(vertices.size())) +
                          " vertices; it must have at most " + std::to_string(Hull::kMaxVertices));
  }
  return make_hull(name, sorted.chosen(vertices));
}

void check_indices(std::span<const Vec3> vertices, HullFaceLists faces) {
  if (faces.size() < 4) {
    throw InvalidArgument("faces has " + std::to_string(faces.size()) +
                          " faces; it must have at least 4");
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const std::vector<std::uint32_t>& face = faces[f];
    if (face.size() < 3) {
      throw InvalidArgument(item("faces", f) + " has " + std::to_string(face.size()) +
                            " vertices; it must have at least 3");
    }
    for (std::size_t i = 0; i < face.size(); ++i) {
      if (face[i] < vertices.size()) continue;
      throw InvalidArgument(item(item("faces", f).c_str(), i) + " is " + std::to_string(face[i]) +
                            "; it must be less than " + std::to_string(vertices.size()) +
                            ", the number of vertices");
    }
    std::vector<std::uint32_t> sorted = face;
    std::ranges::sort(sorted);
    const auto twice = std::ranges::adjacent_find(sorted);
    if (twice != sorted.end()) {
      throw InvalidArgument(item("faces", f) + " has vertex " + std::to_string(*twice) +
                            " twice; its vertices must differ");
    }
  }
}

void check_distinct(std::span<const Vec3> vertices) {
  std::map<std::tuple<Real, Real, Real>, std::size_t> found;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3& v = vertices[i];
    const auto [other, is_new] = found.try_emplace({v.x, v.y, v.z}, i);
    if (is_new) continue;
    throw InvalidArgument(item("vertices", i) + " is " + decimal(v) + "; it must differ from " +
                          item("vertices", other->second));
  }
}

/// Checks that each edge has two faces in opposite directions, that all faces are connected, and
/// that there are as many vertices, edges and faces as on a sphere.
void check_closed(std::span<const Vec3> vertices, const std::vector<FaceCorners>& faces) {
  std::map<std::pair<int, int>, std::size_t> face_of;
  std::vector<bool> has_face(vertices.size());
  const auto text = [](int from, int to) {
    return "from vertex " + std::to_string(from) + " to vertex " + std::to_string(to);
  };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t i = 0; i < faces[f].size(); ++i) {
      const int from = faces[f][i], to = faces[f][(i + 1) % faces[f].size()];
      has_face[static_cast<std::size_t>(from)] = true;
      const auto [other, is_new] = face_of.try_emplace({from, to}, f);
      if (is_new) continue;
      throw InvalidArgument(item("faces", f) + " has an edge " + text(from, to) + ", as " +
                            item("faces", other->second) +
                            "; neighbouring faces must have it in opposite directions");
    }
  }
  for (const auto& [ends, face] : face_of) {
    if (face_of.contains({ends.second, ends.first})) continue;
    throw InvalidArgument(item("faces", face) + " has an edge " + text(ends.first, ends.second) +
                          " of no other face; the faces must be closed");
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (has_face[i]) continue;
    throw InvalidArgument(item("vertices", i) + " has no face; it must be in at least 2 faces");
  }
  std::vector<bool> is_reached(faces.size());
  std::vector<std::size_t> reached = {0};
  is_reached[0] = true;
  for (std::size_t n = 0; n < reached.size(); ++n) {
    const FaceCorners& face = faces[reached[n]];
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::size_t next = face_of.at({face[(i + 1) % face.size()], face[i]});
      if (!is_reached[next]) reached.push_back(next);
      is_reached[next] = true;
    }
  }
  const std::size_t edges = face_of.size() / 2;
  if (reached.size() == faces.size() && vertices.size() + faces.size() == edges + 2) return;
  throw InvalidArgument("faces has " + std::to_string(vertices.size()) + " vertices, " +
                        std::to_string(edges) + " edges and " + std::to_string(faces.size()) +
                        " faces, of which " + std::to_string(reached.size()) +
                        " are connected to the first; it must be one surface without holes");
}

void check_convex(const Polyhedron& polyhedron, const HullGrid& grid) {
  const double tolerance = grid.vertex_tolerance();
  const auto metres = [&](double x) { return decimal(static_cast<Real>(grid.metres(x))) + " m"; };
  for (std::size_t f = 0; f < polyhedron.faces.size(); ++f) {
    const FaceCorners& face = polyhedron.faces[f];
    if (!(length(polyhedron.normal(face)) > 0)) {
      throw InvalidArgument(item("faces", f) + " has an area of 0; it must be > 0");
    }
    const double deviation = polyhedron.deviation(face);
    if (!(deviation <= tolerance)) {
      throw InvalidArgument(item("faces", f) + " has vertices " + metres(deviation) +
                            " behind another vertex; it must be plane, counter-clockwise as seen "
                            "from outside, and have no vertex in front of it, to " +
                            metres(tolerance));
    }
    if (!(polyhedron.least_corner(face) >= -tolerance)) {
      throw InvalidArgument(item("faces", f) +
                            " has a reflex corner or crosses itself; it must be "
                            "a convex polygon");
    }
  }
}

std::shared_ptr<const HullData> make_hull_of_faces(std::span<const Vec3> vertices,
                                                   HullFaceLists faces) {
  check_coordinates("vertices", vertices);
  check_distinct(vertices);
  check_indices(vertices, faces);
  const HullGrid grid(vertices);
  Polyhedron polyhedron;
  for (const Vec3& v : vertices) polyhedron.points.push_back(grid.rounded(v));
  for (const std::vector<std::uint32_t>& face : faces) {
    polyhedron.faces.emplace_back(face.begin(), face.end());
  }
  check_closed(vertices, polyhedron.faces);
  check_convex(polyhedron, grid);
  check_solid("vertices", SortedPoints(vertices));
  const auto is_strict = [&](const FaceCorners& face) { return polyhedron.least_corner(face) > 0; };
  const auto is_enough = [](int count) { return count >= 3; };
  if (vertices.size() <= Hull::kMaxVertices && std::ranges::all_of(polyhedron.faces, is_strict) &&
      std::ranges::all_of(polyhedron.face_counts(), is_enough) &&
      !detail::merge_faces(&polyhedron, grid.face_tolerance())) {
    return checked("vertices", detail::make_hull_data(vertices, grid, polyhedron));
  }
  return make_hull_of_points("vertices", vertices);
}

std::shared_ptr<const HullData> default_hull() {
  static const std::shared_ptr<const HullData> cube = [] {
    std::vector<Vec3> corners;
    for (unsigned i = 0; i < 8; ++i) {
      const auto side = [i](unsigned axis) { return Real((i >> axis & 1u) != 0 ? 0.5 : -0.5); };
      corners.push_back({side(0), side(1), side(2)});
    }
    return make_hull("vertices", corners);
  }();
  return cube;
}

Mat3 inertia_of_spread(const double spread[6], double mass) {
  const auto real = [mass](double x) { return static_cast<Real>(mass * x); };
  const Real xy = real(-spread[3]), yz = real(-spread[4]), zx = real(-spread[5]);
  return {{{real(spread[1] + spread[2]), xy, zx},
           {xy, real(spread[2] + spread[0]), yz},
           {zx, yz, real(spread[0] + spread[1])}}};
}

}  // namespace

Hull::Hull() : data_(default_hull()) {}
Hull::Hull(std::span<const Vec3> points) : data_(make_hull_of_points("points", points)) {}
Hull::Hull(std::span<const Vec3> vertices, std::span<const std::vector<std::uint32_t>> faces)
    : data_(make_hull_of_faces(vertices, faces)) {}

Vec3 Hull::centre_of_mass() const {
  const auto& c = data_->centre;
  return {static_cast<Real>(c[0]), static_cast<Real>(c[1]), static_cast<Real>(c[2])};
}

Mat3 Hull::central_inertia(Real mass) const {
  return inertia_of_spread(data_->spread, static_cast<double>(mass));
}

Mat3 Hull::inertia(Real mass) const {
  const auto& c = data_->centre;
  const auto& s = data_->spread;
  const double about_origin[6] = {s[0] + c[0] * c[0], s[1] + c[1] * c[1], s[2] + c[2] * c[2],
                                  s[3] + c[0] * c[1], s[4] + c[1] * c[2], s[5] + c[2] * c[0]};
  return inertia_of_spread(about_origin, static_cast<double>(mass));
}

template <class Map>
Hull Hull::mapped(const Map& map, bool mirrored) const {
  std::vector<Vec3> points;
  for (const Vec3& v : vertices()) points.push_back(map(v));
  check_coordinates("vertices", points);
  std::vector<std::vector<std::uint32_t>> lists;
  for (const HullFace& face : faces()) {
    lists.emplace_back(corners(face).begin(), corners(face).end());
    if (mirrored) std::ranges::reverse(lists.back());
  }
  try {
    return {points, lists};
  } catch (const InvalidArgument&) {
    // Rounding made a face bent, or vertices equal.
    return Hull(make_hull_of_points("vertices", points));
  }
}

Hull Hull::scaled(const Vec3& factors) const {
  if (!is_finite(factors) || factors.x == 0 || factors.y == 0 || factors.z == 0) {
    throw InvalidArgument("factors is " + decimal(factors) +
                          "; each must be finite and different from 0");
  }
  const bool mirrored = (factors.x < 0) != ((factors.y < 0) != (factors.z < 0));
  return mapped([&](const Vec3& v) { return component_product(v, factors); }, mirrored);
}

Hull Hull::translated(const Vec3& offset) const {
  if (!is_finite(offset)) {
    throw InvalidArgument("offset is " + decimal(offset) + "; it must be finite");
  }
  return mapped([&](const Vec3& v) { return v + offset; }, false);
}

Hull centred(const Hull& hull) { return hull.translated(-hull.centre_of_mass()); }

bool operator==(const Hull& a, const Hull& b) {
  return a.data_ == b.data_ ||
         (a.data_->vertices == b.data_->vertices && a.data_->faces == b.data_->faces &&
          a.data_->corners == b.data_->corners);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
