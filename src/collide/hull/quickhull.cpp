/// Quickhull by insertion of the farthest point.
///
/// A point is in the list of at most one facet. If that facet is removed and the point is outside
/// of the new hull, then it is in front of a new facet: the segment from the removed facet to the
/// point leaves the new hull in front of the removed facet, where all facets are new. Only new
/// facets are therefore tested. With a tolerance, a point may be in front of these by less than the
/// tolerance and in front of an old facet by more; assign_missed() finds such points.
#include "src/collide/hull/quickhull.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

Quickhull::Quickhull(std::span<const GridPoint> points, double tolerance, int most)
    : points_(points), tolerance_(tolerance) {
  const std::array<int, 4> corners = find_simplex();
  if (extent_ != Extent::solid) return;
  facet_from_.resize(points.size());
  make_simplex(corners);
  do {
    insert_all();
  } while (!near_.empty() && vertices().size() <= static_cast<std::size_t>(most) &&
           assign_missed());
}

std::array<int, 4> Quickhull::find_simplex() {
  std::array<int, 4> corner{};
  if (points_.empty()) return corner;
  const auto at = [this](int i) -> const GridPoint& {
    return points_[static_cast<std::size_t>(i)];
  };
  const int count = static_cast<int>(points_.size());
  // Finds the point for which a function is greatest; of equal ones, the first.
  const auto find_greatest = [&](int which, const auto& function) {
    double greatest = 0;
    for (int i = 0; i < count; ++i) {
      const double value = function(at(i));
      if (value > greatest) greatest = value, corner[static_cast<std::size_t>(which)] = i;
    }
    return greatest;
  };
  const GridPoint& origin = at(0);
  const double span = find_greatest(1, [&](const GridPoint& p) { return length(p - origin); });
  if (!(span > tolerance_)) return corner;
  extent_ = Extent::line;
  const GridPoint axis = at(corner[1]) - origin;
  const double area =
      find_greatest(2, [&](const GridPoint& p) { return length(cross(axis, p - origin)); });
  if (!(area > tolerance_ * span)) return corner;
  extent_ = Extent::plane;
  const GridTriangle base(origin, at(corner[1]), at(corner[2]));
  const double height =
      find_greatest(3, [&](const GridPoint& p) { return std::abs(base.height(p)); });
  if (height > tolerance_) extent_ = Extent::solid;
  return corner;
}

void Quickhull::make_simplex(const std::array<int, 4>& corners) {
  auto [a, b, c, d] = corners;
  const auto at = [this](int i) -> const GridPoint& {
    return points_[static_cast<std::size_t>(i)];
  };
  if (GridTriangle(at(a), at(b), at(c)).height(at(d)) > 0) std::swap(b, c);
  const int faces[4] = {make_facet(a, b, c), make_facet(a, d, b), make_facet(b, d, c),
                        make_facet(c, d, a)};
  facets_[0].neighbour = {1, 2, 3};
  facets_[1].neighbour = {3, 2, 0};
  facets_[2].neighbour = {1, 3, 0};
  facets_[3].neighbour = {2, 1, 0};
  for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
    if (i != a && i != b && i != c && i != d) assign(i, faces);
  }
}

int Quickhull::make_facet(int a, int b, int c) {
  int index = static_cast<int>(facets_.size());
  if (free_.empty()) {
    facets_.emplace_back();
  } else {
    index = free_.back();
    free_.pop_back();
  }
  const auto at = [this](int i) -> const GridPoint& {
    return points_[static_cast<std::size_t>(i)];
  };
  Facet& facet = facets_[static_cast<std::size_t>(index)];
  facet.corner = {a, b, c};
  facet.triangle = GridTriangle(at(a), at(b), at(c));
  facet.outside.clear();
  facet.farthest = -1;
  facet.reach = 0;
  facet.alive = true;
  return index;
}

void Quickhull::put(int point, int index, double reach) {
  Facet& facet = facets_[static_cast<std::size_t>(index)];
  facet.outside.push_back(point);
  if (facet.farthest < 0 || reach > facet.reach ||
      (reach == facet.reach && point < facet.farthest)) {
    facet.farthest = point;
    facet.reach = reach;
    candidates_.push({reach, point, index});
  }
}

void Quickhull::assign(int point, std::span<const int> facets) {
  bool is_outside = false;
  for (const int facet : facets) {
    const double height = facets_[static_cast<std::size_t>(facet)].triangle.height(
        points_[static_cast<std::size_t>(point)]);
    if (height > tolerance_) return put(point, facet, height);
    is_outside = is_outside || height > 0;
  }
  if (is_outside) near_.push_back(point);
}

void Quickhull::insert_all() {
  while (!candidates_.empty()) {
    const auto [reach, point, index] = candidates_.top();
    candidates_.pop();
    const Facet& facet = facets_[static_cast<std::size_t>(index)];
    // Otherwise the facet was removed, or has a farther point.
    if (facet.alive && facet.farthest == point) insert(point, index);
  }
}

void Quickhull::find_horizon(int point, int facet) {
  const GridPoint& p = points_[static_cast<std::size_t>(point)];
  ++visits_;
  visible_.assign(1, facet);
  horizon_.clear();
  facets_[static_cast<std::size_t>(facet)].visit = visits_;
  for (std::size_t n = 0; n < visible_.size(); ++n) {
    const Facet& seen = facets_[static_cast<std::size_t>(visible_[n])];
    for (std::size_t i = 0; i < 3; ++i) {
      Facet& next = facets_[static_cast<std::size_t>(seen.neighbour[i])];
      if (next.visit == visits_) continue;
      if (next.triangle.height(p) > 0) {
        next.visit = visits_;
        visible_.push_back(seen.neighbour[i]);
      } else {
        horizon_.push_back({seen.corner[i], seen.corner[(i + 1) % 3], seen.neighbour[i]});
      }
    }
  }
}

void Quickhull::insert(int point, int facet) {
  find_horizon(point, facet);
  orphans_.clear();
  for (const int index : visible_) {
    Facet& seen = facets_[static_cast<std::size_t>(index)];
    for (const int orphan : seen.outside) {
      if (orphan != point) orphans_.push_back(orphan);
    }
    seen.alive = false;
    seen.farthest = -1;
  }
  // The horizon is a simple cycle, because the visible facets are those in front of which the point
  // is exactly. The new facets follow it.
  created_.clear();
  for (const Horizon& edge : horizon_) {
    const int index = make_facet(edge.from, edge.to, point);
    created_.push_back(index);
    facet_from_[static_cast<std::size_t>(edge.from)] = index;
    facets_[static_cast<std::size_t>(index)].neighbour[0] = edge.beyond;
    Facet& beyond = facets_[static_cast<std::size_t>(edge.beyond)];
    for (std::size_t i = 0; i < 3; ++i) {
      if (beyond.corner[i] == edge.to) beyond.neighbour[i] = index;
    }
  }
  for (const int index : created_) {
    Facet& made = facets_[static_cast<std::size_t>(index)];
    const int next = facet_from_[static_cast<std::size_t>(made.corner[1])];
    made.neighbour[1] = next;
    facets_[static_cast<std::size_t>(next)].neighbour[2] = index;
  }
  // Later facets reuse the memory; not these, whose lists are still being read.
  free_.insert(free_.end(), visible_.begin(), visible_.end());
  for (const int orphan : orphans_) assign(orphan, created_);
}

bool Quickhull::assign_missed() {
  std::vector<int> near = std::move(near_);
  near_.clear();
  // Distances from a growing hull decrease, so that a point within the tolerance stays there.
  for (const int point : near) {
    const GridPoint& p = points_[static_cast<std::size_t>(point)];
    if (!(distance(p) > tolerance_)) continue;
    int highest = -1;
    double height = 0;
    for (std::size_t i = 0; i < facets_.size(); ++i) {
      const double above = facets_[i].alive ? facets_[i].triangle.height(p) : 0;
      if (above > height) height = above, highest = static_cast<int>(i);
    }
    if (highest >= 0) put(point, highest, height);
  }
  return !candidates_.empty();
}

double Quickhull::distance(const GridPoint& p) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Facet& facet : facets_) {
    if (!facet.alive || !(facet.triangle.height(p) > 0)) continue;
    least = std::min(least, detail::distance(p, facet.triangle));
  }
  return least < std::numeric_limits<double>::infinity() ? least : 0;
}

std::vector<Quickhull::Corners> Quickhull::triangles() const {
  std::vector<Corners> result;
  for (const Facet& facet : facets_) {
    if (facet.alive) result.push_back(facet.corner);
  }
  return result;
}

std::vector<int> Quickhull::vertices() const {
  std::vector<bool> is_vertex(points_.size());
  for (const Facet& facet : facets_) {
    if (!facet.alive) continue;
    for (const int corner : facet.corner) is_vertex[static_cast<std::size_t>(corner)] = true;
  }
  std::vector<int> result;
  for (std::size_t i = 0; i < is_vertex.size(); ++i) {
    if (is_vertex[i]) result.push_back(static_cast<int>(i));
  }
  return result;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
