/// Triangle meshes for tests of the viewer.
#pragma once

#include <jfpx/triangle_mesh.hpp>

#include <cstdint>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Squares of side `cell` around a point, with the fronts upward. @param height function of x and z
template <class Height>
TriangleMesh terrain(std::uint32_t squares, Real cell, const Height& height,
                     const Vec3& centre = {}, bool two_sided = false) {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  const std::uint32_t row = squares + 1;
  for (std::uint32_t j = 0; j < row; ++j) {
    for (std::uint32_t i = 0; i < row; ++i) {
      const Real x = (Real(i) - Real(squares) / 2) * cell, z = (Real(j) - Real(squares) / 2) * cell;
      vertices.push_back(centre + Vec3{x, height(x, z), z});
      if (i == squares || j == squares) continue;
      const std::uint32_t a = j * row + i;
      triangles.push_back({a, a + row, a + 1});
      triangles.push_back({a + 1, a + row, a + row + 1});
    }
  }
  return {std::move(vertices), std::move(triangles), two_sided};
}

/// A cube with the fronts outward.
inline TriangleMesh cube_mesh(Real half, const Vec3& centre = {}) {
  std::vector<Vec3> vertices;
  for (int i = 0; i < 8; ++i) {
    const auto side = [&](int bit) { return (i >> bit & 1) != 0 ? half : -half; };
    vertices.push_back(centre + Vec3{side(2), side(1), side(0)});
  }
  return {std::move(vertices),
          {{0, 1, 3},
           {0, 3, 2},
           {4, 6, 7},
           {4, 7, 5},
           {0, 4, 5},
           {0, 5, 1},
           {2, 3, 7},
           {2, 7, 6},
           {0, 2, 6},
           {0, 6, 4},
           {1, 5, 7},
           {1, 7, 3}}};
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
