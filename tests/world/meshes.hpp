/// Surfaces of triangles as bodies of tests.
#pragma once

#include "tests/world/support.hpp"

#include <cstdint>
#include <functional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// A square grid around the origin. Diagonals alternate.
inline TriangleMesh grid(std::uint32_t cells, Real size,
                         const std::function<Real(std::uint32_t, std::uint32_t)>& height) {
  TriangleMeshDef def;
  const auto middle = static_cast<Real>(cells) / 2;
  for (std::uint32_t z = 0; z <= cells; ++z) {
    for (std::uint32_t x = 0; x <= cells; ++x) {
      def.vertices.push_back({(static_cast<Real>(x) - middle) * size, height(x, z),
                              (static_cast<Real>(z) - middle) * size});
    }
  }
  for (std::uint32_t z = 0; z < cells; ++z) {
    for (std::uint32_t x = 0; x < cells; ++x) {
      const std::uint32_t a = z * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
      if ((x + z) % 2 == 0) {
        def.triangles.insert(def.triangles.end(), {{a, c, b}, {b, c, d}});
      } else {
        def.triangles.insert(def.triangles.end(), {{a, c, d}, {a, d, b}});
      }
    }
  }
  return TriangleMesh(std::move(def));
}
inline TriangleMesh flat_grid(std::uint32_t cells, Real size) {
  return grid(cells, size, [](std::uint32_t, std::uint32_t) { return 0.0_r; });
}
/// An immovable body with a TriangleMesh or a Heightfield.
inline BodyDef fixed_surface(Shape shape, Real friction) {
  BodyDef def;
  def.shape = std::move(shape);
  def.mass = 0;
  def.friction = friction;
  return def;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
