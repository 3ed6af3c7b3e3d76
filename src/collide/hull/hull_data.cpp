/// Canonical order, planes and mass properties of hulls.
#include "src/collide/hull/hull_data.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
namespace {

GridPoint in_double(const Vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// dot(normal, point) - offset.
ExactSum exact_height(const Vec3& normal, const Vec3& point, Real offset) {
  const GridPoint n = in_double(normal), p = in_double(point);
  ExactSum height;
  height.add_product(n.x, p.x);
  height.add_product(n.y, p.y);
  height.add_product(n.z, p.z);
  height.add(-static_cast<double>(offset));
  return height;
}

/// Mass properties as sums over the tetrahedra that the triangles of the faces span with the first
/// vertex. The volumes are exact up to rounding, and not negative for exactly plane faces, so that
/// nothing cancels in thin hulls.
void set_mass_properties(const Polyhedron& polyhedron, const HullGrid& grid, HullData* data) {
  const GridPoint& apex = polyhedron.points[0];
  // Calls visit(volume, a, b, c) with six times the volume of each tetrahedron.
  const auto for_each_tetrahedron = [&](const auto& visit) {
    for (const FaceCorners& face : polyhedron.faces) {
      for (std::size_t i = 1; i + 1 < face.size(); ++i) {
        const GridPoint &a = polyhedron.point(face[0]), &b = polyhedron.point(face[i]),
                        &c = polyhedron.point(face[i + 1]);
        visit(-GridTriangle(a, b, c).determinant(apex).value(), a, b, c);
      }
    }
  };
  double volume = 0;
  GridPoint first;  // moment about the apex
  for_each_tetrahedron([&](double v, const GridPoint& a, const GridPoint& b, const GridPoint& c) {
    volume += v;
    first = first + ((a - apex) + (b - apex) + (c - apex)) * (v / 4);
  });
  const GridPoint arm = first * (1 / volume), centre = apex + arm;
  double spread[6] = {};  // xx, yy, zz, xy, yz, zx
  for_each_tetrahedron([&](double v, const GridPoint& a, const GridPoint& b, const GridPoint& c) {
    // The mean of p p^T over a tetrahedron is 1/20 of the sum over its corners and over their sum.
    const GridPoint p = a - centre, q = b - centre, r = c - centre, s = apex - centre;
    for (const GridPoint& x : {p, q, r, s, p + q + r + s}) {
      spread[0] += v * (x.x * x.x), spread[1] += v * (x.y * x.y), spread[2] += v * (x.z * x.z);
      spread[3] += v * (x.x * x.y), spread[4] += v * (x.y * x.z), spread[5] += v * (x.z * x.x);
    }
  });
  // Rounding errors of products of inertia that are 0, as those of a box.
  const double noise = 0x1p-49 * (spread[0] + spread[1] + spread[2]);
  for (int i = 3; i < 6; ++i) {
    if (std::abs(spread[i]) <= noise) spread[i] = 0;
  }
  const double centres[3] = {centre.x, centre.y, centre.z};
  data->volume = grid.metres(grid.metres(grid.metres(volume / 6)));
  for (int i = 0; i < 3; ++i) data->centre[i] = grid.metres(centres[i]);
  for (int i = 0; i < 6; ++i) {
    data->spread[i] = grid.metres(grid.metres(spread[i] / (20 * volume)));
  }
}

void set_edges(HullData* data) {
  std::map<std::pair<int, int>, std::size_t> face_of;
  for (std::size_t f = 0; f < data->faces.size(); ++f) {
    const HullFace& face = data->faces[f];
    for (unsigned i = 0; i < face.corner_count; ++i) {
      const unsigned next = i + 1 < face.corner_count ? i + 1 : 0;
      face_of[{data->corners[face.first_corner + i], data->corners[face.first_corner + next]}] = f;
    }
  }
  for (const auto& [ends, left] : face_of) {
    const auto [a, b] = ends;
    if (a > b) continue;
    const std::size_t right = face_of.at({b, a});
    data->edges.push_back({static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b),
                           static_cast<std::uint8_t>(left), static_cast<std::uint8_t>(right)});
  }
}

}  // namespace

Real least_offset(const Vec3& normal, std::span<const Vec3> vertices) {
  constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
  const GridPoint n = in_double(normal);
  const auto rounded = [&](const Vec3& v) { return dot(n, in_double(v)); };
  double most = -std::numeric_limits<double>::infinity(), size = 0;
  for (const Vec3& v : vertices) {
    const GridPoint p = in_double(v);
    most = std::max(most, dot(n, p));
    size = std::max({size, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  // The error of a rounded product is below 6 u times the size.
  const double error = 2 * GridTriangle::kErrorBound * size;
  std::vector<Vec3> highest;
  for (const Vec3& v : vertices) {
    if (rounded(v) >= most - error) highest.push_back(v);
  }
  most = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : highest) most = std::max(most, exact_height(normal, v, 0).value());
  // A few units in the last place from the result.
  auto offset = static_cast<Real>(most);
  const auto is_enough = [&](Real d) {
    return std::ranges::all_of(
        highest, [&](const Vec3& v) { return exact_height(normal, v, d).sign() <= 0; });
  };
  while (!is_enough(offset)) offset = std::nextafter(offset, kInfinity);
  for (Real less = std::nextafter(offset, -kInfinity); is_enough(less);) {
    offset = less;
    less = std::nextafter(offset, -kInfinity);
  }
  return offset + Real(0);
}

HullData make_hull_data(std::span<const Vec3> vertices, const HullGrid& grid,
                        const Polyhedron& polyhedron) {
  std::vector<std::size_t> order(vertices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    return std::tuple(vertices[i].x, vertices[i].y, vertices[i].z);
  };
  std::ranges::sort(order, {}, key);
  HullData data;
  Polyhedron sorted;
  std::vector<int> rank(vertices.size());
  for (const std::size_t i : order) {
    rank[i] = static_cast<int>(data.vertices.size());
    const Vec3& v = vertices[i];
    data.vertices.push_back({v.x + Real(0), v.y + Real(0), v.z + Real(0)});
    data.bounds = merged(data.bounds, {data.vertices.back(), data.vertices.back()});
    sorted.points.push_back(polyhedron.points[i]);
  }
  for (FaceCorners face : polyhedron.faces) {
    for (int& corner : face) corner = rank[static_cast<std::size_t>(corner)];
    sorted.faces.push_back(canonical_cycle(face));
  }
  std::ranges::sort(sorted.faces);
  for (const FaceCorners& corners : sorted.faces) {
    const GridPoint normal = sorted.normal(corners), unit = normal * (1 / length(normal));
    HullFace face;
    face.normal = {static_cast<Real>(unit.x) + Real(0), static_cast<Real>(unit.y) + Real(0),
                   static_cast<Real>(unit.z) + Real(0)};
    face.offset = least_offset(face.normal, data.vertices);
    face.first_corner = static_cast<std::uint16_t>(data.corners.size());
    face.corner_count = static_cast<std::uint16_t>(corners.size());
    for (const int corner : corners) data.corners.push_back(static_cast<std::uint8_t>(corner));
    data.faces.push_back(face);
  }
  set_edges(&data);
  set_mass_properties(sorted, grid, &data);
  return data;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
