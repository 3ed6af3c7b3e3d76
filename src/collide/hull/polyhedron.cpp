/// Merging of faces, which keeps the combinatorial invariants of a convex polyhedron.
#include "src/collide/hull/polyhedron.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Merges faces of a polyhedron, one edge at a time.
class FaceMerger {
 public:
  FaceMerger(Polyhedron* polyhedron, double tolerance)
      : all_(*polyhedron), tolerance_(tolerance), face_counts_(polyhedron->face_counts()) {
    std::map<std::pair<int, int>, int> face_of;
    for (std::size_t f = 0; f < all_.faces.size(); ++f) {
      const FaceCorners& face = all_.faces[f];
      for (std::size_t i = 0; i < face.size(); ++i) {
        face_of[{face[i], face[(i + 1) % face.size()]}] = static_cast<int>(f);
      }
    }
    for (const auto& [ends, left] : face_of) {
      if (ends.first > ends.second) continue;
      edges_.push_back({ends.first, ends.second, left, face_of.at({ends.second, ends.first})});
      set_deviation(&edges_.back());
    }
  }

  bool run() {
    bool has_merged = false;
    while (merge_one()) has_merged = true;
    std::erase_if(all_.faces, [](const FaceCorners& face) { return face.empty(); });
    return has_merged;
  }

 private:
  /// An edge in the order of (a, b), with the deviation of the union of its faces.
  struct Edge {
    int a, b, left, right;
    double deviation = 0;  ///< infinite if the union is no face
  };

  const FaceCorners& face(int i) const { return all_.faces[static_cast<std::size_t>(i)]; }

  /// The corners of both faces, without the edge.
  FaceCorners merged(const Edge& edge) const {
    FaceCorners result;
    const auto append = [&](const FaceCorners& corners, int from) {
      const auto start = std::ranges::find(corners, from) - corners.begin();
      for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
        result.push_back(corners[(static_cast<std::size_t>(start) + i) % corners.size()]);
      }
    };
    append(face(edge.left), edge.b);   // from b to the corner before a
    append(face(edge.right), edge.a);  // from a to the corner before b
    return canonical_cycle(result);
  }

  void set_deviation(Edge* edge) const {
    const FaceCorners corners = merged(*edge);
    edge->deviation = all_.deviation(corners);
    const bool is_face = edge->deviation <= tolerance_ && all_.least_corner(corners) > 0;
    if (!is_face) edge->deviation = kInfinity;
  }

  static bool are_neighbours(const FaceCorners& corners, int a, int b) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const int here = corners[i], next = corners[(i + 1) % corners.size()];
      if ((here == a && next == b) || (here == b && next == a)) return true;
    }
    return false;
  }
  static std::vector<int> common(const FaceCorners& a, const FaceCorners& b) {
    std::vector<int> result;
    for (const int corner : a) {
      if (std::ranges::find(b, corner) != b.end()) result.push_back(corner);
    }
    return result;
  }

  bool can_merge(const Edge& edge) const {
    for (const int end : {edge.a, edge.b}) {
      if (face_counts_[static_cast<std::size_t>(end)] < 4) return false;
    }
    if (common(face(edge.left), face(edge.right)).size() != 2) return false;
    const FaceCorners corners = merged(edge);
    for (int i = 0; i < static_cast<int>(all_.faces.size()); ++i) {
      if (i == edge.left || i == edge.right || face(i).empty()) continue;
      const std::vector<int> shared = common(face(i), corners);
      if (shared.size() > 2) return false;
      if (shared.size() == 2 && !(are_neighbours(face(i), shared[0], shared[1]) &&
                                  are_neighbours(corners, shared[0], shared[1]))) {
        return false;
      }
    }
    return true;
  }

  bool merge_one() {
    std::size_t best = edges_.size();
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const double least = best < edges_.size() ? edges_[best].deviation : kInfinity;
      if (edges_[i].deviation < least && can_merge(edges_[i])) best = i;
    }
    if (best == edges_.size()) return false;
    const Edge edge = edges_[best];
    edges_.erase(edges_.begin() + static_cast<std::ptrdiff_t>(best));
    all_.faces[static_cast<std::size_t>(edge.left)] = merged(edge);
    all_.faces[static_cast<std::size_t>(edge.right)].clear();
    --face_counts_[static_cast<std::size_t>(edge.a)];
    --face_counts_[static_cast<std::size_t>(edge.b)];
    for (Edge& other : edges_) {
      if (other.left == edge.right) other.left = edge.left;
      if (other.right == edge.right) other.right = edge.left;
      if (other.left == edge.left || other.right == edge.left) set_deviation(&other);
    }
    return true;
  }

  Polyhedron& all_;
  double tolerance_;
  std::vector<int> face_counts_;
  std::vector<Edge> edges_;
};

}  // namespace

GridPoint Polyhedron::normal(const FaceCorners& face) const {
  const auto first = static_cast<std::size_t>(std::ranges::min_element(face) - face.begin());
  const auto corner = [&](std::size_t i) { return point(face[(first + i) % face.size()]); };
  GridPoint sum;
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    sum = sum + cross(corner(i) - corner(0), corner(i + 1) - corner(0));
  }
  return sum;
}

double Polyhedron::deviation(const FaceCorners& face) const {
  const GridPoint n = normal(face), &origin = point(*std::ranges::min_element(face));
  const double size = length(n);
  if (!(size > 0)) return kInfinity;
  double top = -kInfinity, lowest = kInfinity;
  for (const GridPoint& p : points) top = std::max(top, dot(n, p - origin));
  for (const int corner : face) lowest = std::min(lowest, dot(n, point(corner) - origin));
  return (top - lowest) / size;
}

double Polyhedron::least_corner(const FaceCorners& face) const {
  const GridPoint n = normal(face);
  const double size = length(n);
  if (!(size > 0)) return -kInfinity;
  const GridPoint unit = n * (1 / size);
  double least = kInfinity;
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {
    const GridPoint &a = point(face[i]), &b = point(face[j]), &c = point(face[k]);
    const double base = length(c - a);
    least = std::min(least, base > 0 ? dot(unit, cross(b - a, c - a)) / base : -kInfinity);
  };
  const std::size_t count = face.size();
  for (std::size_t i = 0; i < count; ++i) add(i, (i + 1) % count, (i + 2) % count);
  for (std::size_t i = 1; i + 1 < count; ++i) add(0, i, i + 1);
  return least;
}

std::vector<int> Polyhedron::face_counts() const {
  std::vector<int> counts(points.size());
  for (const FaceCorners& face : faces) {
    for (const int corner : face) ++counts[static_cast<std::size_t>(corner)];
  }
  return counts;
}

FaceCorners canonical_cycle(const FaceCorners& corners) {
  FaceCorners result = corners;
  std::rotate(result.begin(), std::ranges::min_element(result), result.end());
  return result;
}

bool merge_faces(Polyhedron* polyhedron, double tolerance) {
  return FaceMerger(polyhedron, tolerance).run();
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
