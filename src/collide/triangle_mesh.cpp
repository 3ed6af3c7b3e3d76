/// Construction of triangle meshes: joined vertices, neighbors and tree.
#include <jfpx/error.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/triangle_mesh.hpp>

#include "src/collide/mesh_data.hpp"
#include "src/collide/triangle_normal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using detail::kNoVertex;
using detail::MeshData;
using detail::MeshTriangle;

/// The ends of their edges have numbers of 32 bits.
constexpr std::size_t kMostTriangles = std::size_t{1} << 29;

void check(const TriangleMeshDef& def) {
  if (def.triangles.size() > kMostTriangles || def.vertices.size() >= kNoVertex) {
    throw InvalidArgument("triangles has " + std::to_string(def.triangles.size()) +
                          " items; it must have at most " + std::to_string(kMostTriangles));
  }
  for (std::size_t i = 0; i < def.vertices.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real x = def.vertices[i][axis];
      if (absolute(x) <= kMaxCoordinate) continue;
      throw InvalidArgument("vertices[" + std::to_string(i) + "][" + std::to_string(axis) +
                            "] is " + std::to_string(x) + "; it must be between -1e9 and 1e9");
    }
  }
  for (std::size_t i = 0; i < def.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (def.triangles[i][k] < def.vertices.size()) continue;
      throw InvalidArgument("triangles[" + std::to_string(i) + "][" + std::to_string(k) + "] is " +
                            std::to_string(def.triangles[i][k]) +
                            "; it must be an index of the mesh's " +
                            std::to_string(def.vertices.size()) + " vertices");
    }
  }
}

/// By vertex: the first vertex at the same position.
std::vector<std::uint32_t> joined_vertices(const std::vector<Vec3>& vertices) {
  std::vector<std::uint32_t> order(vertices.size()), first(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto position = [&](std::uint32_t i) {
    const Vec3& v = vertices[i];
    return std::tuple(v.x, v.y, v.z);
  };
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(position(a), a) < std::pair(position(b), b);
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool is_new = k == 0 || position(order[k]) != position(order[k - 1]);
    first[order[k]] = is_new ? order[k] : first[order[k - 1]];
  }
  return first;
}

/// Sets the vertices and the normal. @returns false if the triangle has no area
bool set_triangle(const std::vector<Vec3>& vertices, const Triangle& corners,
                  const std::vector<std::uint32_t>& joined, MeshTriangle* triangle) {
  for (std::size_t k = 0; k < 3; ++k) triangle->vertices[k] = joined[corners[k]];
  const auto corner = [&](std::size_t k) { return vertices[triangle->vertices[k]]; };
  const detail::TriangleArea area(corner(0), corner(1), corner(2));
  if (!has_area(area, corner(0), corner(1), corner(2))) return false;
  triangle->normal = area.unit_normal();
  return true;
}

/// An edge of a triangle, for sorting.
struct Edge {
  std::uint64_t ends;    ///< the lower vertex in the upper half
  std::uint32_t number;  ///< 3 * triangle + edge
  friend bool operator<(const Edge& a, const Edge& b) {
    return std::pair(a.ends, a.number) < std::pair(b.ends, b.number);
  }
};

/// Builds the lists of a mesh.
class Builder {
 public:
  explicit Builder(MeshData* mesh) : mesh_(*mesh) {}

  void build() {
    set_triangles();
    drop_duplicates();
    connect();
    build_tree();
  }

 private:
  void set_triangles() {
    const TriangleMeshDef& def = mesh_.def;
    const std::vector<std::uint32_t> joined = joined_vertices(def.vertices);
    mesh_.triangles.resize(def.triangles.size());
    for (std::uint32_t i = 0; i < def.triangles.size(); ++i) {
      if (set_triangle(def.vertices, def.triangles[i], joined, &mesh_.triangles[i])) {
        used_.push_back(i);
      } else {
        ++mesh_.report.degenerate;
      }
    }
  }

  /// Of triangles with the same vertices, only the first has contacts. For a two-sided result the
  /// winding does not matter; two one-sided triangles with opposite fronts are both used.
  void drop_duplicates() {
    const auto key = [this](std::uint32_t i) {
      std::array<std::uint32_t, 3> v{};
      std::ranges::copy(mesh_.triangles[i].vertices, v.begin());
      std::rotate(v.begin(), std::ranges::min_element(v), v.end());
      if (mesh_.def.two_sided && v[1] > v[2]) std::swap(v[1], v[2]);
      return v;
    };
    std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> keys;
    keys.reserve(used_.size());
    for (const std::uint32_t i : used_) keys.emplace_back(key(i), i);
    std::ranges::sort(keys);
    used_.clear();
    for (std::size_t k = 0; k < keys.size(); ++k) {
      if (k > 0 && keys[k].first == keys[k - 1].first) {
        ++mesh_.report.duplicate;
        mesh_.triangles[keys[k].second].normal = {};
      } else {
        used_.push_back(keys[k].second);
      }
    }
    std::ranges::sort(used_);
  }

  /// Finds the neighbors of triangles and vertices.
  void connect() {
    std::vector<Edge> edges;
    edges.reserve(3 * used_.size());
    for (const std::uint32_t i : used_) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax({vertex(i, k), vertex(i, k + 1)});
        edges.push_back({std::uint64_t{low} << 32 | high, 3 * i + k});
      }
    }
    std::ranges::sort(edges, std::less<>());
    std::vector<std::uint64_t> ends;  // of all edges, each once
    for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
      while (last < edges.size() && edges[last].ends == edges[first].ends) ++last;
      ends.push_back(edges[first].ends);
      join(std::span(edges).subspan(first, last - first));
    }
    list_neighbors(ends);
  }

  /// Makes the triangles at an edge neighbors, if they meet there from two sides. Triangles with
  /// the same vertices, and fronts on both sides, count once.
  void join(std::span<const Edge> triangles) {
    const std::uint32_t first = triangles.front().number, last = triangles.back().number;
    const std::uint32_t one = third_vertex(first);
    std::uint32_t other = one;
    for (const Edge& edge : triangles) {
      const std::uint32_t third = third_vertex(edge.number);
      if (third == one || third == other) continue;
      if (other != one) {
        ++mesh_.report.shared_edges;
        return;
      }
      other = third;
    }
    if (other == one) {
      ++mesh_.report.open_edges;
      return;
    }
    if (triangles.size() == 2 && vertex(first / 3, first % 3) == vertex(last / 3, last % 3)) {
      ++mesh_.report.flipped_edges;
    }
    for (const Edge& edge : triangles) {
      const std::uint32_t number = edge.number;
      MeshTriangle& triangle = mesh_.triangles[number / 3];
      triangle.opposite[number % 3] = third_vertex(number) == one ? other : one;
      if (is_flat(number)) triangle.flat_edges |= 1u << number % 3;
    }
  }
  std::uint32_t third_vertex(std::uint32_t edge) const { return vertex(edge / 3, edge % 3 + 2); }
  /// Whether the triangle of an edge and its neighbor are in one plane.
  bool is_flat(std::uint32_t edge) const {
    const std::uint32_t i = edge / 3, k = edge % 3;
    const std::vector<Vec3>& at = mesh_.def.vertices;
    return detail::are_flat(at[vertex(i, k)], at[vertex(i, k + 1)], at[third_vertex(edge)],
                            at[mesh_.triangles[i].opposite[k]]);
  }

  void list_neighbors(const std::vector<std::uint64_t>& ends) {
    std::vector<std::uint32_t>& first = mesh_.first_neighbor;
    first.assign(mesh_.def.vertices.size() + 1, 0);
    const auto low = [](std::uint64_t pair) { return static_cast<std::uint32_t>(pair >> 32); };
    const auto high = [](std::uint64_t pair) { return static_cast<std::uint32_t>(pair); };
    for (const std::uint64_t pair : ends) {
      ++first[low(pair)];
      ++first[high(pair)];
    }
    std::exclusive_scan(first.begin(), first.end(), first.begin(), 0u);
    mesh_.neighbors.resize(2 * ends.size());
    std::vector<std::uint32_t> next(first.begin(), first.end());
    for (const std::uint64_t pair : ends) {
      mesh_.neighbors[next[low(pair)]++] = high(pair);
      mesh_.neighbors[next[high(pair)]++] = low(pair);
    }
  }

  void build_tree() {
    std::vector<Aabb> bounds;
    bounds.reserve(used_.size());
    for (const std::uint32_t i : used_) {
      Aabb box;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const Vec3& v = mesh_.def.vertices[vertex(i, k)];
        box = merged(box, {v, v});
      }
      bounds.push_back(box);
      for (int axis = 0; axis < 3; ++axis) {
        Real& half = mesh_.half_extents[axis];
        half = std::max({half, absolute(box.lower[axis]), absolute(box.upper[axis])});
      }
    }
    mesh_.tree.build(bounds, used_);
  }

  std::uint32_t vertex(std::uint32_t triangle, std::uint32_t k) const {
    return mesh_.triangles[triangle].vertices[k % 3];
  }

  MeshData& mesh_;
  std::vector<std::uint32_t> used_;  ///< triangles that have contacts, ascending
};

}  // namespace

TriangleMesh::TriangleMesh(TriangleMeshDef def) {
  if (def == TriangleMeshDef{}) return;
  check(def);
  auto data = std::make_shared<MeshData>();
  data->def = std::move(def);
  Builder(data.get()).build();
  data_ = std::move(data);
}

TriangleMesh::TriangleMesh(std::vector<Vec3> vertices, std::vector<Triangle> triangles,
                           bool two_sided)
    : TriangleMesh(TriangleMeshDef{std::move(vertices), std::move(triangles), two_sided}) {}

const TriangleMeshDef& TriangleMesh::def() const noexcept {
  static const TriangleMeshDef kEmpty;
  return data_ == nullptr ? kEmpty : data_->def;
}

TriangleMeshReport TriangleMesh::report() const noexcept {
  return data_ == nullptr ? TriangleMeshReport{} : data_->report;
}

bool operator==(const TriangleMesh& a, const TriangleMesh& b) {
  return a.data_ == b.data_ || a.def() == b.def();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
