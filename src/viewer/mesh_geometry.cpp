/// Geometry of triangle meshes for drawing: vertices with normals, bounds, and distances.
#include "src/viewer/mesh_geometry.hpp"

#include "src/collide/mesh_data.hpp"
#include "src/collide/mesh_triangle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

using jfpx::detail::MeshData;
using jfpx::detail::MeshTriangle;

/// Cosine of the largest angle between two triangles of a smooth surface: 40 degrees.
constexpr Real kSmooth = Real(0.766);
/// The tips of larger fans are not smoothed, because the time is quadratic in their size.
constexpr std::size_t kLargestFan = 64;

class GeometryBuilder {
 public:
  GeometryBuilder(const MeshData& mesh, const Vec3& centre) : mesh_(mesh), centre_(centre) {}

  MeshGeometry build() {
    list_corners();
    find_twins();
    vertex_of_.resize(3 * mesh_.triangles.size());
    for (std::uint32_t v = 0; v < mesh_.def.vertices.size(); ++v) add_vertices(v);
    geometry_.indices.reserve(corners_.size());
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (!mesh_.triangles[i].has_contacts() || sides_[i] == Sides::none) continue;
      add_triangle({vertex_of_[3 * i], vertex_of_[3 * i + 1], vertex_of_[3 * i + 2]},
                   packed(mesh_.triangles[i].normal));
    }
    return std::move(geometry_);
  }

 private:
  /// A corner of a triangle: three times the number of the triangle, plus that of the corner.
  using Corner = std::uint32_t;
  using Normal = std::array<std::int16_t, 3>;
  /// On which a triangle is drawn in full brightness; none if it is not drawn.
  enum class Sides : std::uint8_t { none, front, both };

  /// Sorts the corners by vertex.
  void list_corners() {
    first_.assign(mesh_.def.vertices.size() + 1, 0);
    const auto for_each_corner = [this](const auto& visit) {
      for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
        if (!mesh_.triangles[i].has_contacts()) continue;
        for (std::uint32_t k = 0; k < 3; ++k) visit(mesh_.triangles[i].vertices[k], 3 * i + k);
      }
    };
    std::size_t count = 0;
    for_each_corner([&](std::uint32_t vertex, Corner) { ++first_[vertex], ++count; });
    std::exclusive_scan(first_.begin(), first_.end(), first_.begin(), 0u);
    std::vector<std::uint32_t> next(first_.begin(), first_.end());
    corners_.resize(count);
    for_each_corner([&](std::uint32_t vertex, Corner c) { corners_[next[vertex]++] = c; });
  }

  /// Of two triangles with the same vertices and opposite fronts, which would be drawn at the same
  /// depth, only the first is drawn, on both sides.
  void find_twins() {
    sides_.assign(mesh_.triangles.size(), mesh_.def.two_sided ? Sides::both : Sides::front);
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      const MeshTriangle& triangle = mesh_.triangles[i];
      if (!triangle.has_contacts()) continue;
      const std::span fan = fan_of(triangle.vertices[0]);
      if (fan.size() > kLargestFan) continue;
      for (const Corner c : fan) {
        if (c / 3 <= i ||
            !std::ranges::is_permutation(mesh_.triangles[c / 3].vertices, triangle.vertices)) {
          continue;
        }
        sides_[i] = Sides::both;
        sides_[c / 3] = Sides::none;
      }
    }
  }

  std::span<const Corner> fan_of(std::uint32_t v) const {
    return std::span(corners_).subspan(first_[v], first_[v + 1] - first_[v]);
  }
  const Vec3& normal_of(Corner corner) const { return mesh_.triangles[corner / 3].normal; }

  /// Angle of a triangle at a corner, the weight of its normal (Thuermer and Wuethrich 1998).
  Real angle_at(Corner corner) const {
    const MeshTriangle& triangle = mesh_.triangles[corner / 3];
    const auto place = [&](std::uint32_t k) {
      return mesh_.def.vertices[triangle.vertices[(corner % 3 + k) % 3]];
    };
    const Vec3 a = normalized(place(1) - place(0)), b = normalized(place(2) - place(0));
    return std::acos(std::clamp(dot(a, b), Real(-1), Real(1)));
  }

  /// Adds the vertices at the position of vertex `v`, one for each normal.
  void add_vertices(std::uint32_t v) {
    const std::span fan = fan_of(v);
    angles_.clear();
    for (const Corner c : fan) angles_.push_back(angle_at(c));
    const auto begin = static_cast<std::uint32_t>(geometry_.vertices.size());
    for (const Corner c : fan) {
      if (sides_[c / 3] == Sides::none) continue;
      const MeshVertex vertex = make_vertex(v, smooth_normal(fan, normal_of(c)), sides_[c / 3]);
      auto index = begin;
      const auto end = static_cast<std::uint32_t>(geometry_.vertices.size());
      while (index < end && !same_surface(geometry_.vertices[index], vertex)) ++index;
      if (index == end) geometry_.vertices.push_back(vertex);
      vertex_of_[c] = index;
    }
  }

  /// Mean normal of the triangles of a fan whose angle to the normal of one of them is small.
  Vec3 smooth_normal(std::span<const Corner> fan, const Vec3& normal) const {
    if (fan.size() > kLargestFan) return normal;
    Vec3 sum;
    for (std::size_t i = 0; i < fan.size(); ++i) {
      const Vec3& other = normal_of(fan[i]);
      const Real cosine = dot(other, normal);
      if (cosine >= kSmooth) {
        sum += other * angles_[i];
      } else if (mesh_.def.two_sided && cosine <= -kSmooth) {
        sum -= other * angles_[i];  // the front of a two-sided triangle is arbitrary
      }
    }
    return normalized(sum);
  }

  /// Adds a triangle whose last vertex has the normal of its face; copies a vertex if all three
  /// have that of another.
  void add_triangle(std::array<std::uint32_t, 3> corners, const Normal& face) {
    for (int turn = 0; turn < 3; ++turn) {
      MeshVertex& last = geometry_.vertices[corners[2]];
      const bool is_free = std::ranges::all_of(last.face, [](int n) { return n == 0; });
      if (is_free) std::ranges::copy(face, last.face);
      if (std::ranges::equal(last.face, face)) {
        geometry_.indices.insert(geometry_.indices.end(), corners.begin(), corners.end());
        return;
      }
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    }
    MeshVertex copy = geometry_.vertices[corners[2]];
    std::ranges::copy(face, copy.face);
    corners[2] = static_cast<std::uint32_t>(geometry_.vertices.size());
    geometry_.vertices.push_back(copy);
    geometry_.indices.insert(geometry_.indices.end(), corners.begin(), corners.end());
  }

  static Normal packed(const Vec3& normal) {
    Normal result{};
    for (int i = 0; i < 3; ++i) {
      result[static_cast<std::size_t>(i)] =
          static_cast<std::int16_t>(std::lround(normal[i] * Real(32767)));
    }
    return result;
  }

  static bool same_surface(const MeshVertex& a, const MeshVertex& b) {
    return std::ranges::equal(a.normal, b.normal) && a.one_sided == b.one_sided;
  }

  MeshVertex make_vertex(std::uint32_t v, const Vec3& normal, Sides sides) const {
    MeshVertex vertex{};
    const Vec3 place = mesh_.def.vertices[v] - centre_;
    for (int i = 0; i < 3; ++i) vertex.position[i] = static_cast<float>(place[i]);
    std::ranges::copy(packed(normal), vertex.normal);
    vertex.one_sided = sides == Sides::front ? std::int16_t{32767} : std::int16_t{0};
    return vertex;
  }

  const MeshData& mesh_;
  Vec3 centre_;
  std::vector<std::uint32_t> first_;  ///< by vertex, and the end: index in corners_
  std::vector<Corner> corners_;
  std::vector<Sides> sides_;              ///< by triangle
  std::vector<std::uint32_t> vertex_of_;  ///< by corner: index in the geometry
  std::vector<Real> angles_;              ///< of the current fan
  MeshGeometry geometry_;
};

/// Distance of a point from the triangles of a tree, depth first.
class NearestTriangle {
 public:
  NearestTriangle(const jfpx::detail::MeshView& mesh, const Vec3& point)
      : mesh_(mesh), point_(point) {}

  Real distance() {
    if (mesh_.tree.block_count > 0) visit(mesh_.tree.block_count - 1);
    return nearest_;
  }

 private:
  static constexpr std::uint32_t kWidth = TreeBlock::kWidth;

  /// The levels are at most 12.
  void visit(std::uint32_t index) {
    const TreeBlock& block = mesh_.tree.blocks[index];
    const bool is_leaf = index < mesh_.tree.leaf_blocks;
    const std::uint32_t first = (is_leaf ? index : index - mesh_.tree.leaf_blocks) * kWidth;
    std::array<std::pair<Real, std::uint32_t>, kWidth> lanes;
    for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
      lanes[lane] = {distance_to_box(block, lane), first + lane};
    }
    std::ranges::sort(lanes);
    for (const auto& [distance, child] : lanes) {
      if (!(distance < nearest_)) return;
      if (is_leaf) {
        nearest_ = std::min(nearest_, distance_to_triangle(mesh_.tree.items[child]));
      } else {
        visit(child);
      }
    }
  }

  /// kMaxReal for an unused lane.
  Real distance_to_box(const TreeBlock& block, std::uint32_t lane) const {
    if (block.lower[0][lane] > block.upper[0][lane]) return kMaxReal;
    Vec3 outside;
    for (int i = 0; i < 3; ++i) {
      outside[i] =
          std::max({block.lower[i][lane] - point_[i], point_[i] - block.upper[i][lane], Real(0)});
    }
    return length(outside);
  }

  Real distance_to_triangle(std::uint32_t index) const {
    jfpx::detail::TriangleInstance triangle;
    const MeshTriangle& corners = mesh_.triangles[index];
    for (int k = 0; k < 3; ++k) {
      triangle.corner[k] = mesh_.vertices[corners.vertices[k]] - point_;
    }
    triangle.normal = corners.normal;
    return length(jfpx::detail::closest_on(triangle, {}).offset);
  }

  jfpx::detail::MeshView mesh_;
  Vec3 point_;
  Real nearest_ = kMaxReal;
};

}  // namespace

MeshGeometry make_geometry(const TriangleMesh& mesh) {
  if (!has_surface(mesh)) return {};
  return GeometryBuilder(*mesh.data(), centre_of(mesh)).build();
}

bool has_surface(const TriangleMesh& mesh) {
  return mesh.data() != nullptr && mesh.data()->view().tree.block_count > 0;
}

Aabb bounds_of(const TriangleMesh& mesh) {
  const BlockTreeView tree = mesh.data()->view().tree;
  return tree.blocks[tree.block_count - 1].bounds();
}

Vec3 centre_of(const TriangleMesh& mesh) {
  const Aabb bounds = bounds_of(mesh);
  return (bounds.lower + bounds.upper) * Real(0.5);
}

Real distance_to(const TriangleMesh& mesh, const Vec3& point) {
  if (!has_surface(mesh)) return kMaxReal;
  return NearestTriangle(mesh.data()->view(), point).distance();
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
