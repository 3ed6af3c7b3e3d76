/// Selection of vertices: a hull to which only points outside by more than the tolerance are added,
/// from which vertices that later ones have made redundant are then removed.
#include "src/collide/hull/reduction.hpp"

#include <algorithm>
#include <set>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
namespace {

/// Removes redundant vertices from a hull, the one closest to the hull of the others first.
class HullReduction {
 public:
  HullReduction(std::vector<GridPoint> points, double tolerance)
      : points_(std::move(points)), tolerance_(tolerance), vertices_(points_.size()) {
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      vertices_[i].index = static_cast<int>(i);
      vertices_[i].point = points_[i];
    }
  }

  /// Indices of the remaining points.
  std::vector<int> run() {
    find_rings(Quickhull(points_));
    while (remove_one()) {
    }
    std::vector<int> result;
    for (const Vertex& vertex : vertices_) result.push_back(vertex.index);
    return result;
  }

 private:
  struct Vertex {
    int index = 0;  ///< in the list of all points
    GridPoint point;
    std::vector<int> ring;  ///< indices of the vertices that share an edge with it
    double distance = 0;    ///< from the hull of the ring, or more than the tolerance
    bool must_stay = false;
  };

  /// Sets the rings, and the distances of vertices with a new ring. Vertices of no triangle have an
  /// empty ring and the distance 0.
  void find_rings(const Quickhull& hull) {
    std::vector<std::set<int>> rings(vertices_.size());
    std::vector<GridPoint> outward(vertices_.size());
    for (const Quickhull::Corners& corners : hull.triangles()) {
      const auto at = [&](std::size_t i) {
        return vertices_[static_cast<std::size_t>(corners[i])].point;
      };
      const GridTriangle triangle(at(0), at(1), at(2));
      for (std::size_t i = 0; i < 3; ++i) {
        const auto corner = static_cast<std::size_t>(corners[i]);
        rings[corner].insert(corners[(i + 1) % 3]);
        rings[corner].insert(corners[(i + 2) % 3]);
        outward[corner] = outward[corner] + triangle.normal * (1 / triangle.size);
      }
    }
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      Vertex& vertex = vertices_[i];
      std::vector<GridPoint> ring;
      std::vector<int> indices;
      for (const int n : rings[i]) {
        ring.push_back(vertices_[static_cast<std::size_t>(n)].point);
        indices.push_back(vertices_[static_cast<std::size_t>(n)].index);
      }
      if (indices == vertex.ring && !indices.empty()) continue;
      vertex.ring = std::move(indices);
      vertex.distance =
          protrudes(vertex.point, ring, outward[i]) ? 2 * tolerance_ : distance(vertex.point, ring);
    }
  }

  /// Whether a plane separates a vertex from its ring by more than the tolerance, by a few
  /// attempts.
  bool protrudes(const GridPoint& p, const std::vector<GridPoint>& ring,
                 const GridPoint& outward) const {
    GridPoint sum;
    for (const GridPoint& other : ring) sum = sum + (p - other) * (1 / length(p - other));
    for (const GridPoint& direction : {outward, sum}) {
      const double size = length(direction);
      const auto is_behind = [&](const GridPoint& other) {
        return dot(direction, p - other) > tolerance_ * size;
      };
      if (size > 0 && !ring.empty() && std::ranges::all_of(ring, is_behind)) return true;
    }
    return false;
  }

  /// Distance from the hull of a ring.
  static double distance(const GridPoint& p, const std::vector<GridPoint>& ring) {
    if (ring.empty()) return 0;
    const Quickhull hull(ring);
    if (hull.extent() == Extent::solid) return hull.distance(p);
    // The ring is plane: the union of the triangles of its points.
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < ring.size(); ++i) {
      for (std::size_t j = i + 1; j < ring.size(); ++j) {
        for (std::size_t k = j + 1; k < ring.size(); ++k) {
          const GridTriangle triangle(ring[i], ring[j], ring[k]);
          if (triangle.size > 0) least = std::min(least, detail::distance(p, triangle));
        }
      }
    }
    return least;
  }

  bool remove_one() {
    const Vertex* closest = nullptr;
    for (const Vertex& vertex : vertices_) {
      if (vertex.must_stay || !(vertex.distance <= tolerance_)) continue;
      if (closest == nullptr || vertex.distance < closest->distance) closest = &vertex;
    }
    if (closest == nullptr) return false;
    const auto position = closest - vertices_.data();
    std::vector<GridPoint> others;
    for (const Vertex& vertex : vertices_) {
      if (&vertex != closest) others.push_back(vertex.point);
    }
    const Quickhull hull(others);
    const auto is_covered = [&](const GridPoint& p) { return hull.distance(p) <= tolerance_; };
    if (hull.extent() != Extent::solid || !is_covered(closest->point) ||
        !std::ranges::all_of(removed_, is_covered)) {
      vertices_[static_cast<std::size_t>(position)].must_stay = true;
      return true;
    }
    removed_.push_back(closest->point);
    vertices_.erase(vertices_.begin() + position);
    find_rings(hull);
    return true;
  }

  std::vector<GridPoint> points_;
  double tolerance_;
  std::vector<Vertex> vertices_;
  std::vector<GridPoint> removed_;
};

}  // namespace

VertexSelection select_vertices(std::span<const GridPoint> points, double tolerance, int most) {
  const Quickhull hull(points, tolerance, 4 * most);
  VertexSelection selection{hull.extent(), hull.vertices()};
  if (selection.vertices.empty() ||
      selection.vertices.size() > 4 * static_cast<std::size_t>(most)) {
    return selection;
  }
  std::vector<GridPoint> chosen;
  for (const int i : selection.vertices) chosen.push_back(points[static_cast<std::size_t>(i)]);
  std::vector<int> kept;
  const std::vector<int> left = HullReduction(std::move(chosen), tolerance).run();
  for (const int i : left) {
    kept.push_back(selection.vertices[static_cast<std::size_t>(i)]);
  }
  selection.vertices = std::move(kept);
  return selection;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
