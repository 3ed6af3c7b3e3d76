/// Quickhull (Barber, Dobkin and Huhdanpaa 1996) with exact orientations.
#pragma once

#include "src/collide/hull/grid.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <queue>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Dimension of the smallest affine subspace that contains all points, up to a tolerance.
enum class Extent : std::uint8_t { point, line, plane, solid };

/// Surface of the convex hull of points as triangles. The point farthest from a triangle is
/// inserted first, of equally far points the first one; the result depends only on the points and
/// their order. Points in the plane of a triangle count as behind it, so exactly coplanar faces are
/// triangulated, and no triangle is degenerate.
class Quickhull {
 public:
  using Corners = std::array<int, 3>;

  /// @param points    distinct integers in lexicographic order; must exist as long as this object
  /// @param tolerance >= 0; points at most this far from the hull of the others may be left out. If
  ///                  it is 0, the hull is exact
  /// @param most      maximum number of vertices up to which the hull is completed: above it,
  /// points
  ///                  that are farther than the tolerance from the hull may be left out
  explicit Quickhull(std::span<const GridPoint> points, double tolerance = 0,
                     int most = std::numeric_limits<int>::max());

  /// Below solid, the hull has no triangles.
  Extent extent() const { return extent_; }
  /// Indices of the corners of each triangle, counter-clockwise as seen from outside.
  std::vector<Corners> triangles() const;
  /// Indices of the points that are corners, in ascending order.
  std::vector<int> vertices() const;
  /// Distance of a point from the hull; 0 inside.
  double distance(const GridPoint& p) const;

 private:
  struct Facet {
    Corners corner{};
    Corners neighbour{};  ///< across the edge from corner i to corner i + 1
    GridTriangle triangle;
    std::vector<int> outside;  ///< points in front of it, each in the list of one facet
    int farthest = -1;         ///< of `outside`
    double reach = 0;          ///< distance of `farthest`
    bool alive = false;
    std::uint32_t visit = 0;  ///< number of the insertion that found it to be visible
  };
  struct Candidate {
    double reach;
    int point, facet;
    friend bool operator<(const Candidate& a, const Candidate& b) {
      return a.reach != b.reach ? a.reach < b.reach : a.point > b.point;
    }
  };
  /// An edge between a visible facet and one that is not.
  struct Horizon {
    int from, to, beyond;
  };

  std::array<int, 4> find_simplex();
  void make_simplex(const std::array<int, 4>& corners);
  int make_facet(int a, int b, int c);
  void put(int point, int facet, double reach);
  /// Puts a point in the list of a facet, or drops it if it is inside.
  void assign(int point, std::span<const int> facets);
  void insert_all();
  void insert(int point, int facet);
  void find_horizon(int point, int facet);
  /// Whether points near the hull remain that are farther from it than the tolerance.
  bool assign_missed();

  std::span<const GridPoint> points_;
  double tolerance_;
  Extent extent_ = Extent::point;
  std::vector<Facet> facets_;
  std::vector<int> free_;  ///< facets that are not alive
  std::priority_queue<Candidate> candidates_;
  std::vector<int> near_;  ///< points in front of facets by at most the tolerance
  std::uint32_t visits_ = 0;
  // Scratch memory of insert().
  std::vector<int> visible_, created_, orphans_, facet_from_;
  std::vector<Horizon> horizon_;
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
