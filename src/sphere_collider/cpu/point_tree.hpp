/// A balanced k-d tree of points, which may be in a periodic cell.
#pragma once

#include "src/base/interrupt.hpp"
#include "src/base/parallel_for.hpp"
#include "src/sphere_collider/periodic_cell.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Distances in a cell, or in open space.
class PeriodicMetric {
 public:
  using Vector = std::array<double, 3>;

  /// @param cell null: open space
  explicit PeriodicMetric(const PeriodicCell* cell) {
    for (std::size_t k = 0; cell != nullptr && k < 3; ++k) {
      if (cell->repeats[k]) length_[k] = cell->lengths[static_cast<int>(k)];
    }
  }

  /// Square of the distance of two points. The difference along an axis is rounded once.
  /// @param shift receives that of the nearest image of b; null: not needed
  double square(const Vec3& a, const Vec3& b, ImageShift* shift = nullptr) const {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      std::int32_t cells = 0;
      const double d = difference(k, a[static_cast<int>(k)], b[static_cast<int>(k)], &cells);
      if (shift != nullptr) (*shift)[k] = cells;
      sum += d * d;
    }
    return sum;
  }

  /// Coordinates of a point, reduced to [-length / 2, length / 2] along axes that repeat.
  Vector place(const Vec3& p) const {
    std::int32_t cells = 0;
    return {difference(0, p.x, 0, &cells), difference(1, p.y, 0, &cells),
            difference(2, p.z, 0, &cells)};
  }

  /// At most the square of the distance of a point from any point in a box, less a margin for the
  /// roundings: places have errors of up to epsilon lengths, and the sum has one of a few epsilon.
  double least_square(const Vector& place, const Vector& lower, const Vector& upper) const {
    constexpr double kSlack = 1e-14;
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = place[k], length = length_[k];
      double gap = std::max(lower[k] - x, x - upper[k]);
      if (length > 0) {
        gap = std::min({gap, lower[k] - (x - length), (x + length) - upper[k]});
        gap -= kSlack * length;
      }
      gap = std::max(gap, 0.0);
      sum += gap * gap;
    }
    return sum * (1 - kSlack);
  }

 private:
  /// a - (b + cells * length) for the number of cells with the least absolute value of it.
  double difference(std::size_t axis, Real a, Real b, std::int32_t* cells) const {
    const double length = length_[axis], open = static_cast<double>(a) - static_cast<double>(b);
    if (length == 0 || std::abs(open) < length / 2) return open;
    const auto at = [&](std::int32_t n) {
      return detail::exact_image_difference(a, b, n, static_cast<Real>(length));
    };
    auto count = static_cast<std::int32_t>(std::floor(open / length + 0.5));
    double d = at(count);
    // The quotient is rounded. Half a length is at the smaller shift.
    if (d <= -length / 2) d = at(--count);
    if (d > length / 2) d = at(++count);
    *cells = count;
    return d;
  }

  Vector length_{};  ///< 0 along axes that do not repeat
};

/// The k nearest points of a query. Points are compared by distance, then by index, so that they do
/// not depend on the tree.
class NearestList {
 public:
  struct Item {
    double square;
    std::uint32_t index;
    bool operator<(const Item& other) const {
      return std::pair(square, index) < std::pair(other.square, other.index);
    }
  };

  explicit NearestList(std::size_t k) : k_(k) { items_.reserve(k); }

  void clear() { items_.clear(); }
  /// The largest square of a distance that may still enter the list.
  double limit() const {
    return items_.size() < k_ ? std::numeric_limits<double>::infinity() : items_.front().square;
  }
  void add(const Item& item) {
    if (items_.size() == k_) {
      if (!(item < items_.front())) return;
      std::pop_heap(items_.begin(), items_.end());
      items_.back() = item;
    } else {
      items_.push_back(item);
    }
    std::push_heap(items_.begin(), items_.end());
  }
  /// The items by distance. No call but clear() may follow.
  std::span<const Item> sorted() {
    std::sort_heap(items_.begin(), items_.end());
    return items_;
  }

 private:
  std::size_t k_;
  std::vector<Item> items_;  ///< a heap whose front is the most distant one
};

/// Every node halves its points along the longest side of its bounds, so that the ranges of points
/// follow from the number of a node: node i has the children 2 i + 1 and 2 i + 2.
class PointTree {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  PointTree(std::span<const Vec3> points, const PeriodicMetric& metric, ThreadPool& pool)
      : metric_(metric), items_(points.size()) {
    parallel_for(&pool, points.size(), kChunk, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        items_[i] = {metric_.place(points[i]), points[i], static_cast<std::uint32_t>(i)};
      }
    });
    while ((points.size() >> levels_) > kLeaf) ++levels_;
    nodes_.resize((std::size_t{2} << levels_) - 1);
    for (unsigned level = 0; level <= levels_; ++level) {
      run_interruptible(pool, std::size_t{1} << level,
                        [&](std::size_t at) { make_node(level, at); });
    }
  }

  /// Adds the points to an empty list. @param excluded index of a point that is left out; or kNone
  void search(const Vec3& query, std::uint32_t excluded, NearestList* list) const {
    struct Waiting {
      double least;
      std::size_t node;
    };
    std::array<Waiting, 64> waiting;
    std::size_t count = 0;
    const PeriodicMetric::Vector place = metric_.place(query);
    const auto least_of = [&](std::size_t node) {
      return metric_.least_square(place, nodes_[node].lower, nodes_[node].upper);
    };
    waiting[count++] = {0, 0};
    while (count > 0) {
      auto [least, node] = waiting[--count];
      // A point at the same distance and with a lower index replaces one of the list.
      if (least > list->limit()) continue;
      while (node < first_leaf()) {
        Waiting near{least_of(2 * node + 1), 2 * node + 1};
        Waiting far{least_of(2 * node + 2), 2 * node + 2};
        if (far.least < near.least) std::swap(near, far);
        if (far.least <= list->limit()) waiting[count++] = far;
        node = near.node;
        least = near.least;
      }
      if (least > list->limit()) continue;
      const std::size_t leaf = node - first_leaf();
      for (std::size_t i = begin_of(levels_, leaf); i < begin_of(levels_, leaf + 1); ++i) {
        const Item& item = items_[i];
        if (item.index != excluded) list->add({metric_.square(query, item.point), item.index});
      }
    }
  }

  /// Indices of the points, near ones together.
  std::uint32_t index(std::size_t position) const { return items_[position].index; }

 private:
  static constexpr std::size_t kLeaf = 12;  ///< largest number of points of a leaf, or one less
  static constexpr std::size_t kChunk = 4096;

  struct Item {
    PeriodicMetric::Vector place;
    Vec3 point;
    std::uint32_t index;
  };
  struct Node {
    PeriodicMetric::Vector lower, upper;
  };

  std::size_t first_leaf() const { return (std::size_t{1} << levels_) - 1; }
  /// First point of a node of a level.
  std::size_t begin_of(unsigned level, std::size_t at) const {
    return (items_.size() * at) >> level;  // fewer than 2^32 points and 2^29 nodes
  }

  void make_node(unsigned level, std::size_t at) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Node& node = nodes_[(std::size_t{1} << level) - 1 + at];
    node.lower.fill(kInfinity);
    node.upper.fill(-kInfinity);
    const auto begin = items_.begin() + static_cast<std::ptrdiff_t>(begin_of(level, at));
    const auto end = items_.begin() + static_cast<std::ptrdiff_t>(begin_of(level, at + 1));
    for (auto item = begin; item != end; ++item) {
      for (std::size_t k = 0; k < 3; ++k) {
        node.lower[k] = std::min(node.lower[k], item->place[k]);
        node.upper[k] = std::max(node.upper[k], item->place[k]);
      }
    }
    if (level == levels_) return;
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (node.upper[k] - node.lower[k] > node.upper[axis] - node.lower[axis]) axis = k;
    }
    const auto middle =
        items_.begin() + static_cast<std::ptrdiff_t>(begin_of(level + 1, 2 * at + 1));
    std::nth_element(begin, middle, end, [axis](const Item& p, const Item& q) {
      return p.place[axis] < q.place[axis];
    });
  }

  PeriodicMetric metric_;
  std::vector<Item> items_;
  std::vector<Node> nodes_;
  unsigned levels_ = 0;  ///< without that of the leaves
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
